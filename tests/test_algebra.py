"""Products over leading axes against NumPy's, and the same bits alone and in a batch."""

from collections.abc import Callable

import numpy as np
import pytest

from mjspace import algebra
from mjspace.contract import Array

DRAW = np.random.default_rng(5)
N = 7  # vehicles
VECTORS, OTHERS = DRAW.normal(size=(2, N, 3))
MATRICES, TALL = DRAW.normal(size=(N, 4, 3)), DRAW.normal(size=(N, 3, 5))
ROUNDING = 1e-14  # of sums of four numbers of order one

CASES: dict[str, tuple[Callable[..., Array], tuple[Array, ...], Array]] = {
    "cross": (algebra.cross, (VECTORS, OTHERS), np.cross(VECTORS, OTHERS)),
    "dot": (algebra.dot, (VECTORS, OTHERS), np.sum(VECTORS * OTHERS, -1, keepdims=True)),
    "times": (algebra.times, (MATRICES, VECTORS), np.einsum("nij,nj->ni", MATRICES, VECTORS)),
    "matrix_product": (algebra.matrix_product, (MATRICES, TALL), MATRICES @ TALL),
    "transpose": (algebra.transpose, (MATRICES,), np.einsum("nij->nji", MATRICES)),
}


def test_components_keep_the_axis_that_they_are_taken_from() -> None:
    parts = algebra.components(VECTORS)
    assert [part.shape for part in parts] == [(N, 1)] * 3
    assert np.concatenate(parts, axis=-1).tobytes() == VECTORS.tobytes()


@pytest.mark.parametrize("name", CASES)
def test_a_product_is_numpys(name: str) -> None:
    function, operands, expected = CASES[name]
    np.testing.assert_allclose(function(*operands), expected, atol=ROUNDING)


@pytest.mark.parametrize("name", CASES)
def test_a_vehicle_gets_the_same_bits_alone_as_in_a_batch(name: str) -> None:
    function, operands, _ = CASES[name]
    together = function(*operands)
    for row in range(N):
        assert function(*(each[row] for each in operands)).tobytes() == together[row].tobytes()
        assert function(*(each[row : row + 1] for each in operands)).shape[0] == 1


def test_one_matrix_serves_all_vehicles_and_may_be_a_view() -> None:
    one = MATRICES[0]
    np.testing.assert_array_equal(
        algebra.times(one, VECTORS), [algebra.times(one, v) for v in VECTORS]
    )
    back = algebra.times(algebra.transpose(one), np.ones(4))
    np.testing.assert_allclose(back, one.sum(axis=0), atol=ROUNDING)


def test_no_wheels_have_no_momentum() -> None:
    none = np.zeros((0, 3))
    assert algebra.times(none, VECTORS).shape == (N, 0)
    spins = np.zeros((N, 0))
    np.testing.assert_array_equal(algebra.times(algebra.transpose(none), spins), np.zeros((N, 3)))
