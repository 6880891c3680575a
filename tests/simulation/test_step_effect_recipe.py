"""The recipe of docs/extending.md for a step effect: its file and its line, followed and flown."""

import importlib.util
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.simulation import effects

PAGE = Path(__file__).parents[2] / "docs/extending.md"
MODULE = "mjspace.simulation.outgassing"


def module(name: str, path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    sys.modules[name] = found
    spec.loader.exec_module(found)
    return found


@pytest.fixture
def recipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Add the recipe's file, and its line to the list of effects; return the file's module."""
    section = PAGE.read_text().partition("## A step effect\n")[2].partition("\n## ")[0]
    file, line = re.findall(r"^```(?:python|text)[^\n]*\n(.*?)^```$", section, re.M | re.S)
    monkeypatch.setitem(sys.modules, MODULE, None)  # restored after the test
    (tmp_path / "outgassing.py").write_text(file)
    found = module(MODULE, tmp_path / "outgassing.py")
    source = Path(str(effects.__file__)).read_text()
    last = "    )\n    return tuple("
    assert source.count(last) == 1
    source = source.replace(last, line + last)
    (tmp_path / "effects.py").write_text(f"{source}\nfrom {MODULE} import Outgassing\n")
    with_line = module("effects_with_outgassing", tmp_path / "effects.py")
    for place in ("stepper", "initial_state"):
        monkeypatch.setattr(f"mjspace.simulation.{place}.effects_of", with_line.effects_of)
    return found


def test_the_recipe_of_a_step_effect(recipe: Any, tmp_path: Path) -> None:
    settings = ["duration=16", "checks=[]", "rates.physics=0.05", "rates.control=0.1"]
    rest = ["initial={}", "reference={kind='references:Hold'}", "law={kind='coast:Coast'}"]
    orbit = "environment.orbit.semi_major_axis='7000 km'"
    flown = run("detumble-wheels", overrides=[*settings, *rest, orbit], out=tmp_path / "orbit")
    left = flown.log.read("/state")["actuator_gas_left"][:, 0]
    time = flown.log.read("/truth")["time"]
    np.testing.assert_allclose(left, np.exp(-time / recipe.DECAY), rtol=1e-10)
    force = flown.log.read("/disturbance")["force"][:, 0]
    np.testing.assert_allclose(force, 1e-4 * left, atol=3e-8)  # and the tidal force: 2e-8 N
    (event,) = (event for event in flown.log.events() if "gas" in event.message)
    assert event.time == pytest.approx(recipe.DECAY * np.log(2.0), abs=0.06)
    assert verify(flown.path, start=7.0) is None
    free = run("detumble-wheels", overrides=[*settings, *rest], out=tmp_path / "free")
    assert "actuator_gas_left" not in free.log.read("/state")
