"""A flight is the same however it is cut into blocks, on any number of threads, under any load."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from blocks import blocks_of

from mjspace.contract import Event
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import load
from mjspace.simulation import loop
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

EVENTFUL = [
    "duration=0.6",
    "checks=[]",
    "sensors.rate={noise_std=1e-5,bias_walk=1e-6}",
    "plant.wheels.torque_limit=1.6",  # wheel 0 is cut from the start for 0.2 s, then free
    "events=[{name='slow',signal='truth.rate[0]',below=0.265},"
    "{name='noisy',signal='measurement.rate[1]',above=-0.15,level='WARNING'}]",
    "faults=[{motor='wheel_1',kind='noisy',value=0.1,at=0.1,until=0.2},"
    "{motor='wheel_2',kind='delayed',value='50 ms',at=0.31},"
    "{motor='wheel_0',kind='stuck',when={signal='command.torque[0]',above=-1.5}}]",
]

Flown = tuple[dict[str, bytes], list[Event]]


@pytest.fixture(scope="module")
def eventful() -> Assembly:
    return assemble(*load("detumble-wheels", EVENTFUL))


def flown(built: Assembly, members: tuple[int, ...] = (0, 1), threads: int = 1) -> Flown:
    """Return the bytes of every field of every topic, and all events."""
    blocks = list(fly(built, first_start(built, members), members, threads=threads))
    rows = {
        f"{topic}.{field}": np.concatenate([b.rows[topic][field] for b in blocks]).tobytes()
        for topic, fields in blocks[0].rows.items()
        for field in fields
    }
    rows["time"] = np.concatenate([block.time for block in blocks]).tobytes()
    return rows, [event for block in blocks for event in block.events]


@pytest.fixture(scope="module")
def whole(eventful: Assembly) -> Flown:
    """The flight in one block."""
    with blocks_of(500):
        assert len(list(fly(eventful, first_start(eventful, (0, 1)), (0, 1)))) == 1
        return flown(eventful)


def test_the_flight_has_events_of_every_kind(whole: Flown) -> None:
    """Or the other tests would say little."""
    told = [message for _, vehicle, _, message in whole[1] if vehicle == 0]
    for part in ("wheel_0 saturated", "slow: ", "noisy: ", "is noisy no more", "is stuck"):
        assert any(part in line for line in told), told
    times = [time for time, *_ in whole[1]]
    assert times == sorted(times)


def test_what_lasts_is_told_once(eventful: Assembly, whole: Flown) -> None:
    ((began, *_),) = [e for e in whole[1] if e[1] == 0 and e[3] == "wheel_0 saturated"]
    assert began == 0.0


@pytest.mark.parametrize("periods", [1, 7, 120])
def test_block_length_changes_no_bit_and_no_event(
    periods: int, eventful: Assembly, whole: Flown
) -> None:
    with blocks_of(periods):
        assert flown(eventful) == whole


def test_a_machine_that_is_too_slow_changes_neither(
    eventful: Assembly, whole: Flown, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "BLOCK_SECONDS", 0.0)
    assert flown(eventful) == whole


def test_threads_change_neither(eventful: Assembly, whole: Flown) -> None:
    assert flown(eventful, threads=2) == whole


DIGESTS = """
import sys
sys.path[:0] = {folders!r}
from test_blocks import digest
for name in {names!r}:
    print(name, digest(name))
"""
LIBRARIES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def digest(name: str) -> str:
    """Return what identifies the first periods of a scenario, with all that was computed before."""
    scenario, folder = load(name)
    short = scenario.model_copy(update={"duration": 4 * scenario.rates.control})
    rows, events = flown(assemble(short, folder), (0,))
    return hashlib.sha256(repr((sorted(rows.items()), events)).encode()).hexdigest()


def digests(names: list[str], threads: int | None) -> list[str]:
    """Return the digests as a process of its own finds them."""
    alone = {key: value for key, value in os.environ.items() if key not in LIBRARIES}
    if threads is not None:
        alone |= dict.fromkeys(LIBRARIES, str(threads))
    here = Path(__file__).parent
    code = DIGESTS.format(folders=[str(here), str(here.parent)], names=names)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        env=alone, check=True, capture_output=True, text=True,
    )  # fmt: skip
    return done.stdout.splitlines()


@pytest.mark.slow
def test_no_flight_depends_on_the_threads_of_the_algebra() -> None:
    names = scenario_names()
    assert digests(names, 1) == digests(names, None)
