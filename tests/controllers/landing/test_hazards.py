"""Slope, roughness and the nearest safe site, against a fit and a search point by point."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.landing.hazards import nearest_safe, slope_and_roughness
from mjspace.controllers.landing.landing_site import LandingSite

from mjspace.contract import Array

SPACING, FOOTPRINT = 0.8, 2.5


def land(seed: int, shape: tuple[int, int] = (31, 37)) -> Array:
    """Return rolling ground with steps, some metres high."""
    rng = np.random.default_rng(seed)
    y, x = np.indices(shape) * SPACING
    height = sum(
        0.2 * np.sin(rng.uniform(0.1, 0.7) * x + rng.uniform(0.1, 0.7) * y + rng.uniform(0.0, 6.0))
        for _ in range(4)
    )
    return height + 0.3 * (rng.random(shape) > 0.98)


def fitted(heights: Array, i: int, j: int) -> tuple[float, float]:
    """Return slope and roughness at a point, by least squares over its disc."""
    r, c = np.mgrid[: heights.shape[0], : heights.shape[1]]
    near = SPACING * np.hypot(r - i, c - j) <= FOOTPRINT
    x, y, z = SPACING * (c - j)[near], SPACING * (r - i)[near], heights[near]
    matrix = np.column_stack([x, y, np.ones_like(x)])
    plane = np.linalg.lstsq(matrix, z, rcond=None)[0]
    return np.arctan(np.hypot(*plane[:2])), np.abs(z - matrix @ plane).max()


def test_slope_and_roughness_are_those_of_a_fit_at_each_point() -> None:
    heights = land(1)
    slope, roughness = slope_and_roughness(heights, SPACING, FOOTPRINT)
    for i, j in np.ndindex(heights.shape):
        inside = 3 <= i < heights.shape[0] - 3 and 3 <= j < heights.shape[1] - 3
        if inside:
            assert (slope[i, j], roughness[i, j]) == pytest.approx(fitted(heights, i, j), abs=1e-12)
        else:
            assert slope[i, j] == roughness[i, j] == np.inf


def test_a_plane_has_its_own_slope_and_no_roughness() -> None:
    y, x = np.indices((15, 15)) * SPACING
    slope, roughness = slope_and_roughness(0.3 * x - 0.4 * y + 7.0, SPACING, FOOTPRINT)
    assert slope[7, 7] == pytest.approx(np.arctan(0.5), abs=1e-14)
    assert roughness[7, 7] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("seed", range(8))
def test_the_safe_site_is_the_nearest_that_keeps_the_limits(seed: int) -> None:
    heights = land(seed)
    rng = np.random.default_rng(seed)
    i, j = rng.integers(5, 26), rng.integers(5, 32)
    middle = np.array([(heights.shape[1] - 1) / 2, (heights.shape[0] - 1) / 2])
    planned = SPACING * (np.array([j, i]) - middle) + 0.2 * SPACING
    sites = nearest_safe(
        heights,
        SPACING,
        planned,
        reach=30.0,
        footprint=FOOTPRINT,
        slope_limit=0.2,
        roughness_limit=0.2,
    )
    best = np.inf
    for r in range(3, heights.shape[0] - 3):
        for c in range(3, heights.shape[1] - 3):
            slope, roughness = fitted(heights, r, c)
            if slope <= 0.2 and roughness <= 0.2:
                best = min(best, SPACING * np.hypot(r - i, c - j))
    assert sites.planned == pytest.approx([*(SPACING * (np.array([j, i]) - middle)), heights[i, j]])
    assert np.hypot(*(sites.safe - sites.planned)[:2]) == pytest.approx(best)
    c, r = np.rint(sites.safe[:2] / SPACING + middle).astype(int)
    assert sites.safe[2] == heights[r, c]
    assert max(fitted(heights, r, c)) <= 0.2


def site(**gains: Any) -> LandingSite:
    return LandingSite(ground_heights=land(3), ground_spacing=SPACING, **gains)


def test_a_reference_stands_at_the_planned_site_and_shows_the_safe_one() -> None:
    for source, far in ((site(), 0.0), (site(reach=30.0, slope_limit=0.15), 1.0)):
        row = source.at(np.array([0.0, 5.0]))
        assert row.position.shape == row.safe_site.shape == (2, 3)
        away = np.hypot(*(row.safe_site - row.position)[0, :2])
        assert away >= far if far else away == 0.0
    flat = LandingSite(planned=np.array([3.0, 4.0]), reach=10.0).at(np.zeros(1))
    assert np.array_equal(flat.safe_site, [[3.0, 4.0, 1.8]])


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        (
            {"reach": 1.0, "slope_limit": 1e-4},
            r"no site within 1 m of \[0. 0.\] m keeps the limits; none on the map does",
        ),
        ({"reach": 9.0, "footprint": 0.5}, r"footprint: got 0.5 m, should be at least .* 0.8 m"),
        ({"reach": 9.0, "footprint": 20.0}, "less than half of its width"),
        ({"planned": np.array([50.0, 0.0])}, r"planned: \[50.  0.\] m is not on the map"),
    ],
)
def test_what_cannot_be_chosen_is_refused(gains: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        site(**gains).at(np.zeros(1))
