"""What a whole flight comes to: exit status, JSON, table and log agree on it."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from mjspace.cli import main
from mjspace.errors import InputError
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.runner.replay import replay
from mjspace.runner.run import run
from mjspace.scenario.loading import load, to_toml

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
"""
FAST = '[[checks]]\nname = "fast"\nsignal = "truth.rate"\nabove = {above}\n'
FAILS = 'expected = "FAIL"\nbecause = "0.44 rad/s is slow"\n'
LATER = '[[checks]]\nname = "later"\nsignal = "truth.rate"\nsince = "at rest"\nbelow = 1\n'

CASES = {
    "all is met": ("", True, {"turns": "PASS"}),
    "one is missed": (FAST.format(above=0.5), False, {"turns": "PASS", "fast": "FAIL"}),
    "the expected one is missed": (
        FAST.format(above=0.5) + FAILS,
        True,
        {"turns": "PASS", "fast": "FAIL"},
    ),
    "the expected one is met": (
        FAST.format(above=0.3) + FAILS,
        False,
        {"turns": "PASS", "fast": "PASS"},
    ),
    "nothing to measure": (LATER, False, {"turns": "PASS", "later": "not measured"}),
    "nothing to measure, expected to fail": (
        LATER + FAILS,
        False,
        {"turns": "PASS", "later": "not measured"},
    ),
}


def mjspace(*arguments: str | Path, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "argv", ["mjspace", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


@pytest.mark.parametrize("case", CASES)
def test_a_flight_passes_if_every_check_comes_out_as_expected(
    case: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    more, passed, outcomes = CASES[case]
    (tmp_path / "x.toml").write_text(SCENARIO + more)
    status = mjspace(
        "run", tmp_path / "x.toml", "--out", tmp_path, "--json", monkeypatch=monkeypatch
    )
    assert status == (0 if passed else 1)
    found = json.loads(capsys.readouterr().out)
    assert found["passed"] is passed
    assert {check["name"]: check["verdict"] for check in found["checks"]} == outcomes
    assert all(check["as_expected"] for check in found["checks"]) is passed

    lines = [event for event in Log(tmp_path / "flight.mcap").events() if "turns" in event.message]
    assert [event.level for event in lines] == ["INFO"]
    levels = {event.level for event in Log(tmp_path / "flight.mcap").events()}
    assert ("ERROR" in levels) is not passed

    again = replay(tmp_path / "flight.mcap", tmp_path / "again")
    assert again.passed is passed
    assert [verdict.outcome for verdict in again.verdicts] == list(outcomes.values())


def test_the_table_says_what_was_expected_and_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.toml").write_text(SCENARIO + FAST.format(above=0.5) + FAILS + LATER)
    assert mjspace("run", tmp_path / "x.toml", "--out", tmp_path, monkeypatch=monkeypatch) == 1
    shown = " ".join(capsys.readouterr().out.split())
    assert "fast 0.4387 > 0.5 FAIL as expected" in shown
    assert "later - < 1 not measured" in shown
    assert "as expected: 0.44 rad/s is slow" in shown
    assert "not measured later: event 'at rest' never happened" in shown


def test_the_requirement_that_a_check_verifies_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    named = FAST.format(above=0.4) + 'requirement = "ADCS-012"\n'
    for out, words, has in (("a", SCENARIO + named, True), ("b", SCENARIO, False)):
        (tmp_path / "x.toml").write_text(words)
        run_it = ("run", tmp_path / "x.toml", "--out", tmp_path / out)
        assert mjspace(*run_it, monkeypatch=monkeypatch) == 0
        shown = " ".join(capsys.readouterr().out.split())
        assert shown.startswith("requirement check" if has else "check measured")
        assert ("ADCS-012 fast 0.4387 > 0.4 PASS" in shown) is has
    assert scenario_of(Log(tmp_path / "a" / "flight.mcap")).checks[1].requirement == "ADCS-012"


def test_a_flight_that_ends_early_fails_whatever_its_checks(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    failing_law: Callable[..., Path],
) -> None:
    scenario = failing_law(0.0205, before=SCENARIO + FAST.format(above=0.5) + FAILS)
    status = mjspace("run", scenario, "--out", tmp_path, "--json", monkeypatch=monkeypatch)
    found = json.loads(capsys.readouterr().out)
    assert all(check["as_expected"] for check in found["checks"])
    assert "no way on" in found["trouble"]
    assert found["passed"] is False
    assert status == 1
    again = ("run", scenario, "--out", tmp_path, "--force")
    assert mjspace(*again, monkeypatch=monkeypatch) == 1
    assert "ended early" in capsys.readouterr().out


def test_a_scenario_names_the_checks_that_fail(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text('verdict = "FAIL"' + SCENARIO)
    with pytest.raises(InputError, match=r'x\.toml: verdict: .* expected = "FAIL" and because'):
        load(tmp_path / "x.toml")


@pytest.mark.parametrize("verdict", ["PASS", "FAIL"])
def test_a_log_from_before_that_is_read(verdict: str, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(SCENARIO)
    scenario, _ = load(tmp_path / "x.toml")

    class Old(Log):
        path = tmp_path / "old.mcap"

        def __init__(self) -> None:
            pass

        def attachment(self, name: str) -> bytes:
            assert name == "scenario.toml"
            return (f'verdict = "{verdict}"\n' + to_toml(scenario)).encode()

    assert scenario_of(Old()) == scenario


def test_a_flight_without_checks_passes(tmp_path: Path) -> None:
    assert run("detumble-wheels", overrides=["duration=0.01", "checks=[]"], out=tmp_path).passed
