"""Verdicts read back from a log: those of the flight, or none where it was killed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.contract import Event
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.runner.logged_verdicts import NO_VERDICT, judged
from mjspace.runner.run import run

SCENARIO = """
base = "detumble-wheels"
duration = 0.05

[[events]]
name = "at rest"
signal = "truth.rate"
below = 1e-3

[[checks]]
name = "turns"
signal = "truth.rate"
above = 0.4

[[checks]]
name = "turns: PASS"
signal = "truth.rate"
statistic = "final"
above = 0.5
expected = "FAIL"
because = "it is slower"

[[checks]]
name = "turns"
signal = "truth.rate"
since = "at rest"
below = 1
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("flown")
    (folder / "x.toml").write_text(SCENARIO)
    return run(folder / "x.toml", out=folder)


class Told(Log):
    """A log with other events."""

    told: list[Event]

    def events(self) -> list[Event]:
        return self.told


def told(path: Path, *lines: str) -> Told:
    """Return the log with these last lines in place of its verdicts', none where there are none."""
    log = Told(path)
    events = Log(path).events()
    new = [events[-3]._replace(message=line) for line in lines]
    log.told = [*events[:-3], *new, *(events[len(lines) - 3 :] if lines else [])]
    return log


def test_they_are_those_of_the_flight(flown: Any) -> None:
    found = judged(flown.log, scenario_of(flown.log))
    assert [v.outcome for v in found.verdicts] == ["PASS", "FAIL", "not measured"]
    for logged, right in zip(found.verdicts, flown.verdicts, strict=True):
        assert logged.check == right.check
        np.testing.assert_allclose(logged.measured, right.measured, rtol=5e-6)  # six digits
        assert logged.missing == right.missing
        assert logged.line == right.line
    assert found.passed is flown.passed is False  # one was not measured
    assert not found.trouble
    assert found.events == Log(flown.path).events()[:-3]


def test_six_digits_of_a_bound_are_on_the_side_that_was_judged(flown: Any) -> None:
    for word, right in (("PASS", True), ("FAIL", False)):
        line = f"{word} turns: 0.4 (required > 0.4)"
        log = told(flown.path, line)
        assert judged(log, scenario_of(flown.log)).verdicts[0].as_expected is right


def test_a_number_outside_of_its_bound_fails_whatever_the_log_says(flown: Any) -> None:
    line = "PASS turns: 0.1 (required > 0.4)"
    log = told(flown.path, line)
    assert judged(log, scenario_of(flown.log)).verdicts[0].outcome == "FAIL"


@pytest.mark.parametrize("line", ["turns", "PASS turns: x (required > 0.4)", "PASS turns: "])
def test_what_is_no_verdict_leaves_nothing_judged(flown: Any, line: str) -> None:
    log = told(flown.path, line)
    found = judged(log, scenario_of(flown.log))
    assert [v.missing for v in found.verdicts] == [NO_VERDICT] * 3
    assert not found.passed
    assert len(found.events) == len(log.told)


def test_a_flight_that_was_killed_says_where_its_log_ends(flown: Any) -> None:
    log = told(flown.path)
    longer = scenario_of(flown.log).model_copy(update={"duration": 80.0})
    found = judged(log, longer)
    assert found.trouble == "the log ends at 0.05 s of 80 s"
    assert not found.passed


def test_a_flight_that_ended_early_says_why(failing_law: Callable[..., Path]) -> None:
    scenario = failing_law(0.0205, before=SCENARIO)
    result = run(scenario, out=scenario.parent / "early", trust=True)
    found = judged(result.log, scenario_of(result.log))
    assert found.trouble == result.trouble
    assert [v.line for v in found.verdicts] == [v.line for v in result.verdicts]
