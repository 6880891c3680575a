"""Large and small thrusters: which set fires where, and with which acceleration."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.thrusters.coarse_fine import CoarseFine

from mjspace.contract import Array, Measurement, Reference

X, Y, Z = np.eye(3)
PLACES = np.array([
    [-0.4, 0, 0.5], [0.4, 0, -0.5], [0.4, 0, 0.5], [-0.4, 0, -0.5],
    [-0.4, 0, 0.5], [0.4, 0, -0.5], [0.4, 0, 0.5], [-0.4, 0, -0.5],
])  # fmt: skip
WAYS = np.array([X, -X, -X, X, X, -X, -X, X])
FORCE = np.array([0.5] * 4 + [0.02] * 4)
HOLD = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
U = 0.02 / 12.0


def law(**gains: Any) -> CoarseFine:
    numbers: dict[str, Any] = {
        "fine_below": 0.1,
        "handover": 0.009,
        "threshold": 0.002,
        "hysteresis": 0.0004,
        "rate_gain": 0.5,
    }
    return CoarseFine(
        inertia=np.diag([15.0, 12.0, 18.0]),
        axes=Y[None],
        thruster_positions=PLACES,
        thruster_directions=WAYS,
        thruster_force=FORCE,
        control_period=0.01,
        inner_period=0.01,
        **(numbers | gains),
    )


def fired(angle: float, rate: float, before: float = 0.0) -> tuple[float, Array]:
    """Return the logged firing and the on-times [s] of the eight."""
    flown = law()
    seen = Measurement(
        attitude=np.array([np.cos(0.5 * angle), 0.0, np.sin(0.5 * angle), 0.0]), rate=rate * Y
    )
    state = flown.reset(seen, HOLD)._replace(memory=np.array([[before]]))
    _, aim, signals = flown.step(state, 0.0, seen, HOLD)
    return float(signals.firing[0]), aim.on_time


def test_accelerations_are_those_of_the_sets() -> None:
    flown = law()
    assert flown.acceleration == pytest.approx([0.5 / 12.0])
    assert flown.fine_acceleration == pytest.approx([U])


@pytest.mark.parametrize(
    ("angle", "rate", "firing", "which"),
    [
        (0.1, 0.0, -2.0, [2, 3]),  # far off: back, with the large ones
        (0.02, -0.05, 2.0, [0, 1]),  # too fast for 0.02 rad: the large ones brake
        (0.001, 0.006, -2.0, [2, 3]),  # the small ones would stop it at 0.0118 rad
        (0.001, 0.005, -1.0, [6, 7]),  # and here at 0.0085
        (0.001, 0.001, 0.0, []),
        (-0.0021, 0.0, 1.0, [4, 5]),
    ],
)
def test_the_set_that_fires(angle: float, rate: float, firing: float, which: list[int]) -> None:
    found, on_time = fired(angle, rate)
    assert found == firing
    assert np.flatnonzero(on_time).tolist() == which
    assert on_time[which] == pytest.approx(0.01)


def test_the_trigger_goes_on_until_the_hysteresis_is_passed() -> None:
    assert fired(0.0017, 0.0, before=-1.0)[0] == -1.0
    assert fired(0.0015, 0.0, before=-1.0)[0] == 0.0
    assert fired(0.0017, 0.0)[0] == 0.0


@pytest.mark.parametrize(
    ("gains", "text"),
    [
        ({"fine_below": 0.01}, "fine_below: got 0.01 N, which should divide .* 0.02 to 0.5 N"),
        ({"fine_below": 1.0}, "fine_below: got 1 N"),
        ({"threshold": 0.01}, "threshold: got 0.01 rad, should be .* less than handover, 0.009"),
        ({"hysteresis": 0.003}, "more than hysteresis, 0.003 rad"),
    ],
)
def test_unfit_gains_are_refused(gains: dict[str, float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        law(**gains)
