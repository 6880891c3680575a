"""Sobol indices against a closed form, and from a campaign that is flown."""

from pathlib import Path

import numpy as np
import pytest
from one_axis import ONE_AXIS, written

from mjspace.campaign import campaign as campaigns
from mjspace.campaign import draws, html_report, report
from mjspace.campaign.members import Campaign
from mjspace.campaign.results import results_in
from mjspace.campaign.sensitivity import indices, refuse_unfit
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.scenario.dispersions import Dispersion

DISPERSIONS = [
    Dispersion(key=f"initial.rate[{i}]", distribution="uniform", low=-np.pi, high=np.pi)
    for i in range(3)
]
KEYS = ["x1", "x2", "x3"]
A, B = 7.0, 0.1
VARIANCE = A**2 / 8 + B * np.pi**4 / 5 + B**2 * np.pi**8 / 18 + 0.5
ALONE = np.array([0.5 * (1 + B * np.pi**4 / 5) ** 2, A**2 / 8, 0.0]) / VARIANCE
SHARED = 8 * B**2 * np.pi**8 / 225 / VARIANCE
WITH_OTHERS = ALONE + np.array([SHARED, 0.0, SHARED])
"""x1 and x3 act together: Ishigami and Homma 1990, by integration."""


def ishigami(members: int, seed: int) -> Array:
    rows = draws.uniforms("saltelli", seed, range(members), members, DISPERSIONS)
    x = np.array([draws.values(DISPERSIONS, [0.0] * 3, row) for row in rows])
    found: Array = np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])
    return found


def test_indices_are_those_of_the_closed_form() -> None:
    found = indices("y", KEYS, ishigami(5 * 2048, 3))
    assert found.groups == 2048
    first = [found.first[key].value for key in KEYS]
    total = [found.total[key].value for key in KEYS]
    assert first == pytest.approx(ALONE, abs=0.02)
    assert total == pytest.approx(WITH_OTHERS, abs=0.02)


def test_the_interval_covers_the_closed_form_about_as_often_as_it_says() -> None:
    inside = []
    for seed in range(5):
        found = indices("y", KEYS, ishigami(5 * 64, seed))
        for order, right in ((found.first, ALONE), (found.total, WITH_OTHERS)):
            bounds = zip(order.values(), right, strict=True)
            inside += [each.low <= value <= each.high for each, value in bounds]
    # Of 30, 95 % is 28; a Sobol sequence is better than random points, for which it is made.
    assert np.mean(inside) > 0.85
    assert indices("y", KEYS, ishigami(5 * 64, 1)) == indices("y", KEYS, ishigami(5 * 64, 1))


def test_vectors_are_exchanged_as_one_and_members_draw_the_same_in_any_company() -> None:
    several = [Dispersion(key="initial.attitude", distribution="random_attitude"), *DISPERSIONS[:2]]
    every = draws.uniforms("saltelli", 5, range(12), 12, several)
    assert every.shape == (12, 5)
    one, other, first, second, third = every[5:10]
    assert not (one == other).any()
    assert (first[:3] == other[:3]).all()
    assert (first[3:] == one[3:]).all()
    assert second.tolist() == [*one[:3], other[3], one[4]]
    assert third.tolist() == [*one[:4], other[4]]
    assert (draws.uniforms("saltelli", 5, [7, 2], 40, several) == every[[7, 2]]).all()


def test_what_cannot_be_estimated_says_why() -> None:
    values = ishigami(5 * 8, 1)
    assert indices("y", KEYS, values[:9]).why == "needs 10 members"
    assert indices("y", KEYS, values[:39]).groups == 4
    values[3] = np.nan
    assert indices("y", KEYS, values).why == "1 members have no value"
    assert indices("y", KEYS, np.full(40, 3.0)).why == "it is the same for every member"
    with pytest.raises(InputError, match=r"--n 100: .*3 dispersions it should be 5.*: 80 or 160"):
        refuse_unfit(KEYS, 100)
    with pytest.raises(InputError, match=r"--n 3: .*: 10 or 20"):
        refuse_unfit(KEYS, 3)
    with pytest.raises(InputError, match="needs two or more dispersions, has 1"):
        refuse_unfit(KEYS[:1], 12)


SCENARIO = (
    ONE_AXIS.replace("checks = []", 'sampling = "saltelli"').replace("10 s", "1 s")
    + """
[[checks]]
name = "rate"
signal = "truth.rate[0]"
below = 0.02

[[metrics]]
name = "left"
signal = "truth.rate[0]"
statistic = "final"

[[dispersions]]
key = "initial.rate[0]"
distribution = "normal"
std = 0.002

[[dispersions]]
key = "law.rate_gain"
distribution = "uniform"
low = 5
high = 6
"""
)


@pytest.mark.usefixtures("here")
def test_a_campaign_shows_on_what_its_margins_depend(tmp_path: Path) -> None:
    path, out = written(tmp_path, SCENARIO), tmp_path / "out"
    with pytest.raises(InputError, match="8 or 16"):
        campaigns.fly(Campaign(path, (), 15, 1), out)
    campaigns.fly(Campaign(path, (), 8, 1), out)
    flight = campaigns.fly(Campaign(path, (), 16, 1), out)  # goes on
    found = report.answer(flight.store, None)
    margin, left = found.sensitivities
    # The largest rate is the first, which the gain has no part in.
    assert margin.name == "margin of rate"
    assert margin.first["law.rate_gain"].value == margin.total["law.rate_gain"].value == 0.0
    assert margin.total["law.rate_gain"].high == 0.0
    assert margin.total["initial.rate[0]"].value == pytest.approx(1.0, abs=0.5)
    assert left.total["law.rate_gain"].low > 0.0
    # Members that share draws do not count as others would.
    assert found.rate.members == 8
    page = tmp_path / "report.html"
    html_report.write(results_in(out), found, page)
    assert "From 4 groups of members" in page.read_text()
