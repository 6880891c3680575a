"""Flying several scenarios at once, into one table."""

from pathlib import Path

import pytest

from mjspace.runner import run_all
from mjspace.runner.run_all import Outcome

MET = {"name": "slow enough", "verdict": "PASS", "expected": "PASS", "as_expected": True}
MISSED = {"name": "close enough", "verdict": "FAIL", "expected": "PASS", "as_expected": False}
SHOWN = {"name": "too fast", "verdict": "FAIL", "expected": "FAIL", "as_expected": True}
BLIND = {"name": "later", "verdict": "not measured", "expected": "FAIL", "as_expected": False}


def outcome(name: str, *checks: dict[str, object], trouble: str = "") -> Outcome:
    passed = not trouble and all(check["as_expected"] for check in checks)
    result = {"passed": passed, "trouble": trouble, "log": "x", "checks": list(checks)}
    return Outcome(name, "shows something", result, 1.25)


def test_a_failure_that_is_expected_is_shown_and_passes(capsys: pytest.CaptureFixture[str]) -> None:
    all_of_them = [
        outcome("good", MET),
        outcome("bad", MET, MISSED),
        outcome("crash", MET, SHOWN),
        outcome("blind", SHOWN, BLIND),
        outcome("broken", MET, trouble="the law raised"),
    ]
    assert [one.verdict for one in all_of_them] == ["PASS", "FAIL", "PASS", "FAIL", "FAIL"]
    run_all.show(all_of_them)
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if line.startswith("crash"))
    assert row.split()[1:6] == ["PASS", "2/2,", "1", "FAIL", "as"]
    assert "bad: close enough: FAIL" in lines
    assert "blind: later: not measured" in lines
    assert "broken: the law raised" in lines
    assert run_all.data(all_of_them)[1] == {
        "scenario": "bad",
        "description": "shows something",
        "verdict": "FAIL",
        "seconds": 1.25,
        **all_of_them[1].result,
    }


def test_each_is_flown_as_alone_and_they_come_in_order(tmp_path: Path) -> None:
    names = ["pd-plus-modified", "pd-plus"]
    told: list[float] = []
    short = ["duration=0.05", 'checks=[{name="x", signal="truth.rate", below=9.0}]']
    found, ended_by = run_all.fly(names, short, tmp_path, told.append)
    assert ended_by == 0
    assert [one.name for one in found] == names
    assert all(one.verdict == "PASS" for one in found)
    assert told[-1] == pytest.approx(1.0)
    assert [(tmp_path / name / "flight.mcap").is_file() for name in names] == [True, True]
