"""What passes between a vehicle, its sensors, a reference and a control law."""

from collections.abc import Callable, Mapping
from typing import Annotated, Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from mjspace.contract.commands import GimbalRateCommand as GimbalRateCommand
from mjspace.contract.commands import PulseCommand as PulseCommand
from mjspace.contract.commands import ThrustCommand as ThrustCommand
from mjspace.contract.commands import TorqueCommand as TorqueCommand
from mjspace.contract.commands import VoltageCommand as VoltageCommand
from mjspace.ranges import Gains as Gains
from mjspace.ranges import gain as gain
from mjspace.units import Unit as Unit

Array = NDArray[np.float64]

TICK = 1e-9
"""s: instants that are closer than this are one; it is what the stamps of a log can tell apart."""


_VALID = "_valid"
_NONE = np.zeros(0)
_NONE.setflags(write=False)


class Measurement:
    """What is measured at a control instant; a leading vehicle axis may precede each shape.

    An array for each sensor, under the sensor's name, and for each quantity that the plant reports
    by itself. A quantity is what the sensor of the same name reports, or else the first sensor
    declared for it: ``measurement.attitude`` is ``measurement.st_1`` where ``st_1`` is the first of
    several star trackers. Reading a quantity that no sensor measures raises an AttributeError that
    names the table to add. Attributes cannot be assigned; ``_replace`` returns a changed copy.

    Under ``<name>_valid``, of a sensor or a quantity, is 1.0 where the report is valid and 0.0
    where it is not, shape (..., 1): 1.0 of a sensor that cannot tell.
    """

    attitude: Array
    """Quaternion, scalar first, body to inertial, shape (..., 4)."""
    rate: Annotated[Array, Unit("rad/s")]
    """Angular velocity relative to inertial, body axes [rad/s], shape (..., 3)."""
    position: Annotated[Array, Unit("m")]
    """Of the bus, inertial axes [m], shape (..., 3)."""
    velocity: Annotated[Array, Unit("m/s")]
    """Of the bus, inertial axes [m/s], shape (..., 3)."""
    specific_force: Annotated[Array, Unit("m/s^2")]
    """Specific force at the bus's origin, body axes [m/s^2], shape (..., 3): the mean since the
    accelerometer's last sample."""
    altitude: Annotated[Array, Unit("m")]
    """Height of the bus above the plane z = 0 [m], shape (..., 1)."""
    ground_velocity: Annotated[Array, Unit("m/s")]
    """Velocity of the bus, body axes [m/s], shape (..., 3)."""
    magnetic_field: Annotated[Array, Unit("T")]
    """Of the Earth, body axes [T], shape (..., 3)."""
    field_reference: Annotated[Array, Unit("T")]
    """Of the Earth by the on-board model, inertial axes [T], shape (..., 3)."""
    sun_reference: Array
    """Unit vector to the Sun by the on-board almanac, inertial axes, shape (..., 3)."""

    # Reported by the plant: empty where the vehicle has nothing of the kind.
    wheel_speed: Annotated[Array, Unit("rad/s", display="rpm")] = _NONE
    """Wheel speeds relative to what carries them [rad/s], shape (..., n)."""
    gimbal_angle: Annotated[Array, Unit("rad")] = _NONE
    """Angles of gimbals, the outer before the inner, and of arms' joints [rad], shape (..., g)."""
    gimbal_rate: Annotated[Array, Unit("rad/s")] = _NONE
    """Gimbal rates relative to what carries them [rad/s], shape (..., g)."""
    current: Annotated[Array, Unit("A")] = _NONE
    """(I_d, I_q) of each motor that has an electrical side [A], shape (..., m, 2); its windings'
    currents where the drive works in the stator's axes."""
    thrust: Annotated[Array, Unit("N")] = _NONE
    """Of the engine, then of each thruster [N], shape (..., n)."""
    propellant: Annotated[Array, Unit("kg")] = _NONE
    """Left in the tank, the engine's before the thrusters' [kg], shape (..., n)."""
    contact: Array = _NONE
    """1.0 while at least two feet or the hull touch the ground, else 0.0, shape (..., 1)."""
    wheel_angle: Annotated[Array, Unit("rad")] = _NONE
    """Angles of the wheels with an electrical side, relative to what carries them [rad], shape
    (..., n)."""
    foot_contact: Array = _NONE
    """1.0 for each foot that touches the ground, else 0.0, shape (..., f)."""
    hull_contact: Array = _NONE
    """1.0 while anything else of the vehicle touches the ground, else 0.0, shape (..., 1)."""

    def __init__(self, **arrays: Array) -> None:
        self.__dict__.update(arrays)

    def __getattr__(self, name: str) -> Array:
        """Refuse a name that nothing is measured under.

        Raises:
            AttributeError: with the table to add, and the names that there are.
        """
        if name.startswith("_"):
            raise AttributeError(name)
        if name.endswith(_VALID):
            return self._validity(name.removesuffix(_VALID))
        have = ", ".join(name for name, array in self.__dict__.items() if np.size(array))
        raise AttributeError(f"no sensor measures {name}: add [sensors.{name}] (measured: {have})")

    def _validity(self, name: str) -> Array:
        """Return whether what is reported under a ``name`` is valid."""
        report = vars(type(self)).get(name)
        if isinstance(report, _Report) and f"{report.sensor}{_VALID}" in self.__dict__:
            return self.__dict__[f"{report.sensor}{_VALID}"]  # type: ignore[no-any-return]
        return np.ones((*getattr(self, name).shape[:-1], 1))

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError("a measurement is read-only")

    def __delattr__(self, name: str) -> None:
        raise AttributeError("a measurement is read-only")

    def __repr__(self) -> str:
        return f"Measurement({', '.join(f'{name}={a!r}' for name, a in self.__dict__.items())})"

    @property
    def _fields(self) -> tuple[str, ...]:
        """The names of the sensors and of the plant's quantities."""
        return tuple(self.__dict__)

    def _asdict(self) -> dict[str, Array]:
        """Return the arrays by name, without copying them."""
        return self.__dict__.copy()

    def _replace(self, **changes: Array) -> Self:
        """Return a copy in which these arrays are others, or are measured as well."""
        copy = object.__new__(type(self))  # in a third of the time that __init__ takes
        copy.__dict__.update(self.__dict__)
        copy.__dict__.update(changes)
        return copy

    def _map(self, function: Callable[[Array], Array]) -> Self:
        """Return a copy with ``function`` applied to each array, as ``lambda a: a[0]``."""
        return type(self)(**{name: function(array) for name, array in self.__dict__.items()})

    @classmethod
    def _with_sensors(cls, measured: Mapping[str, str]) -> type[Self]:
        """Return the class for sensors that are ``measured`` (name: quantity), in that order."""
        first = {quantity: name for name, quantity in reversed(list(measured.items()))}
        other = {q: _Report(name) for q, name in first.items() if q not in measured}
        return type(cls.__name__, (cls,), other) if other else cls


class _Report:
    """Under a quantity's name, what a sensor of another name reports."""

    def __init__(self, sensor: str) -> None:
        self.sensor = sensor

    def __get__(self, measurement: Measurement, owner: Any = None) -> Array:
        return measurement.__dict__[self.sensor]  # type: ignore[no-any-return]


REPORTED_BY_PLANT = tuple(name for name in Measurement.__annotations__ if name in vars(Measurement))
"""The quantities of a ``Measurement`` that a vehicle reports without a sensor of their own; of
those, wheel speeds come from the tachometers, which every vehicle has."""


class Truth(NamedTuple):
    """The true state and surroundings at an instant, as a disturbance in Python receives them.

    ``Measurement`` describes its fields; no sensor is between. What is lacking has shape ``(0,)``.
    """

    attitude: Array
    rate: Annotated[Array, Unit("rad/s")]
    wheel_speed: Annotated[Array, Unit("rad/s", display="rpm")]
    gimbal_angle: Annotated[Array, Unit("rad")]
    gimbal_rate: Annotated[Array, Unit("rad/s")]
    current: Annotated[Array, Unit("A")]
    position: Annotated[Array, Unit("m")]
    velocity: Annotated[Array, Unit("m/s")]
    altitude: Annotated[Array, Unit("m")]
    ground_velocity: Annotated[Array, Unit("m/s")]
    thrust: Annotated[Array, Unit("N")]
    propellant: Annotated[Array, Unit("kg")]
    contact: Array
    wheel_angle: Annotated[Array, Unit("rad")]
    magnetic_field: Annotated[Array, Unit("T")]
    foot_contact: Array
    hull_contact: Array
    orbit_position: Annotated[Array, Unit("m")]
    """Of the frame's origin from the planet's centre, inertial axes [m], shape (3,)."""
    orbit_velocity: Annotated[Array, Unit("m/s")]
    """Of the frame's origin, inertial axes [m/s], shape (3,)."""
    sun_direction: Array
    """Unit vector from the bus to the Sun, body axes, shape (3,)."""
    sunlight: Array
    """Part of the Sun's disc that the Earth's shadow leaves visible, 0 to 1, shape (1,)."""
    moon_direction: Array
    """Unit vector from the bus to the Moon, body axes, shape (3,)."""
    latitude: Annotated[Array, Unit("rad")]
    """Geodetic, of the bus above the Earth, on WGS 84 [rad], shape (1,)."""
    longitude: Annotated[Array, Unit("rad")]
    """Of the bus, east of Greenwich [rad], shape (1,)."""
    height: Annotated[Array, Unit("m")]
    """Of the bus above the ellipsoid of WGS 84 [m], shape (1,)."""


class Reference(NamedTuple):
    """The desired motion at a control instant, the same for every vehicle of a batch."""

    attitude: Array
    """Quaternion, scalar first, desired body axes to inertial, shape (..., 4)."""
    rate: Annotated[Array, Unit("rad/s")]
    """Angular velocity of the desired axes, in the desired axes [rad/s], shape (..., 3)."""
    acceleration: Annotated[Array, Unit("rad/s^2")]
    """Time derivative of the components of ``rate`` [rad/s^2], shape (..., 3)."""


class Trajectory(NamedTuple):
    """A ``Reference``, which describes the first fields, with the vehicle's desired position."""

    attitude: Array
    rate: Annotated[Array, Unit("rad/s")]
    acceleration: Annotated[Array, Unit("rad/s^2")]
    position: Annotated[Array, Unit("m")]
    """Inertial axes [m], shape (..., 3)."""
    velocity: Annotated[Array, Unit("m/s")]
    """Inertial axes [m/s], shape (..., 3)."""
    linear_acceleration: Annotated[Array, Unit("m/s^2")]
    """Inertial axes [m/s^2], shape (..., 3)."""


DesiredMotion = Reference | Trajectory
"""What a law is to follow."""


class Path(NamedTuple):
    """How a point moves, inertial axes: its position and three time derivatives."""

    position: Annotated[Array, Unit("m")]
    """[m], shape (n, 3)."""
    velocity: Annotated[Array, Unit("m/s")]
    """[m/s], shape (n, 3)."""
    acceleration: Annotated[Array, Unit("m/s^2")]
    """[m/s^2], shape (n, 3)."""
    jerk: Annotated[Array, Unit("m/s^3")]
    """[m/s^3], shape (n, 3)."""


class Ephemeris(Protocol):
    """What is known beforehand of the orbit, the Sun and the Earth, from the planet's centre.

    A reference that has a parameter ``ephemeris`` is handed that of the scenario's environment.
    Each method takes times [s] of shape (n,), and raises a ValueError that names what the scenario
    would have to say.
    """

    def origin(self, time: Array) -> Path:
        """Return the motion of the frame's origin, which falls along the orbit."""

    def sun(self, time: Array) -> Path:
        """Return the motion of the Sun, as seen from the Earth's centre."""

    def fixed_to_earth(self, place: Array, time: Array) -> Path:
        """Return the motion of a ``place`` (3,) [m] in Earth-fixed axes, z along the Earth's."""


class Event(NamedTuple):
    """Something that happened in a flight, as the log has it on /events."""

    time: float
    """Simulation time [s]."""
    vehicle: int
    """Index in the batch; 0 in a log, which is of one vehicle."""
    level: str
    """``foxglove.Log``'s: DEBUG, INFO, WARNING, ERROR or FATAL."""
    message: str


class Law(Protocol):
    """A control law: gains in, two pure functions, no hidden state.

    ``state``, ``command`` and ``signals`` are named tuples of float64 arrays whose leading axes are
    those of the measurement; they are logged under their field names, so their shapes never change
    during a flight. A field declares its unit in its annotation, ``Annotated[Array, Unit("rad")]``.
    A law that says ``batched = True`` handles any leading axes; another sees the arrays of one
    vehicle and is flown one by one. Reaction wheels obey a ``TorqueCommand``, or any command with
    that field; motors with an electrical side a ``VoltageCommand``; gimbals with speed loops a
    ``GimbalRateCommand``; an engine on gimbals a ``ThrustCommand``, on/off thrusters a
    ``PulseCommand``, arms any command with a field ``joint_torque``. ``reference`` is a row of the
    scenario's reference: ``DesiredMotion``.

    Laws are flown compiled where that is possible: ``step`` is called once on arrays that note what
    is computed with them, and for the first of at most 2000 periods. One that has to be called in
    each period, since it prints or counts, says ``compiled = False``.

    A batched law may have an inner loop as well, for what must be quick: a method
    ``inner(state, time, command, measurement) -> (state, command)``, pure like ``step``, that is
    called every integration step and turns the command of ``step`` into that of the motors.
    """

    def reset(self, measurement: Measurement, reference: Any) -> Any:
        """Return the law's state at the start of a flight."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Any
    ) -> tuple[Any, Any, Any]:
        """Return (state, command, signals) for the control period that starts at ``time`` [s]."""


class Estimator(Protocol):
    """An estimator: gains in, two pure functions, no hidden state; it runs before the law.

    ``state`` and ``estimate`` are named tuples of float64 arrays, as a law's state and signals are,
    logged in /state and on /estimate. The law finds each field of the estimate in its measurement:
    one that is called like a quantity, ``attitude`` or ``rate``, in place of what is measured, any
    other beside it. ``batched``, ``compiled`` and read-only arrays are as of a ``Law``.
    """

    def reset(self, measurement: Measurement) -> Any:
        """Return the estimator's state at the start of a flight.

        The first ``step`` follows at the same instant, twice: for the law's ``reset``, with time 0,
        and for its first step.
        """

    def step(self, state: Any, time: float, measurement: Measurement) -> tuple[Any, Any]:
        """Return (state, estimate) at the control instant ``time`` [s]."""


class ReferenceSource(Protocol):
    """A desired motion as a pure function of time."""

    def at(self, time: Array) -> DesiredMotion:
        """Return the reference at each ``time`` [s], shape (n,), as arrays with n rows.

        Any named tuple is valid that begins with the fields of ``Reference``: the law receives its
        rows, and the log has its fields.
        """
