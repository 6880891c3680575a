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

from mjspace.algebra import components, times
from mjspace.attitude import conjugate, to_euler_zyx
from mjspace.contract import Array, Measurement, ThrustCommand, Trajectory, gain

from .lander_gains import GimballedEngine
from .lander_lqr import PRINTED, lqr_gain

COORDINATES = ("polar", "scaled", "frozen")


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

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.coordinates not in COORDINATES:
            have = ", ".join(COORDINATES)
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
        at, desired = measurement, reference
        psi, phi, gamma = components(euler(at.attitude))
        theta_d, _, gamma_d = components(euler(desired.attitude))
        r, dr, theta_error, dtheta, theta = self._cylindrical(at.position, at.velocity, theta_d)
        r_d, _ = _horizontal(desired.position, theta_d)
        dr_d, _ = _horizontal(desired.velocity, theta_d)
        error, climb = at.position - desired.position, at.velocity - desired.velocity

        phi_error = phi - np.sin(psi - theta_d) * gamma_d  # before (33)
        gamma_error = gamma - np.cos(psi - theta_d) * gamma_d
        alpha = psi - theta  # M4, erratum 1
        c, s = np.cos(alpha), np.sin(alpha)
        phi_L, gamma_L = c * phi_error - s * gamma_error, s * phi_error + c * gamma_error  # (25)
        # z3 to z9 of T X1L, (29), with the signs of T (erratum 12); the errors of theta and alpha
        # before (33) differ by 2 (theta - theta_d).
        z4, z9 = np.sqrt(2.0) * theta_error, error[..., 2:]
        Z = np.concatenate([r - r_d, z4, -dtheta, dr_d - dr, gamma_L, -phi_L, z9], axis=-1)
        X2 = np.concatenate([climb[..., 2:], at.rate[..., :2]], axis=-1)  # x' w2 w3

        virtual = self._turned(times(self._feedback, Z), c, s)
        S = self.loop_share * (self.surface_gain * X2 + virtual)  # (33)
        U = -S - self._robust(S)  # (34)
        upright = np.cos(phi) * np.cos(gamma)
        thrust = self._thrust(U[..., :1], upright, desired, at.propellant)
        commanded = np.concatenate([thrust, U[..., 1:]], axis=-1)

        cut = touched(state.cut, measurement)
        signals = Signals(error, Z, S, commanded[..., :1], commanded[..., :0:-1])
        return State(cut), burning(cut, self.limited(commanded)), signals

    def _robust(self, S: Array) -> Array:
        """Return psi, (36), (..., 3)."""
        robust: Array = self.robust_gain * np.tanh(self.robust_gain * S / self.smoothing)
        return robust

    def _cylindrical(self, position: Array, velocity: Array, theta_d: Array) -> tuple[Array, ...]:
        """Return r, r', theta - theta_d and theta' as K expects them, and theta, each (..., 1).

        Scaled: K is designed for r = re; a change of theta at r moves the vehicle by r/re of that
        at re (M3, erratum 16). Frozen: along the axes at theta_d, since theta is singular at r = 0
        (M6).
        """
        if self.coordinates == "frozen":
            r, across = _horizontal(position, theta_d)
            dr, dacross = _horizontal(velocity, theta_d)
            return r, dr, across / self.radius, dacross / self.radius, theta_d
        y, z, _ = components(position)
        r, theta = np.hypot(y, z), np.arctan2(z, y)
        dr, dacross = _horizontal(velocity, theta)
        share = r / self.radius if self.coordinates == "scaled" else 1.0
        return r, dr, share * _wrapped(theta - theta_d), share * dacross / r, theta

    def _turned(self, u: Array, c: Array, s: Array) -> Array:
        """Return Rx(alpha) u, (27), with ``c`` and ``s`` of alpha, (..., 3).

        Rx mixes axes whose loops have different speeds: it has Ka Rx Ka^-1 instead (M5).
        """
        speeds = self.surface_gain if self.mixes_before_turning else np.ones(3)
        x, u2, u3 = components(u / speeds)
        turned: Array = speeds * np.concatenate([x, c * u2 + s * u3, c * u3 - s * u2], axis=-1)
        return turned

    def _thrust(self, U1: Array, upright: Array, desired: Trajectory, propellant: Array) -> Array:
        """Return F [N] that adds U1 to the equilibrium (M1, erratum 9), (..., 1).

        It is that of the desired motion, or Fe. ``upright`` is the cosine of the tilt.
        """
        if not self.follows_gravity:
            return self.equilibrium_thrust + U1
        needed = (desired.linear_acceleration - self.gravity(desired.position))[..., 2:]
        thrust: Array = self.mass_with(propellant) * (needed + U1) / np.maximum(0.5, upright)
        return thrust

    @cached_property
    def _feedback(self) -> Array:
        """K, (3, 7)."""
        return lqr_gain() * [[1.0], [1.0], [-1.0]] if self.recomputed else PRINTED


def euler(q: Array) -> Array:
    """Return psi, phi, gamma [rad] of C = Rz(gamma) Ry(phi) Rx(psi), (..., 3).

    C is (4), from inertial to body axes (erratum 1) of the paper; ``q`` is in our axes. The paper's
    Rx, Ry and Rz turn axes, those of ``to_euler_zyx`` turn vectors: hence the sign.
    """
    return -to_euler_zyx(conjugate(q[..., [0, 3, 1, 2]]))


def _horizontal(vector: Array, theta: Array) -> tuple[Array, Array]:
    """Return the components along and across the azimuth ``theta``, each (..., 1)."""
    y, z, _ = components(vector)
    c, s = np.cos(theta), np.sin(theta)
    return c * y + s * z, c * z - s * y


def _wrapped(angle: Array) -> Array:
    """Return ``angle`` within half a turn of zero."""
    return angle - 2.0 * np.pi * np.rint(angle / (2.0 * np.pi))


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
