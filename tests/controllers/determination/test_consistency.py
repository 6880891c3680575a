"""The filter in flight is consistent: its errors are as large as its covariance says.

A hundred members of a scenario, each with its own noise and bias, fly as one batch. Bar-Shalom, Li
and Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", section 5.4: the
normalized estimation error squared (NEES) of n members has n times 6 degrees of freedom, and the
normalized innovation squared (NIS) those of the samples.
"""

import functools
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

from mjspace.contract import Array
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

MEMBERS = 100
FLIGHTS = {
    "estimated-attitude": ("duration='20 s'",),
    "sun-magnetometer": ("duration='600 s'", "environment.magnetic_field.model='dipole'"),
}
COMPONENTS = {"estimated-attitude": (3,), "sun-magnetometer": (2, 3)}
"""With information, of each sensor's sample; the Sun's direction has none along itself."""
UNDERSTATED = {
    "estimated-attitude": "estimator.gyro_noise='2 deg/h'",
    "sun-magnetometer": "estimator.gyro_noise='0.5 deg/h'",
}
"""A tenth of the sensor's."""
OUTSIDE = np.sqrt(0.9973 * 0.0027 / (10 * MEMBERS * 3))
"""Standard deviation of the part of errors that are outside of three of theirs: those of a member
are alike for a tenth of the flight, so that ten of each axis are independent."""


class Flown(NamedTuple):
    error: Array
    """Of attitude [rad] and bias [rad/s], (n, N, 6)."""
    covariance: Array
    """(n, N, 6, 6)."""
    innovation: Array
    """(n, N, sensors)."""
    bound: Array
    """(n, N, 3)."""

    @property
    def nees(self) -> Array:
        """(n, N)."""
        solved = np.linalg.solve(self.covariance, self.error[..., None])[..., 0]
        squares: Array = np.sum(self.error * solved, axis=-1)
        return squares

    @property
    def inside(self) -> float:
        """Part of the attitude errors' components that are within three standard deviations."""
        return float(np.mean(np.abs(self.error[..., :3]) < self.bound))


@functools.cache
def flown(name: str, *overrides: str) -> Flown:
    members = list(range(MEMBERS))
    built = assemble(*load(name, [*FLIGHTS[name], *overrides, "checks=[]"]))
    blocks = list(fly(built, first_start(built, members), members, threads=2))

    def rows(topic: str, field: str) -> Array:
        return np.concatenate([block.rows[topic][field] for block in blocks])

    bias = built.sensors(members).constants["rate_bias"] + rows("/state", "sensor_rate_walk")
    error = rows("/truth", "estimation_error"), bias - rows("/estimate", "gyro_bias")
    return Flown(
        np.concatenate(error, axis=-1),
        rows("/estimate", "covariance"),
        rows("/estimate", "innovation"),
        rows("/estimate", "attitude_bound"),
    )


@pytest.mark.parametrize("name", FLIGHTS)
def test_the_estimation_error_has_the_covariance_that_is_estimated(name: str) -> None:
    # Twenty instants; the interval holds each with 99.99 %.
    nees = flown(name).nees
    mean = nees[:: len(nees) // 20].mean(axis=1)
    low, high = chi2.ppf([5e-5, 1.0 - 5e-5], 6 * MEMBERS) / MEMBERS
    assert (low < mean).all()
    assert (mean < high).all()


@pytest.mark.parametrize("name", FLIGHTS)
def test_the_innovations_have_the_covariance_that_is_expected(name: str) -> None:
    innovation = flown(name).innovation
    for sensor, components in enumerate(COMPONENTS[name]):
        squares = innovation[..., sensor]
        count = np.count_nonzero(squares)
        assert count > 50 * MEMBERS
        # White, so that all samples count: the interval holds 99.9 %.
        low, high = chi2.ppf([5e-4, 1.0 - 5e-4], components * count)
        assert low < squares.sum() < high


@pytest.mark.parametrize("name", FLIGHTS)
def test_errors_are_within_three_standard_deviations_997_of_1000_times(name: str) -> None:
    assert abs(flown(name).inside - 0.9973) < 3.0 * OUTSIDE


@pytest.mark.parametrize("name", FLIGHTS)
def test_an_understated_noise_of_the_gyro_shows(name: str) -> None:
    wrong = flown(name, UNDERSTATED[name])
    high = chi2.ppf(1.0 - 5e-5, 6 * MEMBERS) / MEMBERS
    assert np.mean(wrong.nees[len(wrong.nees) // 2 :].mean(axis=1) > high) > 0.9
    assert wrong.inside < flown(name).inside
    if name == "estimated-attitude":  # where the gyro weighs most
        assert wrong.inside < 0.9973 - 3.0 * OUTSIDE
