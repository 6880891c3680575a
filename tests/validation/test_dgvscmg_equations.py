"""The double gimbal's equations: as printed and corrected term by term, by power, by momentum."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation.benchmarks.double_gimbal import (
    ATTITUDE,
    DRIVEN,
    RATE,
    THESIS,
    UNLIKE,
    exact,
    printed_slip,
)
from mjspace.validation.dgvscmg_equations import (
    Vehicle,
    balance,
    cross_matrix,
    derivative,
    driven,
    free,
    simplified,
    steering,
    turned,
)


def any_inertia(rng: np.random.Generator) -> Array:
    """Return a body's inertia, its axes askew."""
    points = rng.normal(size=(8, 3))
    return np.asarray(np.sum(points**2) * np.eye(3) - points.T @ points) / 40.0


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(248)


@pytest.fixture
def vehicle(rng: np.random.Generator) -> Vehicle:
    """Nothing about it is symmetric, the wheel included."""
    return Vehicle(*(any_inertia(rng) for _ in range(4)))


@pytest.fixture
def y(rng: np.random.Generator) -> Array:
    return np.concatenate([attitude.normalize(rng.normal(size=4)), rng.normal(size=9)])


def printed(vehicle: Vehicle, y: Array, joints: Array, whole: bool) -> Array:
    """Return the bus's acceleration by (2.47) and (2.48), term by term as in the thesis.

    ``whole`` puts the right inertia into the gyroscopic term, E1.
    """
    outer = turned(2, y[4])
    inner = outer @ turned(1, y[5])
    wheel = inner @ turned(0, y[6])
    go, gi, s = outer[:, 2], inner[:, 1], wheel[:, 0]
    Mw = wheel @ vehicle.wheel @ wheel.T
    Mgiw = inner @ vehicle.inner @ inner.T + Mw
    Mall = outer @ vehicle.outer @ outer.T + Mgiw
    w, (do, di, dw) = y[7:10], y[10:]
    S = cross_matrix

    def with_rate(M: Array, axis: Array) -> Array:
        return np.asarray(M @ S(w) @ axis + S(w) @ M @ axis + S(axis) @ M @ w)

    def of_two(M: Array, first: Array, second: Array) -> Array:
        return np.asarray(M @ S(first) @ second + S(first) @ M @ second + S(second) @ M @ first)

    tau = -(
        joints[0] * Mall @ go + joints[1] * Mgiw @ gi + joints[2] * Mw @ s
        + do * with_rate(Mall, go) + di * with_rate(Mgiw, gi) + dw * with_rate(Mw, s)
        + do * di * of_two(Mgiw, go, gi) + do * dw * of_two(Mw, go, s) + di * dw * of_two(Mw, gi, s)
        + do**2 * S(go) @ Mall @ go + di**2 * S(gi) @ Mgiw @ gi + dw**2 * S(s) @ Mw @ s
    )  # fmt: skip
    M = vehicle.bus + Mall
    return np.linalg.solve(M, tau - S(w) @ (M if whole else vehicle.bus) @ w)


def test_the_bus_obeys_the_printed_terms_with_the_whole_inertia(
    vehicle: Vehicle, y: Array, rng: np.random.Generator
) -> None:
    joints = rng.normal(size=3)
    acceleration, _ = driven(vehicle, y, joints)
    # Rounding of some twenty terms.
    np.testing.assert_allclose(acceleration[:3], printed(vehicle, y, joints, True), atol=1e-12)
    np.testing.assert_array_equal(acceleration[3:], joints)


def test_the_slip_is_what_the_printed_equation_lacks(vehicle: Vehicle, y: Array) -> None:
    joints = np.zeros(3)
    slipped, _ = driven(vehicle, y, joints, printed_slip(vehicle, y))
    np.testing.assert_allclose(slipped[:3], printed(vehicle, y, joints, False), atol=1e-12)
    assert np.abs(slipped[:3] - printed(vehicle, y, joints, True)).max() > 1e-2
    # The thesis has gimbals and wheel alike about every axis, and cannot see it.
    np.testing.assert_allclose(printed_slip(THESIS, y), 0.0, atol=1e-16)


def slope(function: Callable[[Array], Array], y: Array, along: Array) -> Array:
    """Return a derivative by central differences, good to about 1e-9."""
    return np.asarray((function(y + 1e-5 * along) - function(y - 1e-5 * along)) / 2e-5)


def test_motors_and_outside_torque_do_the_work(
    vehicle: Vehicle, y: Array, rng: np.random.Generator
) -> None:
    # (2.62): of the kinetic energy, by none of the terms that made the torques.
    wanted, outside = rng.normal(size=(2, 3))
    acceleration, motors = driven(vehicle, y, wanted, outside)

    def energy(y: Array) -> Array:
        return np.asarray(0.5 * y[7:] @ balance(vehicle, y)[0] @ y[7:])

    power = y[7:10] @ outside + y[10:] @ motors
    assert slope(energy, y, derivative(y, acceleration)) == pytest.approx(power, abs=1e-7)


def test_only_the_outside_torque_changes_momentum(
    vehicle: Vehicle, y: Array, rng: np.random.Generator
) -> None:
    motors, outside = rng.normal(size=(2, 3))
    along = derivative(y, free(vehicle, y, motors, outside))

    def momentum(y: Array) -> Array:
        return attitude.rotate(y[:4], (balance(vehicle, y)[0] @ y[7:])[:3])

    np.testing.assert_allclose(
        slope(momentum, y, along), attitude.rotate(y[:4], outside), atol=1e-7
    )


def test_free_under_the_driven_motion_s_torques_is_driven(
    vehicle: Vehicle, y: Array, rng: np.random.Generator
) -> None:
    wanted, outside = rng.normal(size=(2, 3))
    acceleration, motors = driven(vehicle, y, wanted, outside)
    # Rounding, by a mass matrix of a condition number below 1e3.
    np.testing.assert_allclose(free(vehicle, y, motors, outside), acceleration, atol=1e-11)


def test_gimbal_motors_bear_the_gyroscopic_torque() -> None:
    # E20 by hand: h = 0.016 kg m^2 x 150 rad/s, gimbal rates 1 and 0.5 rad/s, a bus that stays.
    y = np.array([1.0, *np.zeros(9), 1.0, 0.5, 150.0])
    _, motors = driven(THESIS._replace(bus=1e9 * np.eye(3)), y)
    np.testing.assert_allclose(motors[:2], [-1.2, 2.4], rtol=1e-6)


def test_steering_matrix_is_the_slope_of_the_wheel_s_momentum(y: Array) -> None:
    def momentum(y: Array) -> Array:
        spin = (turned(2, y[4]) @ turned(1, y[5]))[:, 0]
        return np.asarray(UNLIKE.wheel[0, 0] * y[12] * spin)

    columns = [slope(momentum, y, np.eye(13)[k]) for k in (4, 5, 12)]
    np.testing.assert_allclose(steering(UNLIKE, y), np.stack(columns, axis=1), atol=1e-10)


def test_simplified_model_keeps_its_own_momentum(y: Array, rng: np.random.Generator) -> None:
    # h = M_b w + J_w dw' s, (2.54), about a bus that turns; the gimbals' rates are the input.
    eta, outside = rng.normal(size=(2, 3))
    acceleration = np.concatenate([simplified(THESIS, y, eta, outside), [0.0, 0.0, eta[2]]])
    steered = np.concatenate([y[:10], eta[:2], y[12:]])

    def momentum(y: Array) -> Array:
        h = THESIS.bus @ y[7:10] + steering(THESIS, y)[:, 2] * y[12]
        return attitude.rotate(y[:4], h)

    np.testing.assert_allclose(
        slope(momentum, steered, derivative(steered, acceleration)),
        attitude.rotate(y[:4], outside),
        atol=1e-6,
    )


def test_the_thesis_flight_and_its_simplified_model() -> None:
    motion = exact(lambda y: driven(THESIS, y)[0], DRIVEN, 60.0)
    time = np.array([0.0, 10.0, 30.0, 60.0])
    states = motion(time)

    # The motors' work, to the digits of an integration in another program.
    energy = [0.5 * y[7:] @ balance(THESIS, y)[0] @ y[7:] for y in states]
    assert energy[3] - energy[0] == pytest.approx(0.059799621, abs=1e-9)

    eta = np.array([*DRIVEN[:2], 0.0])
    simple = solve_ivp(
        lambda _, y: derivative(y, np.concatenate([simplified(THESIS, y, eta), np.zeros(3)])),
        (0.0, 60.0),
        np.concatenate([ATTITUDE, np.zeros(3), RATE, DRIVEN]),
        "DOP853",
        time,
        rtol=1e-9,
        atol=1e-9,
    ).y.T
    off = attitude.rotation_angle(simple[:, :4], states[:, :4])
    # To the three digits of the reference.
    np.testing.assert_allclose(off, np.radians([0.0, 0.089, 0.190, 0.517]), atol=np.radians(1e-3))
