"""The free CMG's scenario: what its checks compare with is what the equations of motion say."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.validation.benchmarks.double_gimbal import ATTITUDE, DRIVEN, RATE, THESIS
from mjspace.validation.dgvscmg_equations import derivative, free


def exact(seconds: float, tolerance: float) -> Array:
    """Return the state (13,) of Table 2.1's satellite after it was left to itself."""
    start = np.concatenate([ATTITUDE, np.zeros(3), RATE, DRIVEN])
    flown = solve_ivp(
        lambda _, y: derivative(y, free(THESIS, y)),
        (0.0, seconds),
        start,
        "DOP853",
        rtol=tolerance,
        atol=tolerance / 10.0,
    )
    return np.asarray(flown.y[:, -1])


def test_it_moves_as_the_equations_say() -> None:
    built = assemble(*load("dgvscmg-free", ["duration=0.5"]))
    *_, block = fly(built, first_start(built, [0]))
    truth, state = block.rows["/truth"], exact(0.5, 1e-12)
    assert np.abs(state[7:10] - RATE).max() > 1e-3
    # 1e-14 and 2e-12 measured.
    np.testing.assert_allclose(truth["attitude"][-1, 0], state[:4], atol=1e-12)
    np.testing.assert_allclose(truth["rate"][-1, 0], state[7:10], atol=1e-11)


@pytest.mark.long
def test_its_targets_are_those_of_the_equations() -> None:
    scenario, _ = load("dgvscmg-free")
    attitude, rate = (np.array(check.target) for check in scenario.checks[:2])
    state = exact(scenario.duration, 1e-11)
    # Tolerances of 1e-11 and 1e-13 end 1e-9 apart; the targets are of 1e-12.
    np.testing.assert_allclose(attitude, state[:4], atol=2e-9)
    np.testing.assert_allclose(rate, state[7:10], atol=2e-9)
