"""A vehicle's sensors: the truth, sampled late, with errors, and held in between."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np

from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement
from mjspace.scenario.plant import Rates
from mjspace.sensors.base import Sensor, State, Surroundings
from mjspace.sensors.noise import normals, stream_of
from mjspace.units import whole_number

MOST_SAMPLES = 10000
"""That a delay keeps."""


class SensorSuite:
    """The sensors of a batch of vehicles: fixed errors and streams, all memory in ``State``.

    A sensor takes sample j at integration step j * period. It reports the newest sample that is at
    least ``delay`` old, and its first until there is one. An ideal sensor has no state and reports
    the truth's own array, which is no copy. Each other one has ``<name>_samples`` (N, delay + 1,
    width), its last reports, the oldest first; each whose bias walks also has ``<name>_walk``
    (N, axes), the walk at the next sample.

    Attributes:
        ticks: the sampling periods of the sensors that are not ideal, in integration steps;
            ``sample`` is to be called at every multiple of each.
        measurement: the class of what ``sample`` returns, which knows each quantity's sensor.
    """

    def __init__(
        self,
        sensors: Mapping[str, Sensor[Any]],
        rates: Rates,
        seed: int,
        members: Sequence[int],
        surroundings: Surroundings,
    ) -> None:
        """Draw the constant biases of ``members``, the vehicles' numbers in the campaign ``seed``.

        A member measures the same alone or in any batch, whatever other sensors it has.

        Raises:
            ValueError: a period is no whole number of integration steps, or a delay no whole number
                of periods.
        """
        self._surroundings, self._steps = surroundings, rates.steps
        self.measurement = Measurement._with_sensors(
            {name: table.quantity(name) for name, table in sensors.items()}
        )
        every = [
            _sampled(name, table, rates, seed, members, surroundings)
            for name, table in sensors.items()
        ]
        self._sampled = [sensor for sensor in every if sensor is not None]
        own = {sensor.name for sensor in self._sampled}
        self._ideal = {n: table.quantity(n) for n, table in sensors.items() if n not in own}
        self._reported = [name for name in REPORTED_BY_PLANT if name != "wheel_speed"]
        sampled = {table.quantity(name) for name, table in sensors.items()}
        self._reported += [name for name in surroundings.own_sensors if name not in sampled]
        # The fields of a truth that is reported as it is, without a copy.
        same = not self._sampled and all(name == q for name, q in self._ideal.items())
        self._as_it_is = {*self._ideal, *self._reported} if same else set()
        self.ticks = frozenset(sensor.period for sensor in self._sampled)

    def reset(self, truth: Measurement) -> State:
        """Return the state before the first sample, at step 0, where the truth is ``truth``."""
        state: State = {}
        for sensor in self._sampled:
            table = sensor.table
            if table.integrates:
                value = table.begin(state, sensor.name, truth)
            else:
                value = getattr(truth, sensor.quantity)
            if table.bias_walk:
                state[sensor.walk_field] = np.zeros_like(sensor.bias)
            first = sensor.read(state, 0, value)
            state[sensor.samples_field] = np.repeat(first[:, None], sensor.delay + 1, axis=1)
        return state

    def sample(
        self, state: State, step_index: int, truth: Measurement
    ) -> tuple[State, Measurement]:
        """Return (state, measurement) at integration step ``step_index``.

        ``truth`` has a vehicle axis and each quantity by its name: attitude (N, 4), rate (N, 3).
        ``state`` is left as it is, so that this step may be sampled from it again.
        """
        if self._sampled:
            state = state.copy()
            for sensor in self._sampled:
                if step_index % sensor.period == 0:
                    self._take(sensor, state, step_index, truth)
        return state, self.report(state, truth)

    def report(self, state: State, truth: Measurement) -> Measurement:
        """Return the measurement between two samples: what the sensors report is held."""
        arrays = truth._asdict()
        if arrays.keys() == self._as_it_is:
            return truth
        reports = {name: arrays[quantity] for name, quantity in self._ideal.items()}
        for sensor in self._sampled:
            reports[sensor.name] = state[sensor.samples_field][:, 0]
        for name in self._reported:
            reports[name] = arrays[name]
        return self.measurement(**reports)

    @property
    def biases(self) -> dict[str, Array]:
        """The constant bias of each sensor that is not ideal, (N, axes)."""
        return {sensor.name: sensor.bias for sensor in self._sampled}

    def draws(self, periods: Sequence[int]) -> dict[str, Array]:
        """Return what a sample at each of these control instants takes, by sensor and purpose.

        That is random numbers, (n, N, axes), and, of a sensor that samples less often, 1.0 where it
        is due and 0.0 elsewhere, (n, 1, 1).
        """
        drawn = {}
        for sensor in self._sampled:
            steps = [number * self._steps for number in periods]
            samples = [step // sensor.period for step in steps]
            if sensor.table.noise_std:
                drawn[f"{sensor.name}_white"] = np.array([sensor.white(i) for i in samples])
            if sensor.table.bias_walk:
                drawn[f"{sensor.name}_increment"] = np.array([sensor.increment(i) for i in samples])
            if sensor.period != self._steps:
                due = [float(step % sensor.period == 0) for step in steps]
                drawn[f"{sensor.name}_due"] = np.array(due).reshape(-1, 1, 1)
        return drawn

    def with_errors(self, biases: Mapping[str, Any], draws: Mapping[str, Any]) -> "SensorSuite":
        """Return sensors with these biases, and these draws in whichever sample.

        Both are as ``biases`` and, of one control instant, as ``draws`` return them; or they are
        traced.
        """

        def whichever(name: str) -> Callable[[int], Any]:
            return lambda sample: draws[name]

        other = copy.copy(self)
        other._sampled = [
            replace(
                sensor,
                bias=biases[sensor.name],
                white=whichever(f"{sensor.name}_white"),
                increment=whichever(f"{sensor.name}_increment"),
                due=draws.get(f"{sensor.name}_due"),
            )
            for sensor in self._sampled
        ]
        return other

    def sample_where_due(self, state: State, truth: Measurement) -> tuple[State, Measurement]:
        """Return (state, measurement) of sensors ``with_errors``, at any control instant but 0.

        Each takes a sample; one that is not due keeps what it held.
        """
        after = state.copy()
        for sensor in self._sampled:
            before = after.copy()
            self._take(sensor, after, sensor.period, truth)
            if sensor.due is None:
                continue
            for name, held in before.items():
                if after[name] is not held:
                    after[name] = np.where(sensor.due > 0.5, after[name], held)
        return after, self.report(after, truth)

    def _take(self, sensor: "_Sampled", state: State, step_index: int, truth: Measurement) -> None:
        """Put the sample of this step, and the walk that follows it, into ``state``."""
        table, index = sensor.table, step_index // sensor.period
        if not table.integrates:
            value = getattr(truth, sensor.quantity)
        elif index == 0:
            value = table.begin(state, sensor.name, truth)
        else:
            value = table.mean(state, sensor.name, truth, sensor.span, self._surroundings)
        new = sensor.read(state, index, value)[:, None]
        if sensor.delay:
            new = np.concatenate([state[sensor.samples_field][:, 1:], new], axis=1)
        state[sensor.samples_field] = new
        if table.bias_walk:
            walk = sensor.walk * sensor.increment(index)
            state[sensor.walk_field] = state[sensor.walk_field] + walk


@dataclass(frozen=True)
class _Sampled:
    """A sensor that is not ideal, with the random streams of each vehicle's."""

    name: str
    table: Sensor[Any]
    quantity: str  # the field of the truth that it samples
    period: int  # integration steps
    span: float  # of a period [s]
    delay: int  # samples
    bias: Array  # (N, axes)
    white: Callable[[int], Array]
    walk: float  # standard deviation of one period's increment
    increment: Callable[[int], Array]
    samples_field: str
    walk_field: str
    due: Any = None  # 1.0 or 0.0, (1, 1), for ``sample_where_due``; None: always

    def read(self, state: State, index: int, truth: Array) -> Array:
        """Return what sample ``index`` reports of the ``truth``."""
        error = self.bias
        if self.table.noise_std:
            error = error + self.table.noise_std * self.white(index)
        if self.table.bias_walk:
            error = error + state[self.walk_field]
        return self.table.with_error(truth, error)


def _sampled(
    name: str,
    table: Sensor[Any],
    rates: Rates,
    seed: int,
    members: Sequence[int],
    surroundings: Surroundings,
) -> _Sampled | None:
    """Return the sensor, or None when at every control instant it reports the truth itself."""
    axes = table.axes_of(name, surroundings)
    if name in surroundings.own_sensors and table.quantity(name) != name:
        raise ValueError(
            f'sensors.{name}: the model has a sensor of that name: measures = "model" gives it '
            "errors; else call this one otherwise"
        )
    period_key = "rates.control" if table.period is None else f"sensors.{name}.period"
    seconds = rates.control if table.period is None else table.period
    period = whole_number(seconds, rates.physics, period_key, "rates.physics")
    if table.at_control and period % rates.steps:
        whole_number(seconds, rates.control, f"sensors.{name}.period", "rates.control")
    if not (table.errs or table.integrates or table.delay or rates.steps % period):
        return None
    delay = table.delay and whole_number(table.delay, seconds, f"sensors.{name}.delay", period_key)
    if delay > MOST_SAMPLES:
        raise ValueError(
            f"sensors.{name}.delay: {table.delay:g} s is {delay:g} times {period_key}: at most "
            f"{MOST_SAMPLES}, as each sample is kept and logged"
        )
    stream = stream_of(name)
    constant, white, increment = (normals(seed, members, (stream, part), axes) for part in range(3))
    return _Sampled(
        name=name,
        table=table,
        quantity=table.quantity(name),
        period=period,
        span=period * rates.physics,
        delay=int(delay),
        bias=table.bias_std * constant(0),
        white=white,
        walk=table.bias_walk * sqrt(seconds),
        increment=increment,
        samples_field=f"{name}_samples",
        walk_field=f"{name}_walk",
    )
