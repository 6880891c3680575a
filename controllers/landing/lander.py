"""Descent to the Moon on one engine with two gimbals: variable-structure control of paper 003.

"Control de estructura variable para un alunizador subactuado", CNCA 2019, as printed and with its
corrections as data. The printed law tumbles in half a minute. Its frames: (x, y, z) of our world is
(Y, Z, X) of the paper's, less the Moon's radius on X, and (x, y, z) of our body is (Yb, Zb, Xb), so
that thrust is along our z; the vector part of a quaternion moves likewise. b2 is the outer gimbal,
about our y, and b1 the inner one, about our -x: the thrust is
F (cos b1 sin b2, sin b1, cos b1 cos b2) in our body axes. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Measurement, ThrustCommand, Trajectory, gain

from . import lander_kernels as kernels
from .lander_lqr import PRINTED, lqr_gain


class State(NamedTuple):
    """Memory: whether the ground was touched."""

    cut: Array
    """1.0 once the engine is cut, for good, (..., 1)."""


class Signals(NamedTuple):
    """What the law shows."""

    position_error: Array
    """Position less the wanted one [m], world axes, (..., 3)."""
    Z: Array
    """z3 to z9 of the errors, (..., 7)."""
    S: Array
    """The sliding variables, (..., 3)."""
    wanted_thrust: Array
    """Before the limits [N], (..., 1)."""
    wanted_gimbal: Array
    """Before the limits, outer and inner [rad], (..., 2)."""


@dataclass(frozen=True)
class VariableStructure(Gains):
    """U = -S - rho tanh(rho S / delta) with S = Ka X2 + Rx(alpha) K Z, (33), (34), (36).

    With all corrections as by default, and thrust that knows gravity and the wanted acceleration,
    it lands (O2); with ``loop_share`` (1, 0.35, 1) also behind slow gimbals (O3). The paper's
    figure 6 needs ``follows_gravity`` false (O1). The printed law has, besides, "polar"
    ``coordinates``, no ``mixes_before_turning``, ``equilibrium_thrust`` 0 and a positive k3.
    """

    batched: ClassVar[bool] = True

    coordinates: str = "frozen"
    """"polar" (printed, made for r = re), "scaled" by r/re (M3), or "frozen" axes (M3, M6)."""
    mixes_before_turning: bool = True
    """M5: Ka Rx Ka^-1 K for Rx K; without it, a roll rate leads astray (erratum 14)."""
    follows_gravity: bool = True
    """Thrust m (x_d'' + g + U1) / cos(tilt); else Fe + U1, where U1 is in newtons."""
    equilibrium_thrust: float = gain("N", default=160.0, at_least=0.0)
    """Fe (M1); printed: 0, so that U1 has to hold the weight (erratum 9)."""
    recomputed: bool = False
    """K by the Riccati equation, in place of the printed one."""
    surface_gain: Array = gain(shape=(3,), default=(1.0, 14.0, -2.0))
    """Ka; k3 is printed as +2, for which K's third row has the wrong sign (M2, erratum 10)."""
    loop_share: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), above=0.0)
    """Multiplies S: how fast each axis is brought to its surface."""
    robust_gain: float = gain(default=1.0, at_least=0.0)
    """rho; with the printed delta it adds 2 % to S, and no robustness (erratum 17)."""
    smoothing: float = gain(default=50.0, above=0.0)
    """delta."""
    radius: float = gain("m", default=1e4, above=0.0)
    """re, that K is made for."""
    mass: float = gain("kg", default=100.0, above=0.0)
    """m, at the start."""
    tank: float = gain("kg", default=0.0, at_least=0.0)
    """Propellant at the start: what its gauge shows to be gone makes m less. 0: m stays."""
    thrust_range: Array = gain("N", (2,), default=(50.0, 320.0), at_least=0.0, at_most=np.inf)
    """Least, without which no torque is left, and largest."""
    gimbal_limit: float = gain("rad", default=np.radians(20.0), above=0.0, at_most=np.pi)
    """Of either angle."""
    gravity_parameter: float = gain("m^3/s^2", default=4.902e12, above=0.0)
    """mu of the Moon."""
    moon_radius: float = gain("m", default=1.738e6, above=0.0)
    """Of the landing site."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.coordinates not in _COORDINATES:
            have = ", ".join(_COORDINATES)
            raise ValueError(f"coordinates: got {self.coordinates!r}, should be one of {have}")
        if not np.all(self.surface_gain):
            raise ValueError(f"surface_gain: got {self.surface_gain}, none of it may be zero")
        if not (np.inf > self.thrust_range[0] <= self.thrust_range[1]):
            raise ValueError(
                f"thrust_range: got {self.thrust_range} N, should be the least, then the largest"
            )

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:
        """Return the state of an engine that burns."""
        return State(np.zeros_like(measurement.position[..., :1]))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, ThrustCommand, Signals]:
        """Return the state, the thrust with the gimbals' angles, and the errors."""
        cut = touched(state.cut, measurement)
        seen, wanted = measurement, reference
        Z, S, asked, given = kernels.variable_structure(
            seen.attitude, seen.rate, seen.position, seen.velocity,
            wanted.attitude, wanted.position, wanted.velocity, wanted.linear_acceleration,
            *self._gains[:-2], self._engine(seen.propellant), self._gains[-1],
        )  # fmt: skip
        error = seen.position - wanted.position
        shown = Signals(error, Z, S, asked[..., :1], asked[..., :0:-1])
        return State(cut), burning(cut, given), shown

    def _engine(self, propellant: Array) -> Array:
        """Return the engine's numbers with the mass of now, (..., 8)."""
        engine: Array = self._gains[-2]
        if not self.tank or not propellant.shape[-1]:
            return engine
        engine = np.repeat(engine[None], propellant.size, axis=0)
        engine[:, _MASS] -= self.tank - propellant.ravel()
        return engine.reshape(*propellant.shape[:-1], -1)

    @cached_property
    def _gains(self) -> tuple[Array, ...]:
        feedback = lqr_gain() * [[1.0], [1.0], [-1.0]] if self.recomputed else PRINTED
        choices = [_COORDINATES[self.coordinates], self.mixes_before_turning, self.follows_gravity]
        engine = [self.equilibrium_thrust, self.mass, self.radius, self.robust_gain]
        engine += [self.smoothing, *self.thrust_range, self.gimbal_limit]
        moon = [self.gravity_parameter, self.moon_radius]
        numbers = [np.array(part, dtype=float) for part in (choices, engine, moon)]
        return feedback, numbers[0], self.surface_gain, self.loop_share, *numbers[1:]


_MASS = 1  # its place among the engine's numbers
_COORDINATES = {"polar": kernels.POLAR, "scaled": kernels.SCALED, "frozen": kernels.FROZEN}


def touched(cut: Array, measurement: Measurement) -> Array:
    """Return 1.0 where the engine was cut or the feet touch the ground, (..., 1).

    A vehicle without such a sensor is never told.
    """
    contact = measurement.contact
    return np.maximum(cut, contact) if contact.shape[-1] else cut.copy()


def burning(cut: Array, asked: Array) -> ThrustCommand:
    """Return the command of ``asked``, [F, b1, b2] (..., 3) in N and rad, or none once cut."""
    given = np.where(cut > 0.0, 0.0, asked)
    return ThrustCommand(given[..., :1], given[..., :0:-1].copy())
