"""Flying again from the log alone."""

import tomllib
from collections import namedtuple
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from blocks import blocks_of
from log_samples import rewritten
from mjspace.controllers.landing.lander_estimator import EstimatedVectoring

from mjspace.contract import Measurement, Reference
from mjspace.errors import InputError
from mjspace.log.encoding import doubles
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.runner.former_names import FORMER, as_logged
from mjspace.runner.logged_assembly import assembly_of
from mjspace.runner.replay import (
    Difference,
    _other_streams,
    first_difference,
    replay,
    start_of,
    verify,
)
from mjspace.runner.run import Result, run
from mjspace.scenario.loading import component, to_toml, validate
from mjspace.scenario.scenario import Scenario
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block, Rows, shapes

NOISY = (
    "duration=0.4",
    "seed=7",
    "sensors.rate.noise_std=0.01",
    "sensors.attitude.period='4 ms'",
    "sensors.attitude.delay='8 ms'",
    "plant.wheels.torque_limit=5",
)

DAMPER = '''
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray

class State(NamedTuple):
    steps: float

class Signals(NamedTuple):
    steps: float

class Damper:
    """Counts its steps, so that a replay from the middle must be given the count."""

    def __init__(self, gain=2.0):
        self.gain = gain

    def reset(self, measurement, reference):
        return State(0.0)

    def step(self, state, time, measurement, reference):
        torque = -self.gain * (1 + 0.01 * state.steps) * measurement.rate
        return State(state.steps + 1), Command(torque), Signals(state.steps)
'''


@pytest.fixture(scope="module")
def noisy(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return run("contraction-adaptive", overrides=NOISY, out=tmp_path_factory.mktemp("noisy"))


def test_the_same_flight_again_is_the_same_bit_for_bit(noisy: Result) -> None:
    assert verify(noisy.path) is None
    assert verify(noisy.path, start=0.25) is None


def test_a_replay_writes_the_same_state(noisy: Result, tmp_path: Path) -> None:
    again = replay(noisy.path, tmp_path, start=0.1)
    new, old = Log(again.path).read("/state"), noisy.log.read("/state", start=0.1)
    assert new.keys() == old.keys()
    for field in old:
        assert new[field].tobytes() == old[field].tobytes()


def renamed(kind: Any) -> Any:
    """Return the named tuple with the names that an earlier version gave its fields."""
    return namedtuple(kind.__name__, [FORMER.get(field, field) for field in kind._fields])


def test_a_log_from_before_fields_were_renamed_flies_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as earlier:
        own, *joined = EstimatedVectoring.kinds
        earlier.setattr(EstimatedVectoring, "kinds", (own, *map(renamed, joined)))
        old = run("lander-estimated", overrides=["duration=0.1", "checks=[]"], out=tmp_path)
    assert {"wanted_thrust", "believed_position"} <= old.log.topics["/law"].keys()
    assert "law_believed_bias" in old.log.topics["/state"]
    assert verify(old.path) is None
    assert verify(old.path, start=0.06) is None
    new = replay(old.path, tmp_path / "again", start=0.06).log
    assert {"desired_thrust", "estimated_position"} <= new.topics["/law"].keys()
    after, before = new.read("/state"), old.log.read("/state", start=0.06)
    assert after["law_estimated_bias"].tobytes() == before["law_believed_bias"].tobytes()


def test_a_field_of_ones_own_keeps_its_name() -> None:
    own = {"/law": {"wanted": 1, "given": 2}, "/state": {"law_given": 3}}
    assert as_logged(own, own) == own
    both = {"/law": {"desired_speed": 1, "wanted": 2}}
    assert as_logged(both, both) == both
    now = {"/law": {"desired_speed": 1}, "/state": {"law_applied_torque": 3, "physics": 4}}
    assert as_logged(now, now) == now
    before = {"/law": {"wanted": 1}, "/state": {"law_given": 3, "physics": 4}}
    assert as_logged(now, before) == before


def test_a_difference_is_named(
    noisy: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A law that computes a last bit differently from 0.3 s on."""
    from mjspace.runner import logged_assembly as module

    def altered(*arguments: Any, **options: Any) -> Any:
        built = assemble(*arguments, **options)
        step = type(built.law).step

        def other(self: Any, state: Any, time: float, *seen: Any) -> Any:
            state, command, signals = step(self, state, time, *seen)
            if time > 0.2995:
                command = command._replace(torque=np.nextafter(command.torque, np.inf))
            return state, command, signals

        monkeypatch.setattr(type(built.law), "step", other)
        return built

    monkeypatch.setattr(module, "assemble", altered)
    found = verify(noisy.path)
    assert found is not None
    assert found.time == pytest.approx(0.3)
    assert (found.topic, found.field) == ("/command", "torque")
    assert found.flown == np.nextafter(found.logged, np.inf)
    assert "/command.torque[0] differs first at t = 0.3 s" in str(found)


def changed_log(log: Log, out: Path, topic: str, field: str, number: int, *, digests: bool) -> Path:
    """Return the log written anew with the last bit of a field's first number changed in a row."""
    layout = doubles(log.topics[topic])

    def change(at: str, k: int, data: bytes) -> bytes:
        if (at, k) != (topic, number):
            return data
        row = np.frombuffer(bytearray(data), layout.dtype)
        bits = row[field].reshape(1, -1).copy().view(np.uint64)
        bits[0, 0] ^= np.uint64(1)
        row[field] = bits.view(np.float64).reshape(row[field].shape)
        return row.tobytes()

    return rewritten(log.path, out, change, digests=digests)


EVERYTHING = (
    "duration=0.05",
    "sensors.rate.noise_std=0.01",
    "sensors.rate.bias_walk=0.01",
    "faults=[{motor='wheel_0', kind='delayed', value='2 ms', at=0.01}]",
)
"""A flight of which /state holds the memory of law, sensors, actuators and faults."""


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Result:
    result = run("contraction-adaptive", overrides=EVERYTHING, out=tmp_path_factory.mktemp("all"))
    kinds = {field.partition("_")[0] for field in result.log.topics["/state"]}
    assert kinds == {"physics", "law", "sensor", "actuator"}
    return result


@pytest.mark.parametrize("topic", ["/state", "/truth", "/measurement", "/command", "/law"])
def test_one_bit_of_any_field_is_named(everything: Result, tmp_path: Path, topic: str) -> None:
    """The digests name the topic; without them, the flight again names field and time."""
    log = everything.log
    for field in log.topics[topic]:
        path = changed_log(log, tmp_path / "one.mcap", topic, field, 30, digests=False)
        with blocks_of(7):  # also where it differs in a block other than the first
            found = verify(path)
        assert found is not None, field
        assert (found.topic, found.field, found.index) == (topic, field, 0)
        assert found.time == pytest.approx(0.03, abs=1e-9)
        assert f"{topic}.{field}[0] differs first at t = 0.03 s" in str(found)
    path = changed_log(log, tmp_path / "one.mcap", topic, field, 30, digests=True)
    with pytest.raises(InputError, match=f"log: {topic} changed since the flight"):
        verify(path)


TIMES = np.array([0.0, 0.1, 0.2, 0.3])


def difference(*changed: tuple[str, str, int, int], rows: int = 4) -> Any:
    """Return where a flight first differs from a log of that many rows; each change adds 0.5."""
    flown: Rows = {
        "/state": {"physics": np.zeros((4, 3)), "law_p": np.zeros((4, 2, 2))},
        "/law": {"error": np.zeros(4)},
    }
    logged: Rows = {
        topic: {"time": TIMES[:rows], **{name: a[:rows].copy() for name, a in fields.items()}}
        for topic, fields in flown.items()
    }
    for topic, field, row, index in changed:
        flown[topic][field].reshape(4, -1)[row, index] += 0.5
    return first_difference(logged, flown)


def test_of_several_differences_the_first_is_named() -> None:
    late, wide, scalar = ("/state", "physics", 3, 0), ("/state", "law_p", 2, 3), ("/law", "error")
    assert difference() is None
    assert difference(late) == Difference(0.3, *late[:2], 0, 0.0, 0.5)
    # in time, whatever the order of the fields
    assert difference(late, wide) == Difference(0.2, "/state", "law_p", 3, 0.0, 0.5)
    assert difference(late, wide, (*scalar, 1, 0)) == Difference(0.1, *scalar, 0, 0.0, 0.5)
    # of one field
    several = [("/state", "physics", row, index) for row, index in ((2, 2), (1, 2), (1, 1))]
    assert difference(*several) == Difference(0.1, "/state", "physics", 1, 0.0, 0.5)
    # of one instant, in the order in which they are flown
    both = [(*scalar, 2, 0), wide, ("/state", "physics", 2, 1)]
    assert difference(*both) == Difference(0.2, "/state", "physics", 1, 0.0, 0.5)
    # a log that ends before
    assert difference(late, rows=3) is None
    assert difference(wide, rows=3) == Difference(0.2, "/state", "law_p", 3, 0.0, 0.5)
    assert difference(wide, rows=0) is None


def test_bits_are_compared_and_not_numbers() -> None:
    zero, lost = np.zeros((1, 1)), np.full((1, 1), np.nan)
    for logged, flown, differ in ((zero, -zero, True), (lost, lost, False), (lost, -lost, True)):
        log: Rows = {"/law": {"time": TIMES[:1], "x": logged}}
        assert (first_difference(log, {"/law": {"x": flown}}) is not None) is differ


def test_progress_is_told_to_the_end_of_the_log_and_no_further(
    noisy: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the flight was interrupted: it is not flown on to the end of its scenario."""
    from mjspace.runner import logged_assembly as module

    longer = scenario_of(noisy.log).model_copy(update={"duration": 0.8})
    for flown in (scenario_of(noisy.log), longer):
        monkeypatch.setattr(module, "scenario_of", lambda _, flown=flown: flown)
        told: list[float] = []
        with blocks_of(150):
            assert verify(noisy.path, progress=told.append) is None
        assert told == pytest.approx([0.149, 0.299, min(0.449, flown.duration)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"/new": {"x": (1,)}}, r"/new holds None, flown again \{'x': \(1,\)\}"),
        ({"/law": None}, r"/law holds \{.*\}, flown again None"),
        ({"/command": {"torque": (4,)}}, r"/command holds .*, flown again \{'torque': \(4,\)\}"),
    ],
)
def test_a_log_of_other_topics_is_refused(
    noisy: Result, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], message: str
) -> None:
    """As one of a version that logged more, less, or otherwise."""
    from mjspace.runner import replay as module

    def other(block: Block) -> dict[str, Any]:
        return {topic: f for topic, f in (shapes(block) | change).items() if f is not None}

    monkeypatch.setattr(module, "shapes", other)
    with pytest.raises(InputError, match=rf"log: {message}: another version of mjspace wrote it"):
        verify(noisy.path)


def test_a_law_is_reset_with_what_was_measured_and_desired_there(
    noisy: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It tells the names of its state so, whose values are the log's."""
    asked: list[Any] = []
    with assembly_of(noisy.log) as built:
        reset = type(built.law).reset

        def noting(law: Any, measurement: Measurement, reference: Reference) -> Any:
            asked.append((measurement, reference))
            return reset(law, measurement, reference)

        monkeypatch.setattr(type(built.law), "reset", noting)
        next(fly(built, first_start(built, [0])))
        start = start_of(noisy.log, built, 0.25)
        (first, _), (measurement, reference) = asked
        shapes = {name: np.shape(a) for name, a in measurement._asdict().items()}
        assert shapes == {name: np.shape(a) for name, a in first._asdict().items()}
        rate = noisy.log.nearest("/measurement", 0.25)["rate"]
        np.testing.assert_array_equal(measurement.rate[0], rate)
        desired = built.reference.at(np.array([0.25]))
        for name, value in reference._asdict().items():
            np.testing.assert_array_equal(value, getattr(desired, name)[0])
        assert start.period == 250
        assert start_of(noisy.log, built, 0.25, fresh_law=True).law is None
        assert len(asked) == 2

        class Other(NamedTuple):
            memory: float

        monkeypatch.setattr(type(built.law), "reset", lambda *_: Other(0.0))
        message = "the log has no state 'memory' for this law: another flew"
        with pytest.raises(InputError, match=message):
            start_of(noisy.log, built, 0.25)


def test_another_law_from_the_middle(noisy: Result, tmp_path: Path) -> None:
    (tmp_path / "damper.py").write_text(DAMPER)
    other = component("damper.py:Damper", ["gain=3"])
    result = replay(noisy.path, tmp_path / "out", start=0.2, law=other, folder=tmp_path)
    log = Log(result.path)
    assert log.start == pytest.approx(0.2)
    first = log.read("/state", ["physics"], end=0.2)["physics"]
    assert (
        first.tobytes()
        == noisy.log.read("/state", ["physics"], start=0.2, end=0.2)["physics"].tobytes()
    )
    torque = log.read("/command", ["torque"])["torque"]
    seen = log.read("/measurement", ["rate"])["rate"]
    np.testing.assert_allclose(torque[0], -3.0 * seen[0], rtol=1e-14)
    # That log flies again by itself: the law is in it, and its state is too.
    (tmp_path / "damper.py").unlink()
    assert verify(result.path, start=0.2, trust=True) is None
    assert verify(result.path, start=0.3, trust=True) is None


def test_what_cannot_be_replayed_is_refused(noisy: Result, tmp_path: Path) -> None:
    for time in (3.0, -1.0, np.nan, np.inf, -np.inf):
        with pytest.raises(InputError, match=rf"t = {time:g} s is not in the log: it has 0 to 0"):
            verify(noisy.path, start=time)
    nonsense = tmp_path / "x.mcap"
    nonsense.write_bytes(b"hello")
    with pytest.raises(InputError, match=r"x\.mcap is not an MCAP file"):
        verify(nonsense)
    with pytest.raises(InputError, match="the log that"):
        replay(noisy.path, noisy.path.parent)
    with pytest.raises(InputError, match=r"law: .*Damper"):
        replay(noisy.path, tmp_path, law=component("contraction:Damper", []))


def test_a_log_that_ends_with_a_block_is_verified_to_its_end(
    noisy: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if it had been interrupted there: the flight goes on to a block that the log lacks."""
    from mjspace.runner import logged_assembly as module

    longer = scenario_of(noisy.log).model_copy(update={"duration": 0.8})
    monkeypatch.setattr(module, "scenario_of", lambda _: longer)
    for periods in (401, 200, 7):
        with blocks_of(periods):
            assert verify(noisy.path) is None


def test_a_cut_log_is_verified_as_far_as_it_goes(noisy: Result, tmp_path: Path) -> None:
    whole = noisy.path.read_bytes()
    short = tmp_path / "short.mcap"
    short.write_bytes(whole[: int(len(whole) * 0.7)])
    log = Log(short)
    assert not log.complete
    if len(log):
        assert verify(short) is None


def test_a_log_whose_state_is_laid_out_otherwise_is_refused(noisy: Result, tmp_path: Path) -> None:
    """As one of a version that packed its environment otherwise, which this one would leave out."""
    table = scenario_of(noisy.log).model_dump(mode="python")
    table["environment"]["torques"] = [{"bias": [1.0, 0.0, 0.0]}]
    other = to_toml(Scenario.model_validate(table)).encode()
    path = rewritten(noisy.path, tmp_path / "other.mcap", attachments={"scenario.toml": other})
    with pytest.raises(InputError, match="another version of mjspace laid its state out"):
        verify(path)


def test_under_another_law_what_looks_at_the_law_is_left_out(noisy: Result, tmp_path: Path) -> None:
    """Checks of the law's signals, and those that count from events of them; no other."""
    table = scenario_of(noisy.log).model_dump(mode="python")
    events = [{"name": "slow", "signal": "law.error", "below": 1.0}]
    events += [{"name": "turning", "signal": "truth.rate", "above": 0.01}]
    rate = {"signal": "truth.rate", "below": 1e3}
    checks = [{"name": "law", "signal": "law.error", "below": 1e9}]
    checks += [{"name": "after slow", "since": "slow", **rate}]
    checks += [{"name": "after turning", "since": "turning", **rate}, {"name": "always", **rate}]
    table |= {"events": events, "checks": checks}
    other = to_toml(Scenario.model_validate(table)).encode()
    path = rewritten(noisy.path, tmp_path / "other.mcap", attachments={"scenario.toml": other})
    (tmp_path / "damper.py").write_text(DAMPER)
    result = replay(path, tmp_path / "out", law=component("damper.py:Damper", []), folder=tmp_path)
    assert [verdict.check.name for verdict in result.verdicts] == ["after turning", "always"]


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ("noise = 0.01", "other random streams: verify it with version 0.1.0, revision abc"),
        ("delay = 0.01", ""),
        ("measures = 'rate'\nnoise_std = 0.01", ""),
    ],
)
def test_noise_of_an_earlier_version_is_the_reason_of_a_difference(table: str, reason: str) -> None:
    text = (
        "description = 'x'\nduration = 1\n[reference]\nkind = 'references:Hold'\n"
        f"[law]\nkind = 'coast:Coast'\n[sensors.rate]\n{table}\n"
    )
    logged: Any = SimpleNamespace(
        attachment=lambda name: text.encode(), metadata={"mjspace": "0.1.0", "git": "abc"}
    )
    scenario = validate(tomllib.loads(text), "log", context={"flown": True})
    assert _other_streams(logged, scenario).endswith(reason)
    assert bool(_other_streams(logged, scenario)) == bool(reason)
    difference = Difference(0.0, "/state", "physics", 0, 1.0, 2.0, _other_streams(logged, scenario))
    assert str(difference).endswith(reason or "flown 2.0")
