"""Flying again from the log alone."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.assembly import assemble
from mjspace.errors import InputError
from mjspace.flight import Result, run
from mjspace.flown import scenario_of
from mjspace.loading import component
from mjspace.log_reader import Log
from mjspace.plant import UnphysicalInertiaWarning
from mjspace.replay import replay, verify

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
    assert found.time == pytest.approx(0.301)
    assert found.field == "physics"
    assert found.logged != found.flown
    assert "/state.physics" in str(found)
    assert "t = 0.301 s" in str(found)


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
