"""The log of a flight against what flew: every topic against its own source, and their units."""

import errno
import gzip
import threading
from collections.abc import Iterator
from pathlib import Path
from time import sleep
from typing import Any

import mujoco
import numpy as np
import pytest
from blocks import blocks_of
from full_disk import room_for
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from mjspace.contract import Measurement, Reference
from mjspace.log import topics
from mjspace.log.chunk import encode
from mjspace.log.reader import Log
from mjspace.runner import flight_log
from mjspace.runner.logged_assembly import assembly_of
from mjspace.runner.recorder import AHEAD
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation import loop
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block
from mjspace.vehicle import vehicle
from mjspace.vehicle.vehicle import from_mjb

OVERRIDES = [
    "duration=0.1",
    "rates.physics='1 ms'",
    "rates.control='2 ms'",
    "sensors.rate.noise_std=0.01",
    "plant.gyrostat_inertia=[[15, 1, 1], [1, 12, 1], [1, 1, 18]]",
    "plant.wheels.torque_limit=5",
    "environment.torques=[{frame='body',bias=[1,2,3]}]",
    "checks=[{name='late',signal='truth.rate',below=9}]",
]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """51 periods in blocks of 16: frames at every fifth of them, at other places in each block."""
    with blocks_of(16):
        out = tmp_path_factory.mktemp("recorded")
        return run("contraction-adaptive", overrides=OVERRIDES, out=out).log


@pytest.fixture(scope="module")
def built(log: Log) -> Iterator[Assembly]:
    with assembly_of(log) as assembly:
        yield assembly


def frames(log: Log) -> dict[int, Any]:
    """Return the messages on /tf by their stamp [ns]."""
    with log.path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return {m.log_time: d for _, _, m, d in reader.iter_decoded_messages(["/tf"])}


def test_frames_are_those_of_the_state(log: Log) -> None:
    model = from_mjb(gzip.decompress(log.attachment("model.mjb.gz")))
    data = mujoco.MjData(model)
    found = frames(log)
    assert sorted(found) == [10_000_000 * k for k in range(11)]  # 100 times a second
    for stamp, message in found.items():
        row = log.nearest("/state", stamp / 1e9)
        assert round(float(row["time"]) * 1e9) == stamp
        mujoco.mj_setState(model, data, row["physics"], mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_kinematics(model, data)
        *bodies, reference = message.transforms
        assert len(bodies) == model.nbody - 1
        for frame in bodies:
            body = data.body(frame.child_frame_id)
            place, turn = frame.translation, frame.rotation
            assert [place.x, place.y, place.z] == body.xpos.tolist()
            assert [turn.w, turn.x, turn.y, turn.z] == body.xquat.tolist()
        assert reference.child_frame_id == "reference"
        place, turn = reference.translation, reference.rotation
        wanted = log.nearest("/reference", stamp / 1e9)["attitude"]
        assert [turn.w, turn.x, turn.y, turn.z] == wanted.tolist()
        here = log.nearest("/truth", stamp / 1e9)["position"]  # none is desired
        assert [place.x, place.y, place.z] == here.tolist()
    bus = next(t for t in found[100_000_000].transforms if t.child_frame_id == "bus")
    truth = log.nearest("/truth", 0.1)["attitude"]
    assert [bus.rotation.w, bus.rotation.x] == pytest.approx(truth[:2], rel=1e-14)


def test_a_slow_law_has_a_frame_each_period(tmp_path: Path) -> None:
    short = ["duration=0.2", "rates.control='50 ms'", "checks=[]"]
    log = run("detumble-wheels", overrides=short, out=tmp_path).log
    assert sorted(frames(log)) == [50_000_000 * k for k in range(5)]


def rows(log: Log, topic: str, kind: Any) -> Any:
    """Return a topic's columns as a ``Measurement`` or a ``Reference``."""
    return kind(**{name: values for name, values in log.read(topic).items() if name != "time"})


def test_measurement_and_command_are_what_the_law_saw_and_said(log: Log, built: Assembly) -> None:
    """The law computes each row again from the log: its state, what it saw, what it was to do."""
    state = log.read("/state")
    seen, wanted = rows(log, "/measurement", Measurement), rows(log, "/reference", Reference)
    command, signals = log.read("/command"), log.read("/law")
    time = state["time"]
    names = [name.removeprefix("law_") for name in state if name.startswith("law_")]
    begin = built.law.reset(seen._map(lambda a: a[:1]), _row(wanted, 0))
    assert sorted(begin._fields) == sorted(names)
    for k in range(len(time) - 1):
        before = type(begin)(*(state[f"law_{name}"][k][None] for name in begin._fields))
        measured = seen._map(lambda a, k=k: a[k][None])
        after, said, shown = built.law.step(before, time[k], measured, _row(wanted, k))
        np.testing.assert_array_equal(said.torque[0], command["torque"][k])
        for name, value in shown._asdict().items():
            np.testing.assert_array_equal(np.ravel(value), np.ravel(signals[name][k]), name)
        for name, value in after._asdict().items():
            np.testing.assert_array_equal(value[0], state[f"law_{name}"][k + 1], name)


def _row(fields: Any, k: int) -> Any:
    return type(fields)(*(a[k] for a in fields))


def test_truth_reference_and_disturbance_have_their_own_sources(log: Log, built: Assembly) -> None:
    truth, seen, said = log.read("/truth"), log.read("/measurement"), log.read("/command")
    for name in ("attitude", "wheel_speed"):  # ideal sensors
        np.testing.assert_array_equal(truth[name], seen[name])
    assert 0.005 < np.std(truth["rate"] - seen["rate"]) < 0.02  # one of noise 0.01
    wanted = built.reference.at(0.002 * np.arange(51))
    for name, values in log.read("/reference").items():
        if name != "time":
            np.testing.assert_array_equal(values, getattr(wanted, name), name)
    pushed = log.read("/disturbance")
    np.testing.assert_allclose(pushed["torque"], np.tile([1.0, 2.0, 3.0], (51, 1)), rtol=1e-12)
    assert not pushed["force"].any()
    wheels = built.actuators.kinds[0]
    given, cut = wheels.motor_torque(said["torque"], truth["wheel_speed"], 0.001)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(said["wheel_torque"], given)
    events = {(event.time, event.message) for event in log.events()}
    before = np.zeros(3, bool)
    for time, now in zip(truth["time"], cut.astype(bool), strict=True):
        for wheel in range(3):
            began = bool(now[wheel] and not before[wheel])
            assert ((time, f"wheel_{wheel} saturated") in events) is began
        before = now
    assert cut.any()


def test_the_verdict_stands_at_the_end_of_the_log(log: Log) -> None:
    verdict = log.events()[-1]
    assert (verdict.time, verdict.level) == (0.1, "INFO")
    assert verdict.message.startswith("PASS late: ")
    assert log.complete


@pytest.fixture
def slow_disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Blocks of 8 periods, written only when the flight is as far ahead as it may be.

    Yields, for each chunk, how many blocks the flight had flown then.
    """
    flown = 0
    seen: list[int] = []

    def counted(*arguments: Any, **options: Any) -> Iterator[Block]:
        nonlocal flown
        for block in loop.fly(*arguments, **options):
            flown += 1
            yield block
        flown = 10**9

    def slow(parts: Any, position: int) -> Any:
        for _ in range(2000):  # 10 s
            if flown > len(seen) + AHEAD:
                break
            sleep(0.005)
        sleep(0.005)  # and to go further, if it may
        seen.append(flown)
        return encode(parts, position)

    monkeypatch.setattr("mjspace.runner.run.fly", counted)
    monkeypatch.setattr("mjspace.log.file.encode", slow)
    with blocks_of(8):
        yield seen


TURNS = "checks=[{name='turns',signal='truth.rate[0]',statistic='final',below=9}]"
SHORT = ["duration=0.2", "events=[]", TURNS]  # 41 periods of 5 ms, 6 blocks


def test_a_slow_disk_holds_up_the_flight_and_not_its_memory(
    slow_disk: list[int], tmp_path: Path
) -> None:
    """With a block being written and one that waits, the flight has flown one more at most."""
    run("detumble-wheels", overrides=SHORT, out=tmp_path)
    assert slow_disk[:3] == [3, 4, 5]


def test_what_a_slow_disk_gets_is_what_flew_and_was_judged(
    slow_disk: list[int], tmp_path: Path
) -> None:
    flown = run("detumble-wheels", overrides=SHORT, out=tmp_path)
    assembly = assemble(*load("detumble-wheels", SHORT))
    begin = first_start(assembly, [0])
    blocks = [block.rows["/state"]["physics"].copy() for block in fly(assembly, begin)]
    physics = flown.log.read("/state", ["physics"])["physics"]
    assert physics.tobytes() == np.concatenate(blocks)[:, 0].tobytes()
    (verdict,) = flown.verdicts
    assert verdict.measured == flown.log.read("/truth", ["rate"])["rate"][-1, 0]
    assert flown.log.events()[-1].message == verdict.line


@pytest.mark.parametrize("periods", [24, 41], ids=["in a chunk", "in the summary"])
def test_a_disk_that_fills_up_ends_the_flight_and_what_fitted_is_kept(
    periods: int, tmp_path: Path
) -> None:
    with blocks_of(8):
        whole = run("detumble-wheels", overrides=SHORT, out=tmp_path / "whole").path
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    fourth = summary.chunk_indexes[3].chunk_start_offset
    room = fourth + 100 if periods == 24 else whole.stat().st_size - 1
    full = pytest.raises(OSError, match=r"File too large: '.*flight\.mcap'")
    with blocks_of(8), room_for(room), full:
        run("detumble-wheels", overrides=SHORT, out=tmp_path / "full")
    log = Log(tmp_path / "full/flight.mcap")
    assert (log.complete, len(log)) == (False, periods)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("log")]


def test_a_log_that_cannot_be_begun_ends_the_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("mjspace.log.file.create", full)
    with pytest.raises(OSError, match=r"No space left on device: .*flight\.mcap"):
        run("detumble-wheels", overrides=SHORT, out=tmp_path)


def test_flights_of_one_model_compress_and_describe_it_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []

    def counted(module: Any, name: str) -> None:
        function = getattr(module, name)

        def call(what: Any) -> Any:
            done.append(name)
            return function(what)

        monkeypatch.setattr(module, name, call)

    counted(vehicle, "packed")
    counted(flight_log, "scene")
    heavier = "plant.gyrostat_inertia=[[16, 0, 0], [0, 12, 0], [0, 0, 18]]"
    models = {}
    for number, change in enumerate(([], [], [heavier])):
        flown = run("detumble-wheels", overrides=[*SHORT, *change], out=tmp_path / str(number))
        models[number] = flown.log.attachment("model.mjb.gz")
        if number == 0:
            done.clear()  # the model may be that of an earlier flight
        if number == 1:
            assert done == []
    assert done == ["packed", "scene"]
    assert models[0] == models[1] != models[2]


DIMENSIONLESS = {"attitude", "contact", "foot_contact", "hull_contact", "crash", "time"}
A_FLIGHT_OF_EACH_KIND = [
    *("detumble-wheels", "detumble-thrusters", "b-dot", "cmg-slew", "dgvscmg-ideal"),
    *("dgvscmg-tracking", "lander-estimated", "pmsm-speed", "desaturation-thrusters"),
]


@pytest.mark.parametrize("scenario", A_FLIGHT_OF_EACH_KIND)
def test_each_field_has_a_unit_and_each_unit_a_field(scenario: str, tmp_path: Path) -> None:
    """But for a law's own signals, which are whatever it likes, and for the raw state."""
    period = load(scenario)[0].rates.control
    short = [f"duration={2 * period}", "checks=[]", "events=[]"]
    path = run(scenario, overrides=short, out=tmp_path).path
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    log = Log(path)
    for channel in summary.channels.values():
        fields = set(log.topics.get(channel.topic, ()))
        units = {key[5:]: unit for key, unit in channel.metadata.items() if key[:5] == "unit."}
        assert units.keys() <= fields, channel.topic
        if channel.topic in log.topics and channel.topic not in ("/state", "/law"):
            assert fields - units.keys() <= DIMENSIONLESS, channel.topic
        assert all(units.values())


def test_one_name_has_one_unit() -> None:
    declared = topics.units()
    by_name: dict[str, set[str]] = {}
    for topic in ("/truth", "/measurement", "/reference"):
        for name, unit in declared[topic].items():
            by_name.setdefault(name, set()).add(unit.si)
    assert {name: units for name, units in by_name.items() if len(units) > 1} == {}
