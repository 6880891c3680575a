"""A vehicle's sensors: the truth, sampled late, with errors, and held in between."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import ceil, sqrt
from typing import Any

import numpy as np

from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement
from mjspace.scenario.fields import of_each, refuse_other_count
from mjspace.scenario.plant import Rates
from mjspace.sensors.base import Sensor, State, Surroundings, in_unit
from mjspace.sensors.fault_kinds import KINDS, STREAM, SensorFault, of_sensor
from mjspace.sensors.noise import normals, stream_of
from mjspace.sensors.sampled import Fault, Sampled
from mjspace.units import Quantity, whole_number

_PER_SECOND = {"rad": "rad/s", "rad/s": "rad/s^2", "m": "m/s", "m/s": "m/s^2"}
MOST_SAMPLES = 10000
"""That a delay keeps."""
# Streams of a sensor, after that of its name. A number stands in no log, but a flight is flown
# again with the same.
_STREAMS = ("bias", "white", "increment", "scale_factor", "misalignment", "non_orthogonality")
_STREAM = {name: number for number, name in enumerate((*_STREAMS, "markov"))}


class SensorSuite:
    """The sensors of a batch of vehicles: fixed errors and streams, all memory in ``State``.

    A sensor takes sample j at integration step j * period. It reports the newest sample that is at
    least ``delay`` old, and its first until there is one. An ideal sensor has no state and reports
    the truth's own array, which is no copy. Each other one has ``<name>_samples`` (N, delay + 1,
    width), its last reports, the oldest first; each whose bias walks also has ``<name>_walk``
    (N, axes), the walk at the next sample, and ``<name>_markov`` likewise. The samples of one that
    may be invalid have a last column, 1.0 where they are valid, which is reported as
    ``<name>_valid``, (N, 1).

    Attributes:
        ticks: of the sensors that are not ideal, the sampling periods, or what they and the
            arrivals of late samples are multiples of, in integration steps; ``sample`` is to be
            called at every multiple of each.
        measurement: the class of what ``sample`` returns, which knows each quantity's sensor.
    """

    def __init__(
        self,
        sensors: Mapping[str, Sensor[Any]],
        rates: Rates,
        seed: int,
        members: Sequence[int],
        surroundings: Surroundings,
        faults: Sequence[SensorFault] = (),
        *,
        inner: bool = False,
    ) -> None:
        """Draw the constant errors of ``members``, the vehicles' numbers in the campaign ``seed``.

        A member measures the same alone or in any batch, whatever other sensors it has. ``faults``
        are those of the scenario; ``inner`` is whether an inner loop measures between control
        instants.

        Raises:
            ValueError: a period or a delay is no whole number of integration steps, or a known
                error or a fault does not fit its sensor.
        """
        self._surroundings, self._steps = surroundings, rates.steps
        self.measurement = Measurement._with_sensors(
            {name: table.alias(name) for name, table in sensors.items()}
        )
        every = [
            _sampled(name, table, rates, seed, members, surroundings, faults, inner=inner)
            for name, table in sensors.items()
        ]
        self._sampled = [sensor for sensor in every if sensor is not None]
        own = {sensor.name for sensor in self._sampled}
        self._ideal = {n: table.quantity(n) for n, table in sensors.items() if n not in own}
        self._reported = [name for name in REPORTED_BY_PLANT if name != "wheel_speed"]
        measured = {table.quantity(name) for name, table in sensors.items()}
        self._reported += [name for name in surroundings.own_sensors if name not in measured]
        # The fields of a truth that is reported as it is, without a copy.
        same = not self._sampled and all(name == q for name, q in self._ideal.items())
        self._as_it_is = {*self._ideal, *self._reported} if same else set()
        self.ticks = frozenset(sensor.tick for sensor in self._sampled)

    def reset(self, truth: Measurement) -> State:
        """Return the state before the first sample, at step 0, where the truth is ``truth``."""
        state: State = {}
        for sensor in self._sampled:
            sensor.begin(state, truth)
        return state

    def sample(
        self, state: State, step_index: int, truth: Measurement, phase: Array | None = None
    ) -> tuple[State, Measurement]:
        """Return (state, measurement) at integration step ``step_index``.

        ``truth`` has a vehicle axis and each quantity by its name: attitude (N, 4), rate (N, 3).
        ``phase`` (N, faults) is that of the scenario's faults, where there are any. ``state`` is
        left as it is, so that this step may be sampled from it again.
        """
        if self._sampled:
            state = state.copy()
            for sensor in self._sampled:
                sensor.take(state, step_index, truth, phase, self._surroundings)
        return state, self.report(state, truth)

    def report(self, state: State, truth: Measurement) -> Measurement:
        """Return the measurement between two samples: what the sensors report is held."""
        arrays = truth._asdict()
        if arrays.keys() == self._as_it_is:
            return truth
        reports = {name: arrays[quantity] for name, quantity in self._ideal.items()}
        for sensor in self._sampled:
            report = state[sensor.report_field][:, 0]
            reports[sensor.name] = report[:, :-1] if sensor.flagged else report
            if sensor.flagged:
                reports[f"{sensor.name}_valid"] = report[:, -1:]
        for name in self._reported:
            reports[name] = arrays[name]
        return self.measurement(**reports)

    @property
    def constants(self) -> dict[str, Array]:
        """What is constant of the errors of each sensor that is not ideal, (N, ...), by name."""
        return {
            f"{sensor.name}_{what}": array
            for sensor in self._sampled
            for what, array in sensor.fixed.items()
        }

    def draws(self, periods: Sequence[int]) -> dict[str, Array]:
        """Return what a sample at each of these control instants takes, by sensor and purpose.

        That is random numbers, (n, N, axes), and, of a sensor that samples less often, 1.0 where it
        is due and 0.0 elsewhere, (n, 1, 1).
        """
        drawn = {}
        for sensor in self._sampled:
            steps = [number * self._steps for number in periods]
            for purpose, ahead in sensor.drawn.items():
                numbers = [sensor.draws[purpose](step // sensor.period + ahead) for step in steps]
                drawn[f"{sensor.name}_{purpose}"] = np.array(numbers)
            if sensor.period != self._steps:
                for mark, phase in sensor.phases.items():
                    at = [float(step % sensor.period == phase) for step in steps]
                    drawn[f"{sensor.name}_{mark}"] = np.array(at).reshape(-1, 1, 1)
        return drawn

    def with_errors(self, constants: Mapping[str, Any], draws: Mapping[str, Any]) -> "SensorSuite":
        """Return sensors with these constants, and these draws in whichever sample.

        Both are as ``constants`` and, of one control instant, as ``draws`` return them; or they are
        traced.
        """

        def whichever(name: str) -> Callable[[int], Any]:
            return lambda sample: draws[name]

        other = copy.copy(self)
        other._sampled = [
            replace(
                sensor,
                fixed={what: constants[f"{sensor.name}_{what}"] for what in sensor.fixed},
                draws={p: whichever(f"{sensor.name}_{p}") for p in sensor.draws},
                marks={
                    mark: draws[f"{sensor.name}_{mark}"]
                    for mark in sensor.phases
                    if f"{sensor.name}_{mark}" in draws
                },
            )
            for sensor in self._sampled
        ]
        return other

    def sample_where_due(
        self, state: State, truth: Measurement, phase: Array | None = None
    ) -> tuple[State, Measurement]:
        """Return (state, measurement) of sensors ``with_errors``, at any control instant but 0.

        Each takes a sample; one that is not due keeps what it held.
        """
        after = state.copy()
        for sensor in self._sampled:
            sensor.take_where_due(after, truth, phase, self._surroundings)
        return after, self.report(after, truth)


def _sampled(
    name: str,
    table: Sensor[Any],
    rates: Rates,
    seed: int,
    members: Sequence[int],
    surroundings: Surroundings,
    faults: Sequence[SensorFault],
    *,
    inner: bool,
) -> Sampled | None:
    """Return the sensor, or None when at every control instant it reports the truth itself.

    Where nothing looks between control instants, as an ``inner`` loop does, a report arrives at the
    first of them at which it is old enough.

    Raises:
        ValueError: a period or delay is no whole number of integration steps, or a known error or a
            fault does not fit.
    """
    axes = table.axes_of(name, surroundings)
    if name in surroundings.own_sensors and table.quantity(name) != name:
        raise ValueError(
            f'sensors.{name}: the model has a sensor of that name: measures = "model" gives it '
            "errors; else call this one otherwise"
        )
    seconds = rates.control if table.period is None else table.period
    period_key = "rates.control" if table.period is None else f"sensors.{name}.period"
    period = whole_number(seconds, rates.physics, period_key, "rates.physics")
    if table.at_control and period % rates.steps:
        whole_number(seconds, rates.control, f"sensors.{name}.period", "rates.control")
    own = of_sensor(name, faults)
    always = table.always_valid and not own
    if always and not (table.errs or table.integrates or table.delay or rates.steps % period):
        return None
    steps = table.delay and whole_number(
        table.delay, rates.physics, f"sensors.{name}.delay", "rates.physics"
    )
    if not inner and period % rates.steps == 0:
        steps = rates.steps * ceil(steps / rates.steps)
    delay, arrival = divmod(int(steps), period)
    if delay > MOST_SAMPLES:
        raise ValueError(
            f"sensors.{name}.delay: {table.delay:g} s is {delay:g} times {period_key}: at most "
            f"{MOST_SAMPLES}, as each sample is kept and logged"
        )
    stream = stream_of(name)

    def numbers(purpose: str, width: int) -> Callable[[int], Array]:
        return normals(seed, members, (stream, _STREAM[purpose]), width)

    draws = {purpose: numbers(purpose, axes) for purpose in ("white", "increment", "markov")}
    draws |= {f"lost_{number}": normals(seed, members, (STREAM + number,), 1) for number, _ in own}
    width = table.width_of(name, surroundings)
    nothing = np.zeros(width)
    nothing[:1] = float(width == 4 and axes == 3)  # of a quaternion
    return Sampled(
        name=name,
        table=table,
        quantity=table.quantity(name),
        period=period,
        span=period * rates.physics,
        delay=delay,
        arrival=arrival,
        fixed=table.fixed(lambda purpose, count: numbers(purpose, count)(0), name, axes),
        draws=draws,
        noise=table.noise(seconds),
        walk=table.bias_walk * sqrt(seconds),
        markov=table.markov(seconds),
        nothing=nothing,
        faults=[_fault(number, each, table, axes, seconds) for number, each in own],
    )


def _fault(number: int, fault: SensorFault, table: Sensor[Any], axes: int, period: float) -> Fault:
    """Return the fault of a sensor with that ``period`` [s].

    Raises:
        ValueError: its value does not fit the sensor.
    """
    key, kind, value = f"faults.{number}.value", KINDS[fault.kind], fault.value
    if kind.gain(2.0) != 1.0 and not table.noise(period):
        raise ValueError(f"{key}: the sensor has no white noise")
    unit = in_unit(table)
    right = "s" if kind.in_seconds else ""
    if kind.of_axes and unit is not None:
        right = _PER_SECOND.get(unit, "") if kind.per_second else unit
    for each in value if isinstance(value, list) else [value]:
        if (
            isinstance(each, Quantity)
            and each.unit != right
            and not (kind.of_axes and unit is None)
        ):
            wanted = f"in {right}" if right else "a plain number"
            raise ValueError(f"{key}: got {each:.6g} {each.unit}, should be {wanted}")
    if kind.of_axes:
        refuse_other_count(key, value, axes, "axes")
        return Fault(number, kind, of_each(value, axes))
    late = kind.late(value or 0.0, period, key)
    return Fault(number, kind, value, late)
