"""What members draw: the right distributions, and the same in any company."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from mjspace.campaign import draws
from mjspace.errors import InputError
from mjspace.scenario.dispersions import Dispersion, refuse_overlaps
from mjspace.scenario.loading import load

MANY = 1024
# A distribution function is within 1.63 / sqrt(n) of that of n right draws with 99 % (Kolmogorov);
# the seed is fixed.
CLOSE = 1.63 / np.sqrt(MANY)


def dispersion(distribution: str, **parameters: Any) -> Dispersion:
    return Dispersion(key="initial.rate[0]", distribution=distribution, **parameters)


def sample(one: Dispersion, sampling: str = "random", seed: int = 7) -> Any:
    rows = draws.uniforms(sampling, seed, range(MANY), MANY, [one])
    return np.array([draws.values([one], [3.0], row)[0] for row in rows])


@pytest.mark.parametrize(
    ("one", "law"),
    [
        (dispersion("normal", std=0.5), stats.norm(3.0, 0.5)),
        (dispersion("normal", mean="1 deg", std="0.1 deg"), stats.norm(np.pi / 180, np.pi / 1800)),
        (dispersion("uniform", low=-1.0, high=2.0), stats.uniform(-1.0, 3.0)),
        (dispersion("log_uniform", low=1e-3, high=10.0), stats.loguniform(1e-3, 10.0)),
        (dispersion("triangular", low=2.0, high=6.0), stats.triang(0.25, 2.0, 4.0)),
        (dispersion("triangular", low=0.0, high=2.0, mode=0.0), stats.triang(0.0, 0.0, 2.0)),
    ],
)
@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_numbers_have_the_distribution_that_is_named(one: Any, law: Any, sampling: str) -> None:
    distance = stats.kstest(sample(one, sampling), law.cdf).statistic
    # A stratified sample of one number has one in each of n strata.
    assert distance < (CLOSE if sampling == "random" else 1.01 / MANY)


def test_discrete_values_are_equally_likely_and_keep_their_kind() -> None:
    found = sample(dispersion("discrete", values=[1, 5, "540 deg"]))
    counts = np.unique(found, return_counts=True)
    assert counts[0].tolist() == [1, 5, 3 * np.pi]
    assert stats.chisquare(counts[1]).pvalue > 0.01
    two = dispersion("discrete", values=[2])
    kinds = [type(draws.value(two, own, np.array([0.5]))) for own in (3, 3.0)]
    assert kinds == [int, float]


def test_attitudes_are_evenly_distributed_over_all_rotations() -> None:
    found = sample(dispersion("random_attitude"))
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0, abs=1e-14)
    # Each component of a point on the sphere in four dimensions has variance 1/4 and is as the
    # others; its density is 2/pi sqrt(1 - x^2).
    for component in found.T:
        law = lambda x: 0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / np.pi  # noqa: E731
        assert stats.kstest(component, law).statistic < CLOSE
    assert found.T @ found / MANY == pytest.approx(np.eye(4) / 4.0, abs=0.02)


def test_directions_are_evenly_distributed_over_the_sphere() -> None:
    found = sample(dispersion("on_sphere", radius="2 deg/s"))
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.radians(2.0), abs=1e-15)
    for component in found.T / np.radians(2.0):
        assert stats.kstest(component, stats.uniform(-1.0, 2.0).cdf).statistic < CLOSE


KEYS = ["initial.rate[0]", "initial.rate[1]", "law.rate_gain"]
COVARIANCE = np.array([[1.0, -0.6, 20.0], [-0.6, 4.0, 0.0], [20.0, 0.0, 500.0]])


def together(covariance: Any, **parameters: Any) -> Dispersion:
    table: dict[str, Any] = {"keys": KEYS, "distribution": "normal", "covariance": covariance}
    return Dispersion(**(table | parameters))


def test_a_set_has_the_covariance_that_is_given() -> None:
    one, many = together(COVARIANCE.tolist()), 4096
    rows = draws.uniforms("random", 11, range(many), many, [one])
    assert rows.shape == (many, 3)
    found = np.array([draws.values([one], [[1.0, 2.0, 30.0]], row)[0] for row in rows])
    # Of n normal numbers: the mean's variance is c_ii / n, the sample covariance's
    # (c_ii c_jj + c_ij^2) / n; four standard errors, and the seed is fixed.
    error = 4.0 * np.sqrt(np.diag(COVARIANCE) / many)
    assert (np.abs(found.mean(axis=0) - [1.0, 2.0, 30.0]) < error).all()
    variances = np.diag(COVARIANCE)
    error = 4.0 * np.sqrt((np.outer(variances, variances) + COVARIANCE**2) / many)
    assert (np.abs(np.cov(found.T) - COVARIANCE) < error).all()


def test_a_covariance_may_be_singular() -> None:
    one = together([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    rows = draws.uniforms("sobol", 1, range(64), 64, [one])
    found = np.array([draws.value(one, [0.0, 0.0, 5.0], row) for row in rows])
    assert found[:, 1] == pytest.approx(2.0 * found[:, 0], abs=1e-7)
    assert found[:, 2] == pytest.approx(5.0, abs=1e-7)
    assert np.ptp(found[:, 0]) > 2.0


@pytest.mark.parametrize(
    ("covariance", "changes", "line"),
    [
        ([[1.0, 0.5], [0.5, 1.0]], {}, "2 rows of 2 numbers, should be 3 by 3"),
        ([[1.0, 0.5, 0.0]] * 2 + [[0.0]], {}, "3 rows of 3, 1 numbers, should be 3 by 3"),
        ([[1, 0.5, 0], [0.4, 1, 0], [0, 0, 1]], {}, r"\[0\]\[1\] is 0.5, \[1\]\[0\] is 0.4"),
        ([[1, 2, 0], [2, 1, 0], [0, 0, 1]], {}, "not positive semidefinite: .* is -1"),
        ([[1, 0, 0], [0, -1, 0], [0, 0, 1]], {}, "not positive semidefinite"),
        (None, {}, "covariance: missing, keys need it"),
        (np.eye(3).tolist(), {"keys": None}, "key: give one, or keys"),
        (np.eye(3).tolist(), {"key": "law.rate_gain"}, "key: give one, or keys"),
        (np.eye(3).tolist(), {"distribution": "uniform"}, 'distribution = "normal"'),
        (np.eye(3).tolist(), {"std": 1.0}, "std: keys take a covariance alone"),
        (np.eye(3).tolist(), {"keys": ["duration", "seed", "law.k"]}, "'seed' is no part"),
    ],
)
def test_a_set_that_is_none_is_refused(covariance: Any, changes: Any, line: str) -> None:
    with pytest.raises(ValueError, match=line):
        together(covariance, **changes)


def test_two_dispersions_of_one_number_are_refused_in_a_set_too() -> None:
    one, two = together(np.eye(3).tolist()), dispersion("normal", std=1.0)
    with pytest.raises(ValueError, match=r"dispersions.1.key: 'initial.rate\[0\]' and"):
        refuse_overlaps([one, two])
    twice = together(np.eye(3).tolist(), keys=[*KEYS[:2], KEYS[0]])
    with pytest.raises(ValueError, match=r"dispersions.0.keys: .*same number"):
        refuse_overlaps([twice])


@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_a_member_draws_the_same_in_any_company(sampling: str) -> None:
    two = [dispersion("normal", std=1.0), dispersion("on_sphere", radius=1.0)]
    every = draws.uniforms(sampling, 3, range(50), 50, two)
    some = draws.uniforms(sampling, 3, [17, 4], 50, two)
    assert np.array_equal(some, every[[17, 4]])
    assert not np.array_equal(every, draws.uniforms(sampling, 4, range(50), 50, two))
    more = draws.uniforms(sampling, 3, range(50), 80, two)
    assert np.array_equal(more, every) == (sampling != "latin_hypercube")


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("key='initial.rate[0]', distribution='normal', std=-1", "std: got -1, should be greater"),
        ("key='initial.rate[0]', distribution='normal'", "std: missing, normal needs it"),
        ("key='plant.mass', distribution='uniform', low=2, high=1", "low 2 should be less than"),
        ("key='plant.mass', distribution='log_uniform', low=0, high=1", "should be greater than 0"),
        ("key='plant.mass', distribution='triangular', low=0, high=1, mode=3", "mode 3 should be"),
        ("key='plant.mass', distribution='discrete', values=[true]", "should be a number"),
        ("key='plant.mass', distribution='discrete', values=[inf]", "finite"),
        ("key='plant.mass', distribution='normal', std=1, low=1", "low: normal takes std, mean"),
        ("key='plant.mass', distribution='uniform', low='1 kg', high='2 m'", "different units"),
        ("key='checks[0].below', distribution='normal', std=1", "is no part of the flight"),
        ("key='plant mass', distribution='normal', std=1", "should be as 'plant.mass'"),
    ],
)
def test_a_dispersion_that_makes_no_sense_is_refused(table: str, message: str) -> None:
    with pytest.raises(InputError) as raised:
        load("detumble-wheels", [f"dispersions=[{{{table}}}]"])
    assert message in str(raised.value)
    assert "dispersions.0" in str(raised.value)


def test_a_number_is_dispersed_once() -> None:
    each = ", ".join(
        f"{{key='{key}', distribution='normal', mean=1, std=1}}"
        for key in ("initial.rate[0]", "initial.rate[1]", "initial.rate")
    )
    with pytest.raises(InputError, match=r"'initial.rate' and 'initial.rate\[0\]' set the same"):
        load("detumble-wheels", [f"dispersions=[{each}]"])
