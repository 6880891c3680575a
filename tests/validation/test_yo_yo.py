"""The truth of the yo-yo benchmarks, by second routes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.validation.benchmarks import yo_yo
from mjspace.validation.benchmarks.yo_yo import DRUM, SPIN, C


def test_design_meets_the_reference() -> None:
    # The reference's digits.
    assert pytest.approx(2.06155281, abs=1e-8) == yo_yo.TANGENTIAL
    assert pytest.approx(1.56155281, abs=1e-8) == yo_yo.RADIAL
    assert pytest.approx(45.36907, abs=1e-5) == yo_yo.PEAK
    assert pytest.approx(0.739803, abs=1e-6) == yo_yo.OUTWARDS
    assert pytest.approx(2.86501213, abs=1e-8) == yo_yo.HALF_SPIN


def test_unwinding_meets_an_integration_of_the_equations_of_motion() -> None:
    # Lagrange, over m a^2: T = (c w^2 + phi^2 W^2) / 2 with W = w + phi'.  Nothing is said of phi'
    # but its first value.
    def slope(_: float, state: Array) -> list[float]:
        phi, pace, spin = state
        both = spin + pace
        slows = -phi * both**2 / C
        return [pace, (both**2 - 2.0 * pace * both) / phi - slows, slows]

    first = 0.1  # at no cord at all the equations are singular
    begin = [first, SPIN, float(yo_yo.unwinding(np.array(first)))]
    span = (first / SPIN, yo_yo.TANGENTIAL / DRUM / SPIN)
    times = np.linspace(*span, 50)
    phi, pace, spin = solve_ivp(
        slope, span, begin, "DOP853", t_eval=times, rtol=1e-13, atol=1e-13
    ).y
    # 1e-13 a step of DOP853, grown by 1 / first.
    np.testing.assert_allclose(pace, SPIN, rtol=1e-11)
    np.testing.assert_allclose(spin, yo_yo.unwinding(phi), atol=1e-11 * SPIN)
    assert spin[-1] == pytest.approx(0.0, abs=1e-11 * SPIN)
    tension = -np.diff(spin) / np.diff(times) * yo_yo.AXIAL / DRUM
    # Means over a fiftieth of the flight: short of the peak by the curvature, 0.1 %.
    assert tension.max() == pytest.approx(yo_yo.PEAK, rel=1e-3)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_swing_meets_an_integration_of_the_equations_of_motion(share: float) -> None:
    cord = share * yo_yo.RADIAL

    # Lagrange, over m: T = (Q w^2 + 2 P w s' + l^2 s'^2) / 2, Q and P functions of the angle s.
    def slope(_: float, state: Array) -> Array:
        s, spin, rate = state
        P = cord * (cord + DRUM * np.sin(s))
        Q = C * DRUM**2 + cord**2 + 2.0 * DRUM * cord * np.sin(s)
        bend = DRUM * cord * np.cos(s)  # dP/ds, and half of dQ/ds
        matrix = np.array([[Q, P], [P, cord**2]])
        push = [-2.0 * bend * spin * rate - bend * rate**2, bend * spin**2]
        return np.array([rate, *np.linalg.solve(matrix, push)])

    begin = [0.0, float(yo_yo.unwinding(np.array(cord / DRUM))), SPIN]
    outwards = np.array([0.0, np.pi / 2.0])
    times = yo_yo.swing_time(cord, outwards)
    end = solve_ivp(slope, times, begin, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    spin, rate = yo_yo.swinging(cord, outwards)
    assert (spin[0], rate[0]) == pytest.approx(tuple(begin[1:]), rel=1e-13)
    # 1e-13 a step; the quadrature's 20 nodes are good to 1e-14.
    assert end == pytest.approx([outwards[1], spin[1], rate[1]], abs=1e-10)
    if share == 1.0:
        assert spin[1] == pytest.approx(0.0, abs=1e-13)
