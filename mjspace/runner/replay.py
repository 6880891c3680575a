"""Flying again from a log alone: to verify it bit for bit, or under another law."""

import dataclasses
import math
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.contract import REPORTED_BY_PLANT, TICK, Array
from mjspace.errors import InputError, failure, input_error_at
from mjspace.interrupts import Interrupted, on_signals
from mjspace.log.reader import Log
from mjspace.log.rows import due
from mjspace.log.writer import nanoseconds
from mjspace.runner.former_names import as_logged, logged_name
from mjspace.runner.logged_assembly import assembly_of
from mjspace.runner.output import LOG, refuse_existing
from mjspace.runner.run import Progress, Result, fly_to_log, telling_time
from mjspace.scenario.loading import component
from mjspace.scenario.scenario import Component, Scenario
from mjspace.scenario.trust import is_address
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.flight_software.socket_law import ROUND_TRIP
from mjspace.simulation.initial_state import Start, first_start, start_at, state_of_log
from mjspace.simulation.joined import names_in_state
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block, Rows, one_vehicle, shapes
from mjspace.simulation.user_code import LocatedError, reference_at


@dataclass(frozen=True)
class Difference:
    """Where a repeated flight first differs from its log."""

    time: float
    topic: str
    field: str
    index: int
    logged: float
    flown: float
    reason: str = ""
    """Why it has to differ, where that is known."""

    def __str__(self) -> str:
        """Return it as one line."""
        reason = f": {self.reason}" if self.reason else ""
        return (
            f"{self.topic}.{self.field}[{self.index}] differs first at t = {self.time:.6g} s: "
            f"logged {self.logged!r}, flown {self.flown!r}{reason}"
        )


def replay(
    log: Log | str | Path,
    out: str | Path,
    *,
    start: float = 0.0,
    law: Component | str | None = None,
    gains: Iterable[str] = (),
    folder: Path = Path(),
    trust: bool = False,
    force: bool = False,
    progress: Progress = lambda time: None,
) -> Result:
    """Fly a log again from time ``start`` [s] into a new log, ``flight.mcap`` in ``out``.

    ``law`` is another law, ``"module:Class"`` or ``"file.py:Class"``, with ``gains`` as
    ``"key=value"``; its files are looked up from ``folder``. Its state, and that of an estimator,
    begins at ``start``, and the checks and events of the logged law's signals are left out. Code
    out of the log runs with ``trust`` alone.

    Raises:
        InputError: no such log, time, law or gain; ``out`` holds the log itself, or another that
            ``force`` does not allow to replace.
        FlightError: the flight could not even begin.
        OSError: the new log cannot be written.
    """
    with input_error_at("log"):
        log = Log.of(log)
    path = Path(out) / LOG
    if path.exists() and path.samefile(log.path):
        raise InputError(f"--out {out}: holds the log that is to be flown again")
    if isinstance(law, str):
        law = component(law, gains)
    elif gains:
        raise InputError("gains: are for another law: name it by law")
    refuse_existing(path, force=force)
    with assembly_of(log, law, folder, trust=trust) as assembly:
        begin = start_of(log, assembly, start, fresh_law=law is not None)
        return fly_to_log(
            assembly,
            path,
            member=log.member,
            start=begin,
            force=force,
            watch=telling_time(progress),
        )


def verify(
    log: Log | str | Path,
    *,
    start: float = 0.0,
    trust: bool = False,
    progress: Progress = lambda time: None,
) -> Difference | None:
    """Fly a log again from time ``start`` [s]; return the first difference, None if there is none.

    Every field of every topic is compared bit for bit, those of ``/state`` first; but for the round
    trip to a law in another process, which takes part again. Code out of the log runs with
    ``trust`` alone, and to another process it connects with it alone.

    Raises:
        InputError: no such log or time, or rows that differ from the log's own digests.
        FlightError: the repeated flight cannot go on where the logged one did.
    """
    with input_error_at("log"):
        log = Log.of(log)
        altered = log.altered()
    if altered:
        raise InputError(
            f"log: {', '.join(altered)} changed since the flight, by the log's digests"
        )
    with assembly_of(log, trust=trust) as assembly, on_signals() as stop:
        begin = start_of(log, assembly, start)
        if begin.period == 0:
            expected = {"physics": first_start(assembly, [log.member]).physics}
            begun = {"time": np.zeros(1), "physics": begin.physics}
            found = first_difference({"/state": begun}, {"/state": expected})
            if found is not None:
                return dataclasses.replace(found, reason="the scenario begins otherwise")
        for block in stop.breaking_off(fly(assembly, begin, [log.member])):
            if stop():
                raise Interrupted(stop.signal)
            flown = as_logged(_repeated(one_vehicle(block), assembly.scenario), log.topics)
            _check_topics(log, block)
            logged = log.read_topics(dict.fromkeys(flown), start=block.time[0], end=block.time[-1])
            _check_rows(log, logged, block)
            found = first_difference(logged, _as_often(log, logged, flown, block.time))
            if found is not None:
                return dataclasses.replace(found, reason=_other_streams(log, assembly.scenario))
            progress(float(block.time[-1]))
            if block.time[-1] > log.end + TICK:
                break  # the log ends here: its flight was interrupted
    return None


def _repeated(rows: Rows, scenario: Scenario) -> Rows:
    """Return what has to be the same in each flight: all but the round trip to another process."""
    if not is_address(scenario.law.kind):
        return rows
    return rows | {"/law": {n: values for n, values in rows["/law"].items() if n != ROUND_TRIP}}


def _other_streams(log: Log, scenario: Scenario) -> str:
    """Return that the log's noise was drawn otherwise, where an earlier version drew it; else ''.

    Sensors without ``measures`` are of versions whose random streams were numbered, not named.
    """
    logged = tomllib.loads(log.attachment("scenario.toml").decode()).get("sensors", {})
    named = all("measures" in table for table in logged.values())
    random = any(s.noise_std or s.bias_std or s.bias_walk for s in scenario.sensors.values())
    if named or not random:
        return ""
    return (
        "an earlier version of mjspace wrote the log, whose sensors had other random streams: "
        f"verify it with version {log.metadata.get('mjspace', '')}, revision "
        f"{log.metadata.get('git') or 'unknown'}"
    )


def start_of(log: Log, assembly: Assembly, time: float, *, fresh_law: bool = False) -> Start:
    """Return the logged period nearest ``time`` [s] as a start; ``fresh_law`` resets the law there.

    Raises:
        InputError: the log does not hold that time, or not this law's state; the law's ``reset``
            raised, with the line of the user's code.
    """
    period = assembly.scenario.rates.control
    if not log.start - 0.5 * period <= time <= log.end + 0.5 * period:
        raise InputError(f"t = {time:g} s is not in the log: it has {log.start:g} to {log.end:g} s")
    number = round(time / period)
    near = (number - 0.5) * period, (number + 0.5) * period
    row = log.read("/state", None, *near)
    if len(row["time"]) != 1:
        found = float(log.nearest("/state", time)["time"])
        raise InputError(
            f"t = {time:g} s has no logged state: /state is logged every "
            f"{log.every['/state'] * period:g} s, and the nearest is at {found:.10g} s"
        )
    state = {name: values for name, values in row.items() if name != "time"}
    physics = state_of_log(assembly, state["physics"])
    if abs(physics[0, 0] - number * period) > 0.5 * period:
        raise InputError(f"log: /state.physics has t = {physics[0, 0]:g} s at {time:g} s")
    sensors, actuators = (
        {name.removeprefix(kind): v for name, v in state.items() if name.startswith(kind)}
        for kind in ("sensor_", "actuator_")
    )
    fresh = start_at(assembly, physics, [log.member])
    for kind, logged, expected in (
        ("sensor_", sensors, fresh.sensors),
        ("actuator_", actuators, fresh.actuators),
    ):
        for name, right in expected.items():
            _check_shape(f"{kind}{name}", logged.get(name), right)
    law_state: Any = None
    if not fresh_law:
        absent = dict.fromkeys(REPORTED_BY_PLANT, np.empty((1, 0)))
        # Whichever is logged: the law's state is taken from the log, its names from this one.
        logged = log.nearest("/measurement", time)
        measured = {name: values[None] for name, values in logged.items() if name != "time"}
        desired = reference_at(assembly.reference, np.array([number * period]))
        measurement = assembly.sensors([0]).measurement(**absent | measured)
        try:
            template = assembly.law.reset(
                measurement, type(desired)(*(values[0] for values in desired))
            )
        except LocatedError as error:
            raise InputError(f"log: {error}") from error
        except BaseException as error:
            raise InputError(f"log: {failure('the law', error)}") from error
        fields = getattr(template, "_fields", ())
        names = [logged_name(name, state) for name in names_in_state(type(template))]
        missing = [field for field, name in zip(fields, names, strict=True) if name not in state]
        if missing:
            raise InputError(f"the log has no state {missing[0]!r} for this law: another flew")
        for field, name in zip(fields, names, strict=True):
            _check_shape(name, state[name], np.asarray(getattr(template, field)))
        law_state = type(template)(*(state[name] for name in names)) if names else ()
    return Start(number, physics, sensors, law_state, actuators)


def _check_shape(name: str, logged: Array | None, right: Array) -> None:
    found = None if logged is None else logged.shape[1:]
    if found != right.shape[1:]:
        raise InputError(f"log: /state.{name} has shape {found}, should be {right.shape[1:]}")


def _check_rows(log: Log, logged: Rows, block: Block) -> None:
    """Refuse a log that lacks rows of these control periods, or has others among them."""
    stamps = nanoseconds(block.time)
    first = round(log.start / log.control_period)
    sequence = block.period - first + np.arange(len(stamps))
    for topic, every in log.every.items():
        found = nanoseconds(logged[topic]["time"])
        expected = stamps[due(first, sequence, every)]
        lacking = np.setdiff1d(expected[expected <= nanoseconds(np.array(log.end))], found)
        if len(lacking):
            at = f"t = {lacking[0] / 1e9:g} s"
            raise InputError(f"log: {topic} lacks its row at {at}: it is damaged, or recovered")
        other = np.setdiff1d(found, stamps)
        if len(other):
            at = f"t = {other[0] / 1e9:g} s"
            raise InputError(f"log: {topic} has a row at {at}, at which there is no control period")


def _check_topics(log: Log, block: Block) -> None:
    """Refuse a log whose topics are not those of the flight again, as of another version."""
    flown = as_logged(shapes(block), log.topics)
    for topic in flown | log.topics:
        if flown.get(topic) != log.topics.get(topic):
            raise InputError(
                f"log: {topic} holds {log.topics.get(topic)}, flown again {flown.get(topic)}: "
                "another version of mjspace wrote it"
            )


def _as_often(log: Log, logged: Rows, flown: Rows, time: Array) -> Rows:
    """Return the rows of ``flown``, at ``time`` (n,) [s], that each topic has ``logged``."""
    found = {}
    for topic, fields in flown.items():
        chosen: Any = slice(None)
        if log.every[topic] > 1:
            chosen = np.searchsorted(time, logged[topic]["time"] - TICK)
        found[topic] = {name: rows[chosen] for name, rows in fields.items()}
    return found


def first_difference(logged: Rows, flown: Rows) -> Difference | None:
    """Return where ``flown`` first differs from ``logged``, which has ``time`` in each topic.

    ``logged`` may end earlier. Of one instant the first topic and field count, in the flown order.
    """
    found: Difference | None = None
    for topic, fields in flown.items():
        time = logged[topic]["time"]
        n = len(time)
        for name, rows in fields.items():
            width = math.prod(rows.shape[1:])
            a, b = (
                np.ascontiguousarray(both[:n]).reshape(n, width)
                for both in (logged[topic][name], rows)
            )
            places = np.argwhere(a.view(np.uint64) != b.view(np.uint64))
            if len(places) and (found is None or time[places[0][0]] < found.time):
                k, i = map(int, places[0])
                found = Difference(float(time[k]), topic, name, i, float(a[k, i]), float(b[k, i]))
    return found
