"""The package from Python, as the pages use it: ``import mjspace``, and nothing else of it."""

from pathlib import Path

import numpy as np
import pytest

import mjspace

SHORT = ("duration=0.05", "checks=[]")


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


def test_a_scenario_is_read_without_flying_it() -> None:
    for _ in range(2):
        scenario, folder = mjspace.load("detumble-wheels", SHORT)
        assert scenario.duration == 0.05
        assert folder.is_dir()


def test_a_log_is_flown_again_and_verified_as_often_as_one_likes(
    flown: Path, tmp_path: Path
) -> None:
    state = mjspace.Log(flown).read("/state")
    for attempt in range(2):  # the first call imports the module, whose name is the function's
        again = mjspace.replay(flown, tmp_path / str(attempt))
        for field, values in again.log.read("/state").items():
            assert values.tobytes() == state[field].tobytes()
        assert mjspace.verify(flown) is None
        assert mjspace.verify(flown, start=0.02) is None


def test_all_names_are_there_and_no_others() -> None:
    assert sorted(mjspace.__all__) == ["Log", "load", "replay", "run", "verify"]
    assert callable(mjspace.run)
    with pytest.raises(AttributeError, match="module 'mjspace' has no attribute 'fly'"):
        _ = mjspace.fly
