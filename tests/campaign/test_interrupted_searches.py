"""Searches that a signal ends: no half of an answer, and no traceback."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from one_axis import ONE_AXIS, written

from mjspace.campaign.falsify import falsify
from mjspace.campaign.margins import Margin, Question, find
from mjspace.campaign.members import Campaign, population
from mjspace.campaign.tune import Goal, Varied, tune
from mjspace.interrupts import Interrupted
from mjspace.runner import workers

ENDED = (Interrupted, KeyboardInterrupt)
"""The signal is obeyed as before the search: as Ctrl-C is, unless the shell ignores it."""
SCENARIO = (
    ONE_AXIS.replace("checks = []", "")
    + """
[[checks]]
name = "rate"
signal = "truth.rate"
below = 0.1

[[dispersions]]
key = "law.rate_gain"
distribution = "uniform"
low = 2
high = 8
"""
)


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a signal come while the workers begin: none of them makes a call."""

    @contextmanager
    def team(module: str, stop: Any, processes: Any) -> Iterator[Any]:
        stop.signal = signal.SIGINT
        yield lambda calls: iter(())

    def each(calls: Any, stop: Any, processes: Any) -> Iterator[tuple[int, Margin]]:
        stop.signal = signal.SIGINT
        yield 0, Margin("delay")

    monkeypatch.setattr(workers, "team", team)
    monkeypatch.setattr(workers, "each", each)


@pytest.mark.usefixtures("interrupted")
def test_a_search_that_is_interrupted_ends_as_one(tmp_path: Path) -> None:
    what = Campaign(written(tmp_path, SCENARIO), (), 20, 1)
    with pytest.raises(ENDED):
        falsify(population(what))
    varied, goal = [Varied("initial.rate[0]", 0.001, 0.1)], Goal("rms(truth.rate)", ())
    with pytest.raises(ENDED):
        tune(what, varied, goal, draws=1, fresh=1)


@pytest.mark.usefixtures("interrupted")
def test_margins_that_are_interrupted_are_none(tmp_path: Path) -> None:
    with pytest.raises(ENDED):
        find(Question(written(tmp_path, SCENARIO)))
