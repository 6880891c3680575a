"""TRIAD and the q method: against LAPACK's eigenvectors, in any attitude, and in their errors."""

import numpy as np
import pytest
from mjspace.controllers.determination.error_state import attitude_error
from mjspace.controllers.determination.vector_observations import covariance, q_method, triad

from mjspace import attitude as att
from mjspace.contract import Array

HALF_TURNS = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0.6, 0, 0.8], [1, 0, 0, 0]])


def unit(draw: np.random.Generator, *shape: int) -> Array:
    return att.normalize(draw.normal(size=(*shape, 3)))


def davenport(body: Array, inertial: Array, weight: Array) -> tuple[Array, Array]:
    """Return K's eigenvalues and its best eigenvector by LAPACK, K from products of quaternions.

    inertial . (q body q*) is a quadratic form of q; K's elements are its values at sums of two unit
    quaternions, which nothing in the method under test has in common with it.
    """
    units = np.eye(4)

    def gain(p: Array, q: Array) -> Array:
        turned = att.multiply(att.multiply(p, att.pure(body)), att.conjugate(q))[..., 1:]
        return np.sum(weight * np.sum(inertial * turned, axis=-1), axis=-1)

    K = np.array([[gain(p, q) for q in units] for p in units])
    values, vectors = np.linalg.eigh(np.moveaxis(0.5 * (K + K.swapaxes(0, 1)), (0, 1), (-2, -1)))
    return values, vectors[..., -1]


@pytest.mark.parametrize("count", [2, 3, 7])
def test_the_q_method_finds_lapacks_eigenvector(count: int) -> None:
    draw = np.random.default_rng(count)
    body, inertial = unit(draw, 500, count), unit(draw, 500, count)  # no attitude meets them all
    weight = 10.0 ** draw.uniform(-3.0, 3.0, (500, count))
    q = q_method(body, inertial, weight)
    values, best = davenport(body, inertial, weight)
    # The eigenvector's condition is the largest eigenvalue over its distance from the next.
    condition = values[:, -1] / (values[:, -1] - values[:, -2])
    error = np.linalg.norm(q - np.sign(np.sum(q * best, axis=-1, keepdims=True)) * best, axis=-1)
    assert (error < 20.0 * np.finfo(float).eps * condition).all()
    assert np.abs(np.linalg.norm(q, axis=-1) - 1.0).max() < 4.0 * np.finfo(float).eps


@pytest.mark.parametrize("method", ["triad", "q_method"])
def test_exact_directions_give_the_attitude(method: str) -> None:
    draw = np.random.default_rng(1)
    true = np.concatenate([HALF_TURNS, att.normalize(draw.normal(size=(200, 4)))])
    inertial = unit(draw, len(true), 2)
    body = att.rotate(att.conjugate(true[:, None]), inertial)
    found = (
        triad(3.0 * body, 0.5 * inertial)
        if method == "triad"
        else q_method(body, inertial, np.ones((len(true), 2)))
    )
    apart = np.linalg.norm(np.cross(inertial[:, 0], inertial[:, 1]), axis=-1)
    assert (att.rotation_angle(found, true) * apart**2 < 1e-14).all()


def test_triad_meets_the_first_direction_exactly_and_the_q_method_both_alike() -> None:
    body = np.array([[1.0, 0.0, 0.0], [np.cos(1.5), np.sin(1.5), 0.0]])  # 1.5 rad apart, not 1.4
    inertial = np.array([[1.0, 0.0, 0.0], [np.cos(1.4), np.sin(1.4), 0.0]])
    by_triad, by_q = triad(body, inertial), q_method(body, inertial, np.ones(2))
    assert np.allclose(att.to_rotation_vector(by_triad), 0.0, atol=1e-15)
    assert np.allclose(att.to_rotation_vector(by_q), [0.0, 0.0, -0.05], atol=1e-15)


def test_a_weight_of_zero_leaves_a_direction_out() -> None:
    draw = np.random.default_rng(2)
    body, inertial, weight = unit(draw, 3), unit(draw, 3), np.array([1.0, 2.0, 0.0])
    others = q_method(body[:2], inertial[:2], weight[:2])
    assert np.allclose(q_method(body, inertial, weight), others, atol=1e-15)


def test_one_alone_is_as_in_a_batch() -> None:
    draw = np.random.default_rng(3)
    body, inertial, weight = unit(draw, 2, 4, 3), unit(draw, 2, 4, 3), draw.uniform(size=(2, 4, 3))
    together = q_method(body, inertial, weight)
    assert np.array_equal(together[1, 2], q_method(body[1, 2], inertial[1, 2], weight[1, 2]))


def test_errors_are_as_large_as_the_covariance_says() -> None:
    draw = np.random.default_rng(4)
    sigma, true = np.array([1e-3, 4e-3, 2e-3]), att.normalize(draw.normal(size=4))
    inertial, count = unit(draw, 3), 20000
    exact = att.rotate(att.conjugate(true), inertial)
    errors = att.from_rotation_vector(sigma[:, None] * draw.normal(size=(count, 3, 3)))
    body = att.rotate(errors, exact)
    weight = 1.0 / sigma**2
    error = attitude_error(q_method(body, np.broadcast_to(inertial, body.shape), weight), true)
    P = covariance(exact, weight)
    assert np.allclose(P, P.T, rtol=1e-12)
    squares = np.einsum("ni,ij,nj->n", error, np.linalg.inv(P), error)
    # Chi square of 3 degrees of freedom: the mean of n is 3 +- sqrt(6 / n), 0.3 % are above 13.93.
    assert abs(np.mean(squares) - 3.0) < 4.0 * np.sqrt(6.0 / count)
    assert abs(np.mean(squares > 13.93) - 0.003) < 4.0 * np.sqrt(0.003 / count)
