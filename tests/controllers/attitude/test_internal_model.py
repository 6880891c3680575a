"""The adaptive internal model, on a rigid bus that is integrated alone."""

from collections.abc import Callable

import numpy as np
import pytest
from mjspace.controllers.attitude.internal_model import InternalModel, State

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

M = np.array([[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]])
AMPLITUDE = np.array([0.02, 0.03, 0.04])  # N m
FREQUENCY = np.array([0.8, 0.5, 1.2])  # rad/s
PHASE = np.array([0.3, -1.0, 2.0])
STEP = 4e-3
AT_REST = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))


def disturbance(time: float) -> Array:
    """Return the torque from outside [N m], (3,)."""
    return AMPLITUDE * np.cos(FREQUENCY * time + PHASE)


def flown(
    law: InternalModel, duration: float, torque: Callable[[float], Array]
) -> list[tuple[State, Array]]:
    """Return (state, rate) after each step, of a bus that starts 20 deg off and turns."""
    q = att.from_rotation_vector(np.array([0.2, -0.2, 0.2]))
    w = np.array([0.05, -0.1, 0.02])
    state, rows = law.reset(Measurement(attitude=q, rate=w), AT_REST), []
    inverse = np.linalg.inv(M)
    for k in range(round(duration / STEP)):
        state, command, _ = law.step(state, k * STEP, Measurement(attitude=q, rate=w), AT_REST)
        rows.append((state, w))

        def slope(y: Array, time: float, held: Array = command.torque) -> Array:
            turning = 0.5 * att.multiply(y[:4], np.concatenate([[0.0], y[4:]]))
            moment = held + torque(time) - np.cross(y[4:], M @ y[4:])
            return np.concatenate([turning, inverse @ moment])

        y, t = np.concatenate([q, w]), k * STEP
        one = slope(y, t)
        two = slope(y + 0.5 * STEP * one, t + 0.5 * STEP)
        three = slope(y + 0.5 * STEP * two, t + 0.5 * STEP)
        four = slope(y + STEP * three, t + STEP)
        y = y + STEP / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        q, w = att.normalize(y[:4]), y[4:]
    return rows


def test_its_lyapunov_function_falls() -> None:
    law = InternalModel(inertia=M, control_period=STEP, adaptation_gain=300.0)
    values = []
    for k, (state, rate) in enumerate(flown(law, 6.0, disturbance)):
        angle = FREQUENCY * k * STEP + PHASE
        z1, z2 = AMPLITUDE * np.cos(angle), -AMPLITUDE / FREQUENCY * np.sin(angle)
        slip = state.rate_hat - rate
        off_1, off_2 = state.z1_hat - z1, state.z2_hat - z2
        off_phi = state.phi_hat - FREQUENCY**2
        values.append(
            0.5 * law.model_gain * slip @ M @ slip
            + 0.5 * np.sum(off_1**2 + FREQUENCY**2 * off_2**2 + off_phi**2 / law.adaptation_gain)
        )
    V = np.array(values)
    # By steps of 0.2 s; within one, sampling may raise it by its own small part.
    assert np.all(np.diff(V[:: round(0.2 / STEP)]) < 0.0)
    assert np.diff(V).max() < 1e-3 * V[0]
    assert V[-1] < 0.7 * V[0]


def test_a_known_frequency_is_rejected_to_what_sampling_leaves() -> None:
    law = InternalModel(inertia=M, control_period=STEP, adaptation_gain=0.0, frequency=0.8)
    alike = lambda time: AMPLITUDE * np.cos(0.8 * time + PHASE)  # noqa: E731
    rows = flown(law, 16.0, alike)
    state, rate = rows[-1]
    time = STEP * (len(rows) - 1)
    np.testing.assert_allclose(state.z1_hat, alike(time), atol=1e-4)
    assert np.abs(rate).max() < 2e-3


def test_a_bias_is_learned_beside_it() -> None:
    law = InternalModel(
        inertia=M, control_period=STEP, adaptation_gain=0.0, frequency=0.8, bias_gain=20.0
    )
    bias = np.array([0.01, -0.02, 0.03])
    state, _ = flown(law, 16.0, lambda _: bias)[-1]
    # A tenth of the largest is left, of the slowest pole.
    np.testing.assert_allclose(state.bias_hat, bias, atol=3e-3)
    np.testing.assert_allclose(state.z1_hat + state.bias_hat, bias, atol=3e-3)


def test_unfit_gains_are_refused() -> None:
    with pytest.raises(ValueError, match="observer_gain"):
        InternalModel(inertia=M, control_period=STEP, observer_gain=0.0)
