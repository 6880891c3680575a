"""An action: the fields of the command that a vehicle's actuators take, side by side."""

import math
from collections import namedtuple
from collections.abc import Iterable
from typing import Any

import numpy as np
from dm_env.specs import BoundedArray

from mjspace.contract import Array
from mjspace.simulation.assembly import Assembly

LARGEST_ACCELERATION = 100.0
"""Bound of a torque without a limit, as an angular acceleration [rad/s^2]."""


class Action:
    """How a flat array of numbers is the command of one vehicle."""

    def __init__(self, assembly: Assembly) -> None:
        """Collect what the actuators of the vehicle take, in their order."""
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._labels: list[str] = []
        self._limits: dict[str, tuple[Array, Array]] = {}
        for kind in assembly.actuators.kinds:
            for name, (width, unit) in kind.takes.items():
                shape = (width,) if isinstance(width, int) else width
                self._shapes[name] = shape
                self._labels += [f"{name}{_index(i, shape)} [{unit}]" for i in np.ndindex(shape)]
                self._limits[name] = _bounded(kind.limits()[name], unit, assembly.vehicle.inertia)
        self._command = _named_tuple(self._shapes)

    def spec(self) -> BoundedArray:
        """Return shape and bounds; the name has a label with the unit for each number."""
        least, largest = (
            np.concatenate([limits[side].ravel() for limits in self._limits.values()])
            for side in (0, 1)
        )
        return BoundedArray(least.shape, np.float64, least, largest, "\t".join(self._labels))

    def command(self, action: Array) -> Any:
        """Return the command, a named tuple of arrays (1, ...), of an ``action`` (n,).

        Raises:
            ValueError: the action has another length.
        """
        numbers = np.array(action, dtype=float)
        if numbers.shape != (len(self._labels),):
            raise ValueError(
                f"the action has shape {numbers.shape}: it must be ({len(self._labels)},), of "
                f"{', '.join(self._labels)}"
            )
        ends = np.cumsum([math.prod(shape) for shape in self._shapes.values()])
        parts = np.split(numbers, ends[:-1])
        shapes = self._shapes.values()
        return self._command(*(p.reshape(1, *s) for p, s in zip(parts, shapes, strict=True)))


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
