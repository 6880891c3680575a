"""A spinning wheel's angle and speed, observed from its windings alone, and flown on."""

from typing import NamedTuple

import numpy as np
import pytest
from mjspace.controllers.motors.motor_loops import CurrentLoop, SpeedLoop
from mjspace.controllers.motors.sensorless import SpeedObserver, held_in_stator, turned

from mjspace.actuators.pmsm import Drives
from mjspace.contract import Array

J, P, R, L, KM, STEP = 0.016, 6.0, 3.0, 6e-3, 2.0, 1e-4  # the thesis' wheel, 5.3
ROWS = 6000


class Flight(NamedTuple):
    """Rows of every period, (n,)."""

    speed_error: Array
    """Observed less true [rad/s]."""
    angle_error: Array
    """Of the electrical angle [rad], -pi to pi."""
    tracking: Array
    """Wanted less true speed [rad/s]."""


def fly(believed: float, angle: float, closed: bool, sign: float = 1.0) -> Flight:
    """Fly a wheel about 100 rad/s with the vibration of ch. 5; ``closed``, on what is observed.

    ``believed`` is the observer's first speed, ``angle`` the rotor's, of which it knows nothing.
    """
    motor = Drives(*(np.array([value]) for value in (P, R, L, KM, np.inf, 1.0)))
    observer, inner = SpeedObserver(P, R, L, KM, STEP), CurrentLoop(P, R, L, KM, STEP)
    outer = SpeedLoop(
        J, KM, STEP, 0.32, observer_gain=1.0, vibration_gain=5.0, adaptation_gain=1.0, lead=1 / 3e3
    )
    speed, theta, none = np.array([100.0 * sign]), np.array([angle]), np.zeros(1)
    seen, memory = observer.reset(np.array([believed * sign])), outer.reset(speed)
    windings, integral, voltage = motor.reset(), inner.reset(speed), np.zeros((1, 2))
    time, rows = STEP * np.arange(ROWS), []
    wanted = sign * (100.0 + 20.0 * np.sin(3.0 * time))
    slope = sign * 60.0 * np.cos(3.0 * (time + 1.0 / 3e3))
    for k in range(ROWS):
        if k:
            told = KM / J * turned(windings, -seen[:, 4])[:, 1]
            seen = observer.step(seen, windings, voltage, told)
        frame, rate = (seen[:, 4], seen[:, 5]) if closed else (P * theta, speed)
        dq = turned(windings, -frame)
        memory, asked = outer.step(memory, dq, rate, wanted[k : k + 1], slope[k : k + 1], none)
        integral, applied = inner.step(integral, dq, asked, rate)
        off = np.angle(np.exp(1j * (seen[0, 4] - P * theta[0])))
        rows.append((seen[0, 5] - speed[0], off, wanted[k] - speed[0]))
        voltage = held_in_stator(applied, frame, P * rate * STEP)
        windings, torque, _ = motor.advance(windings, voltage, speed, STEP, theta)
        theta = theta + STEP * (speed + 0.5 * STEP * torque / J)
        speed = speed + STEP * (torque + 0.35 * np.cos(0.5 * theta + 3.0)) / J
    return Flight(*np.array(rows).T)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_unknown_angle_and_a_wrong_speed_are_found(sign: float) -> None:
    flight = fly(believed=90.0, angle=2.0, closed=False, sign=sign)
    assert abs(flight.speed_error[1]) > 9.0
    # 0.015 rad/s and 1.2e-4 rad: the vibration, 0.35 N m, changes an acceleration of up to 22
    # rad/s^2 that nobody tells of.
    assert np.abs(flight.speed_error[-3000:]).max() < 0.03
    assert np.abs(flight.angle_error[-3000:]).max() < 3e-4


def test_a_wheel_flies_on_what_is_observed() -> None:
    flight = fly(believed=95.0, angle=0.5 / P, closed=True)
    assert np.abs(flight.speed_error[-3000:]).max() < 0.03  # 0.016, as with the loop open
    assert np.abs(flight.angle_error[-3000:]).max() < 3e-4
    # 0.63 rad/s after half a second, of 1.1 without rejection; on measured speeds 0.22
    assert np.abs(flight.tracking[-1000:]).max() < 1.0


def test_a_motor_gets_the_same_bits_alone_and_in_a_batch() -> None:
    rng = np.random.default_rng(0)
    observer = SpeedObserver(P, R, L, KM, STEP)
    speed = 100.0 * rng.normal(size=(40, 1))
    memory = observer.reset(speed)
    for _ in range(5):
        current, voltage = 10.0 * rng.normal(size=(2, 40, 1, 2))
        after = observer.step(memory, current, voltage, speed)
        for i in range(40):
            alone = observer.step(memory[i], current[i], voltage[i], speed[i])
            assert alone.tobytes() == after[i].tobytes()
        memory = after


def test_a_bandwidth_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match=r"tracking_bandwidth: got -1\.0 rad/s"):
        SpeedObserver(P, R, L, KM, STEP, tracking_bandwidth=-1.0)


def test_currents_do_not_show_the_angle_of_a_rotor_at_rest_and_do_of_one_that_turns() -> None:
    """Signal injection needs windings whose inductance depends on the angle: these have one."""
    drives = Drives(*(np.full(2, value) for value in (4.0, 2.5, 4.5e-3, 1.5, np.inf, 1.0)))
    angle = np.array([0.0, 0.2])
    apart = []
    for speed in (np.zeros(2), np.full(2, 0.1)):
        current = drives.reset()
        for k in range(20):
            injected = 5.0 * np.array([np.cos(0.6 * k), np.sin(0.6 * k)])
            there = angle + 1e-4 * k * speed
            current, _, _ = drives.advance(current, np.tile(injected, (2, 1)), speed, 1e-4, there)
        apart.append(np.abs(current[1] - current[0]).max())
    assert apart[0] < 1e-14  # rounding of 0.3 A
    assert apart[1] > 1e-2
