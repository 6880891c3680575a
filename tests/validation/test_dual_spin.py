"""The stability of dual spin, by the eigenvalues of the nonlinear equations."""

import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.validation.benchmarks.dual_spin import BUS, STABLE, UNSTABLE, stiffness

TEXTBOOK = np.array([10.0, 12.0, 14.0])  # kg m^2


def eigenvalues(inertia: Array, spin: float, momentum: float) -> Array:
    """Return those of a gyrostat's equations of motion about its steady spin [1/s]."""

    def acceleration(w: Array) -> Array:
        return np.asarray(np.cross(inertia * w + [0.0, 0.0, momentum], w) / inertia)

    # The equations are quadratic: central differences over any distance are exact.
    steady = np.array([0.0, 0.0, spin])
    columns = [acceleration(steady + e) - acceleration(steady - e) for e in 0.5 * np.eye(3)]
    return np.asarray(np.linalg.eigvals(np.stack(columns, axis=1)))


def closed_form(inertia: Array, spin: float, momentum: float) -> float:
    """Return the nutation frequency's square [1/s^2]."""
    k1, k2 = stiffness(inertia, spin, momentum)
    return float(k1 * k2 / (inertia[0] * inertia[1]))


@pytest.mark.parametrize("case", [STABLE, UNSTABLE, (0.5, 0.0), (-0.3, 2.0)])
def test_closed_form_is_the_equations_eigenvalue(case: tuple[float, float]) -> None:
    fastest = max(eigenvalues(BUS, *case), key=lambda value: abs(value))
    assert -(fastest**2) == pytest.approx(closed_form(BUS, *case), rel=1e-13)


def test_frequency_and_growth_of_the_textbook_case() -> None:
    # Six and four digits are what the reference gives.
    assert np.sqrt(closed_form(TEXTBOOK, 0.05, 6.0)) == pytest.approx(0.561397, abs=5e-7)
    assert np.sqrt(-closed_form(TEXTBOOK, 0.05, -0.15)) == pytest.approx(0.004564, abs=5e-7)


def test_a_wheel_makes_the_middle_axis_stable_when_fast_enough() -> None:
    # It takes h > (I_max - I_middle) w.
    inertia, spin = np.array([10.0, 14.0, 12.0]), 0.5
    limit = (14.0 - 12.0) * spin
    assert closed_form(inertia, spin, 0.99 * limit) < 0.0 < closed_form(inertia, spin, 1.01 * limit)


def test_the_benchmark_has_a_case_of_each_kind() -> None:
    assert closed_form(BUS, *UNSTABLE) < 0.0 < closed_form(BUS, *STABLE)
