"""Metrics of a flight: what they come to, what their functions receive, and what is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_axis import ONE_AXIS, written

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.log.flown_scenario import scenario_of
from mjspace.reporting import pictures
from mjspace.runner import flight_report
from mjspace.runner.checks import Judge
from mjspace.runner.logged_verdicts import judged
from mjspace.runner.metrics import Measured, refuse_unknown_signals
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load, to_toml
from mjspace.scenario.metrics import Metric
from mjspace.scenario.scenario import EventTable

TOPICS = {"/truth": {"error": (), "rate": (3,), "frame": (2, 2)}}
TIME = 0.5 * np.arange(9)
ERROR = np.array([4.0, 3.0, 2.0, 1.0, 0.5, 2.0, 0.5, 0.25, 0.5])
ROWS = {
    "error": ERROR,
    "rate": np.outer(ERROR, [1.0, 2.0, 2.0]),
    "frame": np.multiply.outer(ERROR, np.eye(2)),
}


def measured(
    metric: Metric, *, blocks: tuple[int, ...] = (9,), own: Any = None, events: Any = ()
) -> Measured:
    """Return what the metric comes to in rows that are handed over in ``blocks``."""
    judge = Judge([], events, TOPICS, [metric], {} if own is None else {metric.name: own})
    start = 0
    for size in blocks:
        part = slice(start, start + size)
        judge.add(TIME[part], {"/truth": {name: rows[part] for name, rows in ROWS.items()}})
        start += size
    (found,) = judge.metrics()
    return found


def of_function(**keys: Any) -> Metric:
    return Metric(name="x", function="x.py:f", signals=["truth.error"], **keys)


@pytest.mark.parametrize("blocks", [(9,), (1, 3, 5), (8, 1)])
@pytest.mark.parametrize(
    ("keys", "value"),
    [
        ({"statistic": "max"}, 4.0),
        ({"statistic": "rms", "start": 2.0}, math.sqrt((0.25 + 4.0 + 0.25 + 0.0625 + 0.25) / 5)),
        ({"statistic": "final", "signal": "truth.rate"}, 1.5),
        # Inside at 1.5, 2, 3 and 3.5 s, each until the next sample, and at the last for no time.
        ({"statistic": "time_inside", "below": 1.5}, 2.0),
        ({"statistic": "time_inside", "below": 1.5, "end": 2.0}, 0.5),
        ({"statistic": "time_inside", "above": 0.9, "below": 3.5}, 2.0),
        ({"statistic": "time_inside", "below": 1.1, "target": 3.0}, 2.0),
        ({"statistic": "time_inside", "below": 0.4, "target": 3.0, "relative": True}, 2.0),
    ],
)
def test_a_statistic_does_not_depend_on_the_blocks(
    keys: dict[str, Any], value: float, blocks: tuple[int, ...]
) -> None:
    metric = Metric(**{"name": "x", "signal": "truth.error", **keys})
    assert measured(metric, blocks=blocks).value == pytest.approx(value, rel=1e-15)


def test_a_function_receives_the_windows_samples_read_only() -> None:
    received: dict[str, Array] = {}

    def own(time: Array, signals: dict[str, Array]) -> float:
        received.update(signals, time=time)
        return time[-1]

    names = ["truth.error", "truth.rate", "truth.rate[2]", "truth.rate[1:3]", "truth.frame"]
    metric = Metric(name="x", function="x.py:own", signals=names, start=1.0, end=3.0)
    assert measured(metric, blocks=(1, 3, 5), own=own).value == 3.0
    assert received["time"].tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    assert received["truth.error"].tolist() == ERROR[2:7].tolist()
    shapes = [received[name].shape for name in names]
    assert shapes == [(5,), (5, 3), (5,), (5, 2), (5, 2, 2)]
    assert (received["truth.frame"] == ROWS["frame"][2:7]).all()
    assert not any(array.flags.writeable for array in received.values())


def test_what_a_function_should_not_do_is_said_in_one_line() -> None:
    def raises(time: Array, signals: dict[str, Array]) -> float:
        raise IndexError("it never\nsettles")

    said = measured(of_function(), own=raises)
    assert math.isnan(said.value)
    assert "x: not measured: raises() raised IndexError at test_metrics.py:" in said.line
    assert said.line.endswith(": it never settles")
    for value, what in [("late", "str"), (TIME, "array of shape (9,)"), (True, "bool"), (1j, "co")]:
        said = measured(of_function(), own=lambda time, signals, value=value: value)
        assert f"<lambda>() returned {what}" in said.missing
    said = measured(of_function(), own=lambda time, signals: np.float32(np.inf))
    assert "should be a finite number" in said.missing
    said = measured(of_function(), own=lambda time, signals: math.nan)
    assert (said.missing, math.isnan(said.value)) == ("it is not a number", True)
    said = measured(of_function(), own=lambda time, signals: np.array(2.0))
    assert (said.value, said.missing) == (2.0, "")


def test_a_window_that_never_comes_leaves_nothing_to_measure() -> None:
    event = EventTable(name="far", signal="truth.error", above=3.5)
    near = EventTable(name="near", signal="truth.error", below=0.1)
    after = Metric(name="x", signal="truth.error", statistic="max", since="far", start=1.0)
    assert measured(after, events=[event]).value == 2.0
    never = Metric(name="x", signal="truth.error", since="near")
    assert measured(never, events=[near]).missing == "event 'near' never happened"
    late = Metric(name="x", signal="truth.error", start=5.0)
    assert measured(late).missing == "no sample from 5 s to the end"


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({}, "give one, or a function"),
        ({"signal": "truth.error", "function": "x.py:f"}, "give one, or a function"),
        ({"function": "x.py:f"}, "signals: missing"),
        ({"signal": "truth.error", "signals": ["truth.error"]}, "go with a function"),
        ({"function": "x.py:f", "signals": ["a.b"], "statistic": "rms"}, "go with a signal"),
        ({"signal": "truth.error", "below": 1.0}, "'time_inside' needs below or above"),
        ({"signal": "truth.error", "statistic": "time_inside"}, "needs below or above"),
        (
            {"signal": "truth.error", "statistic": "time_inside", "below": 1, "above": 2},
            "nothing is inside",
        ),
    ],
)
def test_a_metric_that_says_two_things_or_none_is_refused(keys: dict[str, Any], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        Metric(name="x", **keys)


def test_unknown_signals_and_targets_of_another_size_are_refused() -> None:
    with pytest.raises(InputError, match=r"metrics.0.signal: no signal 'truth.eror'.*truth.error"):
        refuse_unknown_signals([Metric(name="x", signal="truth.eror")], TOPICS)
    own = Metric(name="x", function="x.py:f", signals=["truth.error", "truth.eror"])
    with pytest.raises(InputError, match=r"metrics.0.signals: no signal 'truth.eror'"):
        refuse_unknown_signals([own], TOPICS)
    with pytest.raises(InputError, match=r"metrics.0.target: 2 numbers, truth.rate has 3"):
        refuse_unknown_signals([Metric(name="x", signal="truth.rate", target=[1, 2])], TOPICS)


METRICS = """
[[metrics]]
name = "settled"
function = "mine.py:settled"
signals = ["truth.rate"]

[[metrics]]
name = "rate"
signal = "truth.rate"
statistic = "max"
"""
MINE = """
from limits import LIMIT
import numpy as np


def settled(time, signals):
    return time[np.flatnonzero(np.linalg.norm(signals["truth.rate"], axis=1) > LIMIT)[-1]]
"""


def test_a_flight_its_log_and_its_replay_have_the_same_metrics(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, ONE_AXIS + METRICS)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "limits.py").write_text("LIMIT = 0.005\n")
    flown = run(path, out=tmp_path / "run")
    settled, rate = flown.metrics
    # w[k] = 0.01 * (1 - 0.5 * 6 / (10 - 0.05))^k is above 0.005 for k = 0 and 1.
    assert (settled.value, rate.value) == (0.5, 0.01)
    (tmp_path / "mine.py").unlink()
    again = replay(flown.path, tmp_path / "again", trust=True)
    assert [m.value for m in again.metrics] == [0.5, 0.01]
    assert verify(flown.path, trust=True) is None
    with pytest.raises(InputError, match=r"runs code out of the log, metrics.*mine.py"):
        replay(flown.path, tmp_path / "no")
    found = judged(flown.log, scenario_of(flown.log))
    assert found.metrics == ["metric settled: 0.5", "metric rate: 0.01"]
    assert not any("metric" in event.message for event in found.events)
    monkeypatch.setattr(pictures, "still", lambda log: pictures.Picture("", "none"))
    flight_report.write([flown.path], tmp_path / "report.html")
    assert "<li>settled: 0.5</li>" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    ("source", "line"),
    [
        ("def settled(time): ...", r"settled\(time\): should take \(time, signals\)"),
        ("class settled: ...", "is a type, should be a function"),
        ("def other(time, signals): ...", "has no 'settled': have other"),
        ("import nothing_of_the_kind", "cannot be imported"),
    ],
)
def test_a_function_that_cannot_be_one_is_refused_before_the_flight(
    tmp_path: Path, source: str, line: str
) -> None:
    path = written(tmp_path, ONE_AXIS + METRICS)
    (tmp_path / "mine.py").write_text(source)
    with pytest.raises(InputError, match=rf"metrics.0.function: .*{line}"):
        run(path, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_scenario_without_metrics_is_written_as_before_there_were_any(tmp_path: Path) -> None:
    assert "metrics" not in to_toml(load(written(tmp_path))[0])
    with_metrics, _ = load(written(tmp_path, ONE_AXIS + METRICS))
    assert to_toml(with_metrics).count("[[metrics]]") == 2
    with pytest.raises(InputError, match=r"metrics.1.name: 'settled' is there already"):
        load(written(tmp_path, ONE_AXIS + METRICS.replace('"rate"\ns', '"settled"\ns')))
    with pytest.raises(InputError, match=r"metrics.1.since: no event 'dawn'"):
        load(written(tmp_path, ONE_AXIS + METRICS + 'since = "dawn"'))
