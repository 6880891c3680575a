"""Blocks of a flight that have a known number of periods, however slow the machine is."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from mjspace.simulation import loop


@contextmanager
def blocks_of(periods: int) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop, "BLOCK_PERIODS", periods)
        patch.setattr(loop, "BLOCK_SECONDS", math.inf)
        yield
