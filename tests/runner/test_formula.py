"""Checks of temporal logic: robustness by hand and against rtamt's own, and what is refused."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_lines import command_line
from one_axis import ONE_AXIS, written

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.runner.checks import Judge, margin
from mjspace.runner.formula import Monitor, parsed, robustness
from mjspace.runner.run import run
from mjspace.scenario.loading import load, to_toml
from mjspace.scenario.scenario import Check

rtamt = pytest.importorskip("rtamt")  # which has no wheel for Python 3.13

SIGNALS = {"dark": "truth.dark", "error": "truth.error"}
TOPICS = {"/truth": {"dark": (), "error": ()}}
DARK = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0])
ERROR = np.array([0.2, 0.2, 4.0, 3.0, 1.5, 0.5, 0.5, 3.0, 2.5, 0.5])


def measured(text: str, *, blocks: tuple[int, ...] = (10,), **keys: Any) -> Any:
    """Return the verdict on the samples above, one a second, handed over in blocks."""
    check = Check(name="x", formula=text, signals=SIGNALS, **keys)
    judge = Judge([check], [], TOPICS, period=1.0)
    start = 0
    for size in blocks:
        part = slice(start, start + size)
        rows = {"/truth": {"dark": DARK[part], "error": ERROR[part]}}
        judge.add(np.arange(10.0)[part], rows)
        start += size
    (found,) = judge.verdicts()
    return found


@pytest.mark.parametrize("blocks", [(10,), (1, 4, 5), (3, 7), (1,) * 10])
@pytest.mark.parametrize(
    ("text", "value"),
    [
        # The least of (2 - error) / 2: of 4.
        ("always(error < 2)", -1.0),
        # From 2 s on, (2 - 1.5) / 2 after two seconds, or 0.75 after three: those from 7 s on are
        # not judged, because the flight ends before.
        ("always(rise(dark) -> eventually[0:2 s](error < 2))", 0.25),
        ("always(rise(dark) -> eventually[0:3 s](error < 2))", 0.75),
        ("always(rise(dark) -> eventually[0:1 s](error < 2))", -0.5),
        # From the first sample alone.
        ("eventually[0:3 s](error > 3)", 1.0 / 3.0),
        ("always[0:4000 ms](error < 5)", 0.2),
        ("not dark", 1.0),
        ("always(dark -> once[0:2 s](error > 2.5))", 0.2),
        ("always(fall(dark) -> error < 3)", 1.0 / 6.0),
    ],
)
def test_robustness_is_that_by_hand_however_the_flight_is_cut(
    text: str, value: float, blocks: tuple[int, ...]
) -> None:
    found = measured(text, blocks=blocks)
    assert found.measured == pytest.approx(value, abs=1e-12)
    assert found.outcome == ("PASS" if value > 0.0 else "FAIL")
    assert margin(found.check, found.measured) == found.measured


def test_a_window_and_a_flight_that_is_too_short() -> None:
    assert measured("always(error < 2)", start=4.0, end=6.0).measured == pytest.approx(0.25)
    short = measured("always(eventually[0:12 s](error < 2))")
    assert short.outcome == "not measured"
    assert "ends before what the formula looks ahead" in short.missing
    # It is dark from the first sample on, before which nothing is known: that is no entry.
    assert measured("always(rise(dark) -> error > 3.5)", start=3.0, end=6.0).measured == 1.0


@pytest.mark.parametrize(
    "text",
    [
        "always[0:7](a) -> b",
        "eventually[2:9](a and not b)",
        "(a or b) xor always[1:4](b)",
        "always[3:3](a) iff eventually[0:5](b)",
        "historically[0:6](a) or once[1:3](b)",
        "always[0:4](rise(a) -> eventually[0:3](fall(b) or b))",
    ],
)
def test_robustness_is_rtamts(text: str) -> None:
    a, b = values = np.random.default_rng(5).normal(size=(2, 200))
    formula = parsed(text, {"a": "x", "b": "y"}, 1.0)
    order = [0 if atom.name == "a" else 1 for atom in formula.atoms]
    own = robustness(formula.root, values[order])
    theirs = rtamt.StlDiscreteTimeOfflineSpecification()
    for name in "ab":
        theirs.declare_var(name, "float")
    spaced = text.replace("(", "( ").replace(")", " )").split(" ")
    theirs.spec = " ".join(f"({word} >= 0)" if word in ("a", "b") else word for word in spaced)
    theirs.parse()
    found = theirs.evaluate({"time": list(range(200)), "a": a.tolist(), "b": b.tolist()})
    # rtamt cuts windows at the flight's end, where this judges nothing.
    whole = slice(formula.before, 200 - formula.after)
    assert own[whole] == pytest.approx(np.array(found)[whole, 1], abs=1e-12)


def test_memory_is_that_of_the_formulas_window() -> None:
    monitor = Monitor(parsed("always(a -> eventually[0:2 s](b))", {"a": "x", "b": "y"}, 0.1))
    largest = 0
    for _ in range(200):
        monitor.add({"a": np.ones(100), "b": np.ones(100)})
        largest = max(largest, monitor._atoms.size)
    assert largest <= 2 * (1000 + 100 + 20)
    assert monitor.value() == 1.0
    assert monitor.count == 20000 - 20


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("always(eror < 1)", "no 'eror' among signals: did you mean 'error'"),
        ("error < 1 and", "mismatched input"),
        ("always(eventually(error < 1))", r"give it a time, as in \[0:60 s\]"),
        ("error until[0:2 s] dark", "cannot be judged as it flies"),
        ("eventually[0:1 m](error < 1)", "'1 m' is no time"),
        ("eventually[0.1:0.4 s](error < 1)", "no sample is in it, they are 1 s apart"),
    ],
)
def test_what_is_no_formula_is_refused(text: str, line: str) -> None:
    with pytest.raises(ValueError, match=line):
        parsed(text, SIGNALS, 1.0)


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"formula": "always(a < 1)"}, "signals: missing"),
        ({"formula": "always(a < 1)", "signals": {"a": "b.c"}, "below": 1.0}, "below: goes with a"),
        ({"formula": "a", "signals": {"a": "b.c"}, "statistic": "rms"}, "statistic: goes with a"),
        ({"signal": "b.c", "below": 1.0, "signals": {"a": "b.c"}}, "signals: go with a formula"),
    ],
)
def test_a_check_is_of_a_signal_or_of_a_formula(keys: dict[str, Any], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        Check(name="x", **keys)


SETTLES = """
[[checks]]
name = "settles"
formula = "always(fast -> eventually[0:1 s](rate < 0.3 deg/s))"
signals = { fast = "truth.rate", rate = "truth.rate" }
""".replace("fast ->", "fast > 0.5 deg/s ->")
FLIGHT = ONE_AXIS.replace("checks = []", "") + SETTLES


def test_a_flight_is_judged_and_its_log_keeps_the_formula(tmp_path: Path) -> None:
    flown = run(written(tmp_path, FLIGHT), out=tmp_path / "run")
    (verdict,) = flown.verdicts
    # From 0.573 deg/s, a second later 0.7^2 of it is left: 0.2807 deg/s.
    right = 1.0 - 0.49 * math.degrees(0.01) / 0.3
    assert verdict.measured == pytest.approx(right, rel=1e-9)
    scenario, _ = load(written(tmp_path, FLIGHT))
    assert 'formula = "always(fast > 0.5' in to_toml(scenario)
    assert "formula" not in to_toml(load(written(tmp_path))[0])


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("rate < 0.3 deg/s", "rate < 0.3 deg", "got 0.00523599 rad for rate, should be in rad/s"),
        ('rate = "truth.rate"', 'rate = "truth.rat"', "no signal 'truth.rat'"),
        ("[0:1 s]", "[0:0.2 s]", None),
        ("[0:1 s]", "[0.1:0.2 s]", "no sample is in it, they are 0.5 s apart"),
    ],
)
def test_a_formula_that_does_not_fit_the_flight_is_refused(
    tmp_path: Path, old: str, new: str, line: str | None
) -> None:
    path = written(tmp_path, FLIGHT.replace(old, new))
    if line is None:
        assert not run(path, out=tmp_path / "run").passed
        return
    with pytest.raises(InputError, match=rf"checks.0.formula: .*{line}"):
        run(path, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_without_rtamt_one_line_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rtamt", None)
    assert command_line("run", written(tmp_path, FLIGHT), "--out", str(tmp_path / "run")) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "pip install 'mjspace[logic]'" in error


@pytest.mark.parametrize("text", ["always(a < 1)", "always(eventually[0:1 s](a < 1))"])
def test_a_value_that_is_no_number_is_not_passed_over(text: str) -> None:
    monitor = Monitor(parsed(text, {"a": "x"}, 1.0))
    values: Array = np.array([0.0, np.nan, 0.5])
    monitor.add({"a": values})
    monitor.add({"a": np.zeros(3)})
    assert math.isnan(monitor.value())
