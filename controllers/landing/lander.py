"""Descent to the Moon on one engine with two gimbals: variable-structure control of paper 003.

"Control de estructura variable para un alunizador subactuado", CNCA 2019. The corrections of the
printed law are gains; without them the vehicle tumbles within half a minute.

Frames: our world axes (x, y, z) are the paper's (Y, Z, X), less the Moon's radius on X. Our body
axes (x, y, z) are (Yb, Zb, Xb), so that the thrust is along our z; the vector part of a quaternion
is permuted alike. b2 is the outer gimbal, about our y, and b1 the inner one, about our -x: the
thrust is F (cos b1 sin b2, sin b1, cos b1 cos b2) in body axes. All arrays may have leading vehicle
axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, ThrustCommand, Trajectory, gain

from . import lander_kernels as kernels
from .lander_gains import GimballedEngine
from .lander_lqr import PRINTED, lqr_gain


class State(NamedTuple):
    """Memory of the law: whether the engine was cut at touchdown."""

    cut: Array
    """1.0 from touchdown on, when the engine is cut for good, else 0.0; (..., 1)."""


class Signals(NamedTuple):
    """Signals of the law."""

    position_error: Array
    """Measured less desired position [m], world axes, (..., 3)."""
    Z: Array
    """z3 to z9 of the errors, (..., 7)."""
    S: Array
    """The sliding variables, (..., 3)."""
    desired_thrust: Array
    """Commanded thrust before its limits [N], (..., 1)."""
    desired_gimbal: Array
    """Commanded gimbal angles before their limits, outer and inner [rad], (..., 2)."""


@dataclass(frozen=True)
class VariableStructure(GimballedEngine):
    """U = -S - rho tanh(rho S / delta) with S = Ka X2 + Rx(alpha) K Z, (33), (34), (36).

    The defaults have all corrections and feed gravity and the desired acceleration forward: the
    vehicle lands (O2), with ``loop_share`` (1, 0.35, 1) also behind slow gimbals (O3). The paper's
    figure 6 needs ``follows_gravity`` false (O1). The printed law also has "polar"
    ``coordinates``, ``mixes_before_turning`` false, ``equilibrium_thrust`` 0 and a positive k3.
    """

    batched: ClassVar[bool] = True

    coordinates: str = "frozen"
    """"polar" (as printed, valid at r = re), "scaled" by r/re (M3), or "frozen" axes (M3, M6)."""
    mixes_before_turning: bool = True
    """M5: Ka Rx Ka^-1 K instead of Rx K; without it a roll rate causes errors (erratum 14)."""
    follows_gravity: bool = True
    """True: thrust m (x_d'' + g + U1) / cos(tilt). False: Fe + U1, with U1 in newtons."""
    equilibrium_thrust: float = gain("N", default=160.0, at_least=0.0)
    """Fe (M1); 0 as printed, so that U1 has to carry the weight (erratum 9)."""
    recomputed: bool = False
    """True: K is solved from the Riccati equation. False: K as printed."""
    surface_gain: Array = gain(shape=(3,), default=(1.0, 14.0, -2.0))
    """Ka; printed with k3 = +2, which contradicts the sign of K's third row (M2, erratum 10)."""
    loop_share: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), above=0.0)
    """Factor on S: scales the speed at which each axis reaches its sliding surface."""
    robust_gain: float = gain(default=1.0, at_least=0.0)
    """rho; with the printed delta it adds 2 % to S, but no robustness (erratum 17)."""
    smoothing: float = gain(default=50.0, above=0.0)
    """delta."""
    radius: float = gain("m", default=1e4, above=0.0)
    """re: the distance from the site for which K is designed."""
    tank: float = gain("kg", default=0.0, at_least=0.0)
    """Propellant at the start: m decreases with what the gauge measures as burnt. 0: m is constant.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.coordinates not in _COORDINATES:
            have = ", ".join(_COORDINATES)
            raise ValueError(f"coordinates: got {self.coordinates!r}, should be one of {have}")
        if not np.all(self.surface_gain):
            raise ValueError(f"surface_gain: got {self.surface_gain}, should have no zero")

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:
        """Return the initial state: the engine is not cut."""
        return State(np.zeros_like(measurement.position[..., :1]))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, ThrustCommand, Signals]:
        """Return the next state, the thrust and gimbal angles, and the errors."""
        cut = touched(state.cut, measurement)
        at, desired = measurement, reference
        Z, S, commanded, limited = kernels.variable_structure.ufunc(
            at.attitude, at.rate, at.position, at.velocity,
            desired.attitude, desired.position, desired.velocity, desired.linear_acceleration,
            *self._gains[:-2], self._engine(at.propellant), self._gains[-1],
        )  # fmt: skip
        error = at.position - desired.position
        signals = Signals(error, Z, S, commanded[..., :1], commanded[..., :0:-1])
        return State(cut), burning(cut, limited), signals

    def _engine(self, propellant: Array) -> Array:
        """Return the engine's parameters with the present mass, (..., 8)."""
        engine: Array = self._gains[-2]
        if not self.tank or not propellant.shape[-1]:
            return engine
        left = engine[_MASS] - (self.tank - propellant)
        others = (
            np.broadcast_to(part, (*left.shape[:-1], len(part)))
            for part in (engine[:_MASS], engine[_MASS + 1 :])
        )
        return np.concatenate([next(others), left, next(others)], axis=-1)

    @cached_property
    def _gains(self) -> tuple[Array, ...]:
        feedback = lqr_gain() * [[1.0], [1.0], [-1.0]] if self.recomputed else PRINTED
        choices = [_COORDINATES[self.coordinates], self.mixes_before_turning, self.follows_gravity]
        engine = [self.equilibrium_thrust, self.mass, self.radius, self.robust_gain]
        engine += [self.smoothing, *self.thrust_range, self.gimbal_limit]
        moon = [self.gravity_parameter, self.moon_radius]
        numbers = [np.array(part, dtype=float) for part in (choices, engine, moon)]
        return feedback, numbers[0], self.surface_gain, self.loop_share, *numbers[1:]


_MASS = 1  # index among the engine's parameters
_COORDINATES = {"polar": kernels.POLAR, "scaled": kernels.SCALED, "frozen": kernels.FROZEN}


def touched(cut: Array, measurement: Measurement) -> Array:
    """Return 1.0 where the engine was cut before or the contact sensor reports touchdown, (..., 1).

    On a vehicle without a contact sensor ``cut`` stays as it is.
    """
    contact = measurement.contact
    return np.maximum(cut, contact) if contact.shape[-1] else cut.copy()


def burning(cut: Array, thrust: Array) -> ThrustCommand:
    """Return the command for ``thrust`` [F, b1, b2] (..., 3) in N and rad, zeros where ``cut``."""
    commanded = np.where(cut > 0.0, 0.0, thrust)
    return ThrustCommand(commanded[..., :1], commanded[..., :0:-1].copy())
