"""The least eigenvalue of symmetric matrices, against LAPACK."""

import numpy as np
import pytest
from mjspace.controllers.attitude.excitation import least_eigenvalue

from mjspace.contract import Array

RNG = np.random.default_rng(3)
TURNS = np.linalg.qr(RNG.normal(size=(200, 9, 9)))[0]


def turned(eigenvalues: Array) -> Array:
    """Return matrices with these ``eigenvalues`` (..., 9), along axes of any direction."""
    return (TURNS * eigenvalues[..., None, :]) @ TURNS.swapaxes(1, 2)


def products(count: int) -> Array:
    """Return sums of ``count`` dyadic products each, as an information matrix is."""
    rows = RNG.normal(size=(200, count, 9)) * np.logspace(0, -2, 9)
    return rows.swapaxes(1, 2) @ rows


CASES = {
    "of rank 2": products(2),
    "of full rank": products(30),
    "scaled by 1e-100": 1e-100 * products(30),
    "scaled by 1e100": 1e100 * products(30),
    "any sign": turned(RNG.normal(size=(200, 9))),
    "negative": -products(30),
    "several times the same": turned(np.array([1.0, 1, 1, 1, 2, 2, 2, 3, 3])),
    "of all sizes": turned(10.0 ** -np.arange(0.0, 36.0, 4.0)),
    "diagonal": np.stack([np.diag(RNG.permutation(np.arange(9.0))) for _ in range(9)]),
    "zero": np.zeros((1, 9, 9)),
    # Wilkinson's matrix W9+, whose eigenvalues are pairwise nearly the same
    "tridiagonal": (np.diag(abs(np.arange(9.0) - 4)) + np.eye(9, k=1) + np.eye(9, k=-1))[None],
    "two by two": RNG.normal(size=(50, 2, 1)) * np.ones((1, 2)) * np.eye(2) + 0.3,
    "of one number": RNG.normal(size=(5, 1, 1)),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_lapacks_least_to_a_few_roundings_of_the_largest(case: str) -> None:
    Z = CASES[case]
    all_of_them = np.linalg.eigvalsh(Z)
    error = abs(least_eigenvalue(Z)[:, 0] - all_of_them[:, 0])
    # 2.3e-15 measured
    assert (error <= 5e-15 * abs(all_of_them).max(axis=1)).all()


def test_a_matrix_is_the_same_alone_and_among_others() -> None:
    Z = CASES["of full rank"]
    alone = np.stack([least_eigenvalue(each) for each in Z])
    assert alone.tobytes() == least_eigenvalue(Z).tobytes()


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_there_is_none_of_a_matrix_that_is_not_finite(number: float) -> None:
    Z = np.eye(9)
    Z[3, 4] = Z[4, 3] = number
    last = np.diag(np.append(np.ones(8), number))
    with np.errstate(all="ignore"):  # as in a flight
        for each in (Z, last, np.full((9, 9), number), np.full((9, 9), 1e160)):
            assert np.isnan(least_eigenvalue(each)).all()
