"""The package from Python, as the pages use it: ``import mjspace``, and nothing else of it."""

import inspect
import subprocess
import sys
import typing
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import mjspace
from mjspace.errors import InputError, NoRendererError

SHORT = ("duration=0.05", "checks=[]")
ROOMS = [path.stem for path in Path(mjspace.__file__).parent.iterdir()]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("api")
    result = mjspace.run("detumble-wheels", overrides=SHORT, out=folder)
    assert result.passed
    assert result.verdicts == []
    assert result.path == folder / "flight.mcap"
    return Path(result.path)


def test_a_flight_is_read_as_the_pages_say(flown: Path) -> None:
    log = mjspace.Log(flown)
    truth = log.read("/truth", ["attitude_error", "wheel_speed"])
    assert truth["attitude_error"].shape == (11, 1)
    assert np.degrees(truth["attitude_error"].max()) > 0.0
    assert np.abs(truth["wheel_speed"]).max() > 0.0


def test_a_topic_is_a_table_with_units(flown: Path) -> None:
    log = mjspace.Log(flown)
    rows = log.read("/truth", ["wheel_speed", "rate"], start=0.02)
    table = log.frame("truth", ["wheel_speed", "rate"], start=0.02)
    assert list(table) == [f"{name}[{i}]" for name in ("wheel_speed", "rate") for i in range(3)]
    np.testing.assert_array_equal(table.index, rows["time"])
    np.testing.assert_array_equal(table["rate[2]"], rows["rate"][:, 2])
    assert table.attrs["units"]["wheel_speed[0]"] == "rad/s"
    assert list(log.frame("/truth", ["attitude_error"])) == ["attitude_error"]
    with pytest.raises(InputError, match="no field 'rat' on /truth"):
        log.frame("/truth", ["rat"])


def test_a_log_and_a_result_show_themselves_in_a_notebook(tmp_path: Path) -> None:
    check = "{name='<b>rate</b>', signal='truth.rate', below='1 deg/s'}"
    result = mjspace.run(
        "detumble-wheels", overrides=("duration=0.05", f"checks=[{check}]"), out=tmp_path
    )
    html = result._repr_html_()
    assert "&lt;b&gt;rate&lt;/b&gt;" in html
    assert "FAIL, not as expected" in html
    whole = result.log._repr_html_()
    assert html in whole
    assert "wheel_speed [3]" in whole
    page = result.log.plot("truth.rate")
    assert page.data.startswith(b"\x89PNG")
    assert page._repr_html_().startswith('<img style="max-width: 100%" src="data:image/png;base64,')


def test_scenarios_are_listed_with_their_descriptions() -> None:
    import mjspace.scenarios  # a room of nearly that name, which must not replace the function

    found = mjspace.list_scenarios()
    assert found["detumble-wheels"] == mjspace.load("detumble-wheels")[0].description
    assert list(found) == sorted(found)
    assert all(found.values())


def test_a_scenario_is_read_without_flying_it() -> None:
    for _ in range(2):
        scenario, folder = mjspace.load("detumble-wheels", SHORT)
        assert scenario.duration == 0.05
        assert folder.is_dir()


def test_a_log_is_replayed_and_verified_any_number_of_times(flown: Path, tmp_path: Path) -> None:
    state = mjspace.Log(flown).read("/state")
    for attempt, log in enumerate((flown, str(flown), mjspace.Log(flown))):
        again = mjspace.replay(log, tmp_path / str(attempt))
        for field, values in again.log.read("/state").items():
            assert values.tobytes() == state[field].tobytes()
        assert mjspace.verify(log) is None
        assert mjspace.verify(log, start=0.02) is None


def test_a_log_is_flown_under_another_law(flown: Path, tmp_path: Path) -> None:
    law = "quaternion_feedback:RateDamping"
    again = mjspace.replay(flown, tmp_path, start=0.02, law=law, gains=["rate_gain='5 N m s/rad'"])
    assert again.log.start == pytest.approx(0.02)
    assert "rate_gain = 5.0" in again.log.attachment("scenario.toml").decode()
    with pytest.raises(ValueError, match="gains: are for another law"):
        mjspace.replay(flown, tmp_path, gains=["rate_gain='5 N m s/rad'"])


def size_of(picture: Path) -> tuple[int, int]:
    """Return width and height in pixels of a picture, which is then deleted."""
    with Image.open(picture) as image:
        size = image.size
    picture.unlink()
    return size


def test_pictures_are_made_of_a_path_or_a_log(flown: Path, tmp_path: Path) -> None:
    for log in (flown, mjspace.Log(flown)):
        mjspace.plot(log, tmp_path / "page.png", signals=["truth.rate[0]"])
        assert size_of(tmp_path / "page.png")[0] == 1375
        panels = [axes.get_title(loc="left") for axes in mjspace.figure(log).axes]
        assert "Body rate [deg/s]" in panels


def test_a_still_is_rendered(flown: Path, tmp_path: Path) -> None:
    try:
        mjspace.render(mjspace.Log(flown), tmp_path / "still.png", size=(64, 48))
    except NoRendererError as error:
        pytest.skip(str(error))
    assert size_of(tmp_path / "still.png") == (64, 48)


def test_bad_input_is_one_line_that_names_it(flown: Path, tmp_path: Path) -> None:
    for call, message in (
        (lambda: mjspace.run("detumble-wheel"), "did you mean.*detumble-wheels"),
        (lambda: mjspace.replay("none.mcap", tmp_path), "log: .*none.mcap"),
        (lambda: mjspace.replay(flown, flown.parent), "holds the log that is to be flown again"),
        (lambda: mjspace.plot(flown, "x.jpg"), r"end it in \.png"),
        (lambda: mjspace.figure(flown, ["truth.rates"]), "truth.rate"),
    ):
        with pytest.raises(ValueError, match=message) as raised:
            call()
        assert len(str(raised.value).splitlines()) == 1


def test_all_names_are_there_and_no_others() -> None:
    assert set(mjspace.__all__) == set(mjspace._MODULES) <= set(dir(mjspace))
    for name in mjspace.__all__:
        assert callable(getattr(mjspace, name)), name
    with pytest.raises(AttributeError, match="module 'mjspace' has no attribute 'fly'"):
        _ = mjspace.fly


def test_no_name_is_that_of_a_module_which_would_replace_it() -> None:
    mapped = {"assets", "controllers"}  # by pyproject.toml
    assert set(mjspace.__all__).isdisjoint({*ROOMS, *mapped})


@pytest.mark.parametrize("name", sorted(mjspace.__all__))
def test_each_word_says_what_it_takes_and_returns(name: str) -> None:
    word = getattr(mjspace, name)
    function = word.__init__ if inspect.isclass(word) else word
    assert inspect.getdoc(word)
    if name != "list_scenarios":  # it takes nothing that could be wrong
        assert "Raises:" in (inspect.getdoc(function) or "")
    hints = typing.get_type_hints(function)
    parameters = set(inspect.signature(function).parameters) - {"self"}
    assert parameters | {"return"} == set(hints)


def test_nothing_is_imported_before_it_is_used() -> None:
    code = (
        "import sys, mjspace\n"
        "assert not {'mujoco', 'mcap', 'matplotlib', 'pydantic'} & set(sys.modules)\n"
        "mjspace.Log\n"
        "assert 'mcap' in sys.modules and 'matplotlib' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert import_module("mjspace.runner.replay").replay is mjspace.replay
