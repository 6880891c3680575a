"""The thesis' actuator: its motors by an independent integration, its torque by the momentum."""

from typing import Any

import numpy as np
import pytest
from dgvscmg_samples import BUS
from mjspace.controllers.cmg.dgvscmg_algebraic import Algebraic, State
from scipy.integrate import solve_ivp

from mjspace.contract import Array, Measurement, Reference

INERTIA = np.array([0.001, 0.001, 0.016])
PERIOD, INNER = 1e-3, 1e-4


def law(**gains: Any) -> Algebraic:
    printed = {"turned_inertia": INERTIA, "speed_gain": np.array([0.0015, 0.0015, 0.32])}
    return Algebraic(BUS, PERIOD, INNER, **printed | {"gyroscopic_feedforward": 0.0} | gains)


def seen(vehicles: int) -> Measurement:
    rng = np.random.default_rng(54)
    attitude = rng.normal(size=(vehicles, 4))
    attitude /= np.linalg.norm(attitude, axis=-1, keepdims=True)
    none = np.zeros((vehicles, 0))
    return Measurement(
        attitude=attitude,
        rate=0.1 * rng.normal(size=(vehicles, 3)),
        wheel_speed=none,
        gimbal_angle=none,
        gimbal_rate=none,
        current=none,
    )


def wanted() -> Reference:
    return Reference(np.array([1.0, 0, 0, 0]), np.array([0.05, 0.02, 0]), np.array([0, 0.03, 0]))


def flown(flying: Algebraic, measurement: Measurement, periods: int) -> list[tuple[State, Array]]:
    """Return the state after each inner period, and the torque in it; the satellite stays put."""
    state = flying.reset(measurement, wanted())
    steps = []
    for period in range(periods):
        state, command, _ = flying.step(state, period * PERIOD, measurement, wanted())
        for inner in range(round(PERIOD / INNER)):
            time = period * PERIOD + inner * INNER
            state, asked = flying.inner(state, time, command, measurement)
            steps.append((state, asked.torque))
    return steps


def momentum(state: State) -> Array:
    """Return Jw W s [N m s], body axes, (n, 3)."""
    (do, di, _), W = state.angle.T, state.speed[:, 2]
    spin = np.stack([np.cos(do) * np.cos(di), np.sin(do) * np.cos(di), -np.sin(di)], axis=-1)
    return np.asarray(0.016 * W[:, None] * spin)


def test_the_bus_gets_what_the_wheel_s_momentum_loses() -> None:
    measurement = seen(4)
    steps = flown(law(), measurement, 300)
    assert np.abs(steps[-1][0].angle[:, :2]).min() > 0.01
    for (before, _), (after, torque) in zip(steps[-9:], steps[-8:], strict=False):
        loss = (momentum(before) - momentum(after)) / INNER
        # The midpoint rule's third order, with gimbal rates of some rad/s.
        np.testing.assert_allclose(after.applied_torque, loss, atol=1e-5)
        # And it turns with the bus: h x w on the side of the bus.
        halfway = 0.5 * (momentum(before) + momentum(after))
        np.testing.assert_allclose(
            torque - after.applied_torque, np.cross(halfway, measurement.rate), atol=1e-5
        )
    assert np.abs(steps[-1][0].applied_torque).max() > 0.1


def test_a_motor_turns_under_its_current_and_the_vibration() -> None:
    """With no loop at work but the smallest: J W' = 0.35 cos(theta / 2 + 3), by another program."""
    none = np.zeros((1, 0))
    still = Measurement(
        attitude=np.array([[1.0, 0, 0, 0]]),
        rate=np.zeros((1, 3)),
        wheel_speed=none,
        gimbal_angle=none,
        gimbal_rate=none,
        current=none,
    )
    at_rest = Reference(np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
    free = law(speed_gain=np.full(3, 1e-12), observer_gain=np.zeros(3), vibration_gain=np.zeros(3))
    state = free.reset(still, at_rest)
    state, command, _ = free.step(state, 0.0, still, at_rest)
    for inner in range(2000):
        state, _ = free.inner(state, inner * INNER, command, still)

    def motion(_: float, y: Array) -> list[float]:
        return [y[1], 0.35 * np.cos(0.5 * y[0] + 3.0) / 0.016]

    angle, speed = solve_ivp(motion, (0.0, 0.2), [0.0, 73.0], "DOP853", rtol=1e-11).y[:, -1]
    assert abs(speed - 73.0) > 0.1
    # The midpoint rule's second order: (psi W h)^2 / 24 = 6e-7 of each swing.
    assert state.angle[0, 2] == pytest.approx(angle, abs=1e-6)
    assert state.speed[0, 2] == pytest.approx(speed, abs=1e-6)
    np.testing.assert_array_equal(state.angle[0, :2], 0.0)


def test_gimbals_take_up_their_wanted_rates_as_printed_and_then_keep_to_them() -> None:
    measurement = seen(1)
    flying = law()
    state = flying.reset(measurement, wanted())
    error = [state.desired_speed[0, :2] - state.speed[0, :2]]
    for period in range(200):
        state, command, _ = flying.step(state, period * PERIOD, measurement, wanted())
        for inner in range(10):
            state, _ = flying.inner(state, period * PERIOD + inner * INNER, command, measurement)
        # A wanted rate is reached at the end of the period in which it was asked.
        np.testing.assert_allclose(state.desired_speed[:, :2], command.gimbal_rate, rtol=1e-12)
        error.append(state.desired_speed[0, :2] - state.speed[0, :2])
    assert np.abs(error[0]).min() > 0.1
    # J e' = -k_p e, at 1.5 1/s, whatever is wanted meanwhile: Euler's rule in steps of 0.1 ms.
    np.testing.assert_allclose(error[-1] / error[0], (1.0 - 1.5e-4) ** 2000, rtol=1e-9)


def test_its_speed_loops_refuse_what_the_period_cannot_bear() -> None:
    with pytest.raises(ValueError, match="pole"):
        law(speed_gain=np.array([25.0, 0.0015, 0.32]))
