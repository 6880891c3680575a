"""An action: the fields of the command that a vehicle's actuators take, side by side."""

import math
from collections import namedtuple
from collections.abc import Iterable
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.simulation.assembly import Assembly

LARGEST_ACCELERATION = 100.0
"""Bound of a torque without a limit, as an angular acceleration [rad/s^2]."""


class Action:
    """How flat arrays of numbers are the command of some vehicles.

    Attributes:
        labels: of each number, with its unit: "torque[0] [N m]".
        least: what the actuators can apply at the least, (n,); infinite where nothing bounds it.
        largest: at the most, (n,).
    """

    def __init__(self, assembly: Assembly) -> None:
        """Collect what the actuators of the vehicle take, in their order."""
        self._shapes: dict[str, tuple[int, ...]] = {}
        self.labels: list[str] = []
        limits: dict[str, tuple[Array, Array]] = {}
        for kind in assembly.actuators.kinds:
            for name, (width, unit) in kind.takes.items():
                shape = (width,) if isinstance(width, int) else width
                self._shapes[name] = shape
                self.labels += [f"{name}{_index(i, shape)} [{unit}]" for i in np.ndindex(shape)]
                limits[name] = _bounded(kind.limits()[name], unit, assembly.vehicle.inertia)
        self._ends = np.cumsum([math.prod(shape) for shape in self._shapes.values()])
        self._command = _named_tuple(self._shapes)
        self.least, self.largest = (
            np.concatenate([each[side].ravel() for each in limits.values()]) for side in (0, 1)
        )

    def command(self, actions: Array) -> Any:
        """Return the command, a named tuple of arrays (N, ...), of ``actions`` (N, n).

        Raises:
            ValueError: the actions have another length.
        """
        numbers = np.array(actions, dtype=float)
        if numbers.ndim != 2 or numbers.shape[1] != len(self.labels):
            raise ValueError(
                f"the action has shape {numbers.shape[1:]}: it must be ({len(self.labels)},), of "
                f"{', '.join(self.labels)}"
            )
        parts = np.split(numbers, self._ends[:-1], axis=1)
        shapes = self._shapes.values()
        return self._command(
            *(p.reshape(len(numbers), *s) for p, s in zip(parts, shapes, strict=True))
        )


def _bounded(limits: tuple[Array, Array], unit: str, inertia: Array) -> tuple[Array, Array]:
    """Return the limits; an unlimited torque is bounded by ``LARGEST_ACCELERATION``."""
    if unit != "N m":
        return limits
    largest = LARGEST_ACCELERATION * float(np.linalg.eigvalsh(inertia)[-1])
    least, most = limits
    return np.where(np.isinf(least), -largest, least), np.where(np.isinf(most), largest, most)


def _index(index: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """Return the place of a number in its field, nothing for a field of one number."""
    return "" if math.prod(shape) == 1 else f"[{', '.join(map(str, index))}]"


def _named_tuple(fields: Iterable[str]) -> Any:
    return namedtuple("Action", list(fields))
