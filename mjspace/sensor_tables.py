"""The tables of a scenario's sensors."""

from typing import Annotated

from mjspace.fields import NonNegative, Seconds, Si, Table, Time


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


class Sensors(Table):
    """The vehicle's sensors."""

    attitude: StarTracker = StarTracker()
    """Star tracker."""
    rate: RateSensor = RateSensor()
    """Gyro."""
    wheel_speed: RateSensor = RateSensor()
    """Wheel tachometers."""
