"""Powered descent from a low lunar orbit to a site: braking, approach, vertical descent.

Braking and approach are Apollo's (``quartic``): each meets a target, the high gate and the low
gate, which are given relative to the site. From the low gate on the vehicle goes down above the
site. The attitude follows the thrust as in ``lander_vectoring``. The site that the approach leads
to is the reference's safe one: a divert begins at the high gate. All arrays may have leading
vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mjspace.algebra import dot, times
from mjspace.contract import Array, Measurement, ThrustCommand, Trajectory, gain

from .lander import burning, touched
from .lander_vectoring import ThrustVectoring, shortened
from .landing_site import SiteReference
from .quartic import Target, acceleration, time_to_go

BRAKING, APPROACH, VERTICAL = 0.0, 1.0, 2.0


class State(NamedTuple):
    """Memory of the law."""

    cut: Array
    """1.0 from touchdown on, when the engine is cut for good, else 0.0; (..., 1)."""
    phase: Array
    """0.0 braking, 1.0 approach, 2.0 vertical descent; (..., 1)."""
    time_to_go: Array
    """To the phase's target, as the next step's search begins with it [s], (..., 1)."""


class Signals(NamedTuple):
    """Signals of the law."""

    phase: Array
    """0.0 braking, 1.0 approach, 2.0 vertical descent; (..., 1)."""
    time_to_go: Array
    """To the gate at which the phase ends [s]; of no meaning in the vertical descent, (..., 1)."""
    site: Array
    """Where the vehicle is being led to: the body origin as it stands there [m], (..., 3)."""
    pointing_error: Array
    """Sine of the rotation from the thrust axis to the desired one [rad], body x and y, (..., 2).
    """
    desired_thrust: Array
    """Commanded thrust before its limits [N], (..., 1)."""
    desired_gimbal: Array
    """Commanded gimbal angles before their limits, outer and inner [rad], (..., 2)."""


@dataclass(frozen=True, kw_only=True)
class PoweredDescent(ThrustVectoring):
    """Apollo's guidance through two gates, then down; ``ThrustVectoring`` turns the thrust.

    A gate has three rows: position [m], velocity [m/s] and acceleration [m/s^2] as (along, across,
    up) from the site, ``along`` towards where the vehicle comes from. The time to go is that with
    which the jerk along has its value. Thrust beyond the engine's is cut, not its direction. No
    error is integrated: ``integral_gain`` has no effect.
    """

    azimuth: float = gain("rad", default=0.0, at_least=-2.0 * np.pi, at_most=2.0 * np.pi)
    """Direction of ``along``, from x towards y."""
    high_gate: Array = gain(
        shape=(3, 3), default=((6000.0, 0.0, 2000.0), (-150.0, 0.0, -45.0), (3.4, 0.0, 0.5))
    )
    """Where braking ends."""
    high_gate_jerk: float = gain("m/s^3", default=-0.0036)
    """Along, at the high gate."""
    braking_time: float = gain("s", default=470.0, above=0.0)
    """Time to go with which the search begins at the start."""
    low_gate: Array = gain(
        shape=(3, 3), default=((0.0, 0.0, 30.0), (0.0, 0.0, -2.0), (0.2, 0.0, 0.1))
    )
    """Where the approach ends."""
    low_gate_jerk: float = gain("m/s^3", default=0.0)
    """Along, at the low gate."""
    approach_time: float = gain("s", default=150.0, above=0.0)
    """Time to go with which the search begins at the high gate."""
    gate_time: float = gain("s", default=3.0, at_least=1.0)
    """Time to go at which a phase gives way to the next: the guidance divides by it."""
    descent_speed: float = gain("m/s", default=0.5, above=0.0)
    """At touchdown."""
    settling_time: float = gain("s", default=20.0, above=0.0)
    """Height over it is the speed above ``descent_speed`` in the vertical descent."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:  # type: ignore[override]
        """Return the initial state: braking, with the engine not cut."""
        none = np.zeros_like(measurement.position[..., :1])
        return State(none, none.copy(), none + self.braking_time)

    def step(  # type: ignore[override]
        self, state: State, time: float, measurement: Measurement, reference: SiteReference
    ) -> tuple[State, ThrustCommand, Signals]:
        """Return the next state, the thrust and gimbal angles, and the signals."""
        at, near = measurement, state.phase > BRAKING
        site = np.where(near, reference.safe_site, reference.position)
        high, low = self._gates
        gate = Target(*(np.where(near, low[k], high[k]) for k in range(3)))
        gate = gate._replace(position=site + gate.position)
        left = self._time_to_go(at, gate, near, state.time_to_go)

        guided = acceleration(at.position, at.velocity, gate, left) - self.gravity(at.position)
        most = self.thrust_range[1] / self.mass_with(at.propellant)
        down = self._vertical(at, site)
        force = np.where(state.phase < VERTICAL, shortened(guided, most), down)
        pointing, thrust, torque = self._steered(force, at, Trajectory(*reference[:6]))
        commanded = self._deflected(thrust, torque)

        over = (left < self.gate_time) & (state.phase < VERTICAL)
        cut = touched(state.cut, at)
        phase = np.where(over, state.phase + 1.0, state.phase)
        ahead = np.where(over, self.approach_time, left - self.control_period)
        signals = Signals(
            state.phase.copy(), left, site, pointing[..., :2], thrust, commanded[..., :0:-1]
        )
        return State(cut, phase, ahead), burning(cut, self.limited(commanded)), signals

    def _time_to_go(self, at: Measurement, gate: Target, near: Any, guess: Array) -> Array:
        """Return the time to the gate [s], (..., 1)."""
        along = self._axes[:, 0]

        def part(vector: Array) -> Array:
            return dot(vector, np.broadcast_to(along, vector.shape))

        jerk = np.where(near, self.low_gate_jerk, self.high_gate_jerk)
        goal = part(gate.velocity), part(gate.acceleration), jerk
        return time_to_go(part(gate.position - at.position), part(at.velocity), goal, guess)

    def _vertical(self, at: Measurement, site: Array) -> Array:
        """Return the thrust over mass [m/s^2] that leads down above the site, (..., 3)."""
        error = at.position - site
        high = np.maximum(error[..., 2:], 0.0) / self.settling_time
        wanted = -(self.descent_speed + high)
        down = np.concatenate([0.0 * error[..., :2], wanted], axis=-1)
        aside = error * np.array([1.0, 1.0, 0.0])
        feedback = self.velocity_gain * (at.velocity - down) + self.position_gain * aside
        # While the speed follows the height it changes by itself.
        slows = np.where(high > 0.0, -wanted / self.settling_time, 0.0)
        f = np.array([0.0, 0.0, 1.0]) * slows - shortened(feedback, self.feedback_limit)
        return self._upright(f - self.gravity(at.position), at.propellant)

    @cached_property
    def _axes(self) -> Array:
        """Columns: along, across, up in world axes, (3, 3)."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    @cached_property
    def _gates(self) -> tuple[Array, Array]:
        """The high gate's and the low gate's rows in world axes, each (3, 3)."""
        return times(self._axes, self.high_gate), times(self._axes, self.low_gate)
