"""The inputs of a linear plant: how far each is moved, and whether it acts linearly."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.flight_software.interface import Fields

_PART = 1e-3
"""Step of an input, as a part of its limit, or in SI where it has none."""
_LINEAR = 1e-3
"""How much the slopes to either side of an input may differ, as a part of them."""


class Inputs(NamedTuple):
    """The numbers of a command, in their order, (m,) each."""

    step: Array
    """By which each is moved."""
    centre: Array
    """From which it is moved: zero, or a step inside where its range begins at zero."""
    least: Array
    largest: Array


def inputs_of(assembly: Assembly, fields: Fields) -> Inputs:
    """Return the inputs.

    Raises:
        InputError: the range of one of them is without zero.
    """
    limits: dict[str, Any] = {}
    for kind in assembly.actuators.kinds:
        limits |= kind.limits()
    least, largest = (
        np.concatenate(
            [
                np.zeros(0),
                *(np.broadcast_to(limits[n][end], f.shape).ravel() for n, f in fields.items()),
            ]
        )
        for end in (0, 1)
    )
    for name, low, high in zip(names_of(fields), least, largest, strict=True):
        if low > 0.0 or high < 0.0:
            raise InputError(
                f"command.{name}: zero is not within its range, from {low:g} to {high:g}: a linear "
                "model about no command has no column for it"
            )
    # The smaller of both sides, unless it is none.
    room = np.where(np.minimum(-least, largest) > 0.0, np.minimum(-least, largest), largest - least)
    step = np.where(np.isfinite(room) & (room > 0.0), _PART * room, _PART)
    centre = np.where(least == 0.0, step, 0.0) - np.where(largest == 0.0, step, 0.0)
    return Inputs(step, centre, least, largest)


def refuse_bent(nominal: Array, moved: Array, names: Sequence[str]) -> None:
    """Refuse an input or activation that does not act linearly where it is.

    ``nominal`` (1 or m, n) are derivatives there, ``moved`` (2 m, n) a step up and down in turn.

    Raises:
        InputError: the slopes to either side differ.
    """
    nominal = np.broadcast_to(nominal, (len(names), nominal.shape[1]))
    for name, here, up, down in zip(names, nominal, moved[::2], moved[1::2], strict=True):
        if np.abs(up - 2.0 * here + down).max() > _LINEAR * np.abs(up - down).max() + 1e-12:
            raise InputError(
                f"{name}: does not act linearly about zero, as a thruster that is on or off: a "
                "linear model has no column for it"
            )


def names_of(fields: Fields) -> Iterator[str]:
    """Yield the name of each number of the fields, ``inertia[0,1]``."""
    for name, field in fields.items():
        for index in np.ndindex(field.shape):
            yield f"{name}[{','.join(map(str, index))}]" if index else name
