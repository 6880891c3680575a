"""Twelve random satellites with a double-gimbal CMG, as one batch: see benchmarks/."""

import runpy
from pathlib import Path

import numpy as np
import pytest

BENCHMARK = Path(__file__).parents[1] / "benchmarks/dgvscmg_dispersed.py"


@pytest.mark.long
def test_all_of_twelve_fly_within_their_limits_and_reject_their_vibration() -> None:
    here = runpy.run_path(str(BENCHMARK))
    draw = here["drawn"](here["SEED"], 12)
    with_it = here["flown"](draw, [])
    without = here["flown"](draw, here["NO_REJECTION"])
    assert with_it.gimbal_rate.max() < 5.5  # of the 5 that are asked for at most
    assert with_it.gimbal_current.max() < 15.0
    assert with_it.wheel_current.max() < 20.0
    assert np.all(with_it.torque_error < 0.05 * without.torque_error)
