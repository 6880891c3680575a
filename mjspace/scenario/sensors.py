"""The tables of a scenario's sensors."""

from typing import Annotated

from mjspace.scenario.fields import NonNegative, Seconds, Si, Table, Time


class SensorTiming(Table):
    """When a sensor samples and when it reports."""

    period: Seconds | None = None
    """Time between samples, a whole number of integration steps; else the control period."""
    delay: Time = 0.0
    """Age of a sample when it is reported, a whole number of sample periods."""


class StarTracker(SensorTiming):
    """Attitude sensor; its errors are small rotations about the body axes. Ideal by default."""

    noise: Annotated[NonNegative, Si("rad")] = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Annotated[NonNegative, Si("rad")] = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Annotated[NonNegative, Si("rad")] = 0.0
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Annotated[NonNegative, Si("rad")] = 0.0
    """Size of the least significant digit."""


class RateSensor(SensorTiming):
    """Gyro or tachometer. Ideal by default."""

    noise: Annotated[NonNegative, Si("rad/s")] = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Annotated[NonNegative, Si("rad/s")] = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Annotated[NonNegative, Si("rad/s")] = 0.0
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Annotated[NonNegative, Si("rad/s")] = 0.0
    """Size of the least significant digit."""


class PlaceSensor(SensorTiming):
    """Something that shows a length. Ideal by default."""

    noise: Annotated[NonNegative, Si("m")] = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Annotated[NonNegative, Si("m")] = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Annotated[NonNegative, Si("m")] = 0.0
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Annotated[NonNegative, Si("m")] = 0.0
    """Size of the least significant digit."""


class SpeedSensor(SensorTiming):
    """Something that shows a velocity. Ideal by default."""

    noise: Annotated[NonNegative, Si("m/s")] = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Annotated[NonNegative, Si("m/s")] = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Annotated[NonNegative, Si("m/s")] = 0.0
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Annotated[NonNegative, Si("m/s")] = 0.0
    """Size of the least significant digit."""


class Accelerometer(SensorTiming):
    """Mean specific force since the last sample. Ideal by default."""

    noise: Annotated[NonNegative, Si("m/s^2")] = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Annotated[NonNegative, Si("m/s^2")] = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Annotated[NonNegative, Si("m/s^2")] = 0.0
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Annotated[NonNegative, Si("m/s^2")] = 0.0
    """Size of the least significant digit."""


class Magnetometer(SensorTiming):
    """Something that shows the magnetic field. Ideal by default."""

    noise: Annotated[NonNegative, Si("T")] = 0.0
    """Standard deviation of the white noise of each sample, on each axis."""
    bias: Annotated[NonNegative, Si("T")] = 0.0
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Annotated[NonNegative, Si("T")] = 0.0
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Annotated[NonNegative, Si("T")] = 0.0
    """Size of the least significant digit."""


Errors = StarTracker | RateSensor | PlaceSensor | SpeedSensor | Accelerometer | Magnetometer


class Sensors(Table):
    """The vehicle's sensors."""

    attitude: StarTracker = StarTracker()
    """Star tracker."""
    rate: RateSensor = RateSensor()
    """Gyro."""
    wheel_speed: RateSensor = RateSensor()
    """Wheel tachometers."""
    position: PlaceSensor | None = None
    """Where the bus is; no such sensor when left out."""
    velocity: SpeedSensor | None = None
    """Velocity of the bus, inertial axes; no such sensor when left out."""
    altitude: PlaceSensor | None = None
    """Altimeter: the bus's height above z = 0; none when left out."""
    ground_velocity: SpeedSensor | None = None
    """Velocimeter: the bus's velocity in body axes; none when left out."""
    specific_force: Accelerometer | None = None
    """Accelerometers at the bus's origin; none when left out."""
    magnetic_field: Magnetometer | None = None
    """Magnetometer, which the magnetorquers do not disturb; none when left out."""
