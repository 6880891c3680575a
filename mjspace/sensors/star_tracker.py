"""Star trackers: the attitude, in error by a small rotation."""

from math import cos, sin, sqrt
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from mjspace.contract import Array
from mjspace.gufunc import gufunc
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Sensor


class StarTracker(Sensor[Annotated[NonNegative, Si("rad")]]):
    """Star tracker: the attitude; its errors are small rotations about the body axes."""

    measures: Literal["attitude"] = "attitude"
    quantization: Annotated[NonNegative, Field(lt=1), Si("rad")] = 0.0
    """Size of the least significant digit: the components of the quaternion are rounded to half of
    it."""
    unit: ClassVar[str] = ""
    width: ClassVar[int | None] = 4
    axes: ClassVar[int | None] = 3

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the attitude turned by the rotation vector ``error`` [rad], then rounded.

        What is rounded is what a star tracker sends: the four components of the quaternion, to half
        of a digit. Being orthogonal to its rates of change about the body axes, it then has the
        error of an angle rounded to a digit, digit / sqrt(12), about every axis in every attitude,
        which rounded Euler angles or rotation vectors have not.
        """
        return turned(value, error, self.quantization)


def turned(q: Array, error: Array, digit: float) -> Array:
    """Return the quaternion (..., 4) turned by a rotation vector (..., 3), rounded to half digits.

    A ``digit`` of 0 leaves it as it is.
    """
    result: Array = _turn.ufunc(q, error, digit)
    return result


@gufunc(["void(f8[:], f8[:], f8, f8[:])"], "(q),(a),()->(q)")
def _turn(q: Any, error: Any, digit: Any, turned: Any) -> None:
    angle = sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2])
    scale = sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    w, x, y, z = cos(0.5 * angle), scale * error[0], scale * error[1], scale * error[2]
    turned[0] = q[0] * w - q[1] * x - q[2] * y - q[3] * z
    turned[1] = q[0] * x + q[1] * w + q[2] * z - q[3] * y
    turned[2] = q[0] * y - q[1] * z + q[2] * w + q[3] * x
    turned[3] = q[0] * z + q[1] * y - q[2] * x + q[3] * w
    if digit > 0.0:
        square = 0.0
        for i in range(turned.size):
            turned[i] = np.rint(2.0 * turned[i] / digit)
            square += turned[i] * turned[i]
        for i in range(turned.size):
            turned[i] /= sqrt(square)
