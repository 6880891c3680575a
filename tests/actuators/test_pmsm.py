"""The electric drive: its equations, its energy, its limit, its units."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.integrate import solve_ivp

from mjspace.actuators.pmsm import Drives, Pmsm
from mjspace.units import to_si

GIMBAL = Pmsm(pole_pairs=4, resistance=2.5, inductance=4.5e-3, torque_constant=1.5)
WHEEL = Pmsm(pole_pairs=6, resistance=3.0, inductance=6e-3, torque_constant=2.0)  # thesis, 5.3
DRIVES = Drives.of([GIMBAL, WHEEL])
SPEED = np.array([-3.0, 167.0])
CURRENT = np.array([[0.4, -1.2], [-0.7, 2.2]])
VOLTAGE = np.array([[11.0, -7.0], [-20.0, 340.0]])


def slopes(motor: Pmsm, i: Any, u: Any, W: float) -> tuple[float, float]:
    """Return (I_d', I_q'), (2.73) and (2.74) as printed."""
    p, R, L, km = motor.pole_pairs, motor.resistance, motor.inductance, motor.torque_constant
    return (
        (-R * i[0] + L * p * W * i[1] + u[0]) / L,
        (-R * i[1] - L * p * W * i[0] - km * W + u[1]) / L,
    )


def held(motor: Pmsm, i: Any, u: Any, W: float, step: float) -> np.ndarray:
    """Return I_d, I_q, and the integrals of I_q, u.i and |i|^2, with the speed held."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [*slopes(motor, y, u, W), y[1], u[0] * y[0] + u[1] * y[1], y[0] ** 2 + y[1] ** 2]

    return solve_ivp(
        rates, (0.0, step), [*i, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-15
    ).y[:, -1]


@pytest.mark.parametrize("step", [1e-6, 1e-4, 1e-3, 5e-3, 0.1])
def test_a_step_solves_the_equations(step: float) -> None:
    current, torque, applied = DRIVES.advance(CURRENT, VOLTAGE, SPEED, step)
    assert np.array_equal(applied, VOLTAGE)
    for n, motor in enumerate((GIMBAL, WHEEL)):
        d, q, turned, *_ = held(motor, CURRENT[n], VOLTAGE[n], SPEED[n], step)
        # 3e-13 at most, where the turn p W h is 100 rad: the integrator's own
        assert np.allclose(current[n], [d, q], rtol=1e-12, atol=1e-12)
        assert torque[n] == pytest.approx(motor.torque_constant * turned / step, rel=1e-12)


def test_no_energy_is_made_or_lost() -> None:
    step = 1e-3
    current, torque, _ = DRIVES.advance(CURRENT, VOLTAGE, SPEED, step)
    for n, motor in enumerate((GIMBAL, WHEEL)):
        *_, given, squares = held(motor, CURRENT[n], VOLTAGE[n], SPEED[n], step)
        copper = motor.resistance * squares
        stored = 0.5 * motor.inductance * (current[n] @ current[n] - CURRENT[n] @ CURRENT[n])
        mechanical = torque[n] * SPEED[n] * step
        assert abs(mechanical) > 1e-3  # J, of each: none is idle
        assert given == pytest.approx(copper + mechanical + stored, abs=1e-13)  # rounding


def test_a_long_step_ends_in_the_steady_state() -> None:
    current, *_ = DRIVES.advance(CURRENT, VOLTAGE, SPEED, 1.0)
    p, L, R, km = DRIVES.pole_pairs, DRIVES.inductance, DRIVES.resistance, DRIVES.torque_constant
    across = VOLTAGE[:, 1] - km * SPEED  # what the back-EMF leaves
    reactance = L * p * SPEED
    squared = R**2 + reactance**2
    d = (R * VOLTAGE[:, 0] + reactance * across) / squared
    q = (R * across - reactance * VOLTAGE[:, 0]) / squared
    assert np.allclose(current, np.stack([d, q], axis=-1), rtol=1e-12)
    assert np.allclose(DRIVES.advance(current, VOLTAGE, SPEED, 1.0)[1], km * q, rtol=1e-12)


def test_at_rest_it_is_a_resistance_and_a_coil() -> None:
    current, torque, _ = DRIVES.advance(DRIVES.reset(), VOLTAGE, np.zeros(2), 1e-3)
    time = DRIVES.inductance / DRIVES.resistance
    risen = VOLTAGE / DRIVES.resistance[:, None] * -np.expm1(-1e-3 / time)[:, None]
    assert np.allclose(current, risen, rtol=1e-14)
    assert np.all(np.sign(torque) == np.sign(VOLTAGE[:, 1]))


def test_the_supply_cuts_a_voltage_in_length_alone() -> None:
    limited = Drives.of(
        [
            GIMBAL.model_copy(update={"voltage_limit": 10.0}),
            WHEEL.model_copy(update={"voltage_limit": 400.0}),
        ]
    )
    current, torque, applied = limited.advance(CURRENT, VOLTAGE, SPEED, 1e-4)
    assert np.hypot(*applied[0]) == pytest.approx(10.0, rel=1e-15)
    assert applied[0, 1] / applied[0, 0] == pytest.approx(-7.0 / 11.0, rel=1e-15)
    assert np.array_equal(applied[1], VOLTAGE[1])  # 340.6 V: within
    as_given = DRIVES.advance(CURRENT, applied, SPEED, 1e-4)
    assert np.array_equal(current, as_given[0])
    assert np.array_equal(torque, as_given[1])


def test_not_a_number_is_passed_on() -> None:
    voltage = VOLTAGE.copy()
    voltage[0, 1] = np.nan
    with np.errstate(invalid="ignore"):
        current, torque, applied = DRIVES.advance(CURRENT, voltage, SPEED, 1e-4)
    assert np.isnan(torque[0])
    assert np.isnan(applied[0]).any()
    assert np.isfinite(current[1]).all()


def test_a_vehicle_gets_the_same_bits_alone_and_in_a_batch() -> None:
    rng = np.random.default_rng(0)
    speed = 200.0 * rng.normal(size=(3, 43, 2))  # |a h| below and above one
    voltage, current = 300.0 * rng.normal(size=(2, 3, 43, 2, 2))
    together = DRIVES.advance(current, voltage, speed, 1e-3)
    for i in np.ndindex(3, 43):
        alone = DRIVES.advance(current[i], voltage[i], speed[i], 1e-3)
        assert all(a.tobytes() == b[i].tobytes() for a, b in zip(alone, together, strict=True))
    assert DRIVES.reset((3, 43)).shape == current.shape


@pytest.mark.parametrize(("within", "order"), [(0.0, 1.0), (0.5, 2.0)])
def test_a_speed_that_changes_costs_the_order_that_is_said(within: float, order: float) -> None:
    """The speed of each step is that at its start (as flown), or in its middle."""
    u, span = np.array([1.0, 30.0]), 0.02

    def speed(t: float) -> float:
        return 20.0 + 5.0 * np.sin(200.0 * t)

    exact = solve_ivp(
        lambda t, y: slopes(WHEEL, y, u, speed(t)),
        (0.0, span), [0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14,
    ).y[:, -1]  # fmt: skip
    motor, errors = Drives.of([WHEEL]), []
    for steps in (100, 200, 400):
        step, current = span / steps, motor.reset()
        for k in range(steps):
            held_speed = np.array([speed((k + within) * step)])
            current, *_ = motor.advance(current, u[None], held_speed, step)
        errors.append(np.abs(current[0] - exact).max())
    fitted = np.log2(errors[0] / errors[2]) / 2.0
    assert fitted == pytest.approx(order, abs=0.05)


def windings(t: float, y: Any, u: Any, theta: float, W: float) -> list[float]:
    """Return the slopes of the wheel's windings' currents and the torque, (2.67)-(2.69)."""
    p, R, L, km = WHEEL.pole_pairs, WHEEL.resistance, WHEEL.inductance, WHEEL.torque_constant
    sin, cos = np.sin(p * (theta + W * t)), np.cos(p * (theta + W * t))
    return [
        (-R * y[0] + km * W * sin + u[0]) / L,
        (-R * y[1] - km * W * cos + u[1]) / L,
        km * (-y[0] * sin + y[1] * cos),
    ]


@pytest.mark.parametrize("step", [1e-6, 1e-4, 5e-3])
@pytest.mark.parametrize("W", [167.0, -40.0, 0.0])
def test_a_step_of_the_windings_solves_theirs(W: float, step: float) -> None:
    theta, u = 0.3, np.array([150.0, -290.0])
    motors = Drives.of([GIMBAL, WHEEL.model_copy(update={"axes": "stator"})])
    a, b, impulse = solve_ivp(
        windings, (0.0, step), [*CURRENT[1], 0.0], args=(u, theta, W),
        method="DOP853", rtol=1e-13, atol=1e-14,
    ).y[:, -1]  # fmt: skip
    speed, angle = np.array([-3.0, W]), np.array([9.0, theta])
    current, torque, _ = motors.advance(CURRENT, np.array([VOLTAGE[0], u]), speed, step, angle)
    # 1e-12 at most: the integrator's own
    np.testing.assert_allclose(current[1], [a, b], rtol=1e-11, atol=1e-11)
    assert torque[1] == pytest.approx(impulse / step, rel=1e-11)
    # a motor beside it works in its rotor's axes as ever
    other, given, _ = DRIVES.advance(CURRENT, VOLTAGE, SPEED, step)
    assert current[0].tobytes() == other[0].tobytes()
    assert torque[0] == given[0]


def test_park_gives_the_windings_currents() -> None:
    """(2.68), (2.69), of the windings, integrated as they are, against (d, q) transformed."""
    W, step, theta = 50.0, 2e-3, 0.3
    motor = Drives.of([WHEEL])
    u = np.array([[-3.0, 110.0]])

    def slopes_at(t: float, y: np.ndarray) -> list[float]:
        return windings(t, y, motor.to_stator(u, np.array([theta + W * t]))[0], theta, W)

    start = motor.to_stator(CURRENT[1:], np.array([theta]))[0]
    a, b, impulse = solve_ivp(
        slopes_at, (0.0, step), [*start, 0.0], method="DOP853", rtol=1e-13, atol=1e-14
    ).y[:, -1]
    current, torque, _ = motor.advance(CURRENT[1:], u, np.array([W]), step)
    found = motor.to_stator(current, np.array([theta + W * step]))[0]
    assert np.allclose(found, [a, b], rtol=0.0, atol=1e-11)
    assert torque[0] * step == pytest.approx(impulse, rel=1e-11)


def test_a_table_takes_its_units() -> None:
    table = TypeAdapter(Pmsm).validate_python({
        "pole_pairs": 6, "resistance": "120 mohm", "inductance": "240 uH",
        "torque_constant": "0.4 V s/rad", "voltage_limit": "100 V",
    })  # fmt: skip
    drives = Drives.of([table, WHEEL])
    assert drives.resistance.tolist() == [0.12, 3.0]
    assert drives.inductance[0] == pytest.approx(2.4e-4)
    assert drives.torque_constant.tolist() == [0.4, 2.0]
    assert drives.voltage_limit.tolist() == [100.0, np.inf]
    assert drives.pole_pairs.tolist() == [6.0, 6.0]
    with pytest.raises(ValidationError, match="'3 V' has the unit 'V', should be one of ohm, mohm"):
        TypeAdapter(Pmsm).validate_python(table.model_dump() | {"resistance": "3 V"})


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("5 mV", "V", 5e-3), ("20 mA", "A", 0.02), ("6 mH", "H", 6e-3), ("50 mN m/A", "N m/A", 0.05)],
)
def test_electrical_quantities_have_units(text: str, unit: str, value: float) -> None:
    assert to_si(text, unit) == pytest.approx(value, rel=1e-15)
