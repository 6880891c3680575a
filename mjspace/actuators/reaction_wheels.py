"""Reaction wheels: a torque on the bus shared among motors, which have limits."""

import warnings
from dataclasses import dataclass, field
from math import inf
from typing import Any, ClassVar, Literal, Self

import numba
import numpy as np

from mjspace.actuators.base import Fields, State
from mjspace.contract import Array, Measurement
from mjspace.vehicle import model_checks, stability
from mjspace.vehicle.vehicle import Vehicle

MISSED = 1e-9, 1e-12
"""Rounding where no wheel gives any torque: part of the commanded torque, and N m."""


@dataclass(frozen=True)
class ReactionWheels:
    """Wheels that are all alike, and share a torque by least norm or by least peak.

    Friction is not compensated: what the bearings take is the law's to find out.
    """

    axes: Array
    """Unit spin axes in body axes, shape (n, 3)."""
    torque_limit: float = inf
    """Largest motor torque [N m]."""
    speed_limit: float = inf
    """Largest speed relative to the bus [rad/s]."""
    shared_by: Literal["least_squares", "least_peak"] = "least_squares"
    """Of all motor torques that would do, those of least norm, or whose largest is least."""
    inertia: Array = field(default_factory=lambda: np.zeros(0))
    """Of each rotor against the bus, motor torque over relative acceleration [kg m^2], shape (n,);
    used by the speed limit alone."""
    logged_as: ClassVar[str] = "wheel_torque"
    takes: ClassVar[Fields] = {"torque": (3, "N m")}
    acts_on: ClassVar[str] = "ctrl"
    allocation: Array = field(init=False, repr=False)
    """Motor torques for each unit of torque on the bus, shape (n, 3): -pinv(axes^T)."""
    spare: Array = field(init=False, repr=False)
    """Motor torques that give the bus none and may be added, shape (n,); zero for least norm."""
    unreachable: Array = field(init=False, repr=False)
    """Unit vectors, body axes, about which no wheel gives any torque, shape (3 - rank, 3)."""
    _limits: Array = field(init=False, repr=False)

    @classmethod
    def of(
        cls, vehicle: Vehicle, shared_by: Literal["least_squares", "least_peak"], *, alone: bool
    ) -> Self:
        """Return the reaction wheels of a vehicle, which are ``alone`` where nothing else acts.

        Warns:
            guards.ModelWarning: they are alone, and there are axes about which they give no torque.
        """
        count = len(vehicle.wheel_axes)
        inertia = stability.inertia_at_joints(vehicle.model)[vehicle.wheel_dof[:count]]
        limits = vehicle.torque_limit, vehicle.speed_limit
        wheels = cls(vehicle.wheel_axes, *limits, shared_by, inertia)
        if alone and len(wheels.unreachable):
            about = " and ".join(str(np.round(axis, 6) + 0.0) for axis in wheels.unreachable)
            warnings.warn(
                f"plant.wheels.axes span {3 - len(wheels.unreachable)} of 3 directions: the wheels "
                f"give no torque about {about}, body axes, and report one that is commanded there "
                f"as saturation",
                model_checks.ModelWarning,
                stacklevel=2,
            )
        return wheels

    def __post_init__(self) -> None:
        if np.isfinite(self.speed_limit) and len(self.inertia) != len(self.axes):
            raise ValueError(
                f"speed_limit needs the inertia of each of the {len(self.axes)} rotors: "
                f"{len(self.inertia)} found"
            )
        derived = {
            "allocation": -np.linalg.pinv(self.axes.T),
            "spare": self._spare(),
            "unreachable": self._unreachable(),
            "inertia": self.inertia if len(self.inertia) else np.ones(len(self.axes)),
            "_limits": np.array([self.torque_limit, self.speed_limit]),
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    @property
    def stateful(self) -> bool:
        """Whether they act in every integration step: a speed limit does."""
        return bool(np.isfinite(self.speed_limit))

    def reset(self, vehicles: int) -> State:
        """Return no state."""
        return {}

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the torque that the wheels together apply about each axis."""
        reach = np.abs(self.axes).sum(axis=0)
        largest = np.multiply(reach, self.torque_limit, out=np.zeros(3), where=reach > 0.0)
        return {"torque": (-largest, largest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return what ``motor_torque`` does for a ``TorqueCommand``."""
        return state, *self.motor_torque(command.torque, truth.wheel_speed, step)

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth: the wheels show their speed alone."""
        return truth

    def motor_torque(self, torque: Array, wheel_speed: Array, step: float) -> tuple[Array, Array]:
        """Return (ctrl, saturated), each of shape (..., n), for the next ``step`` [s].

        ``torque`` (..., 3) is commanded on the bus, body axes [N m]; ``wheel_speed`` (..., n) is
        relative to the bus [rad/s]. ``ctrl`` [N m] is the motors' torque on their rotors, whose
        reaction turns the bus: of all that give ``torque``, as ``shared_by`` says, each wheel's
        then cut to the torque limit, and so that the step ends at the speed limit. What the bus's
        other torques add to a relative speed within the step, the motor does not take away.
        ``saturated`` is 1.0 for a wheel whose torque is cut, else 0.0; and 1.0 for every wheel
        where ``torque`` has a part that none of them can give.
        """
        # Past Numba's wrapper, and with both limits in one array: 1.6 us a call, not 2.6.
        applied: tuple[Array, Array] = _motor_torque.ufunc(
            torque,
            wheel_speed,
            self.allocation,
            self.spare,
            self._limits,
            self.inertia,
            self.unreachable,
            step,
        )
        return applied

    def _unreachable(self) -> Array:
        """Return ``unreachable``; of a vehicle without wheels none, as nobody counts on them."""
        if not len(self.axes):
            return np.zeros((0, 3))
        _, singular, right = np.linalg.svd(self.axes)
        missing = right[int(np.sum(singular > 1e-9)) :]
        largest = np.take_along_axis(missing, np.abs(missing).argmax(axis=1)[:, None], axis=1)
        found: Array = missing * np.sign(largest)
        return found

    def _spare(self) -> Array:
        """Return ``spare``; ValueError where least peak has no choice, or more than one number."""
        if self.shared_by == "least_squares":
            return np.zeros(len(self.axes))
        _, singular, right = np.linalg.svd(self.axes.T)
        free = len(self.axes) - int(np.sum(singular > 1e-9))
        if free != 1:
            raise ValueError(
                f"wheels.allocation: least_peak wants one wheel more than their axes span, as four "
                f"of a pyramid are; here it is {free} more: least_squares would do"
            )
        one: Array = right[-1]
        return np.where(np.abs(one) < 1e-12, 0.0, one)


# Products are written out: BLAS may round one vehicle's differently in a batch than alone.
@numba.guvectorize(
    ["void(f8[:], f8[:], f8[:, :], f8[:], f8[:], f8[:], f8[:, :], f8, f8[:], f8[:])"],
    "(k),(n),(n,k),(n),(m),(n),(u,k),()->(n),(n)",
    cache=True,
)
def _motor_torque(
    torque: Any,
    speed: Any,
    allocation: Any,
    spare: Any,
    limits: Any,
    inertia: Any,
    unreachable: Any,
    step: Any,
    ctrl: Any,
    saturated: Any,
) -> None:
    torque_limit, speed_limit = limits[0], limits[1]
    best, least = 0.0, 0.0
    for i in range(speed.size):
        desired = 0.0
        for k in range(torque.size):
            desired += allocation[i, k] * torque[k]
        ctrl[i] = desired
        least = max(least, abs(desired))
    # The largest of |ctrl + t spare| is least where two wheels are level: all t of such pairs are
    # tried, and none, which stays where it is as good.
    for i in range(speed.size):
        for j in range(i):
            for sign in (-1.0, 1.0):
                slope = spare[i] + sign * spare[j]
                if slope != 0.0:
                    t, peak = -(ctrl[i] + sign * ctrl[j]) / slope, 0.0
                    for k in range(speed.size):
                        peak = max(peak, abs(ctrl[k] + t * spare[k]))
                    if peak < least:
                        best, least = t, peak
    missed, largest = 0.0, 0.0
    for k in range(torque.size):
        largest = max(largest, abs(torque[k]))
    for u in range(unreachable.shape[0]):
        part = 0.0
        for k in range(torque.size):
            part += unreachable[u, k] * torque[k]
        missed = max(missed, abs(part))
    beyond = missed > max(MISSED[0] * largest, MISSED[1])
    for i in range(speed.size):
        desired = ctrl[i] + best * spare[i]
        applied = desired
        if abs(applied) > torque_limit:
            applied = np.copysign(torque_limit, desired)
        if speed_limit < np.inf:
            most = max(speed_limit - speed[i], 0.0) * inertia[i] / step
            least = min(-speed_limit - speed[i], 0.0) * inertia[i] / step
            applied = least if applied < least else most if applied > most else applied
        ctrl[i] = applied
        saturated[i] = 1.0 if applied != desired or beyond else 0.0
