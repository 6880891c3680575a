"""What a scenario may say: typed, frozen models of every table and key, with units and defaults."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from mjspace.quantity import to_si

SI_UNIT = "si_unit"


class _Si:
    """Converts quantity strings to one SI unit; the unit also goes into the scenario reference."""

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def __call__(self, value: Any) -> Any:
        return to_si(value, self.unit)


def _number(unit: str, **bounds: Any) -> Any:
    extra = {SI_UNIT: unit}
    return Annotated[
        float, BeforeValidator(_Si(unit)), Field(json_schema_extra=extra, allow_inf_nan=False, **bounds)
    ]


def _vector(unit: str, length: int) -> Any:
    extra = {SI_UNIT: unit}
    return Annotated[
        list[Annotated[float, Field(allow_inf_nan=False)]],
        BeforeValidator(_Si(unit)),
        Field(min_length=length, max_length=length, json_schema_extra=extra),
    ]


Seconds = _number("s", gt=0)
Delay = _number("s", ge=0)
Time = _number("s", ge=0)
Hertz = _number("Hz", gt=0)
Mass = _number("kg", gt=0)
Inertia = _number("kg m^2", gt=0)
Unit3 = _vector("", 3)
Meters3 = _vector("m", 3)
Velocity3 = _vector("m/s", 3)
Rate3 = _vector("rad/s", 3)
Angles3 = _vector("rad", 3)
Torque3 = _vector("N m", 3)
Force3 = _vector("N", 3)
Momentum3 = _vector("N m s", 3)
Quaternion = _vector("", 4)
Matrix3 = Annotated[list[_vector("kg m^2", 3)], Field(min_length=3, max_length=3)]


class Table(BaseModel):
    """A TOML table: frozen, and with no key that is not listed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=False, use_attribute_docstrings=True)


class Rates(Table):
    """How often things happen."""

    physics: Seconds = 1e-3
    """Integration step."""
    control: Seconds = 1e-3
    """Control period, a whole number of integration steps: law, actuators and log."""
    integrator: Literal["RK4", "implicitfast", "implicit", "Euler"] = "RK4"
    """MuJoCo's integrator; all but RK4 are first order, and are warned of."""


class Wheels(Table):
    """Reaction wheels: one for each axis; every wheel is alike."""

    axes: Annotated[list[Unit3], Field(min_length=1)] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    """Spin axes in body axes, one row for each wheel; normalized."""
    positions: list[Meters3] | None = None
    """Rotor centres in the body [m]; the centre of mass when left out (drawn out on the spin axis)."""
    inertia: Inertia = 0.05
    """Axial rotor inertia."""
    transverse_inertia: Inertia | None = None
    """Transverse rotor inertia; half the axial when left out."""
    mass: Mass = 2.0
    """Rotor mass."""
    torque_limit: _number("N m", gt=0) | None = None  # type: ignore[valid-type]
    """Largest motor torque; none when left out."""
    speed_limit: _number("rad/s", gt=0) | None = None  # type: ignore[valid-type]
    """Largest speed relative to the bus; at it the motor gives no torque that would raise it."""
    viscous_friction: _number("N m s/rad", ge=0) = 0.0  # type: ignore[valid-type]
    """Bearing torque for each rad/s."""
    coulomb_friction: _number("N m", ge=0) = 0.0  # type: ignore[valid-type]
    """Bearing torque at any speed, smoothed through zero: c tanh(speed / 0.1 rad/s)."""
    static_imbalance: _number("kg m", ge=0) = 0.0  # type: ignore[valid-type]
    """Rotor mass times its centre's offset from the spin axis."""
    dynamic_imbalance: _number("kg m^2", ge=0) = 0.0  # type: ignore[valid-type]
    """Product of inertia between the spin axis and a transverse one."""

    @model_validator(mode="after")
    def _alike(self) -> "Wheels":
        if any(np.linalg.norm(axis) < 1e-9 for axis in self.axes):
            raise ValueError("axes: a spin axis has no direction")
        if self.positions is not None and len(self.positions) != len(self.axes):
            raise ValueError(
                f"positions: {len(self.positions)} rows for {len(self.axes)} axes: give one for each"
            )
        return self


class PlantTable(Table):
    """The vehicle: an assembly from assets/, with its mass properties and wheels."""

    model: str = "satellite_3rw"
    """Name of a folder in assets/."""
    mass: Mass = 100.0
    """Mass of the bus alone."""
    bus_inertia: Matrix3 | None = None
    """Inertia of the bus alone about its centre of mass, body axes; any symmetric positive-definite
    matrix. The asset's own when neither this nor ``gyrostat_inertia`` is given."""
    gyrostat_inertia: Matrix3 | None = None
    """The papers' H: the whole vehicle about its centre of mass less the wheels' axial inertia; the
    bus inertia follows from it."""
    wheels: Wheels = Wheels()

    @model_validator(mode="after")
    def _one_inertia(self) -> "PlantTable":
        if self.bus_inertia is not None and self.gyrostat_inertia is not None:
            raise ValueError("bus_inertia and gyrostat_inertia are both given: give one")
        for name in ("bus_inertia", "gyrostat_inertia"):
            rows = getattr(self, name)
            if rows is None:
                continue
            matrix = np.array(rows)
            if not np.allclose(matrix, matrix.T, rtol=1e-12, atol=0.0):
                raise ValueError(f"{name}: not symmetric")
            if np.linalg.eigvalsh(matrix)[0] <= 0.0:
                raise ValueError(f"{name}: not positive definite")
        return self


class Initial(Table):
    """The state at time zero."""

    attitude: Quaternion | None = None
    """Quaternion, scalar first, body to inertial; normalized. Identity when left out."""
    euler: Angles3 | None = None
    """Or roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll), body to inertial."""
    rate: Rate3 = [0.0, 0.0, 0.0]
    """Angular velocity, body axes."""
    position: Meters3 = [0.0, 0.0, 0.0]
    """Of the bus, inertial axes; in the free-fall frame when there is an orbit."""
    velocity: Velocity3 = [0.0, 0.0, 0.0]
    """Of the bus, inertial axes."""
    wheel_speed: Annotated[list[_number("rad/s")], Field()] | None = None  # type: ignore[misc]
    """Wheel speeds relative to the bus; zero when left out."""
    momentum: Momentum3 | None = None
    """Or the wanted total angular momentum about the centre of mass, inertial axes: the wheel speeds
    follow (the smallest, where more than three wheels can make it)."""

    @model_validator(mode="after")
    def _one_of_each(self) -> "Initial":
        if self.attitude is not None and self.euler is not None:
            raise ValueError("attitude and euler are both given: give one")
        if self.wheel_speed is not None and self.momentum is not None:
            raise ValueError("wheel_speed and momentum are both given: give one")
        if self.attitude is not None and np.linalg.norm(self.attitude) < 1e-6:
            raise ValueError("attitude: a zero quaternion is no attitude")
        return self


class Orbit(Table):
    """A Kepler orbit: its gravity gradient acts on every body, in the free-fall frame."""

    body: Literal["earth", "moon"] = "earth"
    """What is orbited."""
    semi_major_axis: _number("m", gt=0)  # type: ignore[valid-type]
    """From the body's centre."""
    eccentricity: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """0 is a circle."""
    inclination: _number("rad") = 0.0  # type: ignore[valid-type]
    """To the inertial x-y plane."""
    ascending_node: _number("rad") = 0.0  # type: ignore[valid-type]
    """Right ascension of the ascending node."""
    periapsis: _number("rad") = 0.0  # type: ignore[valid-type]
    """Argument of periapsis."""
    true_anomaly: _number("rad") = 0.0  # type: ignore[valid-type]
    """At time zero."""


class Sine(Table):
    """One sinusoid of a disturbance torque, on each axis: amplitude sin(frequency t + phase)."""

    amplitude: Torque3
    """On each axis."""
    frequency: _number("rad/s", gt=0)  # type: ignore[valid-type]
    """The same on every axis."""
    phase: Angles3 = [0.0, 0.0, 0.0]
    """On each axis."""


class DisturbanceTorque(Table):
    """A torque on the bus from outside: a bias and a sum of sinusoids of time."""

    frame: Literal["body", "inertial"] = "body"
    """The axes in which the components are constant or periodic."""
    bias: Torque3 = [0.0, 0.0, 0.0]
    """Constant part."""
    sines: list[Sine] = []
    """Periodic part."""


class Environment(Table):
    """What acts on the vehicle from outside; nothing when left out."""

    orbit: Orbit | None = None
    torques: list[DisturbanceTorque] = []
    """Evaluated at every stage of the integrator."""
    python: str | None = None
    """A function of one's own, ``"file.py:name"``: name(time, truth) -> (force [N] on the bus in
    inertial axes, torque [N m] in body axes), held over each integration step (first order only)."""


class Sensor(Table):
    """Errors of one sensor; the ideal sensor has none."""

    noise: Any = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Any = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Any = 0.0
    """Standard deviation of the bias random walk after one second: grows with the square root of
    time."""
    quantization: Any = 0.0
    """Size of the least significant digit."""
    period: Seconds | None = None
    """Time between samples, a whole number of integration steps; the control period when left out."""
    delay: Delay = 0.0
    """Age of a sample when it is reported, a whole number of sample periods."""


def _sensor(name: str, unit: str, doc: str) -> type[Sensor]:
    number = _number(unit, ge=0)
    fields = ("noise", "bias", "bias_walk", "quantization")
    body: dict[str, Any] = {"__annotations__": dict.fromkeys(fields, number), "__doc__": doc}
    body |= dict.fromkeys(fields, 0.0) | {"__module__": __name__}
    return type(name, (Sensor,), body)


StarTracker = _sensor("StarTracker", "rad", "Attitude sensor; errors are small rotations about body axes.")
RateSensor = _sensor("RateSensor", "rad/s", "Gyro or tachometer.")


class Sensors(Table):
    """The vehicle's sensors."""

    attitude: StarTracker = StarTracker()  # type: ignore[valid-type]
    """Star tracker."""
    rate: RateSensor = RateSensor()  # type: ignore[valid-type]
    """Gyro."""
    wheel_speed: RateSensor = RateSensor()  # type: ignore[valid-type]
    """Wheel tachometers."""


class Component(BaseModel):
    """A law or a reference: ``kind`` names a class, every other key is one of its gains."""

    model_config = ConfigDict(extra="allow", frozen=True, use_attribute_docstrings=True)

    kind: str
    """``"module:Class"`` in controllers/, or ``"path/to/file.py:Class"`` beside the scenario."""

    @property
    def gains(self) -> dict[str, Any]:
        """The table without ``kind``."""
        return dict(self.model_extra or {})


class Check(Table):
    """One thing that the flight must show, judged from the log alone."""

    name: str
    """What it says in the table of checks."""
    signal: str
    """``topic.field`` or ``topic.field[i]`` of the log: ``truth.attitude_error``."""
    statistic: Literal["max", "min", "mean", "rms", "final", "drift"] = "max"
    """Over the window: of the value, or of the norm of a vector; ``drift`` is the largest change from
    the window's first value."""
    below: float | str | None = None
    """The statistic must be less; a number in SI or a quantity."""
    above: float | str | None = None
    """The statistic must be greater; a number in SI or a quantity."""
    start: Time = 0.0
    """The window's first instant."""
    end: Time | None = None
    """The window's last instant; the flight's when left out."""
    target: float | list[float] | None = None
    """Taken from the signal first, so that the statistic is of an error."""
    relative: bool = False
    """The error is divided by the norm of ``target``."""

    @model_validator(mode="after")
    def _bounded(self) -> "Check":
        if self.below is None and self.above is None:
            raise ValueError("neither below nor above is given: a check must be able to fail")
        if self.relative and self.target is None:
            raise ValueError("relative needs a target")
        return self


class Scenario(Table):
    """One flight, whole: what flies, where, under which law, for how long, and what it must show."""

    name: str = ""
    """The file's name when left out."""
    description: str
    """One line: what the flight shows."""
    source: str = ""
    """Where its numbers come from."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Of every random stream."""
    duration: Seconds
    """Simulated time."""
    rates: Rates = Rates()
    plant: PlantTable = PlantTable()
    initial: Initial = Initial()
    environment: Environment = Environment()
    sensors: Sensors = Sensors()
    reference: Component
    law: Component
    checks: list[Check] = []

    @model_validator(mode="after")
    def _whole_periods(self) -> "Scenario":
        step = self.rates.physics
        spans = {
            "rates.control": self.rates.control,
            "sensors.attitude.period": self.sensors.attitude.period,
            "sensors.rate.period": self.sensors.rate.period,
            "sensors.wheel_speed.period": self.sensors.wheel_speed.period,
        }
        for key, span in spans.items():
            if span is not None:
                whole_number(span, step, key, "rates.physics")
        if self.duration < self.rates.control:
            raise ValueError(f"duration {self.duration:g} s is less than one control period")
        return self


def whole_number(span: float, unit: float, span_key: str, unit_key: str) -> int:
    """Return how many ``unit`` [s] make up ``span`` [s].

    Raises:
        ValueError: not a whole number of them, with both keys and the nearest that would do.
    """
    count = round(span / unit)
    if count < 1 or abs(span / unit - count) > 1e-6:
        near = max(count, 1) * unit
        raise ValueError(
            f"{span_key} {span:g} s is no whole number of {unit_key} {unit:g} s: {near:g} s would be"
        )
    return count
