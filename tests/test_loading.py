"""Scenario files: what is accepted, and the one line that says what is wrong."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from mjspace.errors import InputError
from mjspace.loading import component, load, scenario_names, to_toml, validate

MINIMAL = """
description = "nothing much"
duration = "2 s"
[reference]
kind = "references:Hold"
[law]
kind = "contraction:Ideal"
"""


@pytest.fixture
def minimal(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(MINIMAL)
    return path


def refusal(path: Path, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        load(path, overrides)
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_is_valid_and_says_what_it_shows(name: str) -> None:
    scenario, _ = load(name)
    assert scenario.name == name
    assert scenario.description
    assert scenario.checks


def test_defaults_and_units(minimal: Path) -> None:
    scenario, folder = load(
        minimal, ["initial.rate=['1 deg/s', 0.5, '60 rpm']", "rates.control='20 ms'"]
    )
    assert folder == minimal.parent
    assert scenario.name == "mine"
    np.testing.assert_allclose(scenario.initial.rate, [np.pi / 180, 0.5, 2 * np.pi])
    assert scenario.rates.control == 0.02


def test_written_out_and_read_back_is_the_same(minimal: Path) -> None:
    scenario, _ = load(minimal, ["law.rate_gain=3", "environment.orbit.semi_major_axis='7000 km'"])
    assert validate(tomllib.loads(to_toml(scenario)), "again") == scenario


@pytest.mark.parametrize(
    ("override", "parts"),
    [
        ("plnt.mass=3", ["--set plnt.mass=3", "plnt", "plant"]),
        ("plant.mas=3", ["plant.mas", "did you mean 'mass'"]),
        ("plant.wheels.inertai=3", ["plant.wheels.inertai", "did you mean 'inertia'"]),
        ("plant.mass='3 deg'", ["plant.mass", "'3 deg'", "kg"]),
        ("plant.mass=-1", ["plant.mass", "-1", "greater than 0"]),
        ("plant.mass=nan", ["plant.mass", "finite"]),
        ("initial.rate=[1, 2]", ["initial.rate", "[1, 2]", "3"]),
        ("initial.rate='fast'", ["initial.rate", "'fast'"]),
        ("sensors.rate.noise='0.1 deg'", ["sensors.rate.noise", "deg/s"]),
        ("rates.control='1.5 ms'", ["rates.control", "0.0015", "0.002"]),
        ("rates.integrator=rk4", ["rates.integrator", "rk4", "RK4"]),
        ("plant.gyrostat_inertia=[[1,0,0],[0,1,0],[0,0,-1]]", ["not positive definite"]),
        ("plant.gyrostat_inertia=[[1,0.5,0],[0,1,0],[0,0,1]]", ["not symmetric"]),
        ("initial.attitude=[0,0,0,0]", ["initial.attitude", "norm is 0"]),
        ("duration=0", ["duration", "greater than 0"]),
        ("description", ["--set description", "key=value"]),
        ("duration.x=1", ["--set duration.x=1", "table"]),
    ],
)
def test_what_is_wrong_is_said_with_its_key(minimal: Path, override: str, parts: list[str]) -> None:
    message = refusal(minimal, override)
    for part in parts:
        assert part in message


def test_errors_in_the_file_name_the_file(minimal: Path) -> None:
    minimal.write_text(MINIMAL + "gian = 2\n[plant]\nmass = 'heavy'\n")
    assert str(minimal) in refusal(minimal)
    minimal.write_text("duration = = 2")
    assert "line 1" in refusal(minimal)


def test_two_exclusive_keys(minimal: Path) -> None:
    both = ["initial.attitude=[1,0,0,0]", "initial.euler=[0,0,0]"]
    assert "give one" in refusal(minimal, *both)


def test_a_check_that_cannot_fail_is_refused(minimal: Path) -> None:
    assert "below" in refusal(minimal, "checks=[{name='x', signal='truth.rate'}]")


def test_a_scenario_changes_its_base_key_by_key(minimal: Path) -> None:
    minimal.write_text(
        MINIMAL + "rate_gain = 3\n[initial]\nrate = [1, 2, 3]\nposition = [1, 1, 1]\n"
        "[[checks]]\nname = 'a'\nsignal = 'truth.rate'\nbelow = 1\n"
    )
    upper = minimal.parent / "upper.toml"
    upper.write_text("base = 'mine.toml'\n[initial]\nrate = [0, 0, 7]\n[law]\nattitude_gain = 5")
    top = minimal.parent / "deeper/top.toml"
    top.parent.mkdir()
    top.write_text("base = '../upper.toml'\nchecks = []\n[law]\nrate_gain = 4\n")
    scenario, folder = load(top, ["law.attitude_gain=6"])
    assert (scenario.name, folder) == ("top", top.parent)
    assert scenario.description == "nothing much"
    assert scenario.initial.rate == [0, 0, 7]
    assert scenario.initial.position == [1, 1, 1]
    assert scenario.law.gains == {"rate_gain": 4, "attitude_gain": 6}
    assert scenario.checks == []
    assert load(upper)[0].checks == load(minimal)[0].checks != []
    assert "base" not in tomllib.loads(to_toml(scenario))


def test_a_law_of_another_kind_has_none_of_the_base_s_gains(minimal: Path) -> None:
    minimal.write_text("base = 'contraction-adaptive'\n[law]\nkind = 'contraction:Ideal'\n")
    scenario, _ = load(minimal)
    assert scenario.law.gains == {}
    assert scenario.initial == load("contraction-adaptive")[0].initial


@pytest.mark.parametrize(
    ("base", "parts"),
    [
        ("'contraction-idael'", ["base: no scenario", "did you mean 'contraction-ideal'"]),
        ("'gone.toml'", ["base: no scenario file", "gone.toml"]),
        ("['a', 'b']", ["base: got ['a', 'b']", "a scenario's name or a path"]),
        ("'mine.toml'", ["base: 'mine.toml' is based on this file itself"]),
        ("'other.toml'", ["other.toml: base: './mine.toml' is based on this file itself"]),
    ],
)
def test_a_base_that_will_not_do_is_said(minimal: Path, base: str, parts: list[str]) -> None:
    minimal.write_text(f"base = {base}\n")
    (minimal.parent / "other.toml").write_text("base = './mine.toml'\n")
    message = refusal(minimal)
    assert message.startswith(str(minimal.parent))
    for part in parts:
        assert part in message


def test_unknown_scenario_gives_the_nearest() -> None:
    with pytest.raises(InputError, match="contraction-ideal"):
        load("contraction-idael")
    with pytest.raises(InputError, match=r"no scenario file .*nowhere\.toml"):
        load("nowhere.toml")


def test_component_from_the_command_line() -> None:
    law = component("contraction:Ideal", ["rate_gain=3", "inertia=[[1,0,0],[0,1,0],[0,0,1]]"])
    assert law.gains == {"rate_gain": 3, "inertia": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}
