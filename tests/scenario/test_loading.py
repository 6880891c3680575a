"""Scenario files: what is accepted, and the one line that says what is wrong."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from mjspace.errors import InputError
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import component, load, to_toml, validate

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
        ("sensors.rate.noise_std='0.1 deg'", ["sensors.rate.noise_std", "deg/s"]),
        ("sensors.rate.noise=1", ["sensors.rate: noise is now noise_std: the standard deviation"]),
        ("sensors.rate.nois_std=1", ["sensors.rate.nois_std", "did you mean 'noise_std'"]),
        ("sensors.st_1.measures=attitud", ["sensors.st_1: no", "did you mean 'attitude'"]),
        ("sensors.rat={}", ["sensors.rat: no sensor measures 'rat': did you mean 'rate'"]),
        ("sensors.rate=3", ["sensors.rate: got 3, should be a table"]),
        ("sensors.thrust.measures=rate", ["sensors.thrust: thrust is a quantity"]),
        ("sensors.rate.measures=attitude", ["sensors.rate: rate is a quantity"]),
        ("sensors.magnetic_field={}", ["sensors.magnetic_field: needs an"]),
        ("sensors.a_valid={measures='rate'}", ["sensors.a_valid: a law reads by such a name"]),
        ("sensors=3", ["sensors: got 3, should be a table"]),
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


def test_another_kind_on_the_command_line_starts_afresh_in_any_order(minimal: Path) -> None:
    changes = ["law.rate_gain=3", "law.kind=pd_plus:Classical", "reference.kind=references:Slew"]
    for overrides in (changes, changes[::-1]):
        scenario, _ = load("contraction-adaptive", overrides)
        assert scenario.law.kind == "pd_plus:Classical"
        assert scenario.law.gains == {"rate_gain": 3}
        assert scenario.reference.gains == {}
    same, _ = load("contraction-adaptive", ["law.kind=contraction:Adaptive"])
    assert same.law == load("contraction-adaptive")[0].law
    mission, _ = load("mission", ["law.phases.0.law.kind=coast:Coast"])
    assert mission.law.gains["phases"][0]["law"] == {"kind": "coast:Coast"}
    assert mission.law.gains["phases"][1:] == load("mission")[0].law.gains["phases"][1:]


def test_all_that_is_wrong_is_said_in_one_line(minimal: Path) -> None:
    minimal.write_text(MINIMAL + "gian = 2\n[plant]\nmass = 'heavy'\n[initial]\nrate = 3\n")
    message = refusal(minimal, "duration=-1", "seed=true")
    for part in (
        f"{minimal}: plant.mass: got 'heavy'",
        "initial.rate: got 3, should be a list",
        "--set duration=-1: duration: got -1",
        "--set seed=true: seed: got True, should be a whole number",
    ):
        assert part in message


@pytest.mark.parametrize(
    ("name", "text", "part"),
    [
        ("flight.mcap", "", "the log of a flight, for 'mjspace replay'"),
        ("model.xml", "<mujoco/>", "'mjspace validate --model'"),
        ("law.py", "", 'kind = "law.py:Class"'),
        ("notes.txt", "", "'mjspace list'"),
        ("pyproject.toml", "[tool]\n[project]\n", "it has tool, project, but no duration or law"),
        ("empty.toml", "", "it has nothing, but no duration or law"),
    ],
)
def test_a_file_that_is_no_scenario_is_told_apart(
    tmp_path: Path, name: str, text: str, part: str
) -> None:
    (tmp_path / name).write_text(text)
    message = refusal(tmp_path / name)
    assert name in message
    assert part in message
    assert "is a folder" in refusal(tmp_path)


@pytest.mark.parametrize(
    ("override", "parts"),
    [
        ("inclination=97.4", ["inclination: got 97.4 rad", "did you mean '97.4 deg'?"]),
        ("inclination='400 deg'", ["inclination: got 6.98", "less than or equal to 3.14"]),
        ("inclination='-20 deg'", ["inclination: got -0.349", "greater than or equal to 0"]),
        ("true_anomaly=90", ["true_anomaly: got 90 rad", "did you mean '90 deg'?"]),
        (
            "semi_major_axis=6977.67",
            ["semi_major_axis: got 6977.67 m", "did you mean '6977.67 km'"],
        ),
        ("semi_major_axis='6300 km'", ["semi_major_axis: got 6300000 m", "inside the earth"]),
        ("eccentricity=0.2", ["semi_major_axis", "periapsis", "inside the earth"]),
        ("eccentricity=1", ["eccentricity", "less than 1"]),
    ],
)
def test_an_orbit_that_means_something_else_is_refused(
    minimal: Path, override: str, parts: list[str]
) -> None:
    orbit = "environment.orbit={semi_major_axis='7000 km'}"
    message = refusal(minimal, orbit, f"environment.orbit.{override}")
    for part in parts:
        assert part in message
    assert "did you mean" in parts[-1] or "did you mean" not in message


@pytest.mark.parametrize(
    ("override", "parts"),
    [
        ("seed=true", ["seed: got True", "a whole number"]),
        ("plant.mass=true", ["plant.mass: got True", "a number"]),
        ("plant.mass='7'", ["'7' has no unit", "kg"]),
        ("plant.mass='x'", ["got 'x', should be a number"]),
        ("plant.ideal_thrusters=1", ["plant.ideal_thrusters: got 1", "true or false"]),
        ("plant.wheels.axes=[[0,0,0]]", ["plant.wheels.axes.0", "no direction"]),
        ("initial.attitude=[1,0,0,0.1]", ["initial.attitude", "norm is 1.00499", "0.001"]),
        ("initial.attitude=[1,0,0,'7']", ["initial.attitude", "the text '7'"]),
        ("plant.ground.slope=20", ["plant.ground.slope: got 20 rad", "did you mean '20 deg'?"]),
        ("environment.magnetic_field.epoch=7", ["epoch: got 7, should be a date"]),
    ],
)
def test_nonsense_is_refused(minimal: Path, override: str, parts: list[str]) -> None:
    message = refusal(minimal, override)
    for part in parts:
        assert part in message


def test_a_quaternion_may_be_rounded_to_three_decimals(minimal: Path) -> None:
    load(minimal, ["initial.attitude=[0.707, 0, 0.707, 0]"])


@pytest.mark.parametrize(
    ("check", "part"),
    [
        ("target=0, relative=true, below=1", "relative: the target is zero"),
        ("target=[0, 0, 0], relative=true, below=1", "relative: the target is zero"),
        ("target='x', below=1", "checks.0.target: got 'x'"),
        ("target=nan, below=1", "checks.0.target: got nan"),
        ("below=nan", "checks.0.below: got nan, should be finite"),
        ("above=inf", "checks.0.above: got inf, should be finite"),
        ("below=true", "checks.0.below: got True, should be a number"),
        ("below='7'", "has no unit"),
        ("below=1, above=1", "below 1 and above 1: nothing is inside"),
        ("below=1, start=1.5, end=1.2", "checks.0.start: 1.5 s is after end, 1.2 s"),
        ("below=1, start=2.5", "checks.0.start: 2.5 s is after the flight's end, duration 2 s"),
        ("below=1, start=1.0002, end=1.0004", "nothing is logged from 1.0002 to 1.0004 s"),
    ],
)
def test_a_check_that_judges_nothing_is_refused(minimal: Path, check: str, part: str) -> None:
    table = f"[[checks]]\nname = 'x'\nsignal = 'truth.rate'\n{check.replace(', ', chr(10))}\n"
    if "[" in check:
        table = "[[checks]]\nname = 'x'\nsignal = 'truth.rate'\ntarget = [0, 0, 0]\n"
        table += "relative = true\nbelow = 1\n"
    minimal.write_text(MINIMAL + table)
    assert part in refusal(minimal)


@pytest.mark.parametrize("window", ["start=1.0", "end=0.0", "start=2.0", "start=0.3, end=0.3"])
def test_a_window_of_one_sample_is_enough(minimal: Path, window: str) -> None:
    load(minimal, [f"checks=[{{name='x', signal='truth.rate', below=1, {window}}}]"])


def test_a_shorter_flight_leaves_late_checks_out_and_says_so(minimal: Path) -> None:
    late = "{name='late', signal='truth.rate', below=1, start=1.5}"
    early = "{name='early', signal='truth.rate', below=1, end=1.9}"
    with pytest.warns(UserWarning, match=r"after the flight's end, 1 s, left out: 'late'$"):
        scenario, _ = load(minimal, [f"checks=[{late}, {early}]", "duration=1"])
    assert [check.name for check in scenario.checks] == ["early"]


def test_a_duration_is_a_whole_number_of_control_periods(minimal: Path) -> None:
    message = refusal(minimal, "duration=0.0999", "rates.control='10 ms'")
    assert message.startswith("--set duration=0.0999: duration: 0.0999 s is not a whole number of")
    assert "the nearest are 0.09 s and 0.1 s" in message
    load(minimal, ["duration=20", "rates.control=0.1"])  # 0.1 is no binary fraction


def test_a_control_period_has_not_more_steps_than_can_be_waited_for(minimal: Path) -> None:
    message = refusal(minimal, "rates.physics=1e-9", "rates.control='10 ms'")
    assert "rates.control: 0.01 s has 10000000 steps of rates.physics, 1e-09 s" in message
    assert message.endswith("should be at most 100000")
    load(minimal, ["rates.physics=1e-7", "rates.control='10 ms'"])


def test_component_from_the_command_line() -> None:
    law = component("contraction:Ideal", ["rate_gain=3", "inertia=[[1,0,0],[0,1,0],[0,0,1]]"])
    assert law.gains == {"rate_gain": 3, "inertia": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}


@pytest.mark.filterwarnings("error")
def test_targets_with_units_are_written_out_in_si(minimal: Path) -> None:
    check = "{name='x', signal='truth.gimbal_angle', target=['90 deg', 0], below=1}"
    scenario, _ = load(minimal, [f"checks=[{check}]"])
    (written,) = tomllib.loads(to_toml(scenario))["checks"]
    assert written["target"] == [np.pi / 2, 0.0]
