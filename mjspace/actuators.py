"""Actuators: what a command makes the motors do; here the reaction wheels', which have limits."""

from dataclasses import dataclass, field
from math import inf
from typing import Any, ClassVar, Literal, Protocol

import numba
import numpy as np

from mjspace.contract import Array, Measurement

State = dict[str, Array]
"""What actuators remember, vehicle axis first."""


class Actuators(Protocol):
    """The motors of a batch of vehicles: all memory in ``State``.

    Actuators that burn what they carry have a method ``masses(state)`` as well: for each field of
    MuJoCo's model that has changed, the body and the vehicles' values, (N, ...); and may have
    ``billed(state, given, instead, step)``, which accounts for what faults make them give instead.
    """

    logged_as: ClassVar[str]
    """The field of /command that their torques are logged under."""

    @property
    def takes(self) -> str:
        """What a command must have."""

    acts_on: ClassVar[str]
    """MuJoCo's array that ``act`` fills: "ctrl", "qfrc_applied" for the bus's torque, or "userdata"
    for its magnetic moment [A m^2], body axes, in the environment's field."""

    @property
    def stateful(self) -> bool:
        """Whether they must act in every integration step; else once in a control period."""

    def reset(self, vehicles: int) -> State:
        """Return the state at the start."""

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, torque, saturated) for ``step`` [s] from now; arrays (N, m).

        ``torque`` [N m] is on what each turns, ``saturated`` 1.0 for one that does not do as it is
        told.
        """

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with what the motors themselves show."""


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
    logged_as: ClassVar[str] = "wheel_torque"
    takes: ClassVar[str] = "torque of shape (..., 3) [N m]"
    acts_on: ClassVar[str] = "ctrl"
    stateful: ClassVar[bool] = False
    allocation: Array = field(init=False, repr=False)
    """Motor torques for each unit of torque on the bus, shape (n, 3): -pinv(axes^T)."""
    spare: Array = field(init=False, repr=False)
    """Motor torques that give the bus none and may be added, shape (n,); zero for least norm."""
    _limits: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "allocation", -np.linalg.pinv(self.axes.T))
        object.__setattr__(self, "spare", self._spare())
        object.__setattr__(self, "_limits", np.array([self.torque_limit, self.speed_limit]))

    def reset(self, vehicles: int) -> State:
        """Return no state."""
        return {}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return what ``motor_torque`` does for a ``TorqueCommand``."""
        return state, *self.motor_torque(command.torque, truth.wheel_speed)

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth: the wheels show their speed alone."""
        return truth

    def motor_torque(self, torque: Array, wheel_speed: Array) -> tuple[Array, Array]:
        """Return (ctrl, saturated), each of shape (..., n).

        ``torque`` (..., 3) is wanted on the bus, body axes [N m]; ``wheel_speed`` (..., n) is
        relative to the bus [rad/s]. ``ctrl`` [N m] is the motors' torque on their rotors, whose
        reaction turns the bus: of all that would give ``torque``, as ``shared_by`` says, each
        wheel's then cut to the torque limit. A wheel at its speed limit or beyond gets no torque
        that would raise its speed; as a command is held, it may pass the limit by what one control
        period adds. ``saturated`` is 1.0 for a wheel that does not get the torque allotted to it,
        else 0.0.
        """
        # Past Numba's wrapper, and with both limits in one array: 1.6 us a call, not 2.6.
        given: tuple[Array, Array] = _motor_torque.ufunc(
            torque, wheel_speed, self.allocation, self.spare, self._limits
        )
        return given

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


@dataclass(frozen=True)
class IdealThrusters:
    """Thrusters of which nothing is modelled but their torque, which is what the law asks for."""

    obeys: str = "torque"
    """The field of the command."""

    logged_as: ClassVar[str] = "thruster_torque"
    acts_on: ClassVar[str] = "qfrc_applied"
    stateful: ClassVar[bool] = False

    @property
    def takes(self) -> str:
        """What a command must have."""
        return f"{self.obeys} of shape (..., 3) [N m]"

    def reset(self, vehicles: int) -> State:
        """Return no state."""
        return {}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return the torque that is asked for, body axes, (N, 3); nothing is ever cut."""
        asked = getattr(command, self.obeys)
        torque = np.asarray(asked, dtype=float).reshape(truth.rate.shape)
        return state, torque, np.zeros((len(torque), 0))

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth: thrusters show nothing."""
        return truth


# Products are written out: BLAS may round one vehicle's differently in a batch than alone.
@numba.guvectorize(
    ["void(f8[:], f8[:], f8[:, :], f8[:], f8[:], f8[:], f8[:])"],
    "(k),(n),(n,k),(n),(m)->(n),(n)",
    cache=True,
)
def _motor_torque(
    torque: Any, speed: Any, allocation: Any, spare: Any, limits: Any, ctrl: Any, saturated: Any
) -> None:
    torque_limit, speed_limit = limits[0], limits[1]
    best, least = 0.0, 0.0
    for i in range(speed.size):
        wanted = 0.0
        for k in range(torque.size):
            wanted += allocation[i, k] * torque[k]
        ctrl[i] = wanted
        least = max(least, abs(wanted))
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
    for i in range(speed.size):
        wanted = ctrl[i] + best * spare[i]
        given = wanted
        if abs(given) > torque_limit:
            given = np.copysign(torque_limit, wanted)
        if abs(speed[i]) >= speed_limit and given * speed[i] > 0.0:
            given = 0.0
        ctrl[i] = given
        saturated[i] = 1.0 if given != wanted else 0.0
