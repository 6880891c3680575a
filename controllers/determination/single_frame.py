"""The attitude of an instant from the Sun's direction and the Earth's field, without a filter."""

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from mjspace.algebra import dot
from mjspace.contract import Array, Gains, Measurement, gain

from .samples import is_sample
from .vector_observations import q_method, triad


class State(NamedTuple):
    """Memory of the estimator."""

    attitude: Array
    """The last estimate: quaternion, body to inertial, (..., 4)."""


class Estimate(NamedTuple):
    """What is estimated."""

    attitude: Array
    """Quaternion, body to inertial, (..., 4)."""


@dataclass(frozen=True, kw_only=True)
class SingleFrame(Gains):
    """TRIAD, with the Sun's direction as the first, or the q method, of this instant's samples.

    Where there is no sample of one of the two, as in the shadow, the last attitude is held; where
    there has been none, it is the identity. The gains are standard deviations of one sample.
    """

    batched: ClassVar[bool] = True

    sun_noise: float = gain("rad", above=0.0)
    """Of the Sun's direction; the q method weighs by it."""
    field_noise: float = gain("T", above=0.0)
    """Of the magnetic field; likewise."""
    method: Literal["q_method", "triad"] = "q_method"
    """Which."""

    def reset(self, measurement: Measurement) -> State:
        """Return the identity."""
        lead = measurement.sun_direction.shape[:-1]
        return State(np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*lead, 4)).copy())

    def step(self, state: State, time: float, measurement: Measurement) -> tuple[State, Estimate]:
        """Return (state, estimate) with the samples of now."""
        good = is_sample("sun_direction", measurement) & is_sample("magnetic_field", measurement)
        strength = np.sqrt(dot(measurement.field_reference, measurement.field_reference))
        sun = np.where(good, measurement.sun_direction, measurement.sun_reference)
        field = np.where(good, measurement.magnetic_field, measurement.field_reference)
        body = np.stack([sun, field / np.sqrt(dot(field, field))], axis=-2)
        known = measurement.sun_reference, measurement.field_reference / strength
        inertial = np.stack(known, axis=-2)
        if self.method == "triad":
            found = triad(body, inertial)
        else:
            of_sun = np.ones_like(strength) / self.sun_noise**2
            of_field = strength**2 / self.field_noise**2
            found = q_method(body, inertial, np.concatenate([of_sun, of_field], axis=-1))
        attitude = np.where(good, found, state.attitude)
        return State(attitude), Estimate(attitude.copy())
