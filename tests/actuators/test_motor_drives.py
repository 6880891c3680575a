"""Vehicles whose motors have an electrical side: the loop, replays, batches; and thrusters."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.actuators.motor_drives import DriveTables
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.environment.torque_ripple import Ripple
from mjspace.errors import FlightError, InputError
from mjspace.log.reader import Log
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import run
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.scenario.plant import PlantTable
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

SHORT = "duration=0.05"
QUIET = ["environment.torques=[]", "checks=[]", SHORT]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run("dgvscmg-tracking", overrides=QUIET, out=tmp_path_factory.mktemp("cmg")).path


def test_the_log_has_what_a_cmg_has(flown: Path) -> None:
    log = Log(flown)
    fields = {"gimbal_angle": (2,), "gimbal_rate": (2,), "wheel_speed": (1,), "current": (3, 2)}
    for topic in ("/truth", "/measurement"):
        assert fields.items() <= log.topics[topic].items()
    assert log.topics["/command"]["motor_torque"] == (3,)
    truth = log.read("/truth")
    # all sensors are ideal
    for name in fields:
        np.testing.assert_array_equal(log.read("/measurement")[name], truth[name])
    # the gimbals have begun to turn, and the wheel to change its speed
    assert np.abs(truth["gimbal_rate"][-1]).min() > 1e-3
    assert truth["wheel_speed"][0, 0] == 73.0


def test_what_turns_inside_turns_no_momentum_of_the_whole(flown: Path) -> None:
    momentum = Log(flown).read("/truth", ["momentum"])["momentum"]
    # ripple, motors and gyroscopic torques all have their reactions
    assert np.abs(momentum - momentum[0]).max() < 1e-11  # of 1.2 N m s; 2e-13 measured


def test_a_log_is_flown_again_bit_for_bit(flown: Path, tmp_path: Path) -> None:
    assert verify(flown) is None
    assert verify(flown, start=0.03) is None
    again = replay(flown, tmp_path / "again", start=0.02).log
    logged, new = Log(flown).read("/state"), again.read("/state")
    for name in ("physics", "actuator_current", "law_speed_memory"):
        np.testing.assert_array_equal(new[name], logged[name][20:])


def test_alone_or_in_a_batch_the_same_bits() -> None:
    built = assemble(*load("dgvscmg-tracking", QUIET))
    alone = [b.rows["/state"] for b in fly(built, first_start(built, [0]))]
    batch = [
        b.rows["/state"] for b in fly(built, first_start(built, range(5)), range(5), threads=2)
    ]
    for name in alone[0]:
        one = np.concatenate([rows[name] for rows in alone])[:, 0]
        many = np.concatenate([rows[name] for rows in batch])
        for vehicle in range(5):
            np.testing.assert_array_equal(many[:, vehicle], one)


def test_a_finer_step_flies_the_same() -> None:
    """Currents are exact over a step with its speed held: first order in the step, and small."""
    ends = []
    for physics in ("0.1 ms", "0.05 ms"):
        built = assemble(*load("dgvscmg-tracking", [*QUIET, f"rates.physics={physics!r}"]))
        *_, block = fly(built, first_start(built, [0]))
        ends.append(block.rows["/truth"]["rate"][-1, 0])
    assert np.linalg.norm(ends[0]) > 1e-4
    assert np.linalg.norm(ends[0] - ends[1]) < 0.02 * np.linalg.norm(ends[0])


def test_ideal_thrusters_give_the_bus_what_the_law_asks() -> None:
    built = assemble(*load("pd-plus", ["duration=1"]))
    blocks = list(fly(built, first_start(built, [0])))
    torque, rate = (
        np.concatenate([b.rows[topic][name][:, 0] for b in blocks])
        for topic, name in (("/command", "torque"), ("/truth", "rate"))
    )
    np.testing.assert_array_equal(
        torque, np.concatenate([b.rows["/command"]["thruster_torque"][:, 0] for b in blocks])
    )
    inertia = built.vehicle.inertia
    slope = (rate[2:] - rate[:-2]) / 2e-3
    mean = 0.5 * (torque[:-2] + torque[1:-1])
    euler = slope @ inertia + np.cross(rate[1:-1], rate[1:-1] @ inertia)
    # central differences of 1 ms; the torque is held for as long
    np.testing.assert_allclose(euler, mean, atol=2e-4)
    assert np.abs(torque).max() > 1.0


def test_ripple_is_a_torque_on_its_hinge_and_against_what_carries_it() -> None:
    xml = """<mujoco><option gravity="0 0 0"><flag contact="disable"/></option><worldbody>
      <body name="bus"><freejoint/><inertial pos="0 0 0" mass="9" diaginertia="3 4 5"/>
        <body><joint name="wheel" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.2"/></body></body>
      </worldbody></mujoco>"""
    plant = PlantTable(ripple={"wheel": Ripple(amplitude=0.3, cycles=0.5, phase=3.0)})
    spec = mujoco.MjSpec.from_string(xml)
    spec.nuserdata = userdata_size(Environment(), plant)
    model = spec.compile()
    data = mujoco.MjData(model)
    install_callbacks()
    data.userdata[:] = userdata(model, Environment(), plant)
    data.qpos[7] = 2.5
    mujoco.mj_forward(model, data)
    torque = 0.3 * np.cos(0.5 * 2.5 + 3.0)
    np.testing.assert_allclose(data.qfrc_passive, [0, 0, 0, 0, 0, 0, torque], atol=1e-16)
    # relative to the bus, of 5 kg m^2 against the wheel's 0.2
    assert data.qacc[5] == pytest.approx(-torque / 5.0)
    assert data.qacc[6] == pytest.approx(torque * (1 / 0.2 + 1 / 5.0))


def test_a_motor_without_a_drive_is_refused() -> None:
    scenario, folder = load("dgvscmg-tracking")
    drives = {k: v for k, v in scenario.plant.drives.root.items() if k != "cmg_inner"}
    plant = scenario.plant.model_copy(update={"drives": DriveTables(drives)})
    with pytest.raises(InputError, match=r"plant\.drives: cmg_inner has a motor and no drive"):
        assemble(scenario.model_copy(update={"plant": plant}), folder)


@pytest.mark.parametrize(
    ("scenario", "override", "message"),
    [
        (
            "dgvscmg-tracking",
            "plant.wheels.axes=[[1,0,0]]",
            "drives and wheels are both given: set wheels.axes",
        ),
        ("dgvscmg-tracking", "plant.engine={thrust_max=1}", "give one"),
        (
            "dgvscmg-tracking",
            "plant.drives.cmg_door={pole_pairs=1, resistance=1, inductance=1, torque_constant=1}",
            "plant.drives.cmg_door: no motor turns it: have cmg_outer, cmg_inner, cmg_wheel",
        ),
        ("dgvscmg-tracking", "plant.ripple.door={amplitude=1, cycles=1}", "no hinge 'door'"),
        ("dgvscmg-tracking", "initial.joint_speed.door=1", "no hinge or slide 'door'"),
        ("dgvscmg-tracking", "initial.wheel_speed=[1, 2]", "2 speeds for 1 wheels"),
        ("dgvscmg-tracking", "law.current_gain=9e6", "control period of 0.0001 s is too long"),
    ],
)
def test_what_cannot_fly_is_refused(scenario: str, override: str, message: str) -> None:
    with pytest.raises(InputError) as told:
        assemble(*load(scenario, [override]))
    assert message in str(told.value)


def test_a_law_without_voltages_is_told_so(tmp_path: Path) -> None:
    overrides: list[Any] = [*QUIET, "law={kind='coast:Coast'}"]
    message = r"no field 'voltage': it must be of shape \(\.\.\., 3, 2\) \[V\]"
    with pytest.raises(FlightError, match=message):
        run("dgvscmg-tracking", overrides=overrides, out=tmp_path)
