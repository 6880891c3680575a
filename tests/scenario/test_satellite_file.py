"""Two-line elements from a file: which satellite, in which form, and what the log keeps."""

import re
from pathlib import Path

import pytest

import mjspace
from mjspace.errors import InputError
from mjspace.log.flown_scenario import scenario_of
from mjspace.scenario.loading import load
from mjspace.scenario.satellite_file import satellites

ISS = (
    "1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927",
    "2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537",
)
CBERS = (
    "1 28057U 03049A   06177.78615833  .00000060  00000-0  35940-4 0  1836",
    "2 28057  98.4283 247.6961 0000884  88.1964 271.9322 14.35478080140550",
)
VANGUARD = (
    "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
    "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
)
CATALOGUE = "\r\n".join(["ISS (ZARYA)  ", *ISS, "0 CBERS 2", *CBERS, "", *VANGUARD, ""])
SCENARIO = """
description = "A satellite of a catalogue"
duration = "2 s"
[environment.orbit]
tle_file = "all.tle"
[reference]
kind = "references:Hold"
[law]
kind = "coast:Coast"
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "all.tle").write_bytes(CATALOGUE.encode())
    (tmp_path / "flight.toml").write_text(SCENARIO)
    return tmp_path / "flight.toml"


def of(satellite: str) -> str:
    return f"environment.orbit.satellite={satellite}"


@pytest.mark.parametrize(
    ("satellite", "lines"),
    [
        ("25544", ISS),
        ("'25544'", ISS),
        ("'iss (zarya)'", ISS),
        ("'CBERS 2'", CBERS),
        ("5", VANGUARD),
        ("'00005'", VANGUARD),
    ],
)
def test_a_satellite_by_name_or_number(
    scenario: Path, satellite: str, lines: tuple[str, str]
) -> None:
    orbit = load(scenario, [of(satellite)])[0].environment.orbit
    assert orbit is not None
    assert orbit.tle == list(lines)
    assert orbit.tle_file is orbit.satellite is None


def test_the_only_satellite_needs_no_name(scenario: Path) -> None:
    (scenario.parent / "all.tle").write_text("\n".join(CBERS))
    orbit = load(scenario)[0].environment.orbit
    assert orbit is not None
    assert orbit.tle == list(CBERS)


def test_the_log_has_the_lines_and_needs_no_file(scenario: Path, tmp_path: Path) -> None:
    flown = mjspace.run(scenario, overrides=[of("28057")], out=tmp_path / "out")
    (tmp_path / "all.tle").unlink()
    assert scenario_of(flown.log).environment.orbit.tle == list(CBERS)
    assert mjspace.verify(flown.path) is None


@pytest.mark.parametrize(
    ("text", "settings", "message"),
    [
        (CATALOGUE, [], "flight.toml: {key}: all.tle: has 3 satellites: say which by .*satellite"),
        (CATALOGUE, [of("'CBERS'")], "no satellite 'CBERS': did you mean 'CBERS 2'"),
        (CATALOGUE, [of("7")], r"no satellite '7': have ISS \(ZARYA\), CBERS 2, 00005$"),
        (CATALOGUE + "\r\n".join(ISS), [of("25544")], "has 2 satellites '25544', on lines 2, 10"),
        ("", [], "all.tle: has no satellite"),
        ("\n".join(["A", "B", *ISS]), [], "line 1 is 'A': a satellite is two lines"),
        ("\n".join([*ISS, "A"]), [], "line 3 is 'A': a satellite is two lines"),
        (
            CATALOGUE.replace("0  1836", "0  1837"),
            [of("28057")],
            r"all.tle, from line 5 on, CBERS 2 \(28057\): environment.orbit.tle: line 1 ends with "
            "the checksum '7', should be 6",
        ),
        (CATALOGUE, ["{key}='none.tle'"], "none.tle: no file"),
        (CATALOGUE, ["{key}=3"], "environment.orbit.tle_file: got 3, should be text"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    scenario: Path, text: str, settings: list[str], message: str
) -> None:
    key = "environment.orbit.tle_file"
    (scenario.parent / "all.tle").write_bytes(text.encode())
    with pytest.raises(InputError, match=message.replace("{key}", key)) as refused:
        load(scenario, [setting.replace("{key}", key) for setting in settings])
    assert "\n" not in str(refused.value)


def test_a_file_elsewhere_is_named_on_the_command_line(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    inner = tmp_path / "sub" / "flight.toml"
    inner.write_text(SCENARIO.replace("all.tle", "../all.tle"))
    with pytest.raises(InputError, match="is outside the scenario's folder: copy it there, or"):
        load(inner, [of("25544")])
    elsewhere = f"environment.orbit.tle_file='{tmp_path / 'all.tle'}'"
    orbit = load(inner, [of("25544"), elsewhere])[0].environment.orbit
    assert orbit is not None
    assert orbit.tle == list(ISS)


def test_old_elements_are_warned_of(scenario: Path) -> None:
    day = "environment.epoch=2006-07-{:02}T00:00:00"
    load(scenario, [of("28057"), day.format(10)])  # 13 days; a warning would raise
    with pytest.warns(UserWarning, match=re.escape("are of 2006-06-26, 15 days from time zero")):
        load(scenario, [of("28057"), day.format(12)])


def test_a_satellite_needs_a_file(scenario: Path) -> None:
    scenario.write_text(SCENARIO.replace('tle_file = "all.tle"', "satellite = 5"))
    with pytest.raises(InputError, match=r"environment\.orbit\.satellite: is one of a tle_file"):
        load(scenario)


def test_a_number_may_have_a_letter() -> None:
    lines = [ISS[0].replace("25544U", "A0001U"), ISS[1].replace("25544 ", "A0001 ")]
    (found,) = satellites("\n".join(lines))
    assert found.answers_to("a0001")
    assert not found.answers_to("")
