"""Accelerometers: the mean specific force since the last sample, from two samples of the truth."""

from typing import Annotated, ClassVar, Literal

import numpy as np

from mjspace import attitude
from mjspace.contract import Array, Measurement
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import State, Surroundings
from mjspace.sensors.linear import Triad


class Accelerometer(Triad[Annotated[NonNegative, Si("m/s^2")]]):
    """Accelerometers at the bus's origin: the mean specific force since the last sample, body axes.

    The change of velocity less gravity's share, over the period, in the axes halfway: what pulse
    counters of integrating accelerometers report.
    """

    measures: Literal["specific_force"] = "specific_force"
    unit: ClassVar[str] = "m/s^2"
    of_translation: ClassVar[bool] = True
    integrates: ClassVar[bool] = True

    def begin(self, memory: State, name: str, truth: Measurement) -> Array:
        """Put the start into ``memory``; return the first sample, which is none: zero, (N, 3)."""
        self._remember(memory, name, truth)
        return np.zeros(truth.velocity.shape)

    def mean(
        self, memory: State, name: str, truth: Measurement, span: float, surroundings: Surroundings
    ) -> Array:
        """Return the mean specific force [m/s^2] over the ``span`` [s] since the last, (N, 3)."""
        velocity, turned = _names(name)
        before, start = memory[velocity], memory[turned]
        self._remember(memory, name, truth)
        halfway = truth.position - 0.25 * span * (truth.velocity + before)
        force = (truth.velocity - before) / span - surroundings.gravity(halfway)
        return attitude.rotate(attitude.conjugate(_halfway(start, truth.attitude)), force)

    def _remember(self, memory: State, name: str, truth: Measurement) -> None:
        velocity, turned = _names(name)
        memory[velocity], memory[turned] = truth.velocity.copy(), truth.attitude.copy()


def _names(name: str) -> tuple[str, str]:
    """Return the names of the memory; logs know those of ``specific_force`` as strapdown_..."""
    prefix = "strapdown" if name == "specific_force" else f"{name}_strapdown"
    return f"{prefix}_velocity", f"{prefix}_attitude"


def _halfway(one: Array, other: Array) -> Array:
    """Return the attitude halfway between two that are near each other, (N, 4)."""
    same = np.where(np.sum(one * other, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    total = one + same * other
    result: Array = total / np.sqrt(np.sum(total**2, axis=-1, keepdims=True))
    return result
