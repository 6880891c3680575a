"""Twelve random satellites with a double-gimbal CMG, as one batch: see benchmarks/."""

import runpy
from pathlib import Path

import numpy as np
import pytest

BENCHMARK = Path(__file__).parents[2] / "benchmarks/dgvscmg_dispersed.py"


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


def test_two_of_them_fly_for_a_moment_each_in_its_own_way() -> None:
    """The same draws, the same limits; whether the vibration is rejected takes longer to show."""
    here = runpy.run_path(str(BENCHMARK))
    draw, many = here["drawn"](here["SEED"], 2), here["drawn"](here["SEED"], 12)
    assert len(many.motion) == 12
    for few, all_of_them in zip(draw[1:], many[1:], strict=True):
        np.testing.assert_array_equal(few, all_of_them[:2])
    here["flown"].__globals__["SETTLED"] = 0.0
    figures = here["flown"](draw, ["duration=0.02"])
    for name, values in figures._asdict().items():
        assert values.shape == (2,), name
        assert np.isfinite(values).all(), name
        assert values[0] != values[1], name
    np.testing.assert_allclose(figures.wheel_speed, draw.wheel_speed, rtol=0.1)
    assert figures.gimbal_rate.max() < 5.5  # of the 5 that are commanded at most
    apart = [np.degrees(4.0 * np.arctan(np.linalg.norm(m.start_mrp))) for m in draw.motion]
    np.testing.assert_allclose(figures.pointing, apart, rtol=0.02)  # where each starts
