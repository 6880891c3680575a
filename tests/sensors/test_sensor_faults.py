"""Faults of sensors and their links: each kind against its definition, in flight, compiled."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, assembly, assert_same, flown
from pydantic import TypeAdapter

from mjspace.actuators.faults import Fault, FaultSet
from mjspace.attitude import conjugate, multiply, to_rotation_vector
from mjspace.campaign.members import Campaign, population
from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.scenario.plant import Rates
from mjspace.scenario.sensors import Sensors
from mjspace.sensors.base import Surroundings
from mjspace.sensors.suite import SensorSuite
from mjspace.simulation.assembly import assemble

pytestmark = SHORT_BLOCKS

READ = TypeAdapter[Any](Sensors).validate_python
PLANT = [name for name in REPORTED_BY_PLANT if name != "wheel_speed"]
PERIOD = 0.1  # s
RATES = Rates(physics=0.05, control=PERIOD)
COUNT = 12


def true_rate(k: int) -> Array:
    return np.array([0.1 * k, -0.2 * k, 1.0])  # rad/s


def truth(k: int, vehicles: int) -> Measurement:
    return Measurement(
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (vehicles, 1)),
        rate=np.tile(true_rate(k), (vehicles, 1)),
        wheel_speed=np.zeros((vehicles, 3)),
        **dict.fromkeys(PLANT, np.zeros((vehicles, 0))),
    )


def reports(
    *faults: dict[str, Any], sensor: str = "rate", vehicles: int = 1, **table: Any
) -> tuple[Array, Array]:
    """Return what the sensor reports in ``COUNT`` periods, (COUNT, N, w), and its validity."""
    tables = [Fault.model_validate({"sensor": sensor, **fault}) for fault in faults]
    decided = FaultSet(tables, [], PERIOD, 3, range(vehicles), PERIOD, [sensor])
    sensors = SensorSuite(
        READ({sensor: table}), RATES, 3, range(vehicles), Surroundings(wheels=3), tables
    )
    phase, state, seen, valid = decided.reset(), sensors.reset(truth(0, vehicles)), [], []
    for k in range(COUNT):
        phase, _ = decided.decide_for_sensors(phase, k * PERIOD)
        state, measured = sensors.sample(state, 2 * k, truth(k, vehicles), phase["fault_phase"])
        seen.append(getattr(measured, sensor).copy())
        valid.append(getattr(measured, f"{sensor}_valid")[..., 0].copy())
    return np.array(seen), np.array(valid)


RIGHT = np.array([true_rate(k) for k in range(COUNT)])
WHILE = slice(4, 8)  # of a fault from 0.35 s to 0.8 s


@pytest.mark.parametrize(
    ("fault", "wanted", "valid"),
    [
        ({"kind": "dead"}, np.zeros((4, 3)), 0.0),
        ({"kind": "stuck"}, np.tile(RIGHT[3], (4, 1)), 1.0),
        ({"kind": "biased", "value": "1 deg/s"}, RIGHT[WHILE] + np.radians(1.0), 1.0),
        ({"kind": "biased", "value": [0.1, 0.0, -0.2]}, RIGHT[WHILE] + [0.1, 0.0, -0.2], 1.0),
        (
            {"kind": "drifting", "value": ["1 rad/s^2", 0.0, -2.0]},
            RIGHT[WHILE] + PERIOD * np.arange(4)[:, None] * [1.0, 0.0, -2.0],
            1.0,
        ),
        ({"kind": "dropping", "value": 1.0}, np.tile(RIGHT[3], (4, 1)), 0.0),
        ({"kind": "delayed", "value": "200 ms"}, RIGHT[2:6], 1.0),
    ],
)
def test_a_sensor_reports_what_its_fault_says(fault: Any, wanted: Array, valid: float) -> None:
    seen, ok = reports(fault | {"at": "350 ms", "until": "800 ms"})
    expected, flags = RIGHT.copy(), np.ones(COUNT)
    expected[WHILE], flags[WHILE] = wanted, valid
    np.testing.assert_allclose(seen[:, 0], expected, rtol=0.0, atol=1e-15)
    assert ok[:, 0].tolist() == flags.tolist()


def test_the_white_noise_of_a_noisy_sensor_is_a_multiple_of_its_own() -> None:
    faulty, _ = reports({"kind": "noisy", "value": 5.0, "at": 0.35, "until": 0.8}, noise_std=0.01)
    own, _ = reports({"kind": "stuck", "at": 1e3}, noise_std=0.01)
    noise = own - RIGHT[:, None]
    noise[WHILE] *= 5.0
    np.testing.assert_allclose(faulty - RIGHT[:, None], noise, atol=1e-15)


def test_samples_are_lost_with_the_probability_and_each_vehicle_s_by_itself() -> None:
    seen, valid = reports({"kind": "dropping", "value": 0.3, "at": 0.0}, vehicles=2000)
    lost = valid[1:] == 0.0  # sample 0 has none before it to be held
    assert abs(lost.mean() - 0.3) < 5.0 * np.sqrt(0.21 / lost.size)
    held = np.all(seen[1:] == seen[:-1], axis=-1)
    assert np.array_equal(held, lost)
    alone, _ = reports({"kind": "dropping", "value": 0.3, "at": 0.0})
    assert np.array_equal(alone[:, 0], seen[:, 0])


def test_a_tracker_s_bias_is_a_rotation_and_a_dead_one_has_none() -> None:
    tilted = {"kind": "biased", "value": ["1 deg", 0.0, 0.0], "at": 0.3}
    turned, _ = reports(tilted, sensor="attitude")
    angle = to_rotation_vector(multiply(conjugate(turned[0]), turned[5]))
    np.testing.assert_allclose(angle, [[np.radians(1.0), 0.0, 0.0]], atol=1e-15)
    dead, valid = reports({"kind": "dead", "at": 0.3}, sensor="attitude")
    assert dead[5].tolist() == [[1.0, 0.0, 0.0, 0.0]]
    assert valid[:, 0].tolist() == [1.0] * 3 + [0.0] * 9


def test_of_several_faults_each_changes_what_those_before_it_left() -> None:
    seen, valid = reports(
        {"kind": "biased", "value": 0.5, "at": 0.2},
        {"kind": "stuck", "at": 0.4},
        {"kind": "dead", "at": 0.6, "until": 0.8},
    )
    biased = RIGHT + 0.5 * (np.arange(COUNT) >= 2)[:, None]
    expected = np.concatenate([biased[:4], np.tile(biased[3], (2, 1)), np.zeros((6, 3))])
    # Stuck at what was reported last, which were the dead one's zeros.
    np.testing.assert_allclose(seen[:, 0], expected, atol=1e-15)
    assert valid[:, 0].tolist() == [1.0] * 6 + [0.0] * 2 + [1.0] * 4


def test_a_delay_keeps_what_a_late_sensor_would_have_reported() -> None:
    late = {"delay": 0.1, "noise_std": 0.01}
    faulty, _ = reports({"kind": "delayed", "value": 0.3, "at": 0.5}, **late)
    prompt, _ = reports({"kind": "stuck", "at": 1e3}, **late)
    np.testing.assert_array_equal(faulty[:5], prompt[:5])
    np.testing.assert_array_equal(faulty[5:], prompt[2:-3])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("{kind='dead',at=0}", "motor and sensor: give one of them"),
        ("{sensor='gyro',kind='dead',at=0}", r"faults\.0\.sensor: none is called 'gyro'"),
        ("{sensor='rat',kind='dead',at=0}", "'rat': did you mean 'rate'"),
        ("{sensor='rate',kind='scaled',value=2,at=0}", "a sensor is dead, stuck, .* not scaled"),
        ("{motor='wheel_0',kind='dropping',value=0.5,at=0}", "a motor is dead, .* not dropping"),
        ("{sensor='rate',kind='dropping',value=1.5,at=0}", "from 0 to 1"),
        ("{sensor='rate',kind='noisy',value=2,at=0}", "the sensor has no white noise"),
        ("{sensor='rate',kind='biased',value=[1,2],at=0}", "2 numbers for 3 axes"),
        ("{sensor='rate',kind='biased',value='1 deg',at=0}", "got 0.0174533 rad, should be in"),
        ("{sensor='rate',kind='drifting',value='1 deg/s',at=0}", "should be in rad/s\\^2"),
        ("{sensor='rate',kind='delayed',value='3 ms',at=0}", r"faults\.0\.value: 0\.003 s is not"),
        ("{sensor='rate',kind='delayed',value=[1.0],at=0}", "got a list, should be a number"),
        ("{motor='wheel_0',kind='biased',value=[1.0],at=0}", "got a list, should be a number"),
    ],
)
def test_a_fault_that_cannot_be_is_refused_in_one_line(table: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as refused:
        assemble(*load("detumble-wheels", [f"faults=[{table}]"]))
    assert "\n" not in str(refused.value)


NOISY = (
    "sensors.rate={noise_density='0.1 deg/sqrt(h)',bias=[0.1,0,0],bias_instability=0.01,"
    "correlation_time=5,scale_factor_std='500 ppm',misalignment_std='1 deg',"
    "non_orthogonality_std='1 deg',range=0.3,delay='10 ms',quantization=1e-3}",
    "sensors.attitude={noise_std=0.01,period='4 ms',delay='5 ms'}",
    "sensors.wheel_speed={noise_std=0.5,scale_factor=0.01,delay='5 ms'}",
    "faults=[{sensor='rate',kind='stuck',at=0.0205,until=0.06},"
    "{sensor='rate',kind='noisy',value=3,at=0.05},"
    "{sensor='attitude',kind='dropping',value=0.5,at=0.03},"
    "{sensor='wheel_speed',kind='delayed',value=0.01,at=0.04,until=0.1},"
    "{sensor='rate',kind='drifting',value=[1,0,0],at=0.1},"
    "{sensor='attitude',kind='biased',value='1 deg',when={signal='measurement.rate',above=0.1}},"
    "{motor='wheel_0',kind='dead',at=0.1},{sensor='wheel_speed',kind='dead',at=0.15}]",
    "duration=0.2",
    "rates.physics='0.5 ms'",
)


def test_faulty_sensors_are_compiled_and_fly_as_in_python_alone_and_together() -> None:
    built, members = assembly("contraction-ideal", *NOISY), (0, 1, 2)
    python = flown(built, members, compiled=False)
    together = flown(built, members, threads=2)
    assert together.compiled == "compiled: sensors, law, actuators and step effects (the faults)"
    assert_same(together, python)
    assert flown(built, [1]).bits(0) == python.bits(1)
    assert python.bits(0) != python.bits(1)
    told = [(event.time, event.message) for event in python.events if event.vehicle == 0]
    # Of the sensor between two control instants, from the second of them on.
    assert (0.021, "fault: sensor rate is stuck") in told
    assert (0.06, "fault: sensor rate is stuck no more") in told
    assert (0.1, "fault: wheel_0 is dead") in told
    rate = together.rows["/measurement.rate"][:, 0]  # 10 periods late
    assert np.all(rate[31:70] == rate[30])
    assert np.any(rate[70] != rate[69])
    dropped = together.rows["/measurement.attitude_valid"][:, 0, 0]
    assert dropped[:30].all()
    assert 0.2 < dropped[40:].mean() < 0.8


def test_a_faulty_flight_is_replayed_bit_for_bit_from_anywhere(tmp_path: Path) -> None:
    flight = run("contraction-ideal", overrides=[*NOISY, "checks=[]"], out=tmp_path)
    for start in (0.0, 0.021, 0.0475, 0.1, 0.163):
        assert verify(flight.path, start=start) is None
    measured = flight.log.read("/measurement")
    assert set(measured["wheel_speed_valid"][155:, 0]) == {0.0}


def test_what_a_sensor_s_fault_says_may_be_dispersed() -> None:
    spread = (
        "sensors.rate={noise_std=0.01}",
        "faults=[{sensor='rate',kind='biased',value=0.1,at=0.05}]",
        "dispersions=[{key='faults.0.at',distribution='uniform',low=0.01,high=0.1},"
        "{key='faults.0.value',distribution='normal',std=0.01}]",
    )
    everyone = population(Campaign("contraction-ideal", spread, 3, seed=1))
    members = [everyone.member(number) for number in range(3)]
    for built, drawn in members:
        (fault,) = built.scenario.faults
        assert [fault.at, fault.value] == drawn
    assert len({built.scenario.faults[0].at for built, _ in members}) == 3
