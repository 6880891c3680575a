"""A law in a file of one's own, with modules and data files beside it; and its log, replayed."""

import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from mjspace.contract import Measurement
from mjspace.log.reader import Log
from mjspace.runner.logged_assembly import assembly_of
from mjspace.runner.replay import replay, start_of, verify
from mjspace.runner.run import run
from mjspace.scenario.trust import Trust
from mjspace.scenario.user_files import beside, load_file

LAW = """
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
import numpy as np
from mjspace.contract import TorqueCommand
import helpers
from tools import scale

DATA_FILES = ("gain.csv",)

class Signals(NamedTuple):
    torque: np.ndarray

@dataclass(frozen=True)
class Damper:
    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        gain = float((Path(__file__).parent / "gain.csv").read_text())
        torque = scale.twice(helpers.torque(gain, measurement.rate))
        return None, TorqueCommand(torque), Signals(torque)
"""
SCENARIO = """
description = "a law of several files"
duration = "0.1 s"
[rates]
control = "10 ms"
[initial]
rate = [0.1, 0, 0]
[reference]
kind = "references:Hold"
[law]
kind = "damper.py:Damper"
[plant]
bus_inertia = [[10, 0, 0], [0, 10, 0], [0, 0, 10]]
"""


def write(folder: Path, sign: str = "-") -> Path:
    (folder / "tools").mkdir(parents=True)
    (folder / "damper.py").write_text(LAW)
    (folder / "helpers.py").write_text(f"def torque(gain, rate):\n    return {sign}gain * rate\n")
    (folder / "tools/__init__.py").write_text("")
    (folder / "tools/scale.py").write_text(
        "from .factor import FACTOR\n\ndef twice(x):\n    return FACTOR * x\n"
    )
    (folder / "tools/factor.py").write_text("FACTOR = 2.0\n")
    (folder / "gain.csv").write_text("0.5\n")
    (folder / "unused.py").write_text("raise RuntimeError\n")
    (folder / "flight.toml").write_text(SCENARIO)
    return folder / "flight.toml"


def test_a_log_of_a_law_of_several_files_is_flown_again_without_them(tmp_path: Path) -> None:
    scenario = write(tmp_path / "mine")
    path = run(str(scenario), out=tmp_path / "out").path
    log = Log(path)
    assert log.read("/command")["torque"][0] == pytest.approx([-0.1, 0, 0])
    for file in sorted((tmp_path / "mine").rglob("*.*"), reverse=True):
        file.unlink()
    assert {n for n in log.attachments if n.startswith("law/")} == {
        *("law/damper.py", "law/helpers.py", "law/gain.csv"),
        *("law/tools/__init__.py", "law/tools/scale.py", "law/tools/factor.py"),
    }
    with path.open("rb") as stream:
        types = {a.name: a.media_type for a in make_reader(stream).iter_attachments()}
    assert types["law/helpers.py"] == "text/x-python"
    assert types["law/gain.csv"] == "application/octet-stream"
    assert verify(path, trust=True) is None
    with assembly_of(log, trust=True) as built:  # not reset again where it has no state
        assert start_of(log, built, 0.05).law == ()
    again = replay(
        path, tmp_path / "again", trust=True
    ).path  # whose log can be flown again as well
    assert verify(again, trust=True) is None


def test_two_folders_do_not_answer_for_one_another(tmp_path: Path) -> None:
    before = set(sys.modules), list(sys.path)
    for name, sign in (("a", -1.0), ("b", 1.0)):
        write(tmp_path / name, "+" if sign > 0.0 else "-")
        damper = Trust(tmp_path / name).load("damper.py:Damper")
        seen = Measurement(
            attitude=np.zeros(4), rate=np.array([0.1, 0.0, 0.0]), wheel_speed=np.zeros(3)
        )
        _, command, _ = damper().step(None, 0.0, seen, None)
        assert command.torque[0] == pytest.approx(sign * 0.1)
    assert sys.path == before[1]
    new = {name.partition(".")[0] for name in set(sys.modules) - before[0]}
    assert not new & {"helpers", "tools", "damper"}


def test_a_change_beside_a_law_counts(tmp_path: Path) -> None:
    write(tmp_path / "mine")
    file = tmp_path / "mine/damper.py"
    one = load_file(file)
    assert load_file(file) is one
    (tmp_path / "mine/tools/factor.py").write_text("FACTOR = 3.5\n")
    assert load_file(file).scale.twice(1.0) == 3.5
    assert one.scale.twice(1.0) == 2.0


def test_what_is_installed_wins_over_a_file_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text("import random\nimport numpy\n")
    for name in ("random.py", "numpy.py"):
        (tmp_path / name).write_text("raise RuntimeError")
    assert beside(tmp_path / "law.py") == {}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('DATA_FILES = ("gone.csv",)', r"law\.py: DATA_FILES: no file 'gone\.csv' in its folder"),
        ('DATA_FILES = ("../law.py",)', r"DATA_FILES: no file '\.\./law\.py' in its folder"),
        ("DATA_FILES = sorted('ab')", r"DATA_FILES: write it out"),
        ("import helper", r"law\.py cannot be imported: ModuleNotFoundError: .*'helper'"),
        ("from . import helper", r"law\.py cannot be imported: ImportError"),
        ("def f(:", r"law\.py cannot be imported: SyntaxError"),
    ],
)
def test_what_is_missing_is_said(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "law.py").write_text(text + "\n")
    with pytest.raises(ValueError, match=message):
        load_file(tmp_path / "law.py")
