"""Pictures and videos of a log: what must be seen on them, and what refuses to be drawn."""

import gzip
import shutil
import subprocess
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import av
import mujoco
import numpy as np
import pytest
from full_disk import room_for
from numpy.typing import NDArray
from PIL import Image

from mjspace import attitude, run
from mjspace.environment.orbit import orbit_position
from mjspace.errors import NoRendererError
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.rendering import captions as wording
from mjspace.rendering import markers, overlay
from mjspace.rendering.arrows import arrows_of, body_axes, longest, rounded_up
from mjspace.rendering.captions import captions, time_text
from mjspace.rendering.decorations import decorations
from mjspace.rendering.offscreen import Canvas
from mjspace.rendering.render import frames_at, render, shares_of_thrust
from mjspace.rendering.sampling import nearest_rows
from mjspace.rendering.scene import Stage
from mjspace.rendering.video import Frame, Video
from mjspace.scenario.trust import controllers
from mjspace.vehicle.vehicle import from_mjb

SIZE = 320, 180
Pixels = NDArray[np.int64]


def _why_not() -> str:
    try:
        with Canvas(mujoco.MjModel.from_xml_string("<mujoco/>"), (16, 16)):
            return ""
    except NoRendererError as error:
        return str(error)


WHY_NOT = _why_not()
needs_opengl = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)


@pytest.fixture(scope="module")
def still(pictured_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Pixels]:
    folder = tmp_path_factory.mktemp("stills")

    def draw(at: float, camera: str = "chase") -> Pixels:
        path = folder / f"{camera}-{at}.png"
        if not path.exists():
            render(pictured_log, path, camera=camera, size=SIZE, at=at, arrows=False)
        return np.asarray(Image.open(path)).astype(np.int64)

    return draw


@pytest.fixture
def stage(pictured_log: Path) -> Stage:
    log = Log(pictured_log)
    model = from_mjb(gzip.decompress(log.attachment("model.mjb.gz")))
    return Stage(model, "chase", scenario_of(log).environment.orbit)


@pytest.fixture(scope="module")
def row(pictured_log: Path) -> Any:
    return Log(pictured_log).read("/state", ["physics"], end=0.0)["physics"][0]


def roughness(image: Pixels) -> float:
    """Return how neighbours differ, over how any two pixels do: 1 of noise, 0 of one colour."""
    steps = np.diff(image, axis=1).astype(float)
    return float(np.sqrt(np.mean(steps**2) / (2.0 * image.var())))


@needs_opengl
def test_a_still_shows_a_scene(still: Callable[..., Pixels]) -> None:
    image = still(0.5)
    assert image.shape == (SIZE[1], SIZE[0], 3)
    # Black space, a bright sunlit side, and textures between: 10379 and 59 were measured.
    assert 3000 < len(np.unique(image.reshape(-1, 3), axis=0)) < 30000
    assert 30 < image.std() < 90
    # Neighbours are alike but at edges (0.25 was measured); the same pixels in disorder are not.
    assert roughness(image) < 0.5
    rng = np.random.default_rng(1)
    assert roughness(rng.permuted(image.reshape(-1, 3), axis=0).reshape(image.shape)) > 0.9


@needs_opengl
def test_the_vehicle_is_in_the_middle(still: Callable[..., Pixels]) -> None:
    # What moves against the sky and the planet is the vehicle.
    moved = np.abs(still(0.0) - still(1.0)).max(axis=2)[: SIZE[1] * 3 // 4] > 60
    y, x = np.nonzero(moved)
    # 302 pixels were measured, around (0.54, 0.48) of the picture.
    assert len(x) > 100
    assert abs(x.mean() / SIZE[0] - 0.5) < 0.12
    assert abs(y.mean() / SIZE[1] - 0.5) < 0.12


@needs_opengl
def test_cameras_see_different_things(still: Callable[..., Pixels]) -> None:
    views = [still(0.5, camera) for camera in ("chase", "close", "wide")]
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(views[a] - views[b]).mean() > 5  # 25 or more were measured


@needs_opengl
def test_the_caption_says_when_and_how_well(
    pictured_log: Path, still: Callable[..., Pixels]
) -> None:
    (caption,) = captions(Log(pictured_log), "contraction:Adaptive", np.array([0.5]))
    written = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    lines = (
        ("contraction-adaptive", "contraction:Adaptive"),
        ("0.50 s", caption),
    )
    overlay.write(written, *lines)
    ink = written.min(axis=2) > 195  # the inside of letters, where nothing shines through
    assert ink[:, : SIZE[0] // 2].any()
    assert ink[:, SIZE[0] // 2 :].any()
    assert (still(0.5)[ink] >= 195).all()
    assert not written[: SIZE[1] // 2].any()


@pytest.mark.parametrize("changed", range(4))
def test_each_text_of_the_caption_is_in_its_corner(changed: int) -> None:
    def written(texts: list[str]) -> Pixels:
        frame = np.zeros((180, 320, 3), np.uint8)
        overlay.write(frame, (texts[0], texts[1]), (texts[2], texts[3]))
        return frame.astype(np.int64)

    texts = ["name", "law", "1.00 s", "error 0.26 deg"]
    other = [*texts]
    other[changed] = texts[changed].replace("e", "o").replace("law", "gain").replace("1", "2")
    _, x = np.nonzero((written(texts) != written(other)).any(axis=2))
    assert len(x)
    assert ((x < 160) == (changed < 2)).all()


def test_the_name_of_a_law_gives_way_to_a_long_caption() -> None:
    def written(law: str, caption: str) -> Pixels:
        frame = np.zeros((180, 320, 3), np.uint8)
        overlay.write(frame, ("name", law), ("1.00 s", caption))
        return frame.astype(np.int64)

    assert (written("lander:VariableStructure", "short") != written("", "short")).any()
    long = "altitude 550.3 m, speed 18.95 m/s, 6.62 m off its path"
    assert (written("lander:VariableStructure", long) == written("", long)).all()


@needs_opengl
def test_up_is_up_and_right_is_right() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco>
          <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
          <worldbody>
            <camera name="front" pos="0 -4 0" xyaxes="1 0 0 0 0 1"/>
            <geom size=".4" pos="0 0 1" rgba="1 0 0 1"/>
            <geom size=".4" pos="1 0 0" rgba="0 1 0 1"/>
            <body name="bus"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
          </worldbody>
        </mujoco>"""
    )
    state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    stage = Stage(model, "front", None)
    stage.set(0.0, state, np.array([1.0, 0.0, 0.0, 0.0]))
    with Canvas(model, (100, 100)) as canvas:
        image = canvas.draw(stage.scene)
    for color, place in ((0, (20, 50)), (1, (50, 80))):
        assert tuple(np.argwhere(image[..., color] > 128).mean(axis=0)) == pytest.approx(
            place, abs=5.0
        )


@pytest.mark.parametrize(
    ("degrees", "text"), [(0.0, "0 deg"), (1.2e-7, "1.2e-07 deg"), (120.0, "120.00 deg")]
)
def test_angles_are_in_degrees(degrees: float, text: str) -> None:
    assert wording.angle_text(float(np.radians(degrees))) == text


def test_wanted_axes_stand_where_the_body_ought_to_be(stage: Stage, row: Any) -> None:
    wanted = attitude.from_rotation_vector(np.array([0.3, -0.5, 0.8]))
    stage.set(0.0, row, wanted)
    halos = stage.scene.geoms[stage.scene.ngeom - 3 : stage.scene.ngeom]
    for halo, axis in zip(halos, attitude.to_matrix(wanted).T, strict=True):
        # A capsule's own axis is its z; single precision.
        np.testing.assert_allclose(np.abs(halo.mat[:, 2] @ axis), 1.0, atol=1e-6)
        assert halo.rgba[3] < 1.0
        # From the bus outwards, not inwards.
        assert (halo.pos - row[1:4]) @ axis > 0.1


def test_the_planet_is_below(pictured_log: Path, stage: Stage, row: Any) -> None:
    orbit = scenario_of(Log(pictured_log)).environment.orbit
    assert orbit is not None
    distance = np.linalg.norm(stage.model.geom("planet").pos)
    for time in (0.0, 700.0, 3000.0):
        stage.set(time, row, row[4:8])
        down = -attitude.normalize(orbit_position(orbit, time))
        # Rounding of a rotation.
        np.testing.assert_allclose(stage.model.geom("planet").pos, distance * down, atol=1e-9)


def test_fast_rotors_turn_visibly_and_slow_ones_truly(stage: Stage, row: Any) -> None:
    wheel = int(stage.model.joint("wheel_0").qposadr[0])
    angle = 1 + wheel  # time comes first in a row
    seen = []
    for turned in (0.0, 0.2, 3.2, 2.9):
        now = row.copy()
        now[angle] += turned
        stage.set(0.0, now, row[4:8])
        seen.append(stage._data.qpos[wheel] - row[angle])
    # 0.2 rad is drawn as it is, 3 rad as 30 degrees, and backwards is backwards.
    np.testing.assert_allclose(np.diff(seen), [0.2, np.radians(30.0), -0.3], atol=1e-12)


def test_rows_are_the_nearest_logged(pictured_log: Path) -> None:
    times = np.array([0.0, 0.0004, 0.0006, 0.25, 0.49951, 0.9999, 1.2])
    found = list(nearest_rows(Log(pictured_log), "/state", "physics", times))
    # A row begins with its time, every millisecond; the last one stands for later.
    np.testing.assert_allclose(
        [r[0] for r in found], [0.0, 0.0, 0.001, 0.25, 0.5, 1.0, 1.0], atol=1e-12
    )


@needs_opengl
def test_a_video_has_every_frame(pictured_log: Path, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    path = tmp_path / "x.mp4"
    tell = lambda drawn, count: told.append((drawn, count))  # noqa: E731 - said in one line
    render(pictured_log, path, size=(160, 90), rate=10.0, speed=0.5, progress=tell)
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert (stream.width, stream.height) == (160, 90)
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert stream.average_rate == 10
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in file.decode(stream)]
    # One second at half speed, ten frames a second, the first and the last instant included.
    assert len(frames) == 21
    assert told == [(drawn, 21) for drawn in range(1, 22)]
    assert np.abs(frames[0] - frames[-1]).mean() > 2
    # The index first, so that a browser plays it while it loads.
    assert path.read_bytes().index(b"moov") < path.read_bytes().index(b"mdat")
    if shutil.which("ffprobe"):
        entries = ["-show_entries", "format=duration", "-of", "csv=p=0"]
        answer = subprocess.run(["ffprobe", "-v", "error", *entries, path], capture_output=True)
        assert float(answer.stdout) == pytest.approx(2.1, abs=1e-3)


@pytest.mark.parametrize("name", ["x.png", "x.mp4"])
def test_a_full_disk_is_named_and_leaves_no_picture(
    pictured_log: Path, tmp_path: Path, name: str
) -> None:
    path = tmp_path / name
    with room_for(3000), pytest.raises(OSError, match=rf"File too large: '.*{name}'"):
        render(pictured_log, path, size=(320, 180), rate=10.0)
    assert not path.exists()


@needs_opengl
@pytest.mark.parametrize("name", ["x.png", "x.mp4"])
def test_a_link_is_not_followed(pictured_log: Path, tmp_path: Path, name: str) -> None:
    target, link = tmp_path / "precious", tmp_path / name
    target.write_text("mine")
    link.symlink_to(target)
    render(pictured_log, link, size=(64, 48), rate=2.0)
    assert not link.is_symlink()
    assert link.stat().st_size > 100
    assert target.read_text() == "mine"


@pytest.mark.parametrize(
    ("output", "wrong", "said"),
    [
        ("x.avi", {}, r"\.mp4 for a video, \.png"),
        ("x.mp4", {"size": (321, 180)}, "even, as in 322x180"),
        ("x.png", {"size": (0, 180)}, "from 16x16 to 8192x8192"),
        ("x.mp4", {"rate": 0.0}, "positive"),
        ("x.mp4", {"speed": -1.0}, "positive"),
        ("x.mp4", {"rate": np.nan}, "positive"),
        ("x.mp4", {"rate": 1e9}, r"rate 1e\+09, .* should be from 0.001 to 1000"),
        ("x.mp4", {"rate": np.inf, "speed": 1e-300}, "rate inf, .* from 0.001 to 1000"),
        ("x.mp4", {"rate": 1e300, "speed": 1e300}, "from 0.001 to 1000"),
        ("x.mp4", {"speed": 1e-9}, "frames, should be at most"),
        ("x.png", {"size": (20000, 20000)}, "to 8192x8192"),
        ("x.png", {"at": 1.5}, "the log has 0 s to 1 s"),
        ("x.png", {"camera": "nose"}, "no camera 'nose': have chase, close, wide"),
    ],
)
def test_bad_input_is_refused(
    pictured_log: Path, tmp_path: Path, output: str, wrong: dict[str, Any], said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        render(pictured_log, tmp_path / output, **wrong)
    assert not list(tmp_path.iterdir())


@needs_opengl
def test_a_log_that_is_damaged_further_on_leaves_no_still(
    pictured_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def damaged(*arguments: Any) -> Iterator[Frame]:
        yield from frames_at(*arguments)
        raise ValueError("time does not go on")

    monkeypatch.setattr("mjspace.rendering.render.frames_at", damaged)
    with pytest.raises(ValueError, match="time does not go on"):
        render(pictured_log, tmp_path / "x.png", size=(64, 48))
    assert not list(tmp_path.iterdir())


def test_a_video_that_cannot_be_finished_is_deleted(tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"

    def abandon() -> None:
        with Video(path, (64, 64), 10.0) as video:
            for _ in range(100):  # more than the encoder holds back
                video.write(np.zeros((64, 64, 3), np.uint8))
            assert path.exists()
            raise KeyError

    with pytest.raises(KeyError):
        abandon()
    assert not path.exists()


def test_without_opengl_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any) -> None:
        raise AttributeError("'NoneType' object has no attribute\n'eglQueryDevicesEXT'")

    monkeypatch.setattr("mjspace.rendering.offscreen._context_type", broken)
    with pytest.raises(NoRendererError, match=r"apt-get install libegl1 libgl1") as caught:
        Canvas(mujoco.MjModel.from_xml_string("<mujoco/>"), (16, 16))
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def descent(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """Return the log of a lander's first half second."""
    folder = tmp_path_factory.mktemp("descent")
    return Log(run("lander", overrides=("duration=0.5", "checks=[]"), out=folder).path)


def test_a_landers_caption_tells_of_its_path(descent: Log) -> None:
    text = wording.path_text("altitude", np.array([30.04]), np.array([0.3, 0.0, -0.4]))
    assert text == "altitude 30.04 m, speed 0.50 m/s"
    assert wording.metres(np.array([3e4, 0.0, 4e4])) == "50.0 km"
    first, last = captions(descent, "lander:VariableStructure", np.array([0.0, 0.5]))
    assert first.startswith("altitude 1005.6 m, speed 26.93 m/s, 0.00 m off its path")
    assert last.startswith("altitude 1000.")  # 10 m/s downwards, for half a second


def test_the_caption_of_a_satellite_is_its_error_or_only_its_rate(pictured_log: Path) -> None:
    log, half = Log(pictured_log), np.array([0.5])
    truth = log.nearest("/truth", 0.5)
    error = wording.angle_text(truth["attitude_error"].item())
    turns = wording.rate_text(truth["rate"])
    assert list(captions(log, "contraction:Adaptive", half)) == [
        f"attitude error {error}, rate {turns}"
    ]
    assert list(captions(log, "coast:Coast", half)) == [f"turns at {turns}"]
    assert wording.rate_text(np.radians([0.0, 3.0, 4.0])) == "5.00 deg/s"


@pytest.mark.parametrize("kind", sorted(wording.TURNING))
def test_laws_that_leave_the_attitude_alone_exist(kind: str) -> None:
    module, _, law = kind.partition(":")
    assert hasattr(import_module(controllers()[module]), law)


@pytest.mark.parametrize(
    ("time", "span", "text"),
    [(59.9, 599.0, "59.90 s"), (61.2, 600.0, "1 min 01 s"), (86399.0, 86400.0, "23 h 59 min")],
)
def test_the_time_of_a_long_flight_is_in_minutes_or_hours(
    time: float, span: float, text: str
) -> None:
    assert time_text(time, span) == text


def test_an_arrow_is_as_long_as_its_scale_says(pictured_log: Path, stage: Stage) -> None:
    log, times = Log(pictured_log), np.array([0.1, 0.5])
    torque, momentum = arrows_of(log, "contraction:Adaptive", stage.model, times)
    logged = log.nearest("/command", 0.5)["torque"]
    np.testing.assert_allclose(torque.length(1) * torque.scale, logged)
    assert f"{np.linalg.norm(logged):.3g} N m (1 m: {torque.scale:g} N m)" in torque.legend(1)
    small = torque._replace(vectors=1e-6 * torque.vectors, scale=1e-6 * torque.scale)
    assert f"{np.linalg.norm(logged):.3g} uN m (1 m: {torque.scale:g} uN m)" in small.legend(1)
    for drawn in (torque, momentum):
        lengths = [np.linalg.norm(drawn.length(number)) for number in (0, 1)]
        # A scale of 1, 2, 3 or 5: at most twice too small.
        assert 0.5 * longest(stage.model) <= max(lengths) <= longest(stage.model)
    assert [rounded_up(value) for value in (0.011, 0.2, 3.0, 5.1)] == [0.02, 0.2, 3.0, 10.0]


def test_axes_alone_have_letters() -> None:
    """Group 3 is often that of collision geoms in models of others."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><body><freejoint/>
          <geom size=".2" group="3"/><geom name="box" size=".2" pos="1 0 0" group="3"/>
          <geom name="own_axis_y" type="capsule" size=".01" fromto="0 0 0 0 1 0" group="3"/>
        </body></worldbody></mujoco>"""
    )
    assert body_axes(model) == {2: "y"}
    assert longest(model) == pytest.approx(2.0)


@needs_opengl
def test_a_letter_is_where_the_arrow_ends(stage: Stage, row: Any) -> None:
    """The tip that MuJoCo draws is where we compute the letter's place, but for its distance."""
    attitude_now = row[4:8]
    stage.set(0.0, row, attitude_now)
    with Canvas(stage.model, (640, 360)) as canvas:
        before = canvas.draw(stage.scene).astype(int)
        up = 2.5 * stage.scene.camera[0].up.astype(float)
        (letter,) = markers.add_arrow(stage.scene, row[1:4], up, 2.5, (1.0, 0.0, 1.0), "τ")
        after = canvas.draw(stage.scene).astype(int)
    y, x = np.nonzero(np.abs(after - before).max(axis=2) > 60)
    place = markers.in_frame(stage.scene, letter.place)
    assert place is not None
    tip = y.argmin()
    # 6 % of the arrow's length beyond it, 7 pixels here.
    assert 360 * place[1] == pytest.approx(y[tip] - 7.0, abs=4.0)
    assert 320 + 360 * place[0] == pytest.approx(x[tip], abs=3.0)


def test_a_lander_has_a_trail_from_where_it_began_to_the_site(descent: Log) -> None:
    model = from_mjb(gzip.decompress(descent.attachment("model.mjb.gz")))
    times = np.array([0.1, 0.5])
    drawn = list(decorations(descent, "lander:VariableStructure", model, times))
    (first, _), (last, lines) = drawn
    assert first is not None
    assert last is not None
    np.testing.assert_allclose(last.trail[0], [2000.0, 1500.0, 1003.8])
    assert len(first.trail) < len(last.trail)
    assert (np.diff(last.trail[:, 2]) < 0.0).all()
    assert last.site == pytest.approx(descent.nearest("/reference", 0.5)["position"][:2])
    assert [letter for _, letter, _ in lines] == ["v", "F"]
    stage = Stage(model, "wide", None)
    state = descent.nearest("/state", 0.5)["physics"]
    stage.set(0.5, state, np.array([1.0, 0.0, 0.0, 0.0]), decorated=last)
    with_all = stage.scene.ngeom
    stage.set(0.5, state, np.array([1.0, 0.0, 0.0, 0.0]))
    # Trail, two arrows, a ring of 36 pieces and a rod of 5.
    assert with_all - stage.scene.ngeom == len(last.trail) + 2 + 36 + 5


@needs_opengl
def test_without_arrows_there_is_no_letter_either(pictured_log: Path, tmp_path: Path) -> None:
    pictures = []
    for arrows in (True, False):
        path = tmp_path / f"{arrows}.png"
        render(pictured_log, path, size=SIZE, at=0.5, arrows=arrows)
        pictures.append(np.asarray(Image.open(path)).astype(int))
    legend = pictures[0][: SIZE[1] // 6, : SIZE[0] // 2]
    assert legend.max() > 195
    assert (pictures[1][: SIZE[1] // 6, : SIZE[0] // 2].max(axis=2) > 195).sum() < 10  # stars


def test_the_plume_on_stage_is_the_logged_thrust(descent: Log) -> None:
    model = from_mjb(gzip.decompress(descent.attachment("model.mjb.gz")))
    full, geom = model.geom("engine_plume").size[2], model.geom("engine_plume").id
    stage = Stage(model, "chase", None)
    (share,) = shares_of_thrust(descent, scenario_of(descent).plant.engine, np.array([0.5]))
    assert share == pytest.approx(descent.nearest("/truth", 0.5)["thrust"].item() / 320.0)
    assert 0.1 < share < 1.0
    physics = descent.nearest("/state", 0.5)["physics"]
    for burning in (share, 0.0):
        stage.set(0.5, physics, np.array([1.0, 0.0, 0.0, 0.0]), thrust=burning)
        drawn = [
            shape
            for shape in stage.scene.geoms[: stage.scene.ngeom]
            if shape.objtype == mujoco.mjtObj.mjOBJ_GEOM and shape.objid == geom
        ]
        assert len(drawn) == (burning > 0.0)
        for shape in drawn:
            assert shape.size[2] == pytest.approx(burning * full)
            assert shape.category == mujoco.mjtCatBit.mjCAT_DECOR  # throws no shadow
