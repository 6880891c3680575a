"""The Allan deviation of gyros of a satellite at rest against their data sheets' numbers."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.contract import Array

TOOL: dict[str, Any] = runpy.run_path(str(Path(__file__).parents[2] / "tools/allan_deviation.py"))
LEVEL = 0.9999
"""Of the interval: of some 160 that an honest gyro has, one in 60 tests fails."""


@pytest.fixture(scope="module")
def reports() -> dict[str, Array]:
    """What each gyro reports in four hours at 10 Hz, (144001, 3) [rad/s]."""
    found: dict[str, Array] = TOOL["still"](14400.0)
    return found


def misses(rate: Array, expected: Any) -> list[float]:
    """Return the cluster times [s] at which an axis' interval does not hold what is expected."""
    tau, found = TOOL["deviation"](rate)
    right = np.sqrt(expected(tau))
    missed = []
    for k, multiple in enumerate(TOOL["MULTIPLES"]):
        low, high = TOOL["interval"](found[k], multiple, len(rate), LEVEL)
        if not np.all((low < right[k]) & (right[k] < high)):
            missed.append(float(tau[k]))
    return missed


@pytest.mark.parametrize("name", ["noise", "walk", "markov", "all"])
def test_the_deviation_is_that_of_the_data_sheet(name: str, reports: dict[str, Array]) -> None:
    assert len(reports[name]) == 144001
    expected = TOOL["EXPECTED"][name]
    assert misses(reports[name], expected) == []
    # A number of the data sheet that is off by 5 % is seen.
    for off in (0.95, 1.05):
        assert misses(reports[name], lambda tau, off=off: off**2 * expected(tau))


def test_each_part_is_seen_where_all_act(reports: dict[str, Array]) -> None:
    for name in ("noise", "walk", "markov"):
        part, whole = TOOL["EXPECTED"][name], TOOL["EXPECTED"]["all"]
        assert misses(reports["all"], lambda tau, p=part, w=whole: w(tau) - p(tau)), name


def test_of_long_clusters_the_processes_are_those_of_the_standard() -> None:
    """IEEE Std 952-1997: K^2 tau / 3 (C.1.4), and (C.1.6) with q^2 Tc^2 = 2 sigma^2 Tc."""
    tau = np.array([20.0, 100.0])
    np.testing.assert_allclose(TOOL["of_walk"](tau), TOOL["WALK"] ** 2 * tau / 3.0, rtol=1e-4)
    std, time = TOOL["INSTABILITY"], TOOL["TIME"]
    left = 3.0 - 4.0 * np.exp(-tau / time) + np.exp(-2.0 * tau / time)
    standard = 2.0 * std**2 * time / tau * (1.0 - time / (2.0 * tau) * left)
    np.testing.assert_allclose(TOOL["of_markov"](tau), standard, rtol=1e-4)
    short = TOOL["PERIOD"] * np.array([1.0])
    kept = np.exp(-TOOL["PERIOD"] / time)
    np.testing.assert_allclose(TOOL["of_markov"](short), std**2 * (1.0 - kept), rtol=1e-9)
