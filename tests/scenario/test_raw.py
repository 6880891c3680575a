"""TOML from outside that no scenario can hold: one line, whatever it is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

HEAD = 'base = "detumble-wheels"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = " + 2000 * "[" + 2000 * "]", "tables and lists are nested too deeply"),
        ("[" + ".".join(2000 * ["a"]) + "]\nb = 1", r"a\.a\..*: tables and lists are nested too"),
        ("seed = " + "9" * 5000, "a number has too many digits"),
        ("seed = " + "9" * 30, "seed: a whole number of more than 64 bits"),
        ('description = "a\\u001b[31m"', r"description: got 'a\\\\x1b\[31m': control characters"),
        ('[sensors."a\\u0007"]\nmeasures = "rate"', r"sensors: control characters in the key 'a"),
        ('description = "\\u202eabc"', "description: got .*: control characters"),
    ],
)
def test_what_no_scenario_can_hold_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "x.toml"
    path.write_text(HEAD + text)
    with pytest.raises(InputError, match=rf"x\.toml: .*{message}") as refused:
        load(path)
    assert len(str(refused.value)) < 600


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("law.x=" + 2000 * "[" + 2000 * "]", "nested too deeply"),
        (".".join(2000 * ["a"]) + "=1", "the key has too many parts"),
        ("seed=" + "9" * 5000, "too many digits"),
        ("description=a\x1b[31m", "control characters"),
        ("name=../x", "name: got '../x', should be a name that a folder can have"),
        ("name=/x", "name: got '/x', should be a name"),
        ("name='a\\b'", "should be a name"),
        ("duration=1e10", "duration: got 1.*, should be less than or equal to 9000000000"),
        ("duration=9e9", r"duration: 9000000000 s is more than 1e\+10 times rates\.control"),
        ("rates.physics=1e-10", r"rates\.physics: got 1e-10 s, should be greater"),
        ("law.rate_gain=1e-200", "got 1e-200: its size is not from 1e-100 to 1e100"),
        ("plant.mass=1e200", r"got 1e\+200: its size is not from 1e-100 to 1e100"),
    ],
)
def test_what_no_key_can_be_set_to_is_refused(override: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load("detumble-wheels", [override])


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("plant.model=../satellite_3rw/x", r"plant\.model: no model '\.\./satellite_3rw/x': have"),
        ("plant.model=/etc", "plant.model: no model '/etc': have"),
        ("plant.ground={part='../x'}", r"plant\.ground\.part: no part '\.\./x': have"),
        ("sensors.rate={measures='rate',delay=1000}", "200000 times rates.control: at most 10000"),
    ],
)
def test_what_no_vehicle_can_have_is_refused(override: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        assemble(*load("detumble-wheels", [override]))


def test_a_long_value_is_shortened_in_the_message() -> None:
    with pytest.raises(InputError, match=r"duration: .* \.\.\. ") as refused:
        load("detumble-wheels", ["duration=[" + "1," * 5000 + "]"])
    assert len(str(refused.value).partition("duration: ")[2]) < 1000


def test_a_chain_of_bases_has_an_end(tmp_path: Path) -> None:
    for number in range(100):
        (tmp_path / f"{number}.toml").write_text(f'base = "{number + 1}.toml"\n')
    (tmp_path / "100.toml").write_text(HEAD)
    with pytest.raises(InputError, match="more than 20 files are based on each other"):
        load(tmp_path / "0.toml")
    assert load(tmp_path / "90.toml")[0].name == "90"


def test_a_scenario_is_read_as_utf_8_whatever_the_locale(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes((HEAD + 'description = "45° Körper"\n').encode())
    ascii_alone = {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    command = [sys.executable, "-m", "mjspace", "info", str(path)]
    shown = subprocess.run(command, env=os.environ | ascii_alone, capture_output=True, text=True)
    assert shown.returncode == 0, shown.stderr
    assert r"45\xb0 K\xf6rper" in shown.stdout
