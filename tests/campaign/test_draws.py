"""What members draw: the right distributions, and the same in any company."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from mjspace.campaign import draws
from mjspace.errors import InputError
from mjspace.scenario.dispersions import Dispersion
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
