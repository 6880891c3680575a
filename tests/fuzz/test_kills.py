"""Flights that get a signal at any instant leave a log that is flown again bit for bit."""

import signal
from itertools import islice

import kills
import pytest
from kills import Kill

# A machine that does other things at once takes its time.
BUSY = {"lost": 10.0, "answered": 15.0}


@pytest.mark.parametrize(
    "kill",
    [
        Kill("contraction-ideal", signal.SIGKILL, 1.5),
        Kill("detumble-wheels", signal.SIGTERM, 1.0),
        Kill("wheel-failure", signal.SIGKILL, 0.4),
    ],
    ids=lambda kill: f"{kill.scenario}-{kill.number.name}",
)
def test_a_signal_at_any_instant_loses_nothing_else(kill: Kill) -> None:
    assert kills.attempt(kill, **BUSY).trouble == ""


@pytest.mark.slow
def test_many_signals_lose_nothing_else() -> None:
    for name, kill in islice(kills.cases(15), 15):
        found = kills.attempt(kill, **BUSY)
        assert not found.trouble, f"{name}: {found.trouble}"
