"""Flying several scenarios at once, into one table."""

from pathlib import Path

import pytest

from mjspace import every
from mjspace.every import Outcome

RIGHT = {"passed": True, "trouble": "", "log": "x", "checks": [{"name": "a", "passed": True}]}
WRONG = RIGHT | {"passed": False, "checks": [{"name": "too fast", "passed": False}]}


def outcome(name: str, wanted: str, result: dict[str, object]) -> Outcome:
    return Outcome(name, "shows something", wanted, result, 1.25)


def test_a_failure_that_is_meant_is_right(capsys: pytest.CaptureFixture[str]) -> None:
    all_of_them = [
        outcome("good", "PASS", RIGHT),
        outcome("bad", "PASS", WRONG),
        outcome("crash", "FAIL", WRONG),
        outcome("spared", "FAIL", RIGHT),
    ]
    assert [one.is_right for one in all_of_them] == [True, False, True, False]
    every.show(all_of_them)
    lines = capsys.readouterr().out.splitlines()
    assert "FAIL as it should" in next(line for line in lines if line.startswith("crash"))
    assert "bad: too fast" in lines
    rows = every.data(all_of_them)
    assert rows[1] == {"scenario": "bad", "verdict": "FAIL", "wanted": "PASS", "seconds": 1.25} | {
        "description": "shows something",
        **WRONG,
    }


def test_each_is_flown_as_alone_and_they_come_in_order(tmp_path: Path) -> None:
    names = ["pd-plus-modified", "pd-plus"]
    told: list[float] = []
    short = ["duration=0.05", 'checks=[{name="x", signal="truth.rate", below=9.0}]']
    found = every.fly(names, short, tmp_path, told.append)
    assert [one.name for one in found] == names
    assert all(one.verdict == "PASS" for one in found)
    assert told[-1] == pytest.approx(1.0)
    assert [(tmp_path / name / "flight.mcap").is_file() for name in names] == [True, True]
