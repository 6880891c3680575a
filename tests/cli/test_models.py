"""``mjspace inspect`` and ``mjspace new``, as a user calls them."""

import json
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from own_models import SENSED

from mjspace.cli import main


class Said(NamedTuple):
    """What a command ended with and printed."""

    status: int
    out: str
    err: str


Command = Callable[..., Said]


@pytest.fixture
def mjspace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Command:
    """Return the command line, called in a folder with the model craft.xml."""
    (tmp_path / "craft.xml").write_text(SENSED)
    monkeypatch.chdir(tmp_path)

    def called(*arguments: str) -> Said:
        monkeypatch.setattr(sys, "argv", ["mjspace", *arguments])
        with warnings.catch_warnings():
            warnings.simplefilter("default")  # told, as on a command line, not raised
            with pytest.raises(SystemExit) as ended:
                main()
        code = ended.value.code
        return Said(code if isinstance(code, int) else 0, *capsys.readouterr())

    return called


def test_inspect_says_what_is_recognized(mjspace: Command) -> None:
    shown = mjspace("inspect", "craft.xml")
    assert shown.status == 0, shown.err
    assert shown.err == ""
    for text in (
        "craft.xml: flies",
        "its gravity, [ 0.    0.   -9.81] m/s^2, is replaced by the scenario's environment",
        "bus 'hub', 9.1 kg",
        "a law commands: torque (3) [N m], thruster_force (1) [N], control (1)",
        "imu_rate (gyro), star-tracker (framequat) as star_tracker, acceleration (accelerometer)",
        "measured hinges: elbow",
    ):
        assert text in shown.out


def test_inspect_answers_in_json(mjspace: Command) -> None:
    shown = mjspace("inspect", "craft.xml", "--json", "--wheel", "rw3")
    found = json.loads(shown.out)
    assert found["flies"]
    assert [wheel["motor"] for wheel in found["vehicle"]["wheels"]] == ["rw3_motor"]
    assert found["vehicle"]["wheels"][0]["inertia"] == pytest.approx(0.5 * 0.2 * 0.03**2)
    assert found["vehicle"]["thrusters"][0]["force_limit"] == 2.0
    assert found["vehicle"]["command"]["control"] == {"size": 3, "unit": ""}
    assert [body["name"] for body in found["bodies"]] == ["hub", "rw1", "rw2", "arm", "body"]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            ("<freejoint/>", ""),
            "refused: plant.model: no free joint: the vehicle hangs",
        ),
        (
            ('axis="1 0 0"', 'axis="1 0 0" armature="0.01"'),
            "refused: joint 'rw1' has armature 0.01",
        ),
        (('kp="0.5"', 'kp="5e6"'), "refused: joint 'elbow' has damping"),
    ],
)
def test_inspect_says_why_it_cannot_fly(
    change: tuple[str, str], text: str, mjspace: Command
) -> None:
    Path("craft.xml").write_text(SENSED.replace(*change))
    shown = mjspace("inspect", "craft.xml")
    assert shown.status == 1
    assert "craft.xml: cannot fly" in shown.out
    assert text in shown.out


def test_inspect_notes_what_the_compiler_changes(mjspace: Command) -> None:
    Path("craft.xml").write_text(SENSED.replace("<option", '<compiler settotalmass="20"/><option'))
    shown = mjspace("inspect", "craft.xml")
    assert "note: settotalmass=20: the total mass is 20 kg instead of 9.1 kg" in shown.out


def test_inspect_says_what_of_the_sensors_is_not_flown(mjspace: Command) -> None:
    text = SENSED.replace(
        'name="imu_rate"', 'name="imu-rate" noise="0.01" nsample="2" delay="0.01"'
    )
    Path("craft.xml").write_text(text.replace("<sensor>", '<sensor><magnetometer site="imu"/>'))
    shown = mjspace("inspect", "craft.xml")
    assert shown.status == 0
    for note in (
        "note: the noise of its sensors 'imu-rate' is not flown, as MuJoCo does not use it: with "
        '[sensors.imu_rate] measures = "model", noise_std = 0.01 it is',
        "note: delay and interval of its sensors 'imu-rate' are left out: [sensors.imu_rate] "
        'measures = "model" has delay and period',
        "note: its sensors 'imu_sensor' read the model's uniform magnetic field, not that of the",
    ):
        assert note in shown.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["inspect", "none.xml"], "mjspace: MODEL: no file 'none.xml'"),
        (["inspect", "craft.mjb"], "mjspace: MODEL: craft.mjb is compiled, and nothing can be"),
        (["inspect", "bad.xml"], "mjspace: MODEL: bad.xml is no XML"),
        (["inspect", "craft.xml", "--wheel", "q"], "plant.roles.wheels: 'q' matches no motor"),
        (["new", "a/b"], "mjspace: NAME: got 'a/b', should be letters, digits, - and _"),
        (["new", "there"], "mjspace: NAME: there is there already: choose another name"),
        (["new", "sat", "--model", "none.xml"], "mjspace: MODEL: no file 'none.xml'"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], message: str, mjspace: Command) -> None:
    (Path() / "bad.xml").write_text("<mujoco>")
    (Path() / "there").mkdir()
    shown = mjspace(*arguments)
    assert message in shown.err + shown.out
    assert shown.status == (1 if "--wheel" in arguments else 2)
    assert not (Path() / "sat").exists()


def test_new_writes_what_flies_at_once(mjspace: Command) -> None:
    for name, arguments in (("sat-1", ["--model", "craft.xml"]), ("plain", [])):
        assert mjspace("new", name, *arguments).status == 0
        flown = mjspace("run", f"{name}/{name}.toml", "--out", f"out-{name}")
        assert flown.status == 0, flown.out + flown.err
        assert "attitude held" in flown.out


@pytest.mark.slow
def test_the_test_that_new_writes_passes(mjspace: Command) -> None:
    mjspace("new", "plain")
    tested = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "plain"],
        capture_output=True,
        text=True,
    )
    assert "1 passed" in tested.stdout, tested.stdout


@pytest.mark.parametrize("jet", ["", '<general name="jet" site="jet" gear="0 0 2 0 0 0"/>'])
def test_new_for_a_model_without_wheels_commands_nothing(mjspace: Command, jet: str) -> None:
    start, end = SENSED.index("<actuator>") + 10, SENSED.index("</actuator>")
    Path("craft.xml").write_text(SENSED[:start] + jet + SENSED[end:])
    assert mjspace("new", "drift", "--model", "craft.xml").status == 0
    flown = mjspace("run", "drift/drift.toml", "--out", "out")
    assert flown.status == 0, flown.out + flown.err
    assert "total momentum drift" in flown.out
    assert Path("drift/law.py").exists() == bool(jet)
