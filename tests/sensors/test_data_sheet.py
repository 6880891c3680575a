"""Errors as data sheets state them: each against its definition, known or drawn."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from mjspace.attitude import from_rotation_vector, to_matrix
from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement
from mjspace.scenario.plant import Rates
from mjspace.scenario.sensors import Sensors
from mjspace.sensors.base import Surroundings
from mjspace.sensors.noise import normals, stream_of
from mjspace.sensors.suite import SensorSuite

READ = TypeAdapter[Any](Sensors).validate_python
PLANT = [name for name in REPORTED_BY_PLANT if name != "wheel_speed"]
RATE = np.array([0.3, -0.2, 0.5])  # rad/s
FIVE_SIGMA = 5.0


def reports(table: dict[str, Any], count: int = 1, vehicles: int = 1, rate: Any = RATE) -> Array:
    """Return what gyros of 100 Hz report of a constant ``rate``, (count, vehicles, 3)."""
    rates = Rates(physics=1e-3, control=1e-2)
    gyros = SensorSuite(READ({"rate": table}), rates, 7, range(vehicles), Surroundings(wheels=3))
    truth = still(vehicles, rate)
    state, seen = gyros.reset(truth), []
    for step in range(0, 10 * count, 10):
        state, measured = gyros.sample(state, step, truth)
        seen.append(measured.rate.copy())
    return np.array(seen)


def still(vehicles: int, rate: Any = RATE) -> Measurement:
    return Measurement(
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (vehicles, 1)),
        rate=np.tile(rate, (vehicles, 1)),
        wheel_speed=np.zeros((vehicles, 3)),
        **dict.fromkeys(PLANT, np.zeros((vehicles, 0))),
    )


@pytest.mark.parametrize(
    ("key", "written", "si"),
    [
        ("noise_density", "0.1 deg/sqrt(h)", np.radians(0.1) / 60.0),
        ("noise_density", "6 deg/h/sqrt(Hz)", np.radians(6.0) / 3600.0),
        ("noise_density", "0.01 deg/s/sqrt(Hz)", np.radians(0.01)),
        ("bias_walk", "0.5 deg/h/sqrt(h)", np.radians(0.5) / 3600.0 / 60.0),
        ("bias_walk", "0.5 deg/h", np.radians(0.5) / 3600.0),
        ("bias", ["1 deg/h", 0.0, 2.0], [np.radians(1.0) / 3600.0, 0.0, 2.0]),
        ("scale_factor_std", "300 ppm", 3e-4),
        ("range", "400 deg/s", np.radians(400.0)),
        ("misalignment_std", "1 arcmin", np.radians(1.0 / 60.0)),
    ],
)
def test_units_of_data_sheets_are_converted(key: str, written: Any, si: Any) -> None:
    assert getattr(READ({"rate": {key: written}})["rate"], key) == pytest.approx(si, rel=1e-12)


def test_the_other_sensors_have_densities_in_units_of_their_own() -> None:
    tables = {
        "specific_force": {"noise_density": "60 ug/sqrt(Hz)"},
        "magnetic_field": {"noise_density": "5 nT/sqrt(Hz)", "bias_walk": "1 nT/sqrt(s)"},
        "attitude": {"noise_density": "3 arcsec/sqrt(Hz)", "bias": ["1 arcmin", 0.0, 0.0]},
        "wheel_speed": {"scale_factor": 0.01},
    }
    read = READ(tables)
    assert read["specific_force"].noise_density == pytest.approx(60e-6 * 9.80665)
    assert read["magnetic_field"].noise_density == pytest.approx(5e-9)
    assert read["magnetic_field"].bias_walk == pytest.approx(1e-9)
    assert read["attitude"].noise_density == pytest.approx(np.radians(3.0 / 3600.0))


def test_a_density_is_a_deviation_over_the_root_of_the_period() -> None:
    density = 1e-3
    seen = reports({"noise_density": density}, 2000, 4) - RATE
    expected = density / np.sqrt(1e-2)
    assert abs(seen.std() / expected - 1.0) < FIVE_SIGMA / np.sqrt(2.0 * seen.size)
    both = reports({"noise_density": density, "noise_std": 0.02}, 2000, 4) - RATE
    expected = np.hypot(density / np.sqrt(1e-2), 0.02)
    assert abs(both.std() / expected - 1.0) < FIVE_SIGMA / np.sqrt(2.0 * both.size)
    # and one of the same deviation is the same noise
    same = reports({"noise_std": density / np.sqrt(1e-2)}, 5) - reports(
        {"noise_density": density}, 5
    )
    assert np.abs(same).max() < 1e-17


def test_a_known_bias_is_added_to_the_drawn_one() -> None:
    drawn = reports({"bias_std": 0.01})
    both = reports({"bias_std": 0.01, "bias": [0.1, 0.0, -0.2]})
    np.testing.assert_allclose(both - drawn, [[[0.1, 0.0, -0.2]]], atol=1e-15)
    np.testing.assert_allclose(reports({"bias": 0.1}), [[RATE + 0.1]], atol=1e-15)


def test_a_gauss_markov_bias_is_that_process_sampled() -> None:
    std, time, period = 0.02, 0.5, 1e-2
    table = {"bias_instability": std, "correlation_time": time}
    seen = (reports(table, 400, 500) - RATE) / std
    # Stationary from the start: variance 1 of 1500 independent processes at any sample.
    for k in (0, 1, 399):
        assert abs(seen[k].var() - 1.0) < FIVE_SIGMA * np.sqrt(2.0 / seen[k].size)
    for lag in (1, 50, 200):
        pairs = seen[0] * seen[lag]
        expected = np.exp(-lag * period / time)
        # var of the product of two normals of correlation r: 1 + r^2
        spread = np.sqrt((1.0 + expected**2) / pairs.size)
        assert abs(pairs.mean() - expected) < FIVE_SIGMA * spread
    numbers = normals(7, range(1), (stream_of("rate"), 6), 3)
    kept = np.exp(-period / time)
    one = reports(table, 2) - RATE
    np.testing.assert_allclose(one[0], std * numbers(0), atol=1e-15)
    np.testing.assert_allclose(
        one[1], kept * std * numbers(0) + std * np.sqrt(1.0 - kept**2) * numbers(1), atol=1e-15
    )


def test_a_scale_factor_is_known_or_drawn() -> None:
    np.testing.assert_allclose(
        reports({"scale_factor": [0.1, 0.0, -0.1]})[0, 0] / RATE, [1.1, 1, 0.9]
    )
    factor = reports({"scale_factor_std": "1000 ppm"}, 1, 3000)[0] / RATE - 1.0
    assert abs(factor.std() / 1e-3 - 1.0) < FIVE_SIGMA / np.sqrt(2.0 * factor.size)
    assert abs(factor.mean()) < FIVE_SIGMA * 1e-3 / np.sqrt(factor.size)


def test_a_misaligned_instrument_sees_the_vector_in_its_own_axes() -> None:
    angle = np.array([0.0, 0.0, 0.1])
    # Axes turned by 0.1 rad about z: a vector along y has the component sin 0.1 along their x.
    seen = reports({"misalignment": angle.tolist()}, rate=[0.0, 1.0, 0.0])[0, 0]
    np.testing.assert_allclose(seen, [np.sin(0.1), np.cos(0.1), 0.0], atol=1e-15)
    turn = [0.02, -0.03, 0.05]
    expected = to_matrix(from_rotation_vector(np.array(turn))).T @ RATE
    np.testing.assert_allclose(reports({"misalignment": turn})[0, 0], expected, atol=1e-15)
    drawn = reports({"misalignment_std": "1 mrad"}, 1, 3000, [1.0, 0.0, 0.0])[0]
    for axis in (1, 2):  # to first order a component is the angle about the other axis
        ratio = drawn[:, axis].std() / 1e-3
        assert abs(ratio - 1.0) < FIVE_SIGMA / np.sqrt(2.0 * len(drawn))


def test_axes_that_are_not_orthogonal_see_a_part_of_the_others() -> None:
    table = {"non_orthogonality": [0.1, 0.02, -0.05]}
    columns = [reports(table, rate=axis)[0, 0] for axis in np.eye(3)]
    axes = np.array(columns).T  # rows: the sensitive axes in body axes
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(axes[0], [1.0, 0.0, 0.0], atol=1e-15)
    # y is 0.1 rad off towards x; z has sines of 0.02 and -0.05 of x and y
    np.testing.assert_allclose(axes[1], [np.sin(0.1), np.cos(0.1), 0.0], atol=1e-15)
    np.testing.assert_allclose(axes[2, :2], np.sin([0.02, -0.05]), atol=1e-15)
    assert np.abs(reports({"non_orthogonality_std": 1e-3}, 1, 50)[0] - RATE).max() > 1e-4


def test_it_saturates_at_its_range_before_it_rounds() -> None:
    seen = reports({"range": 0.4, "quantization": 0.25, "bias": [0.0, -0.3, 0.0]})
    assert seen[0, 0].tolist() == [0.25, -0.5, 0.5]
    assert reports({"range": 0.25})[0, 0].tolist() == [0.25, -0.2, 0.25]


DRAWN: dict[str, Any] = {
    "bias_instability": 0.1,
    "correlation_time": 3.0,
    "scale_factor_std": 0.1,
    "misalignment_std": 0.01,
    "non_orthogonality_std": 0.01,
}


def test_another_drawn_error_leaves_the_drawn_ones_alone() -> None:
    """A rate of zero has no scale factor and no misalignment: what is left is the same bits."""
    errors = {"noise_std": 0.01, "bias_std": 0.1, "bias_walk": 0.02}
    nothing = [0.0, 0.0, 0.0]
    less = reports(errors, 20, 3, nothing)
    axes = {
        name: DRAWN[name] for name in DRAWN if name not in ("bias_instability", "correlation_time")
    }
    more = reports(errors | axes, 20, 3, nothing)
    assert less.tobytes() == more.tobytes()
    every = reports(errors | DRAWN, 20, 3, nothing) - reports(
        {n: DRAWN[n] for n in ("bias_instability", "correlation_time")}, 20, 3, nothing
    )
    np.testing.assert_allclose(every, less, atol=1e-15)


def test_a_member_draws_the_same_alone_and_in_a_batch() -> None:
    together = reports(DRAWN | {"bias_std": 0.1}, 5, 7)
    rates = Rates(physics=1e-3, control=1e-2)
    gyros = SensorSuite(
        READ({"rate": DRAWN | {"bias_std": 0.1}}), rates, 7, [5], Surroundings(wheels=3)
    )
    _, alone = gyros.sample(gyros.reset(still(1)), 0, still(1))
    assert alone.rate.tobytes() == together[0, 5:6].tobytes()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"bias": [1.0, 2.0]}, r"sensors\.rate\.bias: 2 numbers for 3 axes"),
        ({"scale_factor": [1.0]}, r"sensors\.rate\.scale_factor: 1 numbers for 3 axes"),
        ({"bias": "1 deg"}, "'1 deg' has the unit 'deg', should be one of rad/s"),
        ({"noise_density": "1 deg/s"}, "should be one of rad/s/sqrt"),
        ({"correlation_time": 3.0}, "bias_instability and correlation_time: give both"),
        ({"range": 0.0}, "greater than 0"),
        ({"non_orthogonality": [0.3, 0.0, 0.0]}, "less than or equal to 0.2"),
        ({"scale_factor": "3 deg"}, "should be a plain number"),
    ],
)
def test_what_is_no_error_of_a_gyro_is_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        reports(table)


@pytest.mark.parametrize(
    ("period", "delay", "control", "inner"),
    [(4, 6, 1, False), (4, 7, 2, True), (10, 3, 10, False), (20, 13, 10, False), (3, 11, 1, True)],
)
def test_a_report_is_as_late_as_its_delay_in_integration_steps(
    period: int, delay: int, control: int, inner: bool
) -> None:
    """What is seen at each instant at which somebody looks; the truth is the number of its step."""
    rates = Rates(physics=1e-3, control=control * 1e-3)
    late = {"period": period * 1e-3, "delay": delay * 1e-3}
    gyros = SensorSuite(READ({"rate": late}), rates, 7, [0], Surroundings(wheels=3), inner=inner)
    state = gyros.reset(still(1, [0.0] * 3))
    for step in range(90):
        truth = still(1, [float(step)] * 3)
        if any(step % tick == 0 for tick in gyros.ticks):
            state, _ = gyros.sample(state, step, truth)
        if step % control and not inner:
            continue
        newest = max(0, (step - delay) // period * period)
        assert gyros.report(state, truth).rate[0, 0] == newest, step
