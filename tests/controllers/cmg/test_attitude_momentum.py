"""Attitude and momentum control of a station: its linear model, its poles, its memory."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.cmg.attitude_momentum import (
    AttitudeHold,
    AttitudeMomentum,
    station_plant,
    with_filters,
)

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

N = 1.1363839e-3
J = np.array([[3.8e7, 6.5e5, -2.3e7], [6.5e5, 1.29e8, 8e4], [-2.3e7, 8e4, 1.04e8]])
J0 = np.trace(J) / 3.0
PITCHED = att.from_rotation_vector(np.array([0.05, 0.3, -0.08]))  # from body axes to the orbit's
OUTER, SPIN = np.tile([0.0, 0.0, 1.0], (4, 1)), np.tile([1.0, 0.0, 0.0], (4, 1))
CMGS = {
    "gimbal_axes": np.stack([OUTER, np.cross(OUTER, SPIN)], axis=1).reshape(-1, 3),
    "spin_axes": SPIN,
    "wheel_inertia": np.full(4, 680.0),
}


@cache
def law(**gains: Any) -> AttitudeMomentum:
    return AttitudeMomentum(**given(), **gains)


def given() -> dict[str, Any]:
    return {"inertia": J, **CMGS, "control_period": 1.0, "orbit_rate": N, "offset": PITCHED}


def accelerations(p: Array, rate: Array, h: Array, u: Array) -> tuple[Array, Array]:
    """Return p'' and h' of the station, turned by a small ``p`` from PITCHED, by Euler's equation.

    In units of 1/N and J0.
    """
    inertia = J / J0
    to_body = att.to_matrix(att.multiply(PITCHED, att.from_rotation_vector(p))).T
    nadir, orbit = to_body[:, 2], -to_body[:, 1]
    w = orbit + rate
    torque = 3.0 * np.cross(nadir, inertia @ nadir) - np.cross(w, inertia @ w) - u
    # w' = orbit' + rate'; the orbit's axes turn in the body's at -rate.
    return np.linalg.solve(inertia, torque) + np.cross(rate, orbit), u - np.cross(w, h)


def test_the_linear_plant_is_that_of_eulers_equation() -> None:
    A, B = station_plant(J, PITCHED)
    matrix, step = np.hstack([A, B]), 1e-6
    for column in range(15):
        x = np.zeros(15)
        x[column] = step
        parts = np.split(x, [3, 6, 9, 12])
        up = np.concatenate(accelerations(parts[0], parts[1], parts[2], parts[4]))
        x[column] = -step
        parts = np.split(x, [3, 6, 9, 12])
        down = np.concatenate(accelerations(parts[0], parts[1], parts[2], parts[4]))
        slope = (up - down) / (2.0 * step)
        np.testing.assert_allclose(matrix[3:9, column], slope, atol=1e-8)
    np.testing.assert_array_equal(matrix[:3, 3:6], np.eye(3))
    np.testing.assert_array_equal(matrix[9:12, 6:9], np.eye(3))


@pytest.mark.parametrize("pitch", ["attitude", "momentum"])
@pytest.mark.parametrize("stability", [0.1, 0.3])
def test_all_poles_are_left_of_the_stability(pitch: Any, stability: float) -> None:
    flown = law(pitch_rejects=pitch, stability=stability)
    A, B = with_filters(*station_plant(J, PITCHED), ("momentum", pitch, "attitude"))
    poles = np.linalg.eigvals(A - B @ flown._gains)
    assert poles.real.max() < -stability
    # The law of a regulator: mirrored at -stability, the unstable poles of A come back.
    assert poles.real.max() > -2.6 * stability


def test_roll_itself_cannot_reject_the_orbits_rate() -> None:
    """Its filter is then out of the controls' reach (Wie et al. 1989); that of momentum is not."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    plant = station_plant(np.diag([3e7, 1.2e8, 1.1e8]), level)
    for roll, least in (("attitude", 0.0), ("momentum", 0.09)):
        A, B = with_filters(*plant, (roll, "attitude", "attitude"))
        reach = np.linalg.svd(np.hstack([A - 1j * np.eye(len(A)), B]))[1]
        assert reach.min() == pytest.approx(least, abs=1e-3)


def test_what_it_rejects_is_not_driven_and_the_mean_momentum_vanishes() -> None:
    """By the linear closed loop's response to torques at 0, n and 2 n."""
    for pitch, still in (("attitude", 1), ("momentum", 7)):
        A, B = with_filters(*station_plant(J, PITCHED), ("momentum", pitch, "attitude"))
        closed = A - B @ law(pitch_rejects=pitch, stability=0.2)._gains
        outside = np.zeros((len(A), 3))
        outside[3:6] = np.linalg.inv(J / J0)
        for frequency in (1.0, 2.0):
            response = np.linalg.solve(1j * frequency * np.eye(len(A)) - closed, outside)
            assert np.abs(response[[6, still, 2]]).max() < 1e-9
            assert np.abs(response[1 if still == 7 else 7]).max() > 0.02
        steady = np.linalg.solve(-closed, outside)
        assert np.abs(steady[6:9]).max() < 1e-9
        assert np.abs(steady[1]).max() > 0.1  # it leans: the torque equilibrium


def test_its_memory_is_that_of_oscillators_and_integrals() -> None:
    """A tenth of an orbit of a constant error, momentum zero, in steps of 1 s, by closed forms."""
    flown = law(stability=0.2)
    p = np.array([0.01, -0.02, 0.03])
    seen = Measurement(
        attitude=att.from_rotation_vector(p),
        rate=np.zeros(3),
        wheel_speed=np.zeros(4),
        gimbal_angle=np.zeros(8),
    )
    reference = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
    state = flown.reset(seen, reference)
    steps = 500
    for k in range(steps):
        state, _, signals = flown.step(state, float(k), seen, reference)
    angle, turn = signals.angle, N * steps
    for f, z in zip((1.0, 2.0), np.split(state.filters, 2), strict=True):
        position = (1.0 - np.cos(f * turn)) / f**2
        np.testing.assert_allclose(z[[2, 4]], angle[1:] * position, rtol=1e-10)
        np.testing.assert_allclose(z[[3, 5]], angle[1:] * np.sin(f * turn) / f, rtol=1e-10)
        np.testing.assert_array_equal(z[:2], 0.0)  # roll's: of the momentum
    np.testing.assert_array_equal(state.integral, 0.0)


def test_gains_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="pitch_rejects: got 'both', should be one of 'attitude'"):
        law(pitch_rejects="both")
    with pytest.raises(ValueError, match="orbit_rate: got 0 rad/s, should be greater than 0"):
        AttitudeHold(**given() | {"orbit_rate": 0.0})
