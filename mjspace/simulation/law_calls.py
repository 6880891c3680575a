"""A law that Python calls in each period of a block, between parts that are compiled."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from mjspace.contract import Array, DesiredMotion, Measurement
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.flown_law import FlownLaw

_GROUPS = ("law", "command", "signals")


class LawCalls:
    """The calls of a law in a block, and columns of what it returns.

    The law receives read-only rows, and what it returns is copied: nothing that is kept can change
    later. It is looked at closely where its type or a shape is not that of the first period.

    Attributes:
        commands: the arrays of its command, (count, N, ...), filled in period by period.
    """

    def __init__(
        self, law: FlownLaw, first: ControlPeriod, count: int, check: Callable[[Any], None]
    ) -> None:
        """Make room for ``count`` periods, of which Python has flown the ``first``.

        ``check`` refuses commands that the actuators cannot obey.
        """
        self._first = first
        self._kinds = {group: type(getattr(first, group)) for group in _GROUPS}
        # The state before each period, and after the last.
        self._columns = {
            "law": [np.empty((count + 1, *array.shape), array.dtype) for array in law.state],
            "command": [np.empty((count, *np.shape(array))) for array in first.command],
            "signals": [np.empty((count, *np.shape(array))) for array in first.signals],
        }
        for group, columns in self._columns.items():
            for column, values in zip(columns, getattr(first, group), strict=True):
                column[0] = values
        for column, values in zip(self._columns["law"], law.state, strict=True):
            column[1] = values
        self.commands = tuple(self._columns["command"])
        every = range(len(first.physics)) if law.one_by_one else [...]
        self._cuts: list[Any] = [np.s_[:, vehicle] for vehicle in every]
        self._calls = [_Call(law, self._kinds, self._columns, cut, check) for cut in self._cuts]

    def step(
        self, k: int, time: float, measurements: Iterable[Measurement], reference: DesiredMotion
    ) -> None:
        """Call the law in the block's period ``k``; ``measurements`` are those of each call.

        Raises:
            FlightError: as ``FlownLaw.step``; or a command that cannot be obeyed.
        """
        for call, measurement in zip(self._calls, measurements, strict=True):
            call.step(k, time, measurement, reference)

    def of_each(self, measurement: Measurement) -> list[Measurement]:
        """Return what each call measures of all vehicles' ``measurement``."""
        return [measurement._map(partial(_cut, cut)) for cut in self._cuts]

    def measurements(self, measured: Mapping[str, Array]) -> Iterator[tuple[Measurement, ...]]:
        """Return what each call measures in each period after the first.

        It is rows of ``measured``, (count, N, ...): views, made when they are asked for.
        """
        names = tuple(measured)
        firsts = self.of_each(self._first.measurement)
        return zip(
            *(
                _rows(first, names, [array[cut][1:] for array in measured.values()])
                for first, cut in zip(firsts, self._cuts, strict=True)
            ),
            strict=True,
        )

    def returned(self, k: int) -> tuple[Any, Any, Any]:
        """Return (state, command, signals) as of the call in period ``k``."""
        command, signals = (
            self._kinds[group](*(_read_only(column)[k] for column in self._columns[group]))
            for group in _GROUPS[1:]
        )
        return self.state_before(k + 1), command, signals

    def state_before(self, k: int) -> Any:
        """Return the law's state before period ``k``, or after the last; read-only or empty."""
        kind, columns = self._kinds["law"], self._columns["law"]
        return kind(*(_read_only(column)[k] for column in columns)) if columns else ()

    def groups(self, count: int) -> dict[str, dict[str, Array]]:
        """Return the columns of the first ``count`` periods, floats, without empty ones."""
        return {
            group: {
                name: column[:count].astype(float, copy=False)
                for name, column in zip(getattr(kind, "_fields", ()), columns, strict=True)
                if column.size
            }
            for (group, kind), columns in zip(
                self._kinds.items(), self._columns.values(), strict=True
            )
        }

    @property
    def kinds(self) -> dict[str, type]:
        """The named tuples of "law", "command" and "signals"."""
        return self._kinds


class _Call:
    """A law's call in each period, for one vehicle or for all."""

    def __init__(
        self,
        law: FlownLaw,
        kinds: Mapping[str, type],
        columns: Mapping[str, Sequence[Array]],
        cut: Any,
        check: Callable[[Any], None],
    ) -> None:
        self._law, self._check = law, check
        self._state, self._command, self._signals = (kinds[group] for group in _GROUPS)
        self._before = [_read_only(column)[cut] for column in columns["law"]]
        self._columns = [column[cut][1:] for column in columns["law"]]
        self._columns += [column[cut] for group in _GROUPS[1:] for column in columns[group]]
        self._shapes = [column.shape[1:] for column in self._columns]
        self._types = [column.dtype for column in self._columns]

    def step(self, k: int, time: float, measurement: Measurement, reference: DesiredMotion) -> None:
        state: Any = self._state(*[column[k] for column in self._before]) if self._before else ()
        returned = self._law.call(state, time, measurement, reference)
        try:
            after, command, signals = returned
            after, signals = after or (), signals or ()
            values = [*after, *command, *signals]
            usual = (
                type(returned) is tuple
                and type(after) is self._state
                and type(command) is self._command
                and type(signals) is self._signals
                and [value.shape for value in values] == self._shapes
                and [value.dtype for value in values] == self._types
            )
        except (AttributeError, TypeError, ValueError):
            usual = False
        if not usual:
            values = self._law.arrays_of(returned, self._check)
        for column, value in zip(self._columns, values, strict=True):
            column[k] = value


def _rows(
    first: Measurement, names: Sequence[str], columns: Sequence[Array]
) -> Iterator[Measurement]:
    for row in zip(*columns, strict=True):
        yield first._replace(**dict(zip(names, row, strict=True)))


def _cut(cut: Any, array: Array) -> Array:
    """Return the part of a column's row that one call receives."""
    return array[None][cut][0]  # type: ignore[no-any-return]


def _read_only(column: Array) -> Array:
    """Return the ``column`` as an array that cannot be made writable."""
    return np.asarray(column.data.toreadonly())
