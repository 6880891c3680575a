"""Flying again from the log alone."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from log_samples import rewritten

from mjspace.assembly import assemble
from mjspace.errors import InputError
from mjspace.flight import Result, run
from mjspace.flown import scenario_of
from mjspace.loading import component, to_toml
from mjspace.log_layout import doubles
from mjspace.log_reader import Log
from mjspace.plant import UnphysicalInertiaWarning
from mjspace.replay import replay, verify
from mjspace.scenario import Scenario

pytestmark = pytest.mark.filterwarnings(
    f"ignore::{UnphysicalInertiaWarning.__module__}.UnphysicalInertiaWarning"
)

NOISY = (
    "duration=0.4",
    "seed=7",
    "sensors.rate.noise=0.01",
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
    with pytest.warns(UnphysicalInertiaWarning):
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


def test_a_difference_is_named(
    noisy: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A law that computes a last bit differently from 0.3 s on."""
    from mjspace import replay as module

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
    "sensors.rate.noise=0.01",
    "sensors.rate.bias_walk=0.01",
    "faults=[{motor='wheel_0', kind='delayed', value='2 ms', at=0.01}]",
)
"""A flight of which /state holds the memory of law, sensors, actuators and faults."""


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Result:
    with pytest.warns(UnphysicalInertiaWarning):
        result = run(
            "contraction-adaptive", overrides=EVERYTHING, out=tmp_path_factory.mktemp("all")
        )
    kinds = {field.partition("_")[0] for field in result.log.topics["/state"]}
    assert kinds == {"physics", "law", "sensor", "actuator"}
    return result


@pytest.mark.parametrize("topic", ["/state", "/truth", "/measurement", "/command", "/law"])
def test_one_bit_of_any_field_is_named(
    everything: Result, tmp_path: Path, topic: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The digests name the topic; without them, the flight again names field and time."""
    monkeypatch.setattr("mjspace.simulation.BLOCK_PERIODS", 7)  # and not in the first block alone
    log = everything.log
    for field in log.topics[topic]:
        path = changed_log(log, tmp_path / "one.mcap", topic, field, 30, digests=False)
        found = verify(path)
        assert found is not None, field
        assert (found.topic, found.field, found.index) == (topic, field, 0)
        assert found.time == pytest.approx(0.03, abs=1e-9)
        assert f"{topic}.{field}[0] differs first at t = 0.03 s" in str(found)
    path = changed_log(log, tmp_path / "one.mcap", topic, field, 30, digests=True)
    with pytest.raises(InputError, match=f"log: {topic} changed since the flight"):
        verify(path)


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
    assert verify(result.path, start=0.2) is None
    assert verify(result.path, start=0.3) is None


def test_what_cannot_be_replayed_is_refused(noisy: Result, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"t = 3 s is not in the log: it has 0 to 0\.4 s"):
        verify(noisy.path, start=3.0)
    nonsense = tmp_path / "x.mcap"
    nonsense.write_bytes(b"hello")
    with pytest.raises(InputError, match=r"log: .*x\.mcap"):
        verify(nonsense)
    with pytest.raises(InputError, match="the very log"):
        replay(noisy.path, noisy.path.parent)
    with pytest.raises(InputError, match=r"law: .*Damper"):
        replay(noisy.path, tmp_path, law=component("contraction:Damper", []))


def test_a_log_that_ends_with_a_block_is_verified_to_its_end(
    noisy: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if it had been interrupted there: the flight goes on to a block that the log lacks."""
    from mjspace import replay as module

    longer = scenario_of(noisy.log).model_copy(update={"duration": 0.8})
    monkeypatch.setattr(module, "scenario_of", lambda _: longer)
    for periods in (401, 200, 7):
        monkeypatch.setattr("mjspace.simulation.BLOCK_PERIODS", periods)
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


def test_an_attachment_stays_in_its_folder(noisy: Result, tmp_path: Path) -> None:
    inside = rewritten(noisy.path, tmp_path / "in.mcap", attachments={"law/beside.py": b""})
    assert verify(inside) is None
    outside = rewritten(noisy.path, tmp_path / "out.mcap", attachments={"law/../../up.py": b""})
    with pytest.raises(InputError, match=r"the attachment 'law/\.\./\.\./up\.py' leads out"):
        verify(outside)


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
