"""Unloading of the CMG's wheel: what thrusters and wheel do, the bus does not feel."""

from typing import Any

import numpy as np
from dgvscmg_samples import AT_REST, RATES, measured
from mjspace.controllers.cmg import steering
from mjspace.controllers.cmg.dgvscmg import Cascade
from mjspace.controllers.cmg.dgvscmg_unloading import Unloading

from mjspace import attitude
from mjspace.contract import Measurement
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

JW = 0.016


def asked(law: Any, measurement: Measurement) -> Any:
    return law.step(law.reset(measurement, AT_REST), 0.0, measurement, AT_REST)[1]


def test_the_bus_feels_neither_thrusters_nor_wheel() -> None:
    measurement = measured(20, wheel_speed=90.0, spread=10.0)
    command = asked(Unloading(**RATES, unloading_gain=0.05), measurement)
    plain = asked(Cascade(**RATES), measurement)
    np.testing.assert_array_equal(command.gimbal_rate, plain.gimbal_rate)
    more = (command.acceleration - plain.acceleration)[:, 2:]
    np.testing.assert_allclose(more, -0.05 * (measurement.wheel_speed - 73.0), rtol=1e-9)
    chi = steering.torque_matrix(measurement.gimbal_angle, measurement.wheel_speed, JW)
    np.testing.assert_allclose(command.thruster_torque, chi[..., 2] * more, atol=1e-15)
    # what the outer motor holds of the wheel's acceleration, along go = z
    held = JW * more[:, 0] * -np.sin(measurement.gimbal_angle[:, 1])
    np.testing.assert_allclose((command.load - plain.load)[:, 0], held, atol=1e-14)
    np.testing.assert_allclose((command.load - plain.load)[:, 1:], 0.0, atol=1e-14)


def test_thrusters_are_asked_for_no_more_than_they_have() -> None:
    measurement = measured(20, wheel_speed=90.0, spread=10.0)
    torque = asked(Unloading(**RATES, unloading_gain=9.0), measurement).thruster_torque
    np.testing.assert_allclose(np.linalg.norm(torque, axis=1), 0.1, rtol=1e-12)


def test_momentum_leaves_by_the_thrusters_alone() -> None:
    quiet = ["duration=0.1", "checks=[]", "environment.torques=[]"]
    built = assemble(*load("dgvscmg-unloading", quiet))
    blocks = [b.rows for b in fly(built, first_start(built, [0]))]
    rows = {
        name: np.concatenate([rows[topic][name][:, 0] for rows in blocks])
        for topic, name in (
            ("/truth", "momentum"), ("/truth", "attitude"), ("/command", "thruster_torque"),
        )
    }  # fmt: skip
    brought = 1e-3 * attitude.rotate(rows["attitude"], rows["thruster_torque"])[:-1].sum(axis=0)
    change = rows["momentum"][-1] - rows["momentum"][0]
    assert np.linalg.norm(brought) > 1e-3
    # the bus turns by some 1e-4 rad while a torque is held
    np.testing.assert_allclose(change, brought, atol=1e-3 * float(np.linalg.norm(brought)))
