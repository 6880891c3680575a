"""Errors, delay and sampling on the sensors of a user's own model."""

from pathlib import Path

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, assert_same, flown
from own_models import SENSED, built, write

from mjspace import attitude
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run

pytestmark = SHORT_BLOCKS

TABLES = (
    "sensors.imu_rate={measures='model',noise_std='1 deg/s',bias_std=0.2,delay='40 ms'}",
    "sensors.star_tracker={measures='model',noise_std='0.1 deg',period='40 ms'}",
    "sensors.Acceleration={measures='model',quantization=0.125}",
)
CAPITAL = SENSED.replace('name="acceleration"', 'name="Acceleration"')


def test_they_err_by_what_the_scenario_says(tmp_path: Path) -> None:
    result = run(write(tmp_path, CAPITAL), out=tmp_path / "out", overrides=[*TABLES, "duration=8"])
    log = result.log
    truth, seen = log.read("/truth"), log.read("/measurement")
    # Two samples late; 1 deg/s of noise about a bias of its own.
    error = seen["imu_rate"][2:] - truth["imu_rate"][:-2]
    bias = error.mean(axis=0)
    assert abs(bias).max() > 0.05
    spread = (error - bias).std() / np.radians(1.0)
    assert spread == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * error.size))  # five sigma
    # A small rotation, every second control period.
    turned = attitude.multiply(attitude.conjugate(truth["star_tracker"]), seen["star_tracker"])
    angles = 2.0 * turned[::2, 1:] / np.radians(0.1)
    assert angles.std() == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * angles.size))
    np.testing.assert_array_equal(seen["star_tracker"][1::2][:9], seen["star_tracker"][::2][:9])
    np.testing.assert_array_equal(seen["Acceleration"] % 0.125, 0.0)
    assert np.abs(seen["Acceleration"] - truth["Acceleration"]).max() <= 0.0625
    np.testing.assert_array_equal(seen["elbow_angle"], truth["elbow_angle"])
    assert log.units["/measurement"]["imu_rate"] == "rad/s"
    assert verify(result.path, start=1.0, trust=True) is None


def test_they_are_compiled_as_in_python(tmp_path: Path) -> None:
    assembly = built(tmp_path, *TABLES, "duration=0.6", model=CAPITAL)
    python = flown(assembly, (0, 1), compiled=False)
    together = flown(assembly, (0, 1))
    assert together.compiled.startswith("compiled: sensors, law, actuators")
    assert_same(together, python)
    assert not np.array_equal(*(python.rows["/measurement.imu_rate"][:, i] for i in (0, 1)))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            "imu={measures='model'}",
            r"sensors\.imu: the model has no sensor .imu.: did you mean 'im",
        ),
        (
            "imu_rate={measures='model',noise_std='1 m/s'}",
            r"sensors\.imu_rate\.noise_std: got 1 m/s, should be in rad/s",
        ),
        ("star_tracker={measures='model',bias_std='1 m'}", r"star_tracker\.bias_std: .* in rad$"),
        ("imu_rate={measures='model',noise_std=-1}", r"noise_std.*greater than or equal to 0"),
        ("imu_rate={measures='model',period='4 ms'}", r"imu_rate\.period: .* of rates\.control"),
        ("imu_rate={measures='rate'}", r"sensors\.imu_rate: the model has a sensor of that name"),
    ],
)
def test_what_cannot_be_is_one_line(table: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        built(tmp_path, f"sensors.{table}")


def test_a_vehicle_of_our_parts_has_none(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"sensors\.gyro: the model has no sensor .gyro.: have none"
    ):
        run("detumble-wheels", out=tmp_path, overrides=["sensors.gyro={measures='model'}"])
