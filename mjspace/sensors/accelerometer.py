"""Accelerometers: the mean specific force since the last sample, from two samples of the truth."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mjspace import attitude
from mjspace.contract import Array, Measurement

State = dict[str, Array]


@dataclass(frozen=True)
class Strapdown:
    """Three accelerometers at the bus's origin, in body axes.

    The change of velocity less gravity's share, over the period, in the axes halfway: what pulse
    counters of integrating accelerometers show.
    """

    gravity: Callable[[Array], Array]
    """What they do not feel [m/s^2], (N, 3), at each position [m], (N, 3); inertial axes."""
    period: int
    """Integration steps from one sample to the next."""
    step: float
    """Integration step [s]."""

    def reset(self, state: State, truth: Measurement) -> Array:
        """Put the start into ``state``; return the first sample, which is none: zero, (N, 3)."""
        state["strapdown_velocity"] = np.array(truth.velocity)
        state["strapdown_attitude"] = np.array(truth.attitude)
        return np.zeros(truth.velocity.shape)

    def take(self, state: State, step_index: int, truth: Measurement) -> Array:
        """Return the mean specific force [m/s^2], (N, 3), and put this sample into ``state``."""
        before, turned = state["strapdown_velocity"], state["strapdown_attitude"]
        state["strapdown_velocity"] = np.array(truth.velocity)
        state["strapdown_attitude"] = np.array(truth.attitude)
        if step_index == 0:
            return np.zeros(truth.velocity.shape)
        span = self.period * self.step
        halfway = truth.position - 0.25 * span * (truth.velocity + before)
        felt = (truth.velocity - before) / span - self.gravity(halfway)
        return attitude.rotate(attitude.conjugate(_mean(turned, truth.attitude)), felt)


def _mean(one: Array, other: Array) -> Array:
    """Return the attitude halfway between two that are near each other, (N, 4)."""
    same = np.where(np.sum(one * other, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    total = one + same * other
    result: Array = total / np.sqrt(np.sum(total**2, axis=-1, keepdims=True))
    return result
