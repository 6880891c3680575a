"""The motors' loops, on the bench of paper 001, chapter 4, and each alone."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from mjspace.controllers.motors.motor_bench import SpeedBench
from mjspace.controllers.motors.motor_loops import CurrentLoop, SpeedLoop, estimates
from numba import njit
from taken_down import taken_down

from mjspace.actuators.pmsm import Drives, Pmsm
from mjspace.contract import Measurement, Reference

J, P, R, L, KM = 0.016, 6.0, 3.0, 6e-3, 2.0  # Table 4.1
AMPLITUDE, RATE = 20.0, np.pi / 2.0
LAMBDA, PSI, PHI = 0.1, 0.2, 3.0
STEP, KEP = 1e-4, 3000.0
MOTOR = Pmsm(pole_pairs=6, resistance=R, inductance=L, torque_constant=KM)
OBSERVER = {"observer_gain": 1.0, "vibration_gain": 5.0, "adaptation_gain": 0.26}


@njit(cache=True)
def turn(angle: Any, speed: Any, torque: Any, step: float) -> None:
    """Advance rotors under a motor's torque and the vibration (4.3) by one RK4 step."""
    for n in range(speed.size):
        slope_a, slope_w, sum_a, sum_w = 0.0, 0.0, 0.0, 0.0
        for stage in range(4):
            part = (0.0, 0.5, 0.5, 1.0)[stage] * step
            theta = angle[n] + part * slope_a
            slope_a = speed[n] + part * slope_w
            slope_w = (torque[n] + LAMBDA * np.cos(PSI * theta + PHI)) / J
            weight = (1.0, 2.0, 2.0, 1.0)[stage] * step / 6.0
            sum_a += weight * slope_a
            sum_w += weight * slope_w
        angle[n] += sum_a
        speed[n] += sum_w


class Flight(NamedTuple):
    """Rows of every tenth period, (n, m)."""

    error: np.ndarray
    phi_hat: np.ndarray
    voltage: np.ndarray


def bench(loop: SpeedLoop, motors: int, every: int, duration: float) -> Flight:
    """Fly motors after 20 sin(pi t/2): currents at 10 kHz, speeds at every ``every``-th period."""
    inner = CurrentLoop(np.full(motors, P), R, L, KM, STEP, KEP)
    drives = Drives(*(np.full(motors, value) for value in (P, R, L, KM, np.inf, 0.0)))
    rows = round(duration / STEP)
    time = STEP * np.arange(rows)
    lag = 1.0 / KEP + 0.5 * (every - 1) * STEP
    wanted = np.repeat(AMPLITUDE * np.sin(RATE * time)[:, None], motors, axis=1)
    slope = np.repeat(RATE * AMPLITUDE * np.cos(RATE * (time + lag))[:, None], motors, axis=1)
    angle, speed, load, asked = np.zeros((4, motors))
    current, integral, memory = drives.reset(), inner.reset(speed), loop.reset(speed)
    outer = taken_down(loop.step, memory, current, speed, wanted[0], slope[0], load)
    within = taken_down(inner.step, integral, current, asked, speed)
    kept = []
    for k in range(rows):
        if k % every == 0:
            memory, asked = outer(memory, current, speed, wanted[k], slope[k], load)
        integral, voltage = within(integral, current, asked, speed)
        if k % 10 == 0:
            kept.append((wanted[k] - speed, memory[:, 6], np.hypot(*voltage.T)))
        current, torque, _ = drives.advance(current, voltage, speed, STEP)
        turn(angle, speed, torque, STEP)
    return Flight(*(np.array(part) for part in zip(*kept, strict=True)))


@pytest.fixture(scope="module")
def flown() -> Flight:
    """20 s of four motors: adaptive; no rejection; psi known; adaptive, fed back without lead."""
    loop = SpeedLoop(
        J, KM, STEP, speed_gain=8.0,
        observer_gain=np.array([1.0, 0.0, 1.0, 1.0]),
        vibration_gain=np.array([5.0, 0.0, 5.0, 5.0]),
        adaptation_gain=np.array([0.26, 0.0, 0.0, 0.26]),
        ratio=np.array([0.0, 0.0, PSI**2, 0.0]),
        lead=np.array([1.0, 1.0, 1.0, 0.0]) / KEP,
    )  # fmt: skip
    return bench(loop, 4, 1, 20.0)


def rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values**2, axis=0))


def test_the_vibration_is_learned_and_rejected(flown: Flight) -> None:
    assert flown.phi_hat[-1, 0] == pytest.approx(PSI**2, abs=1e-6)  # 0.0399998
    late = np.abs(flown.error[-2000:]).max(axis=0)
    # 6.0e-8 and 4.9e-8 rad/s through the real current loop; with a current that is there one
    # period after it is asked for, 4e-10.
    assert late[0] < 2e-7
    assert late[2] < 2e-7


def test_without_rejection_the_vibration_stays(flown: Flight) -> None:
    late = flown.error[-8000:, 1]  # two turns of the profile
    assert np.abs(late).max() == pytest.approx(LAMBDA / 8.0, rel=1e-3)  # Lambda / k_p
    assert rms(late) == pytest.approx(8.8e-3, rel=0.01)
    assert not flown.phi_hat[:, 1].any()


def test_the_lead_is_what_the_current_loop_lags(flown: Flight) -> None:
    late = rms(flown.error[-2000:])
    assert late[3] > 100.0 * late[0]  # 8.4e-6 against 3.0e-8 rad/s


def test_the_bench_asks_for_forty_volts(flown: Flight) -> None:
    assert flown.voltage.max() == pytest.approx(40.0, abs=0.5)  # k_m W, mostly
    assert np.all(flown.phi_hat >= 0.0)
    assert np.all(flown.phi_hat <= 1.5)


def test_a_slower_speed_loop_rejects_too() -> None:
    loop = SpeedLoop(J, KM, 5 * STEP, 8.0, lead=1.0 / KEP + 2.0 * STEP, **OBSERVER)
    late = bench(loop, 1, 5, 8.0).error[-2000:]
    assert rms(late)[0] < 1e-5  # 5.9e-6 rad/s at 2 kHz, still falling: 2.2e-6 by 20 s


MOTORS = (np.array([4.0, 4.0, 6.0]), np.array([2.5, 2.5, 3.0]), np.array([4.5e-3, 4.5e-3, 6e-3]))
CONSTANTS = np.array([1.5, 1.5, 2.0])  # thesis, 5.3: outer and inner gimbal, wheel


def driven(
    loop: CurrentLoop, wanted: Any, speed: Any, periods: int, limit: float = np.inf
) -> np.ndarray:
    """Return the currents (n, m, 2) at held speeds; ``wanted`` is a function of time."""
    motors = Drives(*MOTORS, CONSTANTS, np.full(3, limit), np.zeros(3))
    current, integral, rows = motors.reset(), loop.reset(speed), []
    for k in range(periods):
        rows.append(current)
        integral, voltage = loop.step(integral, current, wanted(k * STEP), speed)
        current, *_ = motors.advance(current, voltage, speed, STEP)
    return np.array(rows)


SPEED = np.array([-3.0, 5.0, 167.0])


def test_a_current_follows_at_the_gain() -> None:
    loop = CurrentLoop(*MOTORS, CONSTANTS, STEP)
    target = np.array([1.0, -2.0, 3.0])
    rows = driven(loop, lambda _: target, SPEED, 400)
    # Sampled, one pole: each period leaves 1 - k_ep T of the error; the held voltage and the turn
    # of the electrical angle, 0.1 rad in a period for the wheel, add a few hundredths.
    left = 1.0 - rows[:8, :, 1] / target
    assert np.allclose(left, 0.7 ** np.arange(8)[:, None], atol=0.03)
    assert np.abs(rows[:, :2, 0]).max() < 0.01  # A: I_d is decoupled
    assert np.abs(rows[:, 2, 0]).max() < 0.5
    assert np.allclose(rows[-1], np.stack([0.0 * target, target], axis=-1), atol=1e-4)


def test_a_ramp_is_followed_one_over_the_gain_late() -> None:
    loop = CurrentLoop(*MOTORS, CONSTANTS, STEP)
    rows = driven(loop, lambda t: np.full(3, 10.0 * t), np.zeros(3), 400)
    late = 399 * STEP - rows[-1, :, 1] / 10.0
    assert np.allclose(late, 1.0 / KEP, rtol=1e-3)


def test_the_integrals_hold_where_the_supply_ends() -> None:
    target = np.array([1.0, -2.0, 3.0])
    at_rest, reached = np.zeros(3), {}
    for known in (5.0, np.inf):
        loop = CurrentLoop(*MOTORS, CONSTANTS, STEP, voltage_limit=known)
        # 5 V are 2 A through 2.5 ohm: none to spare for the second, and 3 ohm stop short of 3 A
        rows = driven(loop, lambda t: target * (t < 0.02), at_rest, 280, limit=5.0)
        reached[known] = np.abs(rows[-40:, 2, 1]).max()
    # 4 to 8 ms after no current is wanted: 0.012 A are left, or, wound up, all of 1.67 A
    assert reached[5.0] < 0.03
    assert reached[np.inf] > 1.6


@pytest.mark.parametrize(
    ("kep", "message"),
    [
        (9e6, r"pole at 9e\+06 rad/s.*2\.2e-07 s.*steps of RK4 at most 3\.1e-07 s.*3000 1/s"),
        (5e6, r"pole at 5e\+06 rad/s.*4\.0e-07 s.*steps of RK4 at most 5\.6e-07 s"),
        (20500.0, "period of 0.0001 s is too long"),
        (-1.0, "proportional_gain: got -1.0, should be greater than zero"),
    ],
)
def test_gains_that_the_period_cannot_bear_are_refused(kep: float, message: str) -> None:
    """Erratum E21: the printed 9e6 and 5e6 1/s."""
    with pytest.raises(ValueError, match=message):
        CurrentLoop(P, R, L, KM, STEP, proportional_gain=kep, integral_gain=10.0)


def test_the_refused_gain_diverges_and_one_below_settles() -> None:
    for factor, settles in ((0.97, True), (1.03, False)):
        loop = CurrentLoop(*MOTORS, CONSTANTS, STEP)
        edge = 2.0 / STEP * factor
        object.__setattr__(loop, "proportional_gain", edge)  # past the guard
        rows = driven(loop, lambda _: np.ones(3), np.zeros(3), 600)
        assert (np.abs(rows[-1, :, 1] - 1.0) < 1e-3).all() == settles
        if settles:
            CurrentLoop(*MOTORS, CONSTANTS, STEP, proportional_gain=edge)
        else:
            with pytest.raises(ValueError, match="too long"):
                CurrentLoop(*MOTORS, CONSTANTS, STEP, proportional_gain=edge)


def test_a_speed_gain_too_high_is_refused() -> None:
    with pytest.raises(ValueError, match=r"pole at 2\.5e\+04 rad/s.*less than 8e-05 s"):
        SpeedLoop(J, KM, STEP, speed_gain=400.0)


def test_without_an_observer_it_is_the_printed_law() -> None:
    """(4.11) less z1_hat, with the load."""
    loop = SpeedLoop(np.array([0.018, 0.017, 0.016]), CONSTANTS, STEP, 2.0)
    rng = np.random.default_rng(1)
    speed, wanted, acceleration, load = rng.normal(size=(4, 5, 3))
    memory, asked = loop.step(
        loop.reset(speed), rng.normal(size=(5, 3, 2)), speed, wanted, acceleration, load
    )
    inertia = np.array([0.018, 0.017, 0.016])
    assert np.allclose(
        asked, (inertia * acceleration + load + 2.0 * (wanted - speed)) / CONSTANTS, rtol=1e-14
    )
    seen = estimates(memory)
    assert np.array_equal(seen.speed_hat, speed)
    assert not np.any([seen.z1_hat, seen.z2_hat, seen.phi_hat])


def test_the_integral_finds_a_load_that_nobody_told() -> None:
    speed, last = np.zeros(2), np.zeros((2, 2))
    loop = SpeedLoop(J, KM, STEP, 2.0, integral_gain=np.array([20.0, 0.0]))
    memory = loop.reset(speed)
    for _ in range(20000):
        memory, asked = loop.step(memory, last, speed, speed * 0.0, speed * 0.0, speed * 0.0)
        speed = speed + STEP * (KM * asked - 0.5) / J
    assert abs(speed[0]) < 1e-7  # exp(-10 t) from 0.25
    assert speed[1] == pytest.approx(-0.25, rel=1e-6)  # load / k_p


def test_what_carries_the_rotor_need_not_disturb_it() -> None:
    """J (W + c)' = k_m I_q + z1 on a carrier that swings: told of it, and not."""
    swing, pace = 2.0, 8.0  # rad/s
    loop = SpeedLoop(
        np.full(2, J), KM, STEP, 0.32, observer_gain=1.0, vibration_gain=5.0, ratio=PSI**2
    )
    total, angle, zero = np.full(2, 100.0), np.zeros(2), np.zeros(2)
    memory, asked, missed = loop.reset(total), zero, []
    for k in range(20000):
        c = swing * np.sin(pace * k * STEP)
        current = np.stack([zero, asked], axis=-1)
        told = np.array([c, 0.0])
        wanted = 100.0 + zero
        memory, asked = loop.step(memory, current, total - c, wanted, zero, zero, told)
        missed.append(total - 100.0)
        z1 = LAMBDA * np.cos(PSI * angle + PHI)
        angle += STEP * (total - c)
        total = total + STEP * (KM * asked + z1) / J
    knowing, not_knowing = rms(np.array(missed)[15000:])
    assert knowing < 1e-3  # 1.4e-4: what Euler's step leaves here
    assert not_knowing > 1.0  # 1.2: the rotor is made to follow its carrier


def test_an_integral_holds_at_the_current_limit() -> None:
    loop = SpeedLoop(J, KM, STEP, 2.0, integral_gain=20.0, current_limit=3.0)
    one = np.ones(1)
    for wanted, given in ((100.0, 3.0), (-100.0, -3.0), (1.0, 1.0)):
        memory, asked = loop.step(
            loop.reset(0.0 * one), np.zeros((1, 2)), 0.0 * one, wanted * one, 0.0 * one, 0.0 * one
        )
        assert asked[0] == pytest.approx(given)
        assert memory[0, 2] == pytest.approx(STEP * wanted if abs(given) < 3.0 else 0.0)


def test_no_measurement_makes_the_rejection_ask_for_more_than_is_believed() -> None:
    """Currents and speeds of noise: the estimates wander, but within what they are allowed."""
    rng = np.random.default_rng(2)
    gains = {"observer_gain": 1.0, "vibration_gain": 5.0, "adaptation_gain": 1.0, "lead": 1 / KEP}
    loop = SpeedLoop(J, KM, STEP, 0.32, vibration_limit=0.4, **gains)
    plain = SpeedLoop(J, KM, STEP, 0.32)
    speed = 100.0 + np.zeros((50, 1))
    memory, off, none, most, phis = loop.reset(speed), plain.reset(speed), 0.0 * speed, 0.0, []
    for _ in range(500):
        speed = speed + rng.normal(size=(50, 1))
        current = 3.0 * rng.normal(size=(50, 1, 2))
        memory, asked = loop.step(memory, current, speed, none + 100.0, none, none)
        off, bare = plain.step(off, current, speed, none + 100.0, none, none)
        most = max(most, KM * np.abs(asked - bare).max())
        phis.append(estimates(memory).phi_hat)
    assert 0.39 < most <= 0.4 * (1.0 + 1e-12)  # reached, not passed
    assert np.min(phis) == 0.0
    assert np.max(phis) == 1.5


def test_a_motor_gets_the_same_bits_alone_and_in_a_batch() -> None:
    rng = np.random.default_rng(3)
    gains = {"observer_gain": [0, 0, 1], "vibration_gain": [0, 0, 5], "adaptation_gain": [0, 0, 1]}
    outer = SpeedLoop(
        np.array([0.018, 0.017, 0.016]), CONSTANTS, STEP, np.array([2.0, 2.0, 0.32]),
        integral_gain=0.1, lead=1.0 / KEP, vibration_limit=0.3, current_limit=4.0,
        **{name: np.array(value, dtype=float) for name, value in gains.items()},
    )  # fmt: skip
    inner = CurrentLoop(*MOTORS, CONSTANTS, STEP, voltage_limit=300.0)
    lead = (2, 33)
    speed = 50.0 * rng.normal(size=(*lead, 3))
    memory, integral = outer.reset(speed), inner.reset(speed)
    for _ in range(20):
        current = rng.normal(size=(*lead, 3, 2))
        given = (current, *(rng.normal(size=(*lead, 3)) + speed for _ in range(2)),
                 *rng.normal(size=(2, *lead, 3)))  # fmt: skip
        for array in (memory, integral, *given):
            array.flags.writeable = False
        after, asked = outer.step(memory, *given)
        summed, voltage = inner.step(integral, current, asked, given[1])
        for i in np.ndindex(*lead):
            lone = outer.step(memory[i], *(array[i] for array in given))
            below = inner.step(integral[i], current[i], lone[1], given[1][i])
            for one, many in zip((*lone, *below), (after, asked, summed, voltage), strict=True):
                assert one.tobytes() == many[i].tobytes()
        memory, integral = after, summed


def test_not_a_number_is_passed_on() -> None:
    loop = SpeedLoop(J, KM, STEP, 8.0, lead=1.0 / KEP, vibration_limit=0.4, **OBSERVER)
    speed = np.array([[np.nan], [1.0]])
    zero = np.zeros((2, 1))
    with np.errstate(invalid="ignore"):
        _, asked = loop.step(loop.reset(speed), np.zeros((2, 1, 2)), speed, zero + 1.0, zero, zero)
    assert np.isnan(asked).tolist() == [[True], [False]]


def test_the_bench_law_is_its_loops() -> None:
    """A second of the law, of three motors in a batch, against the loops by themselves."""
    law = SpeedBench(STEP)
    speed, angle, motor = np.array([0.0, 0.5, -0.5]), np.zeros(3), Drives.of([MOTOR])
    current = motor.reset((3,))
    hold = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))

    def seen() -> Measurement:
        attitude, rate = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), np.zeros((3, 3))
        return Measurement(
            attitude=attitude, rate=rate, wheel_speed=speed[:, None].copy(), current=current
        )

    state = law.reset(seen(), hold)
    for k in range(10000):
        state, command, signals = law.step(state, k * STEP, seen(), hold)
        current, torque, _ = motor.advance(current, command.voltage, speed[:, None], STEP)
        turn(angle, speed, torque[:, 0], STEP)
    alone = SpeedLoop(J, KM, STEP, 8.0, lead=1.0 / KEP, **OBSERVER)
    same = bench(alone, 1, 1, 1.0)
    assert signals.phi_hat.shape == (3, 1)
    assert same.phi_hat[-1, 0] == pytest.approx(state.speed_memory[0, 0, 6], rel=1e-3)  # 9 periods
    assert np.abs(signals.speed_error[:, 0]).max() < 1e-3  # without rejection 1.25e-2 rad/s
    with pytest.raises(ValueError, match=r"steps of RK4 at most 3\.1e-07 s"):
        SpeedBench(STEP, current_gain=9e6)


def test_at_a_constant_speed_a_clock_of_that_rate_is_the_rotor() -> None:
    speed = np.full(1, 30.0)
    by_angle, by_time = (
        SpeedLoop(J, KM, STEP, speed_gain=8.0, lead=1.0 / KEP, clock=clock, **OBSERVER)
        for clock in (0.0, 30.0)
    )
    memories = [by_angle.reset(speed)] * 2
    still = np.zeros(1)
    for k in range(200):
        current = np.full((1, 2), 0.1 * np.cos(6.0 * STEP * k))
        memories = [
            loop.step(memory, current, speed, speed + 0.1, still, still)[0]
            for loop, memory in zip((by_angle, by_time), memories, strict=True)
        ]
    np.testing.assert_array_equal(*memories)
    slower = by_time.step(memories[1], current, 0.5 * speed, speed, still, still)[0]
    assert np.any(
        slower != by_angle.step(memories[0], current, 0.5 * speed, speed, still, still)[0]
    )
