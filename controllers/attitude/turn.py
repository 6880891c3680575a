"""Attitude error and rate error about body-fixed axes."""

from mjspace.algebra import times
from mjspace.attitude import conjugate, multiply, rotate, to_rotation_vector
from mjspace.contract import Array, Measurement, Reference


def turn(measurement: Measurement, reference: Reference, axes: Array) -> tuple[Array, Array]:
    """Return the errors (angle [rad], rate [rad/s]) about each of ``axes`` (m, 3), (..., m).

    ``axes`` are unit vectors in body axes. The angle is a component of the rotation vector from the
    desired to the measured attitude, the shorter way; the rate is measured less desired.
    """
    error = multiply(conjugate(reference.attitude), measurement.attitude)
    slip = measurement.rate - rotate(conjugate(error), reference.rate)
    return times(axes, to_rotation_vector(error)), times(axes, slip)
