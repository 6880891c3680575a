"""The linear-quadratic laws against their closed forms and an independent integration.

The figures are those of an independent study of paper 004 (closed forms, scipy to 1e-13).
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from mjspace.controllers.attitude.linear_quadratic import (
    PrintedTracker,
    Regulator,
    Tracker,
    Weights,
    axis_gains,
    cost_to_go,
    feedback,
    linearized,
    steady_cost,
)
from mjspace.controllers.references.references import Hold, Regulation
from oracle import fly, wheel_speeds
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_continuous_are

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

I = np.diag([10.0, 12.0, 14.0])  # noqa: E741, the lecture's letter
FULL = np.array([[15.0, 5.0, 5.0], [5.0, 10.0, 7.0], [5.0, 7.0, 20.0]])
AXES, JW = np.eye(3), np.full(3, 0.05)
SKEW_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
SKEW_JW = np.array([0.05, 0.06, 0.07, 0.08])
WEIGHTS = Weights(np.diag([10.0, 10.0, 10.0, 1.0, 1.0, 1.0]), np.eye(3))
SLEW = Regulation(0.5 * np.pi, 60.0, np.array([1.0, -2.0, 1.5]))
THIRTY = att.from_rotation_vector(np.radians(30.0) * att.normalize(np.array([1.0, 2.0, -1.0])))
ONE = np.array([1.0, 0.0, 0.0, 0.0])


def regulator(**changes: Any) -> Regulator:
    return Regulator(I, AXES, JW, **changes)


@cache
def tracker() -> Tracker:
    return Tracker(I, AXES, JW)


def test_gains_are_the_closed_form_axis_by_axis() -> None:
    kw, ka = axis_gains(np.diag(I), np.full(3, 10.0), np.ones(3), np.ones(3))
    np.testing.assert_allclose(kw, [5.47723, 5.83095, 6.16441], atol=5e-6)
    np.testing.assert_array_equal(ka, 1.0)
    K = regulator().gain_at(0.0)
    np.testing.assert_allclose(K, -np.hstack([np.diag(kw), np.diag(ka)]), atol=1e-12)  # 6e-15
    poles = np.linalg.eigvals(np.add(*_closed(I, K)))
    wanted = [-0.27386 + 0.15811j, -0.24296 + 0.15590j, -0.22016 + 0.15152j]
    for pole in wanted:
        assert np.abs(poles - pole).min() < 1e-5
        assert np.abs(poles - pole.conjugate()).min() < 1e-5


@pytest.mark.parametrize("rate_weight", [0.0, 3.0])  # zero will do: erratum 2
def test_weights_of_each_axis(rate_weight: float) -> None:
    q, a, r = np.full(3, rate_weight), np.array([0.5, 2.0, 4.0]), np.array([0.1, 1.0, 3.0])
    law = regulator(rate_weight=q, angle_weight=a, torque_weight=r)
    kw, ka = axis_gains(np.diag(I), q, a, r)
    np.testing.assert_allclose(law.gain_at(0.0), -np.hstack([np.diag(kw), np.diag(ka)]), rtol=1e-9)


def test_the_cost_is_what_a_flight_costs() -> None:
    P = steady_cost(FULL, WEIGHTS)
    x0 = np.array([0.02, -0.01, 0.015, 0.1, 0.2, -0.1])
    M = np.add(*_closed(FULL, feedback(FULL, WEIGHTS, P)))
    K = feedback(FULL, WEIGHTS, P)

    def slope(t: float, y: Array) -> Array:
        x = y[:6]
        u = K @ x
        return np.append(M @ x, x @ WEIGHTS.Q @ x + u @ WEIGHTS.R @ u)

    cost = solve_ivp(slope, (0, 200), np.append(x0, 0.0), rtol=1e-10, atol=1e-14).y[6, -1]
    assert cost == pytest.approx(x0 @ P @ x0, rel=1e-8)


def test_the_finite_horizon_is_the_exponential_of_the_hamiltonian() -> None:
    A, B = linearized(I, np.zeros(3))
    H = np.block([[A, -B @ B.T], [-WEIGHTS.Q, -A.T]])
    still = Regulation(0.0, 60.0, np.array([1.0, 0.0, 0.0]))
    steady = steady_cost(I, WEIGHTS)
    distances = []
    for horizon in (2.0, 5.0, 10.0, 20.0, 40.0):
        P = cost_to_go(I, WEIGHTS, still, np.zeros((6, 6)), np.array([0.0, horizon]))[0]
        X, Y = np.split(expm(-H * horizon) @ np.vstack([np.eye(6), np.zeros((6, 6))]), 2)
        np.testing.assert_allclose(P, Y @ np.linalg.inv(X), rtol=1e-8, atol=1e-8)
        third = np.ix_([2, 5], [2, 5])  # the slowest axis
        distances.append(np.abs((P - steady)[third]).max() / np.abs(steady[third]).max())
    np.testing.assert_allclose(distances, [0.76, 0.34, 0.036, 6.3e-4, 9.1e-8], rtol=0.02)
    rate = np.log(distances[3] / distances[4]) / 20.0
    assert rate == pytest.approx(0.4421, abs=2e-4)  # towards 2 sigma = 0.4403


def test_linearization_is_that_of_the_equations_of_motion() -> None:
    w, h = np.array([0.03, -0.02, 0.05]), 1e-6
    A, _ = linearized(FULL, w)
    for i, step in enumerate(h * np.eye(6)):
        ahead, behind = _free(w, step), _free(w, -step)
        np.testing.assert_allclose((ahead - behind) / (2.0 * h), A[:, i], atol=1e-9)


def integrated(inertia: Array, motion: Regulation, time: Array, *, rtol: float) -> Array:
    """Return P (n, 6, 6) at each ``time`` (n,), by DOP853 from the steady cost at the last."""
    final = steady_cost(inertia, WEIGHTS)
    _, B = linearized(inertia, np.zeros(3))

    def slope(t: float, flat: Array) -> Array:
        A, _ = linearized(inertia, motion.at(np.array([t])).rate[0])
        P = flat.reshape(6, 6)
        return -(P @ A + A.T @ P - P @ B @ B.T @ P + WEIGHTS.Q).ravel()

    span, atol = (time[-1], time[0]), 0.1 * rtol * np.abs(final).max()
    found = solve_ivp(slope, span, final.ravel(), "DOP853", time[::-1], rtol=rtol, atol=atol)
    return found.y.T[::-1].reshape(-1, 6, 6)


def test_a_heavy_bus_has_the_gains_of_the_equation() -> None:
    """Absolute tolerances of a stepwise integration would be below rounding there."""
    heavy = 1e6 * FULL
    time = np.linspace(0.0, 60.0, 601)
    P = cost_to_go(heavy, WEIGHTS, SLEW, steady_cost(heavy, WEIGHTS), time)
    expected = integrated(heavy, SLEW, time[::100], rtol=1e-10)
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(P[::100] - expected) / scale).max() < 1e-8  # 5e-10 measured
    assert (np.abs(expected[0] - expected[-1]) / scale).max() > 0.1  # they do change


def test_a_light_bus_has_the_steady_gains_of_each_instant() -> None:
    """Its poles, of up to 6e4 rad/s, do not limit the step."""
    light = 1e-5 * FULL
    time = np.linspace(0.0, 60.0, 601)
    P = cost_to_go(light, WEIGHTS, SLEW, steady_cost(light, WEIGHTS), time)
    _, B = linearized(light, np.zeros(3))
    for i in (0, 150, 300, 500):
        A, _ = linearized(light, SLEW.at(time[i : i + 1]).rate[0])
        steady = solve_continuous_are(A, B, *WEIGHTS)
        assert np.abs(P[i] - steady).max() < 1e-8 * np.abs(steady).max()  # 3e-10 measured


@pytest.mark.parametrize("steps", [10, 20])
def test_the_riccati_equation_is_integrated_at_fourth_order(steps: int) -> None:
    turn = Regulation(2.0, 10.0, np.array([1.0, -2.0, 1.5]))
    final = steady_cost(FULL, WEIGHTS)
    expected, far, near = (
        cost_to_go(FULL, WEIGHTS, turn, final, np.linspace(0.0, 10.0, n + 1))[0]
        for n in (640, steps, 2 * steps)
    )
    order = np.log2(np.abs(far - expected).max() / np.abs(near - expected).max())
    assert order == pytest.approx(4.0, abs=0.5)


def test_a_long_turn_has_no_longer_table() -> None:
    law = Tracker(I, AXES, JW, duration=1e9)
    np.testing.assert_allclose(law.gain_at(5e8), regulator().gain_at(0.0), atol=1e-7)


def test_interpolated_gains_are_those_of_the_equation() -> None:
    law = tracker()
    time = np.array([0.0, 7.3456, 29.95, 47.13, 59.97, 60.0])
    P = integrated(I, SLEW, time, rtol=1e-11)
    wanted = feedback(I, WEIGHTS, P)
    found = np.array([law.gain_at(t) for t in time])
    assert np.abs(found - wanted).max() < 2e-8  # of 6; 2.1e-9 measured
    assert np.abs(found[2] - found[-1]).max() > 0.05  # they do change
    np.testing.assert_array_equal(law.gain_at(75.0), law.gain_at(60.0))
    np.testing.assert_allclose(law.gain_at(60.0), regulator().gain_at(0.0), atol=1e-12)


class Continuous(NamedTuple):
    """A flight of a law that acts all the time, on bus and wheels: scipy, rtol 1e-12."""

    end: Array
    """Attitude, rate and wheel speeds."""
    angle: Array
    """Attitude error at each time asked for [deg]."""


def continuous(
    law: Any, reference: Any, y0: Array, times: list[float], *, disturbance: Any = None
) -> Continuous:
    """Fly each motor by itself: Jw (a.w' + Omega') = m, and the whole by its total momentum."""
    axes, Jw, inertia = law.wheel_axes, law.wheel_inertia, law.inertia
    share = -np.linalg.pinv(axes.T)
    M = np.zeros(3) if disturbance is None else disturbance

    def wanted(t: float) -> Reference:
        return Reference(*(part[0] for part in reference.at(np.array([t]))))

    def slope(t: float, y: Array) -> Array:
        q, w, speed = y[:4], y[4:7], y[7:]
        _, command, _ = law.step(
            law.reset(None, None), t, Measurement(attitude=q, rate=w, wheel_speed=speed), wanted(t)
        )
        motor = share @ command.torque
        whole = inertia @ w + axes.T @ (Jw * (axes @ w + speed))
        dw = np.linalg.solve(inertia, np.cross(whole, w) - axes.T @ motor + M)
        dq = 0.5 * att.multiply(q, np.append(0.0, w))
        return np.concatenate([dq, dw, motor / Jw - axes @ dw])

    found = solve_ivp(
        slope, (0.0, times[-1]), y0, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=times
    )
    q = att.normalize(found.y[:4].T)
    angle = np.degrees(att.rotation_angle(q, reference.at(np.array(times)).attitude))
    return Continuous(found.y[:, -1], angle)


def start(law: Any, q: Array, w: Array, h: Array) -> Array:
    """Return the state with the wheels' absolute momentum ``h``."""
    speed = np.linalg.pinv(law.wheel_axes.T) @ h / law.wheel_inertia - law.wheel_axes @ w
    return np.concatenate([q, w, speed])


def sheet(
    reference: Regulation | Hold, gain: Any, q: Array, w: Array, h: Array, end: float
) -> Array:
    """Return the gyrostat of the lecture at ``end``: I w' + w x I w = u, h' = -u + h x w."""

    def slope(t: float, y: Array) -> Array:
        q, w, h = y[:4], y[4:7], y[7:]
        qr, wr, ar = (part[0] for part in reference.at(np.array([t])))
        dq = att.multiply(att.conjugate(qr), q)
        x = np.concatenate([w - wr, 2.0 * dq[1:] / dq[0]])
        u = I @ ar + np.cross(wr, I @ wr) + gain(t) @ x
        dw = np.linalg.solve(I, u - np.cross(w, I @ w))
        rate = 0.5 * att.multiply(q, np.append(0.0, w))
        return np.concatenate([rate, dw, -u + np.cross(h, w)])

    y0 = np.concatenate([q, w, h])
    return solve_ivp(slope, (0.0, end), y0, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


H0, W0 = np.array([1.0, -2.0, 3.0]), np.array([0.02, -0.01, 0.015])


def test_regulation_by_wheels_is_the_lectures() -> None:
    law = regulator()
    of = continuous(law, Hold(), start(law, THIRTY, W0, H0), [5.0, 10.0, 20.0, 40.0])
    np.testing.assert_allclose(of.angle, [15.2846, 3.70755, 0.239113, 1.96e-3], rtol=4e-4)
    whole = sheet(Hold(), lambda t: law.gain_at(0.0), THIRTY, W0, H0, 40.0)
    assert np.abs(of.end[:7] - whole[:7]).max() < 1e-9
    q, w, speed = of.end[:4], of.end[4:7], of.end[7:]
    np.testing.assert_allclose(JW * (w + speed), whole[7:], atol=1e-9)
    # At rest the wheels hold all of the momentum, R(q0) (I w0 + h0).
    left = att.rotate(q, I @ w + JW * (w + speed))
    np.testing.assert_allclose(left, [1.777407, -3.015275, 1.996857], atol=1e-6)


def test_four_skew_wheels_turn_the_bus_alike() -> None:
    one = regulator()
    other = Regulator(I, SKEW_AXES, SKEW_JW)
    ends = [continuous(law, Hold(), start(law, THIRTY, W0, H0), [10.0]).end for law in (one, other)]
    assert np.abs(ends[0][:7] - ends[1][:7]).max() < 1e-9


def test_a_constant_torque_leaves_its_quotient_by_the_stiffness() -> None:
    law, torque = regulator(), np.array([0.02, -0.01, 0.03])
    of = continuous(law, Hold(), start(law, ONE, np.zeros(3), H0), [80.0], disturbance=torque)
    q = of.end[:4]
    np.testing.assert_allclose(2.0 * q[1:] / q[0], torque, atol=1e-6)  # M / ka


A0, D0 = np.array([0.08, -0.05, 0.06]), np.array([0.01, -0.02, 0.015])
TILTED = np.append(2.0, A0) / np.sqrt(4.0 + A0 @ A0)
FULL_WHEELS = np.array([4.0, -3.0, 5.0])


def test_tracking_by_wheels_is_the_lectures() -> None:
    law = tracker()
    of = continuous(law, SLEW, start(law, TILTED, D0, FULL_WHEELS), [0.0, 10.0, 20.0, 60.0])
    np.testing.assert_allclose(of.angle[:3], [6.3992, 1.7457, 0.0397], rtol=5e-4)
    assert np.radians(of.angle[3]) == pytest.approx(1.75e-8, abs=2e-9)  # 1.7e-8 of the study
    whole = sheet(SLEW, law.gain_at, TILTED, D0, FULL_WHEELS, 60.0)
    assert np.abs(of.end[:7] - whole[:7]).max() < 1e-9


def test_erratum_1_the_printed_wheel_command_loses_the_turn() -> None:
    law = PrintedTracker(I, AXES, JW)
    y0 = start(law, ONE, np.zeros(3), FULL_WHEELS)
    times = [20.0, 38.0, 60.0]
    of = continuous(law, SLEW, y0, times)
    np.testing.assert_allclose(of.angle[1:], [10.39, 1.427], atol=5e-3)
    right = continuous(tracker(), SLEW, y0, times)
    assert right.angle.max() < 1e-6
    for end in (of.end, right.end):  # a check of momentum sees nothing of it
        momentum = att.rotate(end[:4], I @ end[4:7] + JW * (end[4:7] + end[7:]))
        np.testing.assert_allclose(momentum, FULL_WHEELS, atol=1e-9)


def test_held_for_a_period_the_torque_errs_in_proportion() -> None:
    errors = []
    for period in (0.02, 0.01):
        of = fly(
            regulator(), Hold(), H=I, wheel_axes=AXES, Jw=JW, q0=THIRTY, w0=W0,
            Omega0=wheel_speeds(I @ W0 + H0, I, AXES, JW, W0), duration=5.0, period=period,
        )  # fmt: skip
        angle = att.rotation_angle(of.attitude[-1], ONE)
        errors.append(np.radians(15.284650) - float(angle))
    assert errors[1] == pytest.approx(3.2e-4, rel=0.02)
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.03)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate_weight": np.array([1.0, -1.0, 1.0])}, "rate_weight.* 0 or more"),
        ({"angle_weight": np.zeros(3)}, "angle_weight.* greater than 0"),
        ({"torque_weight": np.zeros(3)}, "torque_weight.* greater than 0"),  # erratum 2
    ],
)
def test_weights_without_a_solution_are_refused(change: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        regulator(**change)


def _closed(inertia: Array, K: Array) -> tuple[Array, Array]:
    A, B = linearized(inertia, np.zeros(3))
    return A, B @ K


def _free(w: Array, x: Array) -> Array:
    """Return x' where delta and a are ``x``, exactly, under u_ref of a motion of steady rate w."""
    delta, a = x[:3], x[3:]
    rate = w + delta
    u_ref = np.cross(w, FULL @ w)
    change = np.linalg.solve(FULL, u_ref - np.cross(rate, FULL @ rate))
    turn = delta + 0.5 * np.cross(a, rate + w) + 0.25 * a * (a @ delta)
    return np.concatenate([change, turn])
