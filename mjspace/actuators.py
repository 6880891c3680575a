"""Actuators: what a command makes the motors do; here the reaction wheels', which have limits."""

from dataclasses import dataclass, field
from math import inf
from typing import Any, ClassVar, Protocol

import numba
import numpy as np

from mjspace.contract import Array, Measurement

State = dict[str, Array]
"""What actuators remember, vehicle axis first."""


class Actuators(Protocol):
    """The motors of a batch of vehicles: all memory in ``State``.

    Actuators that burn what they carry have a method ``masses(state)`` as well: for each field of
    MuJoCo's model that has changed, the body and the vehicles' values, (N, ...).
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
    """Wheels that are all alike, with a pseudo-inverse allocation.

    Friction is not compensated: what the bearings take is the law's to find out.
    """

    axes: Array
    """Unit spin axes in body axes, shape (n, 3)."""
    torque_limit: float = inf
    """Largest motor torque [N m]."""
    speed_limit: float = inf
    """Largest speed relative to the bus [rad/s]."""
    logged_as: ClassVar[str] = "wheel_torque"
    takes: ClassVar[str] = "torque of shape (..., 3) [N m]"
    acts_on: ClassVar[str] = "ctrl"
    stateful: ClassVar[bool] = False
    allocation: Array = field(init=False, repr=False)
    """Motor torques for each unit of torque on the bus, shape (n, 3): -pinv(axes^T)."""
    _limits: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "allocation", -np.linalg.pinv(self.axes.T))
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
        reaction turns the bus: of all that would give ``torque``, the one of least norm, each
        wheel's then cut to the torque limit. A wheel at its speed limit or beyond gets no torque
        that would raise its speed; as a command is held, it may pass the limit by what one control
        period adds. ``saturated`` is 1.0 for a wheel that does not get the torque allotted to it,
        else 0.0.
        """
        # Past Numba's wrapper, and with both limits in one array: 1.6 us a call, not 2.6.
        given: tuple[Array, Array] = _motor_torque.ufunc(
            torque, wheel_speed, self.allocation, self._limits
        )
        return given


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
    ["void(f8[:], f8[:], f8[:, :], f8[:], f8[:], f8[:])"],
    "(k),(n),(n,k),(m)->(n),(n)",
    cache=True,
)
def _motor_torque(
    torque: Any, speed: Any, allocation: Any, limits: Any, ctrl: Any, saturated: Any
) -> None:
    torque_limit, speed_limit = limits[0], limits[1]
    for i in range(speed.size):
        wanted = 0.0
        for k in range(torque.size):
            wanted += allocation[i, k] * torque[k]
        given = wanted
        if abs(given) > torque_limit:
            given = np.copysign(torque_limit, wanted)
        if abs(speed[i]) >= speed_limit and given * speed[i] > 0.0:
            given = 0.0
        ctrl[i] = given
        saturated[i] = 1.0 if given != wanted else 0.0
