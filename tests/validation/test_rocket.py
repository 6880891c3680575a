"""The truth of the rocket benchmarks, by second routes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.validation.benchmarks import rocket

END = np.array([rocket.BURN])


def test_burn_meets_the_reference() -> None:
    speed, distance = rocket.exact_flight(END)
    assert pytest.approx(2206.49625, abs=1e-5) == rocket.BURN  # the reference's digits
    assert speed[0] == pytest.approx(1049.33590, abs=1e-5)
    assert distance[0] == pytest.approx(1089004.2268, abs=1e-4)
    assert rocket.exact_pitch(END)[0][0] == pytest.approx(0.0640283853, abs=1e-10)


def test_burn_meets_an_integration_of_momentum_with_the_exhaust() -> None:
    # Nothing outside acts, and what leaves moves with v - ve: neither F/m nor a logarithm is used.
    # The body's angular momentum loses w re^2 with every kilogram.
    def slope(_: float, state: Array) -> list[float]:
        left, momentum, _, spin, _ = state
        speed = momentum / left
        rate = spin / (left * rocket.GYRATION**2)
        return [
            -rocket.FLOW,
            -rocket.FLOW * (speed - rocket.EXHAUST),
            speed,
            -rocket.FLOW * rocket.LEVER**2 * rate,
            rate,
        ]

    begin = [rocket.MASS, 0.0, 0.0, rocket.MASS * rocket.GYRATION**2 * rocket.PITCH, 0.0]
    end = solve_ivp(slope, (0.0, rocket.BURN), begin, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    speed, distance = rocket.exact_flight(END)
    rate, angle = rocket.exact_pitch(END)
    # 1e-13 a step of DOP853, a few dozen steps.
    assert end[0] == pytest.approx(rocket.DRY, rel=1e-13)
    assert end[1] / end[0] == pytest.approx(speed[0], rel=1e-11)
    assert end[2] == pytest.approx(distance[0], rel=1e-11)
    assert end[3] / (end[0] * rocket.GYRATION**2) == pytest.approx(rate[0], rel=1e-11)
    assert end[4] == pytest.approx(angle[0], rel=1e-11)


def test_burn_begins_with_the_acceleration_of_the_full_mass() -> None:
    speed, distance = rocket.exact_flight(np.array([0.0, 1.0]))
    # The mass changes by 1.4e-4 in the second, and the mean of it by half.
    assert speed == pytest.approx([0.0, rocket.THRUST / rocket.MASS], rel=1e-4)
    assert distance == pytest.approx([0.0, 0.5 * rocket.THRUST / rocket.MASS], rel=1e-4)
