"""Two sets of on/off thrusters: large ones for slews, small ones to hold an attitude.

R. Vázquez, "Tema 8: Control activo de la actitud", Universidad de Sevilla 2016 (paper 004):
thrusters of small thrust are for fine manoeuvres, those of larger thrust for fast ones. All arrays
may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjspace.contract import Array, Gains, gain

from .relays import PhasePlane


@dataclass(frozen=True, kw_only=True)
class CoarseFine(PhasePlane):
    """Minimum time with the large thrusters, a Schmitt trigger with the small ones.

    The small thrusters, u each way, act on an axis where |a| + a'^2 / 2u is within ``handover``,
    which is where they can stop the motion; else u = -U sgn(a + a' |a'| / 2U) with the large ones.
    The trigger on s = a + k a' is on where |s| > delta and off where |s| < delta - hysteresis; its
    limit cycle has |a'| = hysteresis / 2k between pulses. Memory: the firing sense of the small
    thrusters. ``firing`` is 2 or -2 for the large thrusters, 1 or -1 for the small.
    """

    fine_below: float = gain("N", above=0.0)
    """Thrusters of less force than that are the small ones."""
    handover: float = gain("rad", above=0.0)
    threshold: float = gain("rad", above=0.0)
    """delta, less than ``handover``."""
    hysteresis: float = gain("rad", above=0.0)
    rate_gain: float = gain("s", at_least=0.0)
    """k."""

    def __post_init__(self) -> None:
        Gains.__post_init__(self)  # before the sets, of which the base makes patterns
        small = self.thruster_force < self.fine_below
        if small.all() or not small.any():
            raise ValueError(
                f"fine_below: got {self.fine_below:g} N, which should divide the thrusters of "
                f"{self.thruster_force.min():g} to {self.thruster_force.max():g} N into two sets"
            )
        super().__post_init__()
        if not self.hysteresis < self.threshold < self.handover:
            raise ValueError(
                f"threshold: got {self.threshold:g} rad, should be more than hysteresis, "
                f"{self.hysteresis:g} rad, and less than handover, {self.handover:g} rad"
            )

    @cached_property
    def _patterns(self) -> Array:
        return self._patterns_of(self._effects * (self.thruster_force >= self.fine_below))

    @cached_property
    def _small(self) -> Array:
        return self._patterns_of(self._effects * (self.thruster_force < self.fine_below))

    @cached_property
    def fine_acceleration(self) -> Array:
        """u of each axis [rad/s^2], (m,)."""
        return self._acceleration_by(self._small[0])

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        stops_at = np.abs(angle) + rate**2 / (2.0 * self.fine_acceleration)
        ahead = angle + rate * np.abs(rate) / (2.0 * self.acceleration)
        s, before = angle + self.rate_gain * rate, memory[..., 0]
        begins = np.abs(s) > self.threshold
        goes_on = -before * s > self.threshold - self.hysteresis
        held = np.where(begins, -np.sign(s), np.where(goes_on, before, 0.0))
        fine = np.where(stops_at <= self.handover, held, 0.0)
        firing = np.where(stops_at <= self.handover, held, -2.0 * np.sign(ahead))
        return fine[..., None], firing, np.full_like(firing, self.inner_period)

    def _on_time(self, firing: Array, duration: Array) -> Array:
        on_time = np.zeros((*firing.shape[:-1], len(self.thruster_force)))
        for level, (forth, back) in ((2.0, self._patterns), (1.0, self._small)):
            on = np.where(firing == level, duration, 0.0)[..., None] * forth
            off = np.where(firing == -level, duration, 0.0)[..., None] * back
            on_time = on_time + (on + off).sum(axis=-2)
        found: Array = np.minimum(on_time, self.inner_period)
        return found
