"""Sensors of Sun, Earth and field in flight: compiled as in Python, and what a law sees of them."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, assembly, assert_same, flown

from mjspace.contract import Measurement
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.simulation.flight_software.interface import interface_of

pytestmark = SHORT_BLOCKS

ORBITING = (
    *("duration=3", "events=[]", "environment.epoch='2025-03-20T09:00:00'"),
    "environment.orbit={semi_major_axis='7000 km',inclination='50 deg',j2=true}",
    "sensors.horizon={measures='nadir',noise_std='0.1 deg',field_of_view='120 deg'}",
    "sensors.fine={measures='sun_direction',noise_std='0.05 deg',field_of_view='20 deg',"
    "boresight=[1,0,0]}",
    "sensors.cells={measures='sun_cosines',noise_std=0.01,scale_factor_std=0.02}",
    "sensors.gps={measures='gnss_position',noise_std='5 m'}",
    "sensors.speed={measures='gnss_velocity',noise_std='0.05 m/s'}",
    "sensors.tracker={measures='attitude',noise_std='5 arcsec',roll_noise_std='40 arcsec',"
    "sun_exclusion='100 deg',earth_exclusion='10 deg',rate_limit='25 deg/s',delay='20 ms'}",
)


def test_they_are_compiled_and_fly_as_in_python_alone_and_together() -> None:
    built, members = assembly("detumble-wheels", *ORBITING), (0, 1, 2)
    python = flown(built, members, compiled=False)
    together = flown(built, members, threads=2)
    assert together.compiled.startswith("compiled: sensors, law, actuators")
    assert_same(together, python)
    assert flown(built, [1]).bits(0) == python.bits(1)
    rows = python.rows
    for name in ("fine", "tracker"):
        assert 0.05 < rows[f"/measurement.{name}_valid"].mean() < 0.95, name
    # The report is 4 periods of 5 ms late, and its validity with it.
    late = rows["/measurement.tracker_valid"][4:]
    assert np.array_equal(late, rows["/truth.tracker_valid"][:-4])
    held = np.all(rows["/measurement.tracker"][1:] == rows["/measurement.tracker"][:-1], axis=-1)
    assert np.array_equal(held[4:], rows["/measurement.tracker_valid"][5:, :, 0] == 0.0)
    sun, true = rows["/measurement.fine"], rows["/truth.sun_direction"]
    off = np.linalg.norm(np.cross(sun, true), axis=-1)[
        rows["/measurement.fine_valid"][..., 0] > 0.5
    ]
    assert np.sqrt(np.mean(off**2)) == pytest.approx(np.radians(0.05) * np.sqrt(2.0), rel=0.1)
    speed = np.linalg.norm(rows["/truth.gnss_velocity"], axis=-1)
    np.testing.assert_allclose(speed, np.sqrt(3.986004418e14 / 7.0e6), rtol=2e-3)  # J2


def test_such_a_flight_is_replayed_from_anywhere(tmp_path: Path) -> None:
    flight = run("detumble-wheels", overrides=[*ORBITING, "checks=[]"], out=tmp_path)
    for start in (0.0, 2.345):
        assert verify(flight.path, start=start) is None


COUPLED = "coil_coupling=[['100 nT/(A m^2)',0,0],[0,2e-7,'30 nT/(A m^2)'],[0,0,3e-7]]"


def test_one_s_own_coils_disturb_a_magnetometer() -> None:
    mag = f"sensors.mag={{measures='magnetic_field',{COUPLED},noise_density='5 nT/sqrt(Hz)'}}"
    built = assembly("desaturation-magnetic", "duration=100", mag)
    python, compiled = flown(built, (0, 1), compiled=False), flown(built, (0, 1), threads=2)
    assert compiled.compiled.startswith("compiled: sensors, law, actuators")
    assert_same(compiled, python)
    rows = python.rows
    added = rows["/truth.mag_with_coils"] - rows["/truth.magnetic_field"]
    # At a control instant the coils have the moment of the period before.
    moment = rows["/command.magnetic_moment"][:-1]
    coupling = np.array([[1e-7, 0.0, 0.0], [0.0, 2e-7, 3e-8], [0.0, 0.0, 3e-7]])
    np.testing.assert_allclose(added[1:], moment @ coupling.T, atol=1e-19)
    assert not added[0].any()
    assert np.abs(added).max() > 1e-6
    noise = rows["/measurement.mag"] - rows["/truth.mag_with_coils"]
    step = built.scenario.rates.control
    assert np.std(noise) == pytest.approx(5e-9 / np.sqrt(step), rel=0.2)


def test_a_magnetometer_that_is_disturbed_is_the_law_s_magnetometer() -> None:
    mag = f"sensors.mag={{measures='magnetic_field',{COUPLED}}}"
    built = assembly("b-dot", "duration=20", mag)
    named = built.sensors([0]).measurement
    assert "magnetic_field" not in vars(named)  # its own sensor is first
    only = built.scenario.model_copy(
        update={
            "sensors": {n: s for n, s in built.scenario.sensors.items() if n != "magnetic_field"}
        }
    )

    named = dataclasses.replace(built, scenario=only).sensors([0]).measurement
    field = np.ones((1, 3))
    assert named(mag=field).magnetic_field is field


def test_the_validity_of_a_sensor_that_cannot_tell_is_one() -> None:
    kind: Any = Measurement._with_sensors({"st": "attitude", "gyro": "rate"})
    flag, attitude = np.zeros((2, 1)), np.ones((2, 4))
    measured = kind(st=attitude, st_valid=flag, gyro=np.ones((2, 3)))
    assert measured.st_valid is flag
    assert measured.attitude_valid is flag
    assert measured.gyro_valid.tolist() == [[1.0], [1.0]]
    assert measured.rate_valid.tolist() == [[1.0], [1.0]]
    with pytest.raises(AttributeError, match="no sensor measures nadir: add"):
        _ = measured.nadir_valid


def test_flight_software_is_told_which_reports_are_valid() -> None:
    fields = interface_of(assembly("detumble-wheels", *ORBITING)).measurement
    assert fields["tracker_valid"].shape == (1,)
    assert fields["tracker_valid"].about == "1 where tracker is valid, else 0"
    assert "gps_valid" not in fields
