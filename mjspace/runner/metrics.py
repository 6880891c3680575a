"""A flight's metrics, gathered as it flies: statistics of signals, and functions of the user's."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import failure, input_error_at
from mjspace.runner.statistic import Statistic
from mjspace.runner.windows import Rows, Windows, numbers_of
from mjspace.scenario.metrics import Metric
from mjspace.scenario.region import admitted
from mjspace.signals import Topics, find_signal, magnitude

Functions = Mapping[str, Callable[..., Any]]
"""The user's functions, by the names of their metrics."""
LINE = "metric "
"""How the line of a metric in a log begins."""


@dataclass(frozen=True)
class Measured:
    """A metric and what it came to in the flight."""

    metric: Metric
    value: float
    """SI; nan where there is none."""
    missing: str = ""
    """Why there is none."""

    @property
    def line(self) -> str:
        """It in one line."""
        found = f"not measured: {self.missing}" if self.missing else f"{self.value:.6g}"
        return f"{LINE}{self.metric.name}: {found}"


def refuse_unknown_signals(metrics: Sequence[Metric], topics: Topics) -> None:
    """Refuse metrics of signals that a log with these topics will not have.

    Raises:
        InputError: the first of them, with the near names.
    """
    for number, metric in enumerate(metrics):
        for signal in _signals(metric):
            key = "signal" if metric.function is None else "signals"
            with input_error_at(f"metrics.{number}.{key}"):
                _, _, part = find_signal(topics, signal)
        size, count = part.stop - part.start, np.size(metric.target or 0.0)
        with input_error_at(f"metrics.{number}.target"):
            if count not in (1, size):
                raise ValueError(f"{count} numbers, {signal} has {size}")


def _signals(metric: Metric) -> list[str]:
    return metric.signals if metric.signal is None else [metric.signal]


class Meter:
    """The metrics of one vehicle's flight."""

    def __init__(self, metrics: Sequence[Metric], functions: Functions, topics: Topics) -> None:
        """Begin a flight with these ``topics``.

        Raises:
            ValueError: a metric names a signal that is not there.
        """
        self._gathered: list[tuple[Metric, _Seconds | _Samples | _OfSignal]] = []
        for metric in metrics:
            found = {signal: find_signal(topics, signal) for signal in _signals(metric)}
            if metric.function is not None:
                own = _Samples(metric, functions[metric.name], found, topics)
                self._gathered.append((metric, own))
                continue
            kind = _Seconds if metric.statistic == "time_inside" else _OfSignal
            self._gathered.append((metric, kind(metric, *found.values())))

    def add(self, windows: Windows, time: Array, rows: Rows) -> None:
        """Go on with n > 0 control periods at ``time`` [s], which ``windows`` has already."""
        for metric, gathered in self._gathered:
            part = windows.part(metric)
            if part.start < part.stop:
                gathered.add(time[part], rows, part)

    def measured(self, windows: Windows) -> list[Measured]:
        """Return what each metric came to in what has been flown so far."""
        return [self._measured(windows, *each) for each in self._gathered]

    def _measured(
        self, windows: Windows, metric: Metric, gathered: "_Seconds | _Samples | _OfSignal"
    ) -> Measured:
        if never := windows.never(metric):
            return Measured(metric, math.nan, never)
        if not gathered.count:
            return Measured(metric, math.nan, windows.without_sample(metric))
        try:
            value = gathered.value()
        except _NoValueError as error:
            return Measured(metric, math.nan, str(error))
        missing = "it is not a number" if math.isnan(value) else ""
        return Measured(metric, value, missing)


class _NoValueError(Exception):
    """A function of the user's came to no value; the reason."""


class _OfSignal:
    """A statistic of a signal."""

    def __init__(self, metric: Metric, signal: tuple[str, str, slice]) -> None:
        self._signal, self._statistic = signal, Statistic(metric)

    @property
    def count(self) -> int:
        """Samples so far."""
        return self._statistic.count

    def add(self, time: Array, rows: Rows, part: slice) -> None:
        """Go on with this ``part`` of the rows, at ``time``."""
        self._statistic.add(numbers_of(rows, self._signal)[part])

    def value(self) -> float:
        """Return it."""
        return self._statistic.value()


class _Seconds:
    """The time inside bounds: a sample counts until the next one of the window."""

    def __init__(self, metric: Metric, signal: tuple[str, str, slice]) -> None:
        self._metric, self._signal = metric, signal
        self._target = None if metric.target is None else np.asarray(metric.target, dtype=float)
        self._time, self._inside, self._total = math.nan, False, 0.0
        self.count = 0

    def add(self, time: Array, rows: Rows, part: slice) -> None:
        """Go on with this ``part`` of the rows, at ``time``."""
        numbers = numbers_of(rows, self._signal)[part]
        if self._target is None:
            values = magnitude(numbers)
        else:  # of an error
            scale = float(np.linalg.norm(self._target)) if self._metric.relative else 1.0
            values = np.abs(magnitude(numbers - self._target)) / scale
        inside = admitted(values, self._metric.below, self._metric.above)
        if self.count:
            time, inside = np.append(self._time, time), np.append(self._inside, inside)
        # One after the other, so that the sum does not depend on how a flight is cut into blocks.
        terms = np.diff(time) * inside[:-1]
        self._total = float(np.add.accumulate(np.append(self._total, terms))[-1])
        self._time, self._inside = float(time[-1]), bool(inside[-1])
        self.count += len(values)

    def value(self) -> float:
        """Return the seconds."""
        return self._total


class _Samples:
    """The samples that a function of the user's receives when the flight has ended."""

    def __init__(
        self,
        metric: Metric,
        function: Callable[..., Any],
        signals: Mapping[str, tuple[str, str, slice]],
        topics: Topics,
    ) -> None:
        self._name, self._function, self._signals = f"{function.__name__}()", function, signals
        self._shapes = {
            name: _shape(topics[topic][field], part)
            for name, (topic, field, part) in signals.items()
        }
        self._time: list[Array] = []
        self._rows: dict[str, list[Array]] = {name: [] for name in signals}
        self.count = 0

    def add(self, time: Array, rows: Rows, part: slice) -> None:
        """Go on with this ``part`` of the rows, at ``time``."""
        self._time.append(time.copy())
        for name, signal in self._signals.items():
            self._rows[name].append(numbers_of(rows, signal)[part].copy())
        self.count += len(time)

    def value(self) -> float:
        """Return what the function makes of them.

        Raises:
            _NoValueError: it raises, or returns something else than a number.
        """
        time = _read_only(np.concatenate(self._time))
        signals = {
            name: _read_only(np.concatenate(rows).reshape(len(time), *self._shapes[name]))
            for name, rows in self._rows.items()
        }
        try:
            value = self._function(time, signals)
        except BaseException as error:
            raise _NoValueError(str(failure(self._name, error))) from error
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value[()]
        if isinstance(value, bool) or not isinstance(value, Real | np.bool_):
            kind = f"array of shape {value.shape}" if isinstance(value, np.ndarray) else ""
            raise _NoValueError(
                f"{self._name} returned {kind or type(value).__name__}, should be a number"
            )
        if math.isinf(value):
            raise _NoValueError(f"{self._name} returned {value}, should be a finite number, or nan")
        return float(value)


def _shape(field: tuple[int, ...], part: slice) -> tuple[int, ...]:
    """Return the shape of a sample: the field's where it is whole, else of its components."""
    size = part.stop - part.start
    if size == 1:
        return ()
    return field if size == math.prod(field) else (size,)


def _read_only(values: Array) -> Array:
    values.setflags(write=False)
    return values
