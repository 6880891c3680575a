"""A copy of a log for viewers: all of the log, with arrows as long as what acted was large."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from mjspace.attitude import rotate
from mjspace.contract import Array
from mjspace.conversion.arrows import arrows_of
from mjspace.conversion.convert import convert
from mjspace.conversion.shown import extent, frames_of, shapes_of
from mjspace.log.reader import Log
from mjspace.rendering.video import access_units
from mjspace.runner.run import run

NODE, MODULES = shutil.which("node"), Path(__file__).parents[2] / "node_modules"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    overrides = ["duration=1", "checks=[]"]
    return run("detumble-wheels", overrides=overrides, out=tmp_path_factory.mktemp("log")).log


@pytest.fixture(scope="module")
def copy(log: Log, tmp_path_factory: pytest.TempPathFactory) -> Log:
    path = tmp_path_factory.mktemp("copy") / "viewed.mcap"
    convert(log, path)
    return Log(path)


def arrows(copy: Log, name: str) -> list[tuple[float, Array, float]]:
    """Return the time [s], direction and length [m] of each arrow of that name."""
    found = []
    with copy.path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, _, message, update in reader.iter_decoded_messages(["/arrows"]):
            (entity,) = update.entities
            assert (entity.frame_id, entity.frame_locked) == ("bus", True)
            for arrow in entity.arrows if entity.id == name else ():
                turn = arrow.pose.orientation
                along = rotate(np.array([turn.w, turn.x, turn.y, turn.z]), np.array([1.0, 0, 0]))
                found.append(
                    (message.log_time / 1e9, along, arrow.shaft_length + arrow.head_length)
                )
    return found


def test_a_copy_has_all_of_the_log(log: Log, copy: Log) -> None:
    assert copy.altered() == []
    assert copy.topics == log.topics
    assert copy.units == log.units
    assert copy.metadata == log.metadata
    assert copy.attachments == log.attachments
    assert copy.attachment("model.mjb.gz") == log.attachment("model.mjb.gz")
    assert copy.events() == log.events()
    assert [*copy.records("/tf")] != []
    assert len([*copy.records("/tf")]) == len([*log.records("/tf")])


def test_arrows_are_along_what_acts_and_in_proportion(log: Log, copy: Log) -> None:
    found = arrows(copy, "commanded torque")
    reach = extent(shapes_of(log), frames_of(log), "bus")
    lengths = np.array([length for _, _, length in found])
    assert lengths.max() == pytest.approx(reach)
    wanted, norm = [], np.linalg.norm(log.nearest("/truth", 0.0)["momentum"])
    for time, along, _ in found:
        torque = log.nearest("/command", time)["torque"]
        wanted.append(np.linalg.norm(torque))
        np.testing.assert_allclose(along, torque / wanted[-1], atol=1e-9)
    np.testing.assert_allclose(lengths / reach, np.array(wanted) / max(wanted), rtol=1e-9)
    for time, along, length in arrows(copy, "total momentum"):
        truth = log.nearest("/truth", time)
        turned = rotate(truth["attitude"], length * along)  # inertial: it does not change
        np.testing.assert_allclose(turned / reach, truth["momentum"] / norm, atol=1e-6)
    times = np.array([time for time, _, _ in found])
    assert np.diff(times).min() >= 0.05 - 1e-9  # at most 20 Hz


def test_a_thrust_pushes_at_its_place(tmp_path: Path) -> None:
    log = run("lander", overrides=["duration=0.2", "checks=[]"], out=tmp_path).log
    frames = frames_of(log)
    (thrust,) = (a for a in arrows_of(log, frames, "bus", 1.0) if a.name == "thrust")
    nozzle, bus = frames["engine_nozzle"], frames["bus"]
    up = rotate(nozzle.quaternion[-1], np.array([0.0, 0.0, 1.0]))
    assert thrust.time[-1] == nozzle.time[-1]
    vector, origin = (
        rotate(bus.quaternion[-1], each[-1, 0]) for each in (thrust.vector, thrust.origin)
    )
    np.testing.assert_allclose(vector / np.linalg.norm(vector), up, atol=1e-9)
    tip = bus.position[-1] + origin + vector - nozzle.position[-1]
    np.testing.assert_allclose(np.cross(tip, up), 0.0, atol=1e-9)  # on the nozzle's axis


def test_a_copy_of_a_copy_or_of_some_signals_is_refused(
    log: Log, copy: Log, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match="has /arrows already"):
        convert(copy, tmp_path / "x.mcap")
    with pytest.raises(ValueError, match="leave signals, topics and rate out"):
        convert(log, tmp_path / "x.mcap", topics=["truth"])
    with pytest.raises(ValueError, match="should not be the log itself"):
        convert(log, log.path)
    with pytest.raises(ValueError, match=r"for \.mcap alone"):
        convert(log, tmp_path / "x.csv", camera="chase")
    assert not list(tmp_path.iterdir())
    assert log.path.exists()


def test_each_access_unit_is_a_picture_and_a_viewer_can_begin_each_second() -> None:
    shades = [np.full((48, 64, 3), 6 * k, np.uint8) for k in range(30)]
    units = list(access_units(iter(shades), (64, 48), 25))
    assert len(units) == 30
    kinds = [[part[0] & 0x1F for part in unit.split(b"\0\0\1")[1:]] for unit in units]
    SEQUENCE, PICTURE, KEY = 7, 8, 5  # types of NAL units, ITU-T H.264 table 7-1
    for k, found in enumerate(kinds):
        assert ({SEQUENCE, PICTURE, KEY} <= set(found)) == (k in (0, 25)), k
    for start in (0, 25):
        decoder = av.CodecContext.create("h264", "r")
        decoder.flags |= av.codec.context.Flags.low_delay
        pictures = [p for u in units[start:] for p in decoder.decode(av.Packet(u))]
        pictures += decoder.decode(None)
        means = [float(p.to_ndarray(format="rgb24").mean()) for p in pictures]
        np.testing.assert_allclose(means, [6 * k for k in range(start, 30)], atol=4)


@pytest.mark.skipif(
    NODE is None or not (MODULES / "@mcap").is_dir(),
    reason="npm install --no-save @mcap/core @mcap/nodejs @mcap/support protobufjs",
)
def test_foxgloves_own_library_decodes_every_message(copy: Log, tmp_path: Path) -> None:
    # Modules are looked for from the script's folder upwards.
    script = Path(__file__).with_name("decode.mjs")
    done = subprocess.run([str(NODE), script, copy.path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    assert found["/truth"]["count"] == len(copy)
    last = copy.nearest("/truth", copy.end)
    for field, shape in copy.topics["/truth"].items():
        assert found["/truth"]["last"].get(field, 0.0) == last[field].tolist(), (field, shape)
    assert {"/tf", "/scene", "/arrows", "/state", "/law"} <= set(found)
    frames = found["/tf"]["last"]["transforms"]
    assert frames[-1]["child_frame_id"] == "reference"
