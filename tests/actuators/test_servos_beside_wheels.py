"""Gimbals turned by servos on a vehicle with reaction wheels: whose speed is whose, momentum."""

from pathlib import Path
from typing import Any

import numpy as np
import own_models
import pytest

from mjspace.contract import Array
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble, facts_of
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray
    gimbal_rate: np.ndarray

class Both:
    batched = True
    def __init__(self, torque=(0.0, 0.0, 0.0), gimbal_rate=(0.0,)):
        self.torque, self.gimbal_rate = np.array(torque), np.array(gimbal_rate)
    def reset(self, measurement, reference):
        return ()
    def step(self, state, time, measurement, reference):
        ones = np.ones_like(measurement.rate[..., :1])
        return state, Command(ones * self.torque, ones * self.gimbal_rate), ()
"""
CMGS = [
    "plant.wheels={axes=[[1,0,0],[0,1,0],[0,0,1]],positions=[[0,0,0],[0,0,0],[0,0,0]],"
    "inertia=[0.02,0.03,0.04]}"
]


def built(scenario: str, overrides: list[str], folder: Path, **law: Any) -> Assembly:
    (folder / "law.py").write_text(LAW)
    table = f"law={{kind='{folder}/law.py:Both',{','.join(f'{k}={v}' for k, v in law.items())}}}"
    scenario_, where = load(scenario, ["checks=[]", *overrides, table])
    return assemble(scenario_, where, trust=True)


def flown(assembly: Assembly) -> dict[str, dict[str, Array]]:
    blocks = list(fly(assembly, first_start(assembly, [0])))
    return {
        topic: {
            name: np.concatenate([b.rows[topic][name][:, 0] for b in blocks]) for name in fields
        }
        for topic, fields in blocks[0].rows.items()
    }


def test_a_gimbal_turns_the_bus_the_other_way(tmp_path: Path) -> None:
    quick = ["duration=3", "plant.servos.rate_limit=1", "reference={kind='references:Hold'}"]
    truth = flown(built("antenna-slew", quick, tmp_path, gimbal_rate=[0.3]))["/truth"]
    angle = truth["gimbal_angle"][-1, 0]
    assert angle == pytest.approx(0.9, rel=2e-3)
    # I w + J (w + r) is zero for a bus with its dish, less the wheel, which keeps its own speed.
    turned = -0.2 * angle / (14.0 - 0.02)
    assert truth["attitude"][-1, 1] == pytest.approx(np.sin(0.5 * turned), rel=1e-9)
    np.testing.assert_allclose(truth["wheel_speed"][-1, 0], -truth["rate"][-1, 0], rtol=1e-9)
    assert np.abs(truth["momentum"]).max() < 1e-15


def test_wheels_obey_the_torque_and_gimbals_the_rate(tmp_path: Path) -> None:
    quick = ["duration=0.5", "reference={kind='references:Hold'}", *CMGS]
    speeds = "initial.wheel_speed=[1,2,3,500,500,500,500]"
    assembly = built(
        "cmg-slew", [*quick, speeds], tmp_path, torque=[0.1, 0.2, -0.3], gimbal_rate=[0.1] * 4
    )
    facts = facts_of(assembly.vehicle, assembly.scenario)
    np.testing.assert_array_equal(facts["wheel_axes"], np.eye(3))
    np.testing.assert_array_equal(facts["wheel_inertia"], [0.02, 0.03, 0.04])
    np.testing.assert_allclose(facts["spin_inertia"], 0.004, rtol=1e-14)
    alone = assemble(*load("cmg-slew"))
    for name in ("gimbal_axes", "spin_axes"):
        np.testing.assert_array_equal(facts[name], getattr(alone.law, name))
    # H leaves out what reaction wheels have about their axes; a law adds their absolute momentum.
    np.testing.assert_allclose(facts["inertia"], np.diag([9.98, 11.97, 13.96]), atol=1e-12)
    rows = flown(assembly)
    truth, command = rows["/truth"], rows["/command"]
    np.testing.assert_allclose(
        command["wheel_torque"], [[-0.1, -0.2, 0.3]] * len(command["torque"])
    )
    # A rotor's absolute momentum about its axis changes by its motor's torque, and as it turns.
    speed, rate = truth["wheel_speed"], truth["rate"]
    spin = np.array([0.02, 0.03, 0.04]) * (speed[:, :3] + rate)
    turned = 0.5 * np.array([-0.1, -0.2, 0.3])
    np.testing.assert_allclose(spin[-1] - spin[0], turned, atol=2e-4)
    assert np.abs(speed[:, 3:] - 500.0).max() < 0.5  # held by the servos
    np.testing.assert_allclose(truth["gimbal_angle"][-1], 0.05, atol=2e-3)
    drift = truth["momentum"] - truth["momentum"][0]
    assert np.abs(drift).max() < 1e-9  # of 8 N m s in the CMGs


@pytest.mark.usefixtures("one_block")
def test_alone_or_in_a_batch_the_same_bits(tmp_path: Path) -> None:
    quick = ["duration=0.2", "reference={kind='references:Hold'}", *CMGS]
    speeds = "initial.wheel_speed=[0,0,0,500,500,500,500]"
    assembly = built("cmg-slew", [*quick, speeds], tmp_path, gimbal_rate=[0.1] * 4)
    (one,) = fly(assembly, first_start(assembly, [0]))
    (many,) = fly(assembly, first_start(assembly, range(3)), range(3))
    for name, alone in one.rows["/state"].items():
        for vehicle in range(3):
            np.testing.assert_array_equal(many.rows["/state"][name][:, vehicle], alone[:, 0])


def test_a_log_is_flown_again_from_the_middle_of_the_slew(tmp_path: Path) -> None:
    quick = ["duration=4", "checks=[]"]
    path = run("antenna-slew", overrides=quick, out=tmp_path).path
    assert verify(path) is None
    assert verify(path, start=3.0) is None


def test_parts_on_a_model_of_ones_own_are_turned_beside_its_own_motors(tmp_path: Path) -> None:
    """Its own gimbal, wheels and jet obey as before; the servos have the hinge of the part."""
    path = own_models.write(tmp_path)
    law = own_models.LAW.replace("control: np.ndarray", "control: np.ndarray\n    gimbal_rate: Any")
    law = law.replace("force, control)", "0.0 * force, control, np.full((*rows, 1), 0.2))")
    (tmp_path / "law.py").write_text("from typing import Any\n" + law)
    antenna = ["plant.parts.dish={part='antenna',position=[0,0,0.3]}", "plant.servos={}"]
    assembly = assemble(*load(path, antenna))
    facts = facts_of(assembly.vehicle, assembly.scenario)
    np.testing.assert_allclose(facts["gimbal_axes"], [[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(facts["gimbal_inertia"], [0.2])
    assert len(facts["wheel_axes"]) == 3
    truth = flown(assembly)["/truth"]
    angle = truth["gimbal_angle"]
    assert angle[-1, 1] == pytest.approx(0.4, rel=2e-2)  # after the arm's
    assert 0.05 < angle[-1, 0] < 0.4  # on its way to 0.3 rad
    assert (np.abs(truth["wheel_speed"][-1]) > 0.1).all()
    drift = truth["momentum"] - truth["momentum"][0]
    assert np.abs(drift).max() < 1e-6
