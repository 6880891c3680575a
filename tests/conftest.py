"""Its presence puts this folder on the path: ``from oracle import fly`` works in every test."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from blocks import blocks_of
from hypothesis import settings

from mjspace.runner.run import run
from mjspace.simulation import loop

# The first call of anything may compile it. In CI the examples are the same on every run, since a
# failure could not be told from a change.
settings.register_profile("mjspace", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("mjspace")

# A shell that starts the tests in the background has them ignore Ctrl-C, and all that they start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def one_block() -> Iterator[None]:
    """Let a short flight be one block on a slow machine too."""
    with blocks_of(loop.BLOCK_PERIODS):
        yield


@pytest.fixture
def short_blocks() -> Iterator[None]:
    """Let a short flight be several blocks, of 40 periods each."""
    with blocks_of(40):
        yield


@pytest.fixture(scope="session")
def pictured_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of the adaptive law, in orbit, disturbed, with wheels that saturate: to draw."""
    overrides = (
        "duration=1",
        # Of a body that can exist: the papers' own warns.
        "plant.gyrostat_inertia=[[15, 1, 1], [1, 12, 1], [1, 1, 18]]",
        "plant.wheels.torque_limit=5",
        "environment.orbit={semi_major_axis='6871 km', inclination='51 deg'}",
        "environment.torques=[{bias=[0.01, 0, 0]}]",
    )
    folder = tmp_path_factory.mktemp("pictured")
    return run("contraction-adaptive", overrides=overrides, out=folder).path


_LAW = """
import time
from pathlib import Path
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray

class Law:
    def reset(self, measurement, reference):
        return None

    def step(self, state, now, measurement, reference):
        if now > {at}:
            {what}
        return None, Command(np.zeros(3)), ()
"""


@pytest.fixture
def failing_law(tmp_path: Path) -> Callable[..., Path]:
    """Write a scenario in which a law in ``law.py`` commands no torque and fails after a time [s].

    Returned is its path; ``before`` is what stands in it before the table of the law, ``what`` the
    statement that fails.
    """

    def write(
        at: float,
        before: str = 'base = "detumble-wheels"\nchecks = []\n',
        what: str = 'raise ArithmeticError("no way on")',
    ) -> Path:
        (tmp_path / "law.py").write_text(_LAW.format(at=at, what=what))
        path = tmp_path / "x.toml"
        path.write_text(f'{before}[law]\nkind = "law.py:Law"\n')
        return path

    return write
