"""Damaged, foreign and hostile logs: one line, status 2, and nothing poisoned is identical."""

import warnings
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import log_attack
import logs
import pytest
from outcomes import Commands

import mjspace


@pytest.fixture(autouse=True)
def _no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """A renderer that other tests have used in this process hangs in a fork of it."""
    monkeypatch.setattr(log_attack, "OTHERS", ("json", "replay"))


@pytest.fixture
def commands() -> Iterator[Commands]:
    with Commands() as found:
        yield found


@pytest.fixture(scope="module")
def bases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("bases")
    with warnings.catch_warnings(action="ignore"):
        flown = {
            name: mjspace.run(name, overrides=overrides, out=folder / name).path
            for name, overrides in logs.BASES.items()
        }
    for path in flown.values():
        assert mjspace.verify(path) is None  # what is compiled for it is then shared by the forks
    return flown


def test_no_damage_to_a_log_is_a_traceback(
    bases: dict[str, Path], tmp_path: Path, commands: Commands
) -> None:
    for case in islice(logs.cases(bases, 0), 6):
        folder = tmp_path / case.name
        folder.mkdir()
        assert not list(log_attack.attack(case, folder, commands, every=False)), case.name


def test_what_is_changed_is_repaired_but_for_the_change(
    bases: dict[str, Path], tmp_path: Path, commands: Commands
) -> None:
    """So that what reads a log meets the change, and not a checksum before it."""
    for name, path in bases.items():
        anew = logs.parts.joined(logs.parts.parts_of(path, 5))
        case = logs.Case(name, anew)
        (tmp_path / name).mkdir()
        assert not list(log_attack.attack(case, tmp_path / name, commands, every=False))
        (tmp_path / f"{name}.mcap").write_bytes(anew)
        assert mjspace.verify(tmp_path / f"{name}.mcap") is None
