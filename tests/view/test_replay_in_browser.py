"""A replay in the browser: what is shown is what the log has there, and no more of it is read."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browser
import chromium
import numpy as np
import pytest
from blocks import blocks_of

from mjspace import attitude
from mjspace.errors import InputError
from mjspace.log import frames, reader
from mjspace.log.frames import Frames
from mjspace.log.reader import Log
from mjspace.runner.run import run
from mjspace.view.moments import Moments
from mjspace.view.replay import Replay
from mjspace.view.scene import FOLLOWS
from mjspace.view.server import serving


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of a slew, in chunks of 40 ms."""
    with blocks_of(40):
        return run(
            "contraction-ideal",
            overrides=("duration=2", "checks=[]", GYROSTAT),
            out=tmp_path_factory.mktemp("view"),
        ).path


GYROSTAT = "plant.gyrostat_inertia=[[15, 1, 1], [1, 12, 1], [1, 1, 18]]"  # a body that can exist


@pytest.fixture
def replay(log: Path) -> Iterator[tuple[Replay, str]]:
    with serving("127.0.0.1", 0, "test") as (server, address):
        yield Replay(server, Log(log)), address


@pytest.mark.parametrize("at", [0.0, 0.513, 1.99, 2.0])
def test_the_moment_of_a_time_is_that_of_the_log(log: Path, at: float) -> None:
    moment = Moments(Log(log)).at(at)
    assert abs(moment.poses.time - at) <= 0.005 + 1e-9  # of 100 frames a second
    truth = Log(log).nearest("/truth", moment.poses.time)
    bus = moment.poses.names.index("bus")
    np.testing.assert_allclose(moment.poses.quaternion[bus], truth["attitude"], atol=1e-12)
    row = Log(log).nearest("/truth", at)
    np.testing.assert_array_equal(moment.vectors["angular velocity"], row["rate"])
    assert moment.desired is not None
    np.testing.assert_array_equal(moment.desired, Log(log).nearest("/reference", at)["attitude"])


def test_a_jump_reads_the_chunks_around_it_alone(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moments, read = Moments(Log(log)), set[int]()
    for module in (frames, reader):
        plain = module.read_content

        def noted(file: Any, place: Any, channels: Any, plain: Any = plain) -> Any:
            read.add(place.position)
            return plain(file, place, channels)

        monkeypatch.setattr(module, "read_content", noted)
    chunks = len(Log(log)) // 40
    moments.at(0.5)
    assert 25 <= len(read) <= 30 < chunks  # a second of rows, and three chunks of frames
    moments.at(0.6)
    assert len(read) <= 34


def test_the_survey_has_the_largest_vectors_and_the_whole_way(log: Path) -> None:
    survey = Moments(Log(log)).survey(size=1.0)
    rate = Log(log).read("/truth")["rate"]
    largest = np.linalg.norm(rate, axis=1).max()
    # Every other row is looked at.
    assert survey.longest["angular velocity"] == pytest.approx(largest, rel=1e-3)
    time, points = survey.path
    assert (time[0], time[-1]) == (0.0, 2.0)
    assert len(time) <= 2000
    # It stays where it is: the trail is on a sphere around it.
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.1, rtol=0.01)


def test_the_world_moves_against_what_the_camera_follows(replay: tuple[Replay, str]) -> None:
    view, _ = replay
    moment = view._moments.at(1.0)
    place = np.array([3.0, -4.0, 5.0])
    poses = moment.poses._replace(position=moment.poses.position + place)
    turn = poses.quaternion[0]
    for what, expected in zip(
        FOLLOWS, (-place, -attitude.rotate(attitude.conjugate(turn), place), 0 * place), strict=True
    ):
        view.scene.follow = what
        view.scene.show(moment._replace(poses=poses))
        np.testing.assert_allclose(view.scene._world.position, expected, atol=1e-6)


def test_playing_goes_on_at_its_speed_and_stops_at_the_end(replay: tuple[Replay, str]) -> None:
    view, _ = replay
    view._play(True)
    view.speed = 2.0
    view.advance(0.25)
    assert view.time == pytest.approx(0.5)
    view.advance(10.0)
    assert view.time == 2.0
    assert not view.playing
    view._play(True)
    assert view.time == 0.0


def test_what_holds_no_frames_is_refused_in_one_line(tmp_path: Path, log: Path) -> None:
    other = tmp_path / "x.mcap"
    other.write_bytes(log.read_bytes().replace(b"/tf", b"/xx"))
    with pytest.raises(InputError, match=r"x\.mcap has no /tf: nothing to draw"):
        Frames(other)


@pytest.mark.slow
@chromium.needed
def test_the_picture_changes_when_time_is_scrubbed(
    replay: tuple[Replay, str], tmp_path: Path
) -> None:
    view, address = replay
    over = threading.Event()
    thread = threading.Thread(target=view.run, args=(over.is_set,))
    thread.start()
    try:
        with browser.opened(address, tmp_path / "profile") as page:
            page.until("document.querySelectorAll('.uplot canvas').length > 2")
            page.until("document.querySelector('.mantine-Slider-track') !== null")
            before = page.still_picture(SCENE)
            x, y, width = page.value(f"(r => [r.x, r.y, r.width])({TRACK}.getBoundingClientRect())")
            page.click(x + 0.75 * width, y)
            while view.time == 0.0:
                time.sleep(0.05)
            after = page.still_picture(SCENE)
    finally:
        over.set()
        thread.join()
    assert view.time == pytest.approx(1.5, abs=0.05)
    assert (np.abs(after - before).max(axis=-1) > 30).mean() > 0.01


SCENE = "[...document.querySelectorAll('canvas')].find(c => c.closest('.uplot') === null)"
TRACK = "document.querySelector('.mantine-Slider-track')"
