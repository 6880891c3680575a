"""Sensors: what their errors look like, when they report, and that all memory is in the state."""

import copy
from itertools import pairwise
from operator import itemgetter
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator, Philox, SeedSequence
from pydantic import TypeAdapter

from mjspace.attitude import conjugate, from_rotation_vector, multiply, to_rotation_vector
from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement
from mjspace.scenario.plant import Rates
from mjspace.scenario.sensors import ALWAYS, KINDS, Sensors
from mjspace.sensors.base import State, Surroundings
from mjspace.sensors.noise import normals, stream_of
from mjspace.sensors.suite import SensorSuite

EVERYTHING: dict[str, Any] = {
    "noise_std": 1e-2,
    "bias_std": 0.1,
    "bias_walk": 2e-2,
    "quantization": 1e-3,
}
READ = TypeAdapter[Any](Sensors).validate_python
PLANT = [name for name in REPORTED_BY_PLANT if name != "wheel_speed"]
OPTIONAL = (
    *("position", "velocity", "altitude", "ground_velocity", "specific_force", "magnetic_field"),
)
FIVE_SIGMA = 5.0  # an honest generator fails one such test in 1.7 million


def suite(
    members: Any = (0,), wheels: int = 3, seed: int = 7, rates: Rates | None = None, **sensors: Any
) -> SensorSuite:
    surroundings = Surroundings(wheels=wheels)
    return SensorSuite(READ(sensors), rates or Rates(), seed, members, surroundings)


def still(vehicles: int = 1, wheels: int = 3) -> Measurement:
    """Return the truth of vehicles at rest in the inertial axes."""
    return Measurement(
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (vehicles, 1)),
        rate=np.zeros((vehicles, 3)),
        wheel_speed=np.zeros((vehicles, wheels)),
        **dict.fromkeys(PLANT, np.zeros((vehicles, 0))),
    )


def moving(step: int, members: Any = (0,)) -> Measurement:
    """Return the truth of tumbling vehicles, each in its own way."""
    axis = np.array([[1.0, 0.3 * m, -0.2] for m in members])
    return Measurement(
        attitude=from_rotation_vector(0.01 * step * axis),
        rate=np.cos(0.1 * step) * axis,
        wheel_speed=3.0 * axis + step,
        **dict.fromkeys(PLANT, axis[:, :0]),
    )


def fly(
    sensors: SensorSuite, truth: Any, steps: range, state: State | None = None
) -> tuple[list[State], list[Measurement]]:
    """Return the state before and the measurement at each of ``steps``."""
    state = sensors.reset(truth(0)) if state is None else state
    states, seen = [], []
    for step in steps:
        states.append(state)
        state, measurement = sensors.sample(state, step, truth(step))
        seen.append(measurement._map(np.copy))
    return states, seen


def reports(sensors: SensorSuite, name: str, count: int, vehicles: int, wheels: int = 3) -> Array:
    """Return ``count`` reports of resting vehicles, shape (count, vehicles, width)."""
    truth = still(vehicles, wheels)
    return np.stack([getattr(m, name) for m in fly(sensors, lambda _: truth, range(count))[1]])


def turn_b(truth: Array, seen: Array) -> Array:
    return to_rotation_vector(multiply(conjugate(truth), seen))


def assert_same_bits(one: Any, other: Any) -> None:
    if isinstance(one, Measurement):
        assert one._fields == other._fields
        one, other = one._asdict().values(), other._asdict().values()
    for a, b in zip(one, other, strict=True):
        assert np.asarray(a).tobytes() == np.asarray(b).tobytes()


def test_ideal_sensors_report_the_truth_itself() -> None:
    sensors, truth = suite(), still()
    state = sensors.reset(truth)
    assert state == {}
    assert sensors.ticks == frozenset()
    assert sensors.sample(state, 0, truth)[1] is truth

    sensors = suite(rate={"noise_std": 1.0}, wheel_speed={"period": 1e-3})
    _, seen = sensors.sample(sensors.reset(truth), 0, truth)
    assert seen.attitude is truth.attitude
    assert seen.wheel_speed is truth.wheel_speed
    assert seen.rate is not truth.rate


@pytest.mark.parametrize("name", ["attitude", "rate", "wheel_speed"])
def test_noise_is_white_with_the_given_deviation(name: str) -> None:
    sigma, count, vehicles = 1e-3, 1500, 8
    seen = reports(suite(range(vehicles), **{name: {"noise_std": sigma}}), name, count, vehicles)
    error = (turn_b(still().attitude, seen) if name == "attitude" else seen) / sigma
    n = error.size
    assert abs(error.mean()) < FIVE_SIGMA / np.sqrt(n)
    assert abs(error.var() - 1.0) < FIVE_SIGMA * np.sqrt(2.0 / n)
    for lag in (1, 2, 7, 255, 256, 257):  # the last three: across the streams' blocks
        pairs = error[lag:] * error[:-lag]
        assert abs(pairs.mean()) < FIVE_SIGMA / np.sqrt(pairs.size)


@pytest.mark.parametrize("name", ["attitude", "rate", "wheel_speed"])
def test_bias_is_constant_and_drawn_for_each_vehicle_and_axis(name: str) -> None:
    sigma, vehicles = 1e-3, 3000
    seen = reports(suite(range(vehicles), **{name: {"bias_std": sigma}}), name, 3, vehicles)
    error = (turn_b(still().attitude, seen) if name == "attitude" else seen) / sigma
    assert np.array_equal(error[0], error[2])
    assert abs(error[0].mean()) < FIVE_SIGMA / np.sqrt(error[0].size)
    assert abs(error[0].var() - 1.0) < FIVE_SIGMA * np.sqrt(2.0 / error[0].size)


def test_star_tracker_errs_about_body_axes() -> None:
    sensors = suite(attitude={"bias_std": 1e-2})
    _, seen = fly(sensors, moving, range(200))
    errors = np.stack(
        [turn_b(moving(k).attitude, measurement.attitude) for k, measurement in enumerate(seen)]
    )
    # rounding of two products of unit quaternions
    assert np.abs(errors - errors[0]).max() < 1e-14


@pytest.mark.parametrize(("noise", "walk"), [(1e-3, 0.0), (0.0, 1e-3)])
def test_allan_variance_of_noise_and_of_walk(noise: float, walk: float) -> None:
    period, count, vehicles = 4e-3, 1024, 64
    sensors = suite(
        range(vehicles),
        rates=Rates(control=period),
        rate={"noise_std": noise, "bias_walk": walk},
    )
    truth = still(vehicles)
    seen = [m.rate for m in fly(sensors, lambda _: truth, range(0, 4 * count, 4))[1]]
    for m in (1, 4, 16, 64):
        means = np.stack(seen).reshape(count // m, m, -1).mean(axis=1)
        allan = 0.5 * np.mean(np.diff(means, axis=0) ** 2)
        # Clusters of m samples. White noise falls as 1/m; a walk, a sum of steps with variance
        # walk^2 period, grows as m/3 (m large), here exactly.
        expected = noise**2 / m + walk**2 * period * (2 * m**2 + 1) / (6 * m)
        # The mean of n squared differences varies by (2/n)(1 + 2 r^2), where r is the correlation
        # of neighbours: -1/2 for noise, at most 1/4 for a walk.
        spread = np.sqrt(3.0 / (means.size - means.shape[1]))
        assert abs(allan / expected - 1.0) < FIVE_SIGMA * spread


def test_an_error_is_made_of_its_own_numbers() -> None:
    """A logged flight is replayed only as long as sample k adds up the same numbers."""
    members, period = (4, 9), 2e-3
    tables = {"noise_std": 1e-2, "bias_std": 0.5, "bias_walk": 0.3}
    sensors = suite(members, rates=Rates(control=period), attitude=tables, rate=tables)
    truth = [moving(step, members) for step in range(0, 12, 2)]
    _, seen = fly(sensors, lambda step: truth[step // 2], range(0, 12, 2))
    # A sensor's stream is keyed by its name; then 0: bias, 1: noise, 2: walk.
    for name in ("attitude", "rate"):
        stream = stream_of(name)
        bias, noise, walk = (normals(7, members, (stream, part), 3) for part in range(3))
        drifted = np.zeros((2, 3))
        for k, measurement in enumerate(seen):
            error = 0.5 * bias(0) + 1e-2 * noise(k) + drifted
            drifted += 0.3 * np.sqrt(period) * walk(k)
            true = getattr(truth[k], name)
            turned = name == "attitude"
            expected = multiply(true, from_rotation_vector(error)) if turned else true + error
            np.testing.assert_allclose(getattr(measurement, name), expected, rtol=0.0, atol=1e-15)


def test_walk_has_its_deviation_after_one_second_at_any_period() -> None:
    vehicles, walk = 2000, 0.3
    for period, steps in ((0.1, 100), (0.25, 250)):
        sensors = suite(range(vehicles), rate={"bias_walk": walk, "period": period})
        truth = still(vehicles)
        _, seen = fly(sensors, lambda _, truth=truth: truth, range(0, 1001, steps))
        assert not seen[0].rate.any()
        final = seen[-1].rate / walk
        assert abs(final.var() - 1.0) < FIVE_SIGMA * np.sqrt(2.0 / final.size)


def test_streams_are_independent_of_each_other() -> None:
    count, noisy = 4000, {"noise_std": 1.0}
    quiet = {"noise_std": 1e-3}
    sensors = suite((0, 1), attitude=quiet, rate=noisy, wheel_speed=noisy)
    truth = still(2)
    _, seen = fly(sensors, lambda _: truth, range(count))
    columns = np.concatenate(
        [
            np.stack([turn_b(truth.attitude, m.attitude) / 1e-3 for m in seen]).reshape(count, -1),
            np.stack([m.rate for m in seen]).reshape(count, -1),
            np.stack([m.wheel_speed for m in seen]).reshape(count, -1),
        ],
        axis=1,
    )
    mixed = columns.T @ columns / count - np.diag(np.mean(columns**2, axis=0))
    assert np.abs(mixed).max() < FIVE_SIGMA / np.sqrt(count)


def test_noise_bias_and_walk_of_a_sensor_are_independent() -> None:
    vehicles, period = 2000, 1e-3
    alike = {"noise_std": 1.0, "bias_std": 1.0, "bias_walk": 1.0 / np.sqrt(period)}
    first, second = reports(suite(range(vehicles), rate=alike), "rate", 2, vehicles)
    spread = FIVE_SIGMA * np.sqrt(2.0 / first.size)
    # b + n_0, then b + n_1 + w_1, where each has variance 1
    assert abs(first.var() / 2.0 - 1.0) < spread
    assert abs((second - first).var() / 3.0 - 1.0) < spread


def test_the_errors_of_a_sample_depend_on_its_number_only() -> None:
    fast, slow = suite(rate={"noise_std": 1.0}), suite(rate={"noise_std": 1.0, "period": 3e-3})
    truth = still()
    _, often = fly(fast, lambda _: truth, range(10))
    _, seldom = fly(slow, lambda _: truth, range(0, 30, 3))
    assert_same_bits([m.rate for m in often], [m.rate for m in seldom])


def test_normals_do_not_depend_on_what_was_asked_before() -> None:
    forth, back = normals(3, [4], (0, 1), 2), normals(3, [4], (0, 1), 2)
    indices = [0, 1, 255, 256, 1000, 10**9]
    assert_same_bits([forth(j) for j in indices], [back(j) for j in indices[::-1]][::-1])
    drawn = np.stack([forth(j) for j in range(600)])
    assert np.unique(drawn).size == drawn.size
    with pytest.raises(ValueError, match="read-only"):
        forth(0)[:] = 0.0


def test_each_block_of_normals_has_a_key_of_its_own() -> None:
    """That of (seed, member, stream, block), 256 samples in each: logged flights were drawn so."""
    sample = normals(3, [4], (0, 1), 2)
    for block, index, row in ((0, 0, 0), (0, 255, 255), (1, 256, 0), (3, 1000, 232)):
        key = SeedSequence(3, spawn_key=(4, 0, 1, block))
        drawn = Generator(Philox(key)).standard_normal((256, 2))
        assert sample(index).tolist() == [drawn[row].tolist()]


def test_same_seed_same_bits_and_another_seed_others() -> None:
    tables = {"attitude": EVERYTHING, "rate": EVERYTHING, "wheel_speed": EVERYTHING}
    one, same, other = (fly(suite(seed=s, **tables), moving, range(5))[1] for s in (1, 1, 2))
    for a, b, c in zip(one, same, other, strict=True):
        assert_same_bits(a, b)
        assert all((getattr(a, name) != getattr(c, name)).any() for name in ALWAYS)


def test_a_member_measures_the_same_alone_and_in_a_batch() -> None:
    late = EVERYTHING | {"delay": 4e-3, "period": 2e-3}
    tables = {"attitude": late, "rate": EVERYTHING, "wheel_speed": late}
    batch = [11, 5, 9, 3, 21]
    steps = range(600)  # crosses a block of the streams
    _, together = fly(suite(batch, **tables), lambda k: moving(k, batch), steps)
    for row, member in enumerate(batch):
        _, alone = fly(suite([member], **tables), lambda k, m=member: moving(k, [m]), steps)
        for one, all_of_them in zip(alone, together, strict=True):
            assert_same_bits(one._map(itemgetter(0)), all_of_them._map(itemgetter(row)))


@pytest.mark.parametrize("start", [1, 299, 511, 512])
def test_a_flight_goes_on_from_any_logged_state(start: int) -> None:
    late = EVERYTHING | {"delay": 6e-3, "period": 2e-3}
    tables = {"attitude": late, "rate": late, "wheel_speed": EVERYTHING}
    states, seen = fly(suite(**tables), moving, range(600))
    logged = {
        name: np.frombuffer(part.tobytes()).reshape(part.shape)
        for name, part in states[start].items()
    }
    again, seen_again = fly(suite(**tables), moving, range(start, 600), logged)
    for one, other in zip(seen[start:], seen_again, strict=True):
        assert_same_bits(one, other)
    for before, after in zip(states[start:], again, strict=True):
        assert before.keys() == after.keys()
        assert_same_bits(before.values(), after.values())


def test_state_is_float64_of_constant_shape_and_never_changed() -> None:
    late = EVERYTHING | {"delay": 2e-3}
    sensors = suite((0, 1), attitude=late, rate={"noise_std": 1.0}, wheel_speed=EVERYTHING)
    states, _ = fly(sensors, lambda k: moving(k, (0, 1)), range(3))
    shapes = {name: part.shape for name, part in states[0].items()}
    assert shapes == {
        "attitude_samples": (2, 3, 4),
        "attitude_walk": (2, 3),
        "rate_samples": (2, 1, 3),
        "wheel_speed_samples": (2, 1, 3),
        "wheel_speed_walk": (2, 3),
    }
    for state in states:
        assert {name: part.shape for name, part in state.items()} == shapes
        assert {part.dtype for part in state.values()} == {np.dtype(np.float64)}
        before = {name: part.copy() for name, part in state.items()}
        sensors.sample(state, 0, moving(5, (0, 1)))
        assert_same_bits(state.values(), before.values())


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 7), st.integers(0, 5), st.integers(1, 7))
def test_a_report_is_the_newest_sample_that_is_old_enough(
    period: int, delay: int, control: int
) -> None:
    rates = Rates(physics=1e-3, control=control * 1e-3)
    late = {"period": period * 1e-3, "delay": delay * period * 1e-3}
    sensors = suite(rates=rates, attitude=late, rate=late, wheel_speed=late)
    # a sample at every control instant is the truth there, and needs no sensor
    held = delay > 0 or control % period > 0
    assert sensors.ticks == ({period} if held else set())
    if not held:
        return
    _, seen = fly(sensors, moving, range(60))
    for step, measurement in enumerate(seen):
        # Truth is a function of the step, so a report tells which step it shows.
        shown = max(step // period - delay, 0) * period
        expected = moving(shown)
        assert_same_bits(
            [measurement.rate, measurement.wheel_speed], [expected.rate, expected.wheel_speed]
        )
        assert np.allclose(measurement.attitude, expected.attitude, rtol=0.0, atol=1e-15)


def test_a_late_report_is_that_of_a_prompt_sensor_before_and_the_first_until_then() -> None:
    tables = dict.fromkeys(("attitude", "rate", "wheel_speed"), EVERYTHING)
    late = {name: table | {"delay": 3e-3} for name, table in tables.items()}
    prompt, delayed = (fly(suite(**each), moving, range(10))[1] for each in (tables, late))
    for step, measurement in enumerate(delayed):
        assert_same_bits(measurement, prompt[max(step - 3, 0)])


def surroundings(step: int) -> Measurement:
    """Return the truth of two vehicles that fall without turning, with every optional field.

    There is no specific force: what accelerometers report is the mean over their period.
    """
    time = 1e-3 * step
    up = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])
    return still(2)._replace(
        position=(50.0 - 20.0 * time**3) * up,
        velocity=-60.0 * time**2 * up,
        altitude=(50.0 - 20.0 * time**3) * up[:, 2:],
        ground_velocity=-60.0 * time**2 * up,
        magnetic_field=3e-5 * up,
    )


@pytest.mark.parametrize("name", OPTIONAL)
def test_what_no_sensor_measures_is_not_in_the_measurement(name: str) -> None:
    truth = surroundings(0)
    sensors = suite((0, 1), **{name: {}})
    _, seen = sensors.sample(sensors.reset(truth), 0, truth)
    assert set(seen._fields) == {*ALWAYS, *PLANT, name}
    assert getattr(seen, name).shape == (2, 1 if name == "altitude" else 3)
    if name != "specific_force":
        assert getattr(seen, name) is getattr(truth, name)
    for other in set(OPTIONAL) - {name}:
        with pytest.raises(AttributeError, match=rf"measures {other}: add \[sensors\.{other}\]"):
            getattr(seen, other)


def test_an_altimeter_errs_along_its_one_axis() -> None:
    truth = surroundings(0)
    sensors = suite((0, 1), altitude=EVERYTHING)
    state = sensors.reset(truth)
    assert state["altitude_walk"].shape == (2, 1)
    assert sensors.sample(state, 0, truth)[1].altitude.shape == (2, 1)


def test_accelerometers_show_the_mean_of_their_own_period() -> None:
    tables: Any = {
        "rate": {"noise_std": 1e-3, "period": 2e-3},
        "specific_force": {"period": 5e-3},
        "position": {"delay": 1e-3},
    }
    down = np.array([0.0, 0.0, -1.6])
    moon = Surroundings(wheels=3, gravity=lambda place: np.broadcast_to(down, place.shape))
    sensors = SensorSuite(READ(tables), Rates(), 7, (0, 1), moon)
    assert sensors.ticks == {1, 2, 5}
    _, seen = fly(sensors, surroundings, range(20))
    for step, measurement in enumerate(seen):
        newest = surroundings(step // 5 * 5)
        gained = newest.velocity - surroundings(step // 5 * 5 - 5).velocity
        expected = gained / 5e-3 - down if step >= 5 else np.zeros((2, 3))
        np.testing.assert_allclose(measurement.specific_force, expected, rtol=0.0, atol=1e-12)


def test_without_a_period_a_sensor_samples_at_the_control_rate() -> None:
    sensors = suite(rates=Rates(control=5e-3), rate={"noise_std": 1.0}, attitude={"delay": 0.01})
    assert sensors.ticks == {5}
    _, seen = fly(sensors, moving, range(20))
    changes = [k + 1 for k, (a, b) in enumerate(pairwise(seen)) if (a.rate != b.rate).any()]
    assert changes == [5, 10, 15]
    assert sensors.reset(still())["attitude_samples"].shape == (1, 3, 4)


def test_rate_is_rounded_to_whole_digits_after_its_noise() -> None:
    digit = 0.25
    sensors = suite(rate={"quantization": digit, "noise_std": 1e-3})
    truth = still()._replace(rate=np.array([[0.1, 0.13, -7.7]]))
    _, seen = sensors.sample(sensors.reset(truth), 0, truth)
    assert seen.rate.tolist() == [[0.0, 0.25, -7.75]]


def test_rounding_an_attitude_errs_alike_about_every_axis_in_every_attitude() -> None:
    digit, vehicles = 1e-3, 5000
    attitude = np.random.default_rng(1).normal(size=(vehicles, 4))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    truth = still(vehicles)._replace(attitude=attitude)
    sensors = suite(range(vehicles), attitude={"quantization": digit})
    seen = sensors.sample(sensors.reset(truth), 0, truth)[1].attitude
    error = turn_b(attitude, seen) / digit
    # Each component of the quaternion errs uniformly within half of its digit: variance 1/12, and
    # no more than the norm of four halves, 1, about any axis.
    assert np.all(np.abs(error) < 1.0)
    assert np.abs(error.var(axis=0) * 12.0 - 1.0).max() < FIVE_SIGMA * np.sqrt(2.0 / vehicles)
    exact = 0.5 * digit * np.rint(2.0 * attitude / digit)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert np.abs(seen - exact).max() < 1e-15  # one rounding of numbers below 1


def test_a_measured_quaternion_is_of_unit_length_and_of_the_true_sign() -> None:
    members = range(50)
    sensors = suite(members, attitude=EVERYTHING)
    for step in (0, 1, 400, 700):  # past a whole turn, where the true quaternion changes sign
        truth = moving(step, members)
        for sign in (1.0, -1.0):
            signed = truth._replace(attitude=sign * truth.attitude)
            seen = sensors.sample(sensors.reset(truth), step, signed)[1].attitude
            assert np.abs(np.linalg.norm(seen, axis=1) - 1.0).max() < 1e-15  # a few roundings
            assert np.all(np.sum(seen * signed.attitude, axis=1) > 0.9)


def test_the_coarsest_digit_of_an_attitude_still_shows_one() -> None:
    attitude = np.array([[0.5, -0.5, 0.5, 0.5]])  # of which no component is large
    sensors, truth = suite(attitude={"quantization": 0.999}), still()._replace(attitude=attitude)
    _, seen = sensors.sample(sensors.reset(truth), 0, truth)
    np.testing.assert_allclose(seen.attitude, attitude, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("wheels", [0, 4])
def test_any_number_of_wheels_is_read(wheels: int) -> None:
    sensors = suite((0, 1), wheels=wheels, wheel_speed=EVERYTHING)
    truth = still(2, wheels)
    assert sensors.sample(sensors.reset(truth), 0, truth)[1].wheel_speed.shape == (2, wheels)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        (
            {"rate": {"period": 2.5e-3}},
            r"sensors\.rate\.period: 0\.0025 s .* 0\.002 s and 0\.003 s",
        ),
        (
            {"rate": {"period": 2e-3, "delay": 5.5e-3}},
            r"sensors\.rate\.delay: 0\.0055 s .* rates\.physics, 0\.001 s: .* 0\.005 s and",
        ),
        (
            {"attitude": {"delay": 4e-4}},
            r"sensors\.attitude\.delay: .* rates\.physics, 0\.001 s: .* 0\.001 s",
        ),
        ({"attitude": {"quantization": 1.0}}, r"attitude\.quantization\s.* less than 1"),
    ],
)
def test_what_cannot_be_sampled_is_refused(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        suite(**tables)


NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,7}", fullmatch=True).filter(
    lambda name: name not in KINDS and name not in REPORTED_BY_PLANT
)


@settings(max_examples=40, deadline=None)
@given(st.lists(NAMES, min_size=1, max_size=3, unique=True), st.integers(0, 3))
def test_another_sensor_leaves_the_noise_of_the_others_alone(names: list[str], place: int) -> None:
    errs: Any = {"noise_std": 1e-2, "bias_std": 0.1, "bias_walk": 2e-2}
    tables = {"attitude": errs, "rate": errs, **{n: errs | {"measures": "rate"} for n in names}}
    rows = list(tables.items())
    more = dict([*rows[:place], ("another_one", errs | {"measures": "attitude"}), *rows[place:]])
    (states, without), (_, with_it) = (fly(suite(**t), moving, range(3)) for t in (tables, more))
    for before, after in zip(without, with_it, strict=True):
        assert_same_bits([getattr(before, n) for n in tables], [getattr(after, n) for n in tables])
    # and no two sensors of one quantity have the same errors
    gyros = np.concatenate([without[-1].rate, *[getattr(without[-1], n) for n in names]])
    assert len(np.unique(gyros, axis=0)) == len(gyros)
    assert {f"{n}_samples" for n in tables} <= states[0].keys()


def test_a_stream_is_the_hash_of_the_name_alone() -> None:
    """Logged flights were drawn so. These are pinned: BLAKE2b of the name, 8 bytes."""
    assert stream_of("rate") == 0xDA26CF16CDAEF8B3
    assert stream_of("st_1") != stream_of("st_2")


def test_of_several_sensors_of_a_quantity_the_first_is_meant() -> None:
    tables: Any = {
        "st_2": {"measures": "attitude", "bias_std": 0.1},
        "st_1": {"measures": "attitude"},
        "tacho": {"measures": "wheel_speed", "quantization": 100.0},
    }
    sensors, truth = suite(**tables), moving(5)
    _, measured = sensors.sample(sensors.reset(truth), 5, truth)
    assert set(measured._fields) == {"rate", "st_1", "st_2", "tacho", *PLANT}
    assert measured.attitude is measured.st_2
    assert (measured.st_2 != truth.attitude).any()
    assert measured.st_1 is truth.attitude
    assert measured.wheel_speed is measured.tacho
    believed = measured._replace(attitude=truth.attitude)
    assert believed.attitude is truth.attitude
    assert believed.st_2 is measured.st_2


def test_a_sensor_of_the_quantity_s_own_name_is_meant_wherever_it_stands() -> None:
    sensors = suite(st_1={"measures": "attitude", "bias_std": 0.1}, attitude={})
    truth = moving(5)
    _, measured = sensors.sample(sensors.reset(truth), 5, truth)
    assert measured.attitude is truth.attitude
    assert (measured.st_1 != truth.attitude).any()


def test_a_measurement_is_what_it_was_made_of() -> None:
    measured = still()
    assert measured._replace(rate=np.ones((1, 3))).rate.tolist() == [[1.0, 1.0, 1.0]]
    assert measured.rate.tolist() == [[0.0, 0.0, 0.0]]
    assert measured._map(itemgetter(0)).attitude.shape == (4,)
    for change in (lambda: setattr(measured, "rate", 1.0), lambda: delattr(measured, "rate")):
        with pytest.raises(AttributeError, match="a measurement is read-only"):
            change()
    with pytest.raises(TypeError):
        _, _ = measured  # type: ignore[misc]
    assert not hasattr(measured, "position")
    assert not hasattr(measured, "_position")
    assert "rate=array([[0., 0., 0.]])" in repr(measured)
    assert Measurement(rate=measured.rate).thrust.shape == (0,)
    copied = copy.deepcopy(measured)
    assert_same_bits(copied, measured)
    assert copied.rate is not measured.rate


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"st": {}}, "no sensor measures 'st'"),
        ({"st": {"measures": "attitud"}}, "no sensor measures 'attitud': did you mean 'attitude'"),
        ({"st": 3}, "got 3, should be a table"),
        ({"s t": {"measures": "rate"}}, "String should match pattern"),
        ({"rate": {"noise": 1.0}}, "noise is now noise_std: the standard deviation"),
        ({"rate": {"bias_instability": 1.0}}, "bias_instability and correlation_time: give both"),
    ],
)
def test_what_is_no_sensor_is_refused(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        READ(tables)


def test_a_log_s_own_scenario_may_have_the_old_names() -> None:
    old = {"rate": {"noise": 0.5, "bias": 0.25, "delay": 0.1}}
    read = TypeAdapter[Any](Sensors).validate_python(old, context={"flown": True})
    assert (read["rate"].noise_std, read["rate"].bias_std, read["rate"].delay) == (0.5, 0.25, 0.1)
