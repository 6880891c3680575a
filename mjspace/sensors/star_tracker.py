"""Star trackers: the attitude, in error by a small rotation."""

from math import cos, pi, sin, sqrt
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from mjspace.contract import Array
from mjspace.gufunc import gufunc
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Positive, Si, Unit3
from mjspace.sensors import sky
from mjspace.sensors.base import Motion, Sensor

Exclusion = Annotated[Positive, Field(le=pi), Si("rad")]


class StarTracker(Sensor[Annotated[NonNegative, Si("rad")]]):
    """Star tracker: the attitude; its errors are small rotations about the body axes.

    Blinded, or turning too fast, it reports its last attitude again, which is not valid:
    ``measurement.<name>_valid``. One of several heads is several sensors.
    """

    measures: Literal["attitude"] = "attitude"
    quantization: Annotated[NonNegative, Field(lt=1), Si("rad")] = 0.0
    """Size of the least significant digit: the components of the quaternion are rounded to half of
    it."""
    boresight: Unit3 = Field(default=[0.0, 0.0, 1.0])
    """Centre of the field of view, body axes; its length does not matter."""
    roll_noise_std: Annotated[NonNegative, Si("rad")] | None = None
    """``noise_std`` about the boresight, which is then that about the axes across; as those when
    left out."""
    sun_exclusion: Exclusion | None = None
    """Least angle between the boresight and the Sun, where the Sun is visible."""
    moon_exclusion: Exclusion | None = None
    """Least angle between the boresight and the Moon, where the Earth does not hide it."""
    earth_exclusion: Exclusion | None = None
    """Least angle between the boresight and the limb of what is orbited."""
    rate_limit: Annotated[Positive, Si("rad/s")] | None = None
    """Fastest rotation at which it has an attitude."""
    unit: ClassVar[str] = ""
    width: ClassVar[int | None] = 4
    axes: ClassVar[int | None] = 3

    @model_validator(mode="after")
    def _rolls(self) -> "StarTracker":
        if self.roll_noise_std is not None and not (self.noise_std and not self.noise_density):
            raise ValueError("roll_noise_std: needs a noise_std, and no noise_density")
        return self

    @property
    def always_valid(self) -> bool:
        """Whether nothing blinds it."""
        exclusions = self.sun_exclusion, self.moon_exclusion, self.earth_exclusion
        return all(limit is None for limit in (*exclusions, self.rate_limit))

    def check_environment(self, environment: Environment) -> None:
        """Refuse exclusion angles to what is not known to be there."""
        if self.earth_exclusion is not None and environment.orbit is None:
            raise ValueError("earth_exclusion: needs an [environment.orbit]")
        for body in ("sun", "moon"):
            key = f"{body}_exclusion"
            if getattr(self, key) is not None and not environment.has_sun:
                raise ValueError(
                    f"{key}: needs an environment.epoch and an [environment.orbit] with body = "
                    '"earth"'
                )

    def validity(self, motion: Motion) -> Array:
        """Return 1.0 where nothing blinds it and it turns slowly enough, else 0.0, (..., 1)."""
        axis, valid = sky.unit(self.boresight), np.ones((*motion.rate.shape[:-1], 1))
        if self.rate_limit is not None:
            square = np.sum(motion.rate**2, axis=-1, keepdims=True)
            valid = np.where(square <= self.rate_limit**2, valid, 0.0)
        if self.earth_exclusion is not None:
            off = sky.from_axis(sky.nadir(motion), axis) - sky.limb(motion)
            valid = np.where(off >= self.earth_exclusion, valid, 0.0)
        if self.sun_exclusion is not None:
            off = sky.from_axis(sky.sun_direction(motion), axis)
            dazzled = (off < self.sun_exclusion) & (sky.sunlight(motion) > 0.0)
            valid = np.where(dazzled, 0.0, valid)
        if self.moon_exclusion is not None:
            moon = sky.moon_direction(motion)
            near = sky.from_axis(moon, axis) < self.moon_exclusion
            away = np.sum(moon * sky.nadir(motion), axis=-1, keepdims=True)
            hidden = away > np.cos(sky.limb(motion))  # behind the Earth, which is nearer
            valid = np.where(near & ~hidden, 0.0, valid)
        return valid

    def weighted(self, white: Array) -> Array:
        """Return the numbers with those about the boresight in the ratio of the noises."""
        if self.roll_noise_std is None:
            return white
        axis, across = sky.unit(self.boresight), float(self.noise_std)
        about = np.sum(white * axis, axis=-1, keepdims=True) * axis
        weighted: Array = white + (self.roll_noise_std / across - 1.0) * about
        return weighted

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
