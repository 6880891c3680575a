"""Judging flights made by hand, where every statistic is known."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest
from pydantic import ValidationError

from mjspace.errors import InputError
from mjspace.runner.checks import Judge, Verdict, refuse_other_dimensions, refuse_unknown
from mjspace.runner.statistic import Statistic
from mjspace.scenario.scenario import Check, EventTable
from mjspace.signals import by_topic, find_signal
from mjspace.units import Unit


class Recording(NamedTuple):
    """A flight by hand: one topic, ten control periods a second."""

    error: np.ndarray
    rate: np.ndarray


TOPICS = {"/truth": {"error": (1,), "rate": (3,)}}


def judge(
    flight: Recording, checks: Sequence[Check], events: Sequence[EventTable] = ()
) -> list[Verdict]:
    """Judge the flight, which comes in two blocks."""
    judge = Judge(checks, events, TOPICS)
    for part in np.array_split(np.arange(len(flight.error)), 2):
        rows = {"/truth": {"error": flight.error[part, None], "rate": flight.rate[part]}}
        judge.add(part / 10.0, rows)
    return judge.verdicts()


ERROR = np.array([3.0, -5.0, 2.0, 1.0, 0.5, 0.25])
RATE = np.outer(ERROR, [3.0, 0.0, 4.0])


def measure(**check: object) -> float:
    check = {"name": "x", "below": 1.0} | check
    return judge(Recording(ERROR, RATE), [Check.model_validate(check)])[0].measured


@pytest.mark.parametrize(
    ("statistic", "value"),
    [
        ("max", 3.0),
        ("min", -5.0),
        ("peak", 5.0),
        ("mean", ERROR.mean()),
        ("rms", np.sqrt((ERROR**2).mean())),
        ("final", 0.25),
        ("drift", 8.0),
    ],
)
def test_statistics_of_a_scalar(statistic: str, value: float) -> None:
    assert measure(signal="truth.error", statistic=statistic) == pytest.approx(value, rel=1e-15)


def test_a_signal_below_zero_is_judged_without_a_warning() -> None:
    falling = -np.arange(1.0, 7.0)
    for statistic, value in (("final", -6.0), ("mean", -3.5), ("rms", np.sqrt(91.0 / 6.0))):
        check = Check.model_validate(
            {"name": "x", "signal": "truth.error", "statistic": statistic, "below": 1.0}
        )
        assert judge(Recording(falling, RATE), [check])[0].measured == pytest.approx(value)


def test_drift_is_from_the_start_of_the_window_not_of_a_chunk() -> None:
    ramp = np.arange(6.0)
    check = Check(name="x", signal="truth.error", statistic="drift", below=1.0)
    assert judge(Recording(ramp, RATE), [check])[0].measured == 5.0
    late = check.model_copy(update={"start": 0.2})
    assert judge(Recording(ramp, RATE), [late])[0].measured == 3.0


def test_a_vector_is_judged_by_its_norm_and_a_component_by_itself() -> None:
    assert measure(signal="truth.rate") == 25.0
    assert measure(signal="truth.rate[2]") == 12.0
    assert measure(signal="/truth.rate[2]", statistic="min") == -20.0


def test_the_window_holds_both_its_ends() -> None:
    assert measure(signal="truth.error", start=0.2, end=0.3) == 2.0
    assert measure(signal="truth.error", start=0.2, end=0.3, statistic="min") == 1.0
    assert np.isnan(measure(signal="truth.error", start=7.0))


def test_target_and_relative() -> None:
    found = measure(signal="truth.rate", target=[3, 0, 4], statistic="final")
    assert found == pytest.approx(0.75 * 5.0)
    found = measure(signal="truth.rate", target=[3, 0, 4], statistic="final", relative=True)
    assert found == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("below", "above", "passed"),
    [(3.1, None, True), (3.0, None, False), (None, 2.9, True), (None, 3.0, False), (4, 3.5, False)],
)
def test_bounds(below: float | None, above: float | None, passed: bool) -> None:
    check = Check(name="x", signal="truth.error", below=below, above=above)
    assert judge(Recording(ERROR, RATE), [check])[0].as_expected is passed


FAILING = {"expected": "FAIL", "because": "it is fast"}


@pytest.mark.parametrize("expected", [{}, FAILING], ids=["PASS", "FAIL"])
def test_what_is_not_measured_comes_out_neither_way(expected: dict[str, str]) -> None:
    broken = ERROR.copy()
    broken[1] = np.nan
    late = {"start": 9.0}
    cases: list[tuple[Any, np.ndarray, str]] = [
        *(
            ({"statistic": statistic}, broken, "truth.error is not a number")
            for statistic in ("max", "min", "peak", "mean", "rms", "drift")
        ),
        (late, ERROR, "no sample from 9 s to the end"),
        (late | {"end": 9.5}, ERROR, "no sample from 9 s to 9.5 s"),
        ({"until": "small", "start": 0.3}, ERROR, "no sample from 0.3 s to 0.3 s"),
        ({"since": "never"}, ERROR, "event 'never' never happened"),
        ({"since": "small", "until": "never"}, ERROR, "event 'never' never happened"),
    ]
    for bound in ({"below": 1e9}, {"below": -1e9}):
        for keys, signal, why in cases:
            check = Check.model_validate(
                {"name": "x", "signal": "truth.error"} | keys | bound | expected
            )
            verdict = judge(Recording(signal, RATE), [check], [SMALL, NEVER])[0]
            assert verdict.outcome == "not measured"
            assert not verdict.as_expected
            assert verdict.line == f"not measured x: {why}"


@pytest.mark.parametrize(
    ("below", "expected", "as_expected", "line"),
    [
        (4.0, {}, True, "PASS x: 3 (required < 4)"),
        (2.0, {}, False, "FAIL x: 3 (required < 2)"),
        (2.0, FAILING, True, "FAIL x: 3 (required < 2), as expected: it is fast"),
        (4.0, FAILING, False, "PASS x: 3 (required < 4), expected to FAIL: it is fast"),
    ],
)
def test_a_check_may_be_expected_to_fail(
    below: float, expected: dict[str, str], as_expected: bool, line: str
) -> None:
    check = Check.model_validate({"name": "x", "signal": "truth.error", "below": below} | expected)
    verdict = judge(Recording(ERROR, RATE), [check])[0]
    assert verdict.as_expected is as_expected
    assert verdict.line == line


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"expected": "FAIL"}, "needs because"),
        ({"expected": "FAIL", "because": " "}, "needs because"),
        ({"because": "it is fast"}, 'goes with expected = "FAIL"'),
        ({"expected": "fail", "because": "it is fast"}, "'PASS' or 'FAIL'"),
        ({"fails_with": "law.rate_gain"}, "'law.rate_gain', should be 'key=value'"),
        ({"fails_with": ["seed=1", "=2"]}, "'=2', should be 'key=value'"),
        ({"fails_with": "checks.0.below=1"}, "should change the flight"),
    ],
)
def test_an_expectation_that_says_too_little_is_refused(
    keys: dict[str, object], message: str
) -> None:
    with pytest.raises(ValidationError, match=message):
        Check.model_validate({"name": "x", "signal": "truth.error", "below": 1.0} | keys)


def test_what_a_check_fails_with_is_one_change_or_several() -> None:
    check = {"name": "x", "signal": "truth.error", "below": 1.0}
    one = Check.model_validate(check | {"fails_with": "seed=1"})
    assert one.fails_with == ["seed=1"]
    assert Check.model_validate(check | {"fails_with": ["a=1", "b=2"]}).fails_with == ["a=1", "b=2"]


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        ("truth.eror", r"checks\.0\.signal.*truth\.error"),
        ("truht.error", "truth.error"),
        ("truth.rate[3]", "3 components"),
        ("error", "topic.field"),
    ],
)
def test_unknown_signals_are_refused(signal: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        refuse_unknown([Check(name="x", signal=signal, below=1)], TOPICS)


def test_a_target_of_the_wrong_length_is_refused() -> None:
    check = Check(name="x", signal="truth.rate", below=1, target=[1, 2])
    with pytest.raises(InputError, match=r"checks\.0\.target: 2 numbers, truth\.rate has 3"):
        refuse_unknown([check], TOPICS)


UNITS = {"/truth": {"rate": Unit("rad/s")}}


def refuse(units: dict[str, dict[str, Unit]] = UNITS, event: bool = False, **keys: Any) -> None:
    """Refuse a check, or an event, of the rate if it has another dimension."""
    table = {"name": "x", "signal": "truth.rate"} | keys
    checks = [] if event else [Check.model_validate(table)]
    events = [EventTable.model_validate(table)] if event else []
    refuse_other_dimensions(checks, events, TOPICS, units)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"below": "3 m"},
            r"^checks\.0\.below: got 3 m for truth\.rate, should be in rad/s$",
        ),
        ({"above": "90 deg"}, r"checks\.0\.above: got 1\.5708 rad for .*, should be in rad/s"),
        ({"below": 1, "target": [1, "2 s", 3]}, r"checks\.0\.target: got 2 s .* in rad/s"),
        ({"below": 1, "target": "2 s"}, r"checks\.0\.target: got 2 s .* in rad/s"),
        (
            {"below": "1 rad/s", "target": "2 deg/s", "relative": True},
            r"below: got 1 rad/s .* a plain number, of a relative error",
        ),
        ({"below": "3 m", "event": True}, r"events\.0\.below: got 3 m .* in rad/s"),
    ],
)
def test_bounds_of_another_dimension_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        refuse(**keys)


def test_bounds_of_the_signals_dimension_are_taken() -> None:
    refuse(below="3 deg/s", above="-1 rpm", target=["1 rad/s", 0, 0])
    refuse(below=3, target=1)
    refuse(below=0.1, target="2 rad/s", relative=True)
    refuse(below="3 deg/s", event=True)
    refuse({"/truth": {}}, below="3 m")  # of what has no unit, it may be anything


SMALL = EventTable(name="small", signal="truth.error", below=1.5, above=0.0)  # first at 0.3 s
LOW = EventTable(name="low", signal="truth.error", below=0.7, above=0.0)  # first at 0.4 s
HIGH = EventTable(name="high", signal="truth.error", above=0.9)  # at once, and again at 0.2 s
NEVER = EventTable(name="never", signal="truth.error", above=10.0)


def test_some_components_have_a_norm_of_their_own() -> None:
    assert measure(signal="truth.rate[0:2]", statistic="peak") == 15.0
    assert measure(signal="truth.rate[1:3]", statistic="peak") == 20.0


@pytest.mark.parametrize(
    ("window", "value"),
    [
        ({"until": "low"}, 1.0),
        ({"since": "low"}, 0.25),
        ({"since": "low", "end": 0.05}, 0.5),
        ({"since": "low", "start": 0.1}, 0.25),
        ({"until": "small"}, 2.0),
        ({"since": "small", "until": "low"}, 1.0),
        ({"since": "high", "end": 0.05}, 3.0),
        ({"since": "never"}, np.nan),
        ({"until": "never"}, np.nan),
        ({"until": "never", "end": 0.1}, np.nan),
    ],
)
def test_windows_are_counted_from_events(window: dict[str, str], value: float) -> None:
    check = Check.model_validate(
        {"name": "x", "signal": "truth.error", "statistic": "final", "below": 9.0} | window
    )
    verdict = judge(Recording(ERROR, RATE), [check], [SMALL, LOW, HIGH, NEVER])[0]
    assert verdict.measured == pytest.approx(value, nan_ok=True)
    assert verdict.outcome == ("not measured" if np.isnan(value) else "PASS")


def test_the_line_has_both_bounds_and_a_relative_target_its_scale() -> None:
    both = Check(name="x", signal="truth.error", below=4.0, above=-2.5)
    verdict = judge(Recording(ERROR, RATE), [both])[0]
    assert verdict.bound == "< 4 and > -2.5"
    assert verdict.line == "PASS x: 3 (required < 4 and > -2.5)"
    one = Check(name="x", signal="truth.error", above=3.5)
    assert judge(Recording(ERROR, RATE), [one])[0].line == "FAIL x: 3 (required > 3.5)"


def test_a_target_of_one_number_is_of_each_component() -> None:
    check = Check(name="x", signal="truth.rate", below=1, target=[5.0], statistic="final")
    refuse_unknown([check], TOPICS)
    last = RATE[-1] - 5.0
    assert judge(Recording(ERROR, RATE), [check])[0].measured == pytest.approx(np.linalg.norm(last))


@pytest.mark.parametrize(
    ("signal", "part"), [("truth.m", (0, 6)), ("truth.m[4]", (4, 5)), ("truth.m[2:6]", (2, 6))]
)
def test_a_matrix_is_its_numbers_row_by_row(signal: str, part: tuple[int, int]) -> None:
    topics = {"/truth": {"m": (2, 3), "n": ()}}
    assert find_signal(topics, signal) == ("/truth", "m", slice(*part))
    assert find_signal(topics, "truth.n") == ("/truth", "n", slice(0, 1))
    for wrong in ("truth.m[6]", "truth.m[3:3]", "truth.m[2:7]"):
        with pytest.raises(ValueError, match="6 components"):
            find_signal(topics, wrong)


def test_a_topic_has_each_of_its_fields_once() -> None:
    fields = [("/truth", "rate"), ("/law", "e"), ("/truth", "rate"), ("/truth", "attitude")]
    assert by_topic(fields) == {"/truth": ["rate", "attitude"], "/law": ["e"]}


@pytest.mark.parametrize("statistic", ["mean", "rms"])
def test_a_statistic_is_the_same_bits_however_the_flight_is_cut(statistic: str) -> None:
    """A campaign's table must not depend on the wall time by which blocks end."""
    values = np.random.default_rng(5).normal(size=(1000, 1))
    found = set()
    for parts in (1, 2, 7, 300):
        gathered = Statistic(Check(name="x", signal="truth.error", below=1.0, statistic=statistic))
        for part in np.array_split(values, parts):
            gathered.add(part)
        found.add(gathered.value())
    assert len(found) == 1
    expected = values.mean() if statistic == "mean" else np.sqrt(np.mean(values**2))
    assert found.pop() == pytest.approx(expected, rel=1e-12)
