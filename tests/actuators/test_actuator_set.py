"""Actuators of two kinds at once: each obeys its own field of the command, and both act."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch
from scipy.integrate import simpson

from mjspace import attitude
from mjspace.actuators.actuator_set import ActuatorSet
from mjspace.actuators.base import Actuator
from mjspace.actuators.ideal_thrusters import IdealThrusters
from mjspace.actuators.magnetorquers import CoilSet
from mjspace.actuators.reaction_wheels import ReactionWheels
from mjspace.contract import Measurement, TorqueCommand
from mjspace.errors import FlightError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

TRUTH = Measurement(
    attitude=np.array([[1.0, 0.0, 0.0, 0.0]] * 2),
    rate=np.zeros((2, 3)),
    wheel_speed=np.zeros((2, 3)),
)
LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray
    thruster_torque: np.ndarray

class Both:
    batched = True
    def reset(self, measurement, reference):
        return ()
    def step(self, state, time, measurement, reference):
        one = np.ones_like(measurement.rate)
        return state, Command([0.3, 0.0, 0.0] * one, [0.0, 0.02, 0.01] * one), ()
"""
BOTH = ["plant.ideal_thrusters=true", "environment.torques=[]", "duration=2", "checks=[]"]


@pytest.fixture
def overrides(tmp_path: Path) -> list[str]:
    (tmp_path / "law.py").write_text(LAW)
    return [*BOTH, f"law={{kind='{tmp_path}/law.py:Both'}}"]


def test_wheels_exchange_momentum_and_thrusters_bring_it(
    overrides: list[str], tmp_path: Path
) -> None:
    flown = run("dgvscmg-against-wheels", overrides=overrides, out=tmp_path / "flight")
    truth, command = flown.log.read("/truth"), flown.log.read("/command")
    np.testing.assert_array_equal(command["wheel_torque"][5], [-0.3, 0.0, 0.0])
    np.testing.assert_array_equal(command["thruster_torque"][5], [0.0, 0.02, 0.01])
    brought = truth["momentum"][-1] - truth["momentum"][0]
    # The thrusters' torque is held in body axes; no wheel changes the total.
    torque = attitude.rotate(truth["attitude"], [0.0, 0.02, 0.01] * np.ones_like(truth["rate"]))
    due = simpson(torque, x=truth["time"], axis=0)
    np.testing.assert_allclose(brought, due, atol=1e-14)  # 1e-15 measured
    # About its own axis a rotor has its motor's torque alone.
    turning = truth["wheel_speed"] + truth["rate"]
    spun = 0.016 * (turning[-1] - turning[0])
    np.testing.assert_allclose(spun, [-0.6, 0.0, 0.0], atol=1e-14)  # 3e-16 measured
    assert verify(flown.path, trust=True) is None


def test_a_batch_is_as_one(overrides: list[str]) -> None:
    built = assemble(*load("dgvscmg-against-wheels", [*overrides, "duration=0.05"]))
    one, many = (
        np.concatenate([block.rows["/state"]["physics"] for block in blocks])
        for blocks in (fly(built, first_start(built, range(n)), range(n)) for n in (1, 3))
    )
    for vehicle in range(3):
        np.testing.assert_array_equal(many[:, vehicle], one[:, 0])


def test_a_law_that_forgets_one_is_told_so() -> None:
    built = assemble(*load("dgvscmg-against-wheels", BOTH))
    message = (
        r"the law's command, a TorqueCommand, has no field 'thruster_torque': it must be of shape "
        r"\(\.\.\., 3\) \[N m\]; its fields are: torque$"
    )
    with pytest.raises(FlightError, match=message):
        list(fly(built, first_start(built, [0])))


@pytest.mark.parametrize(
    ("torque", "message"),
    [
        (np.zeros((2, 4)), r"torque has shape \(\.\.\., 4\): it must be of shape \(\.\.\., 3\)"),
        (np.zeros(3), r"torque has shape \(3,\): it must be of shape \(\.\.\., 3\) \[N m\]"),
        ([["a"] * 3] * 2, r"torque is not numbers \(could not convert .*\): it must be of shape"),
    ],
)
def test_a_misshapen_command_is_the_laws_fault(torque: Any, message: str) -> None:
    wheels = ActuatorSet((ReactionWheels(np.eye(3)),))
    with pytest.raises(FlightError, match=f"the law's command: {message}"):
        wheels.act({}, TorqueCommand(torque), TRUTH, 0.1)


class Broken(ReactionWheels):
    def act(self, state: Any, command: Any, truth: Any, step: float) -> Any:
        raise KeyError("its own")


class BrokenSensor(ReactionWheels):
    def measured(self, state: Any, truth: Any) -> Any:
        raise KeyError("its own")


class Misshapen(ReactionWheels):
    def act(self, state: Any, command: Any, truth: Any, step: float) -> Any:
        return state, np.zeros((2, 4)), np.zeros((2, 3))


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (
            Broken,
            r"the actuator Broken \(wheel_torque\) raised KeyError at test_actuator_set.py:\d+: ",
        ),
        (Misshapen, r"the actuator Misshapen applies .* of shape \(2, 4\): it must be \(2, 3\)"),
    ],
)
def test_an_actuators_fault_is_reported_as_its_own(
    kind: type[ReactionWheels], message: str
) -> None:
    with pytest.raises(FlightError, match=message):
        ActuatorSet((kind(np.eye(3)),)).act({}, TorqueCommand(np.zeros((2, 3))), TRUTH, 0.1)


def test_so_is_one_in_its_measurement() -> None:
    broken = ActuatorSet((BrokenSensor(np.eye(3)),))
    with pytest.raises(FlightError, match=r"the actuator BrokenSensor .* raised KeyError at "):
        broken.measured({}, TRUTH)


@pytest.mark.parametrize("other", [ReactionWheels(np.eye(3)[:1]), CoilSet(np.eye(3))])
def test_two_kinds_cannot_drive_the_same(other: Actuator) -> None:
    ActuatorSet((IdealThrusters(), other))
    for kind in (IdealThrusters(), other):
        with pytest.raises(ValueError, match="both drive"):
            ActuatorSet((kind, kind))


class Coordinator(IdealThrusters):
    logged_as = "wheel_torque"


def test_two_kinds_cannot_be_logged_under_one_name() -> None:
    with pytest.raises(ValueError, match=r"are both logged as command\.wheel_torque: give one"):
        ActuatorSet((ReactionWheels(np.eye(3)), Coordinator()))


def test_motors_are_found_by_name_wherever_they_stand() -> None:
    joints = "".join(f'<body><joint name="{n}"/><geom size="1"/></body>' for n in "abc")
    motors_in = "".join(f'<motor name="wheel_{i}" joint="{n}"/>' for i, n in ((2, "a"), (0, "b")))
    xml = "<mujoco><worldbody>{}</worldbody><actuator>{}</actuator></mujoco>"
    model = mujoco.MjModel.from_xml_string(
        xml.format(joints, motors_in + '<motor name="wheel_1" joint="c"/>')
    )
    batch = Batch(model, 2, 1)
    for count, desired in (
        (2, [[0.0, 1.0, 2.0], [0.0, 4.0, 5.0]]),
        (3, [[3.0, 1.0, 2.0], [6.0, 4.0, 5.0]]),
    ):
        (views,) = ActuatorSet((ReactionWheels(np.eye(3)[:count]),)).inputs(batch)
        for view, part in views:
            view[:] = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])[:, part]
        assert batch.bind("ctrl").tolist() == desired
