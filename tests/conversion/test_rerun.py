"""A log as a recording of Rerun: its reader finds the log's numbers, units, frames and shapes."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.cli import app
from mjspace.conversion.convert import convert
from mjspace.errors import InputError
from mjspace.log.frames import bus_of
from mjspace.log.reader import Log
from mjspace.runner.run import run

chunk = pytest.importorskip("rerun.chunk")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    overrides = ["duration=1", "checks=[]"]
    return run("lqr-regulation", overrides=overrides, out=tmp_path_factory.mktemp("log")).log


@pytest.fixture(scope="module")
def recording(log: Log, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "flight.rrd"
    convert(log, path)
    return path


def column(recording: Path, entity: str, name: str) -> Any:
    """Return an entity's column, with the part of each chunk after the other."""
    parts = list(_batches(recording, entity, name))
    return [value for part in parts for value in part.to_pylist()]


def _batches(recording: Path, entity: str, name: str) -> Iterator[Any]:
    for each in chunk.RrdReader(recording).store().stream():
        if each.entity_path == entity:
            batch = each.to_record_batch()
            if name in batch.schema.names:
                yield batch[name]


def test_a_signal_is_curves_with_the_logs_numbers_and_unit(log: Log, recording: Path) -> None:
    truth = log.read("/truth", ["rate"])
    values = column(recording, "/truth/rate", "Scalars:scalars")
    assert np.array_equal(np.array(values), truth["rate"])
    times = np.concatenate([np.array(t) for t in _batches(recording, "/truth/rate", "time")])
    assert np.array_equal(times.astype("timedelta64[ns]").astype(int), np.rint(truth["time"] * 1e9))
    (names,) = column(recording, "/truth/rate", "SeriesLines:names")
    assert names == [f"rate[{i}] [rad/s]" for i in range(3)]


def test_every_signal_but_the_state_is_in_it(log: Log, recording: Path) -> None:
    entities = {each.entity_path for each in chunk.RrdReader(recording).store().stream()}
    for topic, fields in log.topics.items():
        for field, shape in fields.items():
            shown = topic != "/state" and 0 not in shape
            assert (f"{topic}/{field}" in entities) == shown, (topic, field)


def test_bodies_move_as_in_the_log_and_have_their_shapes(log: Log, recording: Path) -> None:
    turns = np.array(column(recording, "/world/bus", "Transform3D:quaternion"))[:, 0]
    attitude = log.read("/truth", ["attitude"], every=2)["attitude"]  # /tf has 100 Hz
    assert np.allclose(turns[: len(attitude)], attitude[:, [1, 2, 3, 0]], atol=1e-6)
    assert column(recording, "/world/bus/boxes", "Boxes3D:half_sizes")


def test_the_view_follows_the_bus_without_turning_with_it(recording: Path) -> None:
    follow = np.array(column(recording, "/world/follow", "Transform3D:quaternion"))[:, 0]
    assert (follow == [0.0, 0.0, 0.0, 1.0]).all()
    place = column(recording, "/world/follow", "Transform3D:translation")
    assert place == column(recording, "/world/bus", "Transform3D:translation")


def test_panels_are_laid_out_and_the_file_is_whole(recording: Path) -> None:
    reader = chunk.RrdReader(recording)
    (layout,) = reader.blueprints()
    (origins,) = (
        [
            each.to_record_batch()["ViewBlueprint:space_origin"].to_pylist()[0][0]
            for each in reader.stream(store=layout)
            if "ViewBlueprint:space_origin" in each.to_record_batch().schema.names
        ],
    )
    assert {"/world/follow", "/events", "/truth/attitude_error", "/truth/rate"} <= set(origins)
    rerun = Path(sys.executable).with_name("rerun")
    done = subprocess.run([rerun, "rrd", "verify", recording], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_layout_of_a_log_follows_the_bus(log: Log, tmp_path: Path) -> None:
    assert bus_of(log) == "bus"
    with pytest.raises(SystemExit, match="0"):
        app(["layout", str(log.path), "-o", str(tmp_path / "x.json")], standalone_mode=True)
    assert (tmp_path / "x.json").read_bytes() == log.attachment("foxglove_layout.json")


def test_the_rows_of_a_rate_alone(log: Log, tmp_path: Path) -> None:
    convert(log, tmp_path / "x.rrd", signals=["truth.rate[1]"], rate=10)
    values = column(tmp_path / "x.rrd", "/truth/rate", "Scalars:scalars")
    assert np.array_equal(np.array(values), log.read("/truth", ["rate"], every=20)["rate"][:, 1:2])


def test_without_reruns_library_one_line_says_what_to_install(
    log: Log, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"pip install 'mjspace\[rerun\]'"):
        convert(log, tmp_path / "x.rrd")
    assert not (tmp_path / "x.rrd").exists()
