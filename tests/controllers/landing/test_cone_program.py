"""The cone program: answers that a pencil finds, limits that cannot be met, and no chaos."""

import numpy as np
import pytest
from mjspace.controllers.landing import cone_program
from mjspace.controllers.landing.cone_program import Affine, least


def free(offset: list[list[float]]) -> Affine:
    """Return vectors that all move with the three unknowns, from each ``offset``."""
    rows = np.array(offset, float).T
    return Affine(np.repeat(np.eye(3)[:, :, None], rows.shape[1], axis=2), rows)


def ball(radius: float, center: list[float]) -> Affine:
    """Return the cone of unknowns within ``radius`` of ``center``."""
    return free([np.negative(center).tolist()]).mapped(np.eye(4, 3, -1)).plus(0, radius)


def test_the_nearest_point_of_a_ball() -> None:
    x, excess = least(free([[-1.0, -2.0, -2.0]]), np.ones(1), 0.0, ball(1.0, [0.0, 0.0, 0.0]))
    assert x == pytest.approx(np.array([1.0, 2.0, 2.0]) / 3.0, abs=1e-4)
    assert abs(excess) < 1e-5


def test_weights_pull() -> None:
    """Of a ball's points, the one where the pulls of two others, one twice as heavy, balance."""
    others = free([[0.0, -3.0, 0.0], [0.0, 0.0, -4.0]])
    x, _ = least(others, np.array([1.0, 2.0]), -9.0, ball(1.0, [0.0, 0.0, 0.0]))  # -9: any length
    angle = np.linspace(0.0, 0.5 * np.pi, 100001)
    y, z = np.cos(angle), np.sin(angle)
    best = np.argmin(np.hypot(y - 3.0, z) + 2.0 * np.hypot(y, z - 4.0))
    assert x == pytest.approx([0.0, y[best], z[best]], abs=1e-4)


def test_no_length_is_shorter_than_the_shortest() -> None:
    x, excess = least(free([[0.0, 0.0, 0.5]]), np.ones(1), 0.8, ball(3.0, [0.0, 0.0, 0.0]))
    assert np.linalg.norm(x + np.array([0.0, 0.0, 0.5])) == pytest.approx(0.8, abs=1e-5)
    assert abs(excess) < 1e-5


def test_the_shortest_length_leans_where_it_has_to() -> None:
    """With the third component held at 0.3, a length of 0.5 needs 0.4 aside."""
    slope = np.zeros((2, 3, 1))
    slope[[0, 1], [0, 1], 0] = 1.0
    flat = Affine(slope, np.array([[0.0], [0.0], [0.3]]))
    cone = Affine(np.zeros((2, 4, 1)), np.array([[0.0], [0.35], [0.0], [0.0]]))
    cone.slope[:, 1:3] = slope[:, :2]
    cone = cone.plus(0, 1.0)
    x, excess = least(flat, np.ones(1), 0.5, cone)
    assert np.linalg.norm(x) == pytest.approx(0.4, abs=2e-3)
    assert abs(excess) < 2e-3


def test_limits_that_contradict_each_other_are_exceeded_alike() -> None:
    """Two balls of radius 1 whose centres are 3 apart: each is missed by 0.5, halfway."""
    apart = ball(1.0, [0.0, 0.0, 0.0]).beside(ball(1.0, [3.0, 0.0, 0.0]))
    x, excess = least(free([[0.0, 0.0, 0.0]]), np.ones(1), 0.0, apart)
    assert x == pytest.approx([1.5, 0.0, 0.0], abs=1e-3)
    assert excess == pytest.approx(0.5, abs=1e-4)


def test_newtons_derivatives_are_those_of_the_cost_and_the_barrier() -> None:
    rng = np.random.default_rng(1)
    lengths = Affine(rng.normal(size=(3, 3, 4)), rng.normal(size=(3, 4)))
    cones = Affine(0.1 * rng.normal(size=(3, 4, 5)), rng.normal(size=(4, 5))).plus(0, 6.0)
    weight, x = rng.uniform(1.0, 2.0, 4), 0.1 * rng.normal(size=3)

    def value(x: np.ndarray) -> float:
        v = cones.at(x)
        room = v[0] ** 2 - v[1] ** 2 - v[2] ** 2 - v[3] ** 2
        return float((weight * np.linalg.norm(lengths.at(x), axis=0)).sum() - np.log(room).sum())

    h = 1e-4 * np.eye(3)
    slope, curvature = cone_program._derivatives(x, lengths, weight, cones)
    for i in range(3):
        assert slope[i] == pytest.approx((value(x + h[i]) - value(x - h[i])) / 2e-4, rel=1e-6)
        for j in range(3):
            corners = [value(x + a * h[i] + b * h[j]) * a * b for a in (1, -1) for b in (1, -1)]
            assert curvature[i, j] == pytest.approx(sum(corners) / 4e-8, rel=1e-5, abs=1e-5)


def test_elimination_solves() -> None:
    rng = np.random.default_rng(2)
    root = rng.normal(size=(6, 6))
    matrix, x = root @ root.T + np.eye(6), rng.normal(size=6)
    assert cone_program._solve(matrix, matrix @ x) == pytest.approx(x, abs=1e-12)
