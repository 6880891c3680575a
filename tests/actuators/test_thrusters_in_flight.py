"""Thrusters in the loop: what they bring, what it costs, beside wheels, again from the log."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.rendering.scene import Stage
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

# Pulses that are longer than a period, under way between two, and closed within a step.
LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray
    on_time: np.ndarray

class Both:
    batched = True
    def reset(self, measurement, reference):
        return ()
    def step(self, state, time, measurement, reference):
        on = np.zeros((*measurement.rate.shape[:-1], 12))
        on[..., 4:6] = 0.037 if time < 0.45 else 0.0
        wheels = [0.3, 0.0, 0.0] * np.ones_like(measurement.rate)
        return state, Command(wheels, on), ()
"""
RCS = [
    *("duration=1", "checks=[]", "rates.control='50 ms'", "plant.rcs.delay='63 ms'"),
    *("plant.rcs.rise='20 ms'", "initial.euler=[0, 0, 0]"),
]


def test_they_turn_the_bus_beside_wheels_and_burn_for_it(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text(LAW)
    own = [f"law={{kind='{tmp_path}/law.py:Both'}}", "plant.wheels.axes=[[1,0,0]]"]
    flown = run("rcs-three-axis", overrides=[*RCS, *own], out=tmp_path / "flight")
    truth, state = flown.log.read("/truth"), flown.log.read("/state")
    on = 9 * 0.037
    np.testing.assert_allclose(state["actuator_rcs_on_time"][-1], on * (np.eye(12)[4:6].sum(0)))
    # two of 0.5 N on levers of 0.5 m; the body has turned by 0.02 rad
    np.testing.assert_allclose(truth["momentum"][-1], [0.0, 0.5 * on, 0.0], atol=3e-3)
    np.testing.assert_allclose(truth["momentum"][-1, 1], 0.5 * on, rtol=1e-3)
    np.testing.assert_allclose(truth["velocity"][-1], 0.0, atol=1e-15)
    used = 1.0 - truth["propellant"][-1, 0]
    np.testing.assert_allclose(used, 2 * 0.5 * on / (220.0 * STANDARD_GRAVITY), rtol=1e-6)
    assert truth["thrust"][-1].max() < 1e-7
    assert truth["wheel_speed"][-1, 0] < -5.0
    assert verify(flown.path, trust=True) is None
    assert verify(flown.path, start=0.3, trust=True) is None


ONE_BURN = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    on_time: np.ndarray

class OneBurn:
    batched = True
    def reset(self, measurement, reference):
        return ()
    def step(self, state, time, measurement, reference):
        on = np.where(np.abs(time - 1.0) < 0.5, 12.34, 0.0)
        return state, Command(on + np.zeros((*measurement.rate.shape[:-1], 1))), ()
"""


@pytest.mark.parametrize(
    ("actuator", "gas"),
    [
        ("rcs", "propellant=20, delay='30 ms', rise='10 ms', minimum_on='20 ms'"),
        ("cold_gas", "gas=20"),
    ],
)
def test_a_burn_over_many_periods_gives_tsiolkovskys_velocity(
    actuator: str, gas: str, tmp_path: Path
) -> None:
    (tmp_path / "law.py").write_text(ONE_BURN)
    layout = "positions=[[0,0,0]], directions=[[1,0,0]], thrust=400, specific_impulse=220"
    table = f"plant.{actuator}={{{layout}, {gas}, burns='to_the_end'}}"
    (tmp_path / "burn.toml").write_text(
        f"""description = "one burn"
duration = 16
rates = {{physics = "10 ms", control = "1 s"}}
plant.wheels.axes = []
{table}
reference = {{kind = "references:Hold"}}
law = {{kind = "law.py:OneBurn"}}
"""
    )
    flown = run(tmp_path / "burn.toml", out=tmp_path / "flight")
    truth, state = flown.log.read("/truth"), flown.log.read("/state")
    mass = assemble(*load(str(tmp_path / "burn.toml"))).vehicle.model.body_mass.sum()
    exhaust, used = 220.0 * STANDARD_GRAVITY, 20.0 - truth["propellant"][-1, 0]
    speed = exhaust * np.log(mass / (mass - used))
    # A step of 10 ms has its middle mass: off by (F h / m c)^2 / 12 = 2e-11, as measured.
    np.testing.assert_allclose(truth["velocity"][-1], [speed, 0.0, 0.0], rtol=1e-10, atol=1e-12)
    if actuator == "rcs":
        np.testing.assert_allclose(used, 400.0 * 12.34 / exhaust, rtol=1e-12)
        np.testing.assert_allclose(state["actuator_rcs_on_time"][-1], 12.34, rtol=1e-12)
    else:
        left = np.exp(-400.0 * 12.34 / (20.0 * exhaust))
        np.testing.assert_allclose(20.0 - used, 20.0 * left, rtol=1e-12)
    assert not flown.log.events()
    assert verify(flown.path, trust=True) is None
    assert verify(flown.path, start=7.0, trust=True) is None  # in the middle of the burn


@pytest.mark.usefixtures("one_block")
def test_a_batch_is_as_one_and_its_tanks_empty() -> None:
    built = assemble(*load("detumble-thrusters", ["duration=0.5", "checks=[]"]))
    (one,), (many,) = (list(fly(built, first_start(built, range(n)), range(n))) for n in (1, 3))
    for topic in ("/state", "/truth", "/command"):
        for name, alone in one.rows[topic].items():
            for vehicle in range(3):
                np.testing.assert_array_equal(many.rows[topic][name][:, vehicle], alone[:, 0])
    assert 0.99 < one.rows["/truth"]["propellant"][-1, 0, 0] < 0.9999


def test_unlike_thrusters_turn_a_satellite_as_alike_ones_do(tmp_path: Path) -> None:
    """The law is told each one's force and least pulse; what it commands is what the bus gets."""
    unlike = [
        "plant.rcs.thrust=[0.5,0.8,0.5,0.5,0.9,0.5,0.5,0.7,0.5,0.6,0.5,0.5]",
        "plant.rcs.minimum_on=[0.01,0.02,0.01,0.01,0.03,0.01,0.01,0.01,0.01,0.01,0.01,0.01]",
        "plant.rcs.specific_impulse=[220,200,220,220,220,220,220,220,220,220,220,180]",
    ]
    flown = run("rcs-three-axis", overrides=["duration=20", "checks=[]", *unlike], out=tmp_path)
    truth = flown.log.read("/truth")
    assert truth["rate"][-1] @ truth["rate"][-1] > 1e-4  # it slews
    assert np.rad2deg(truth["attitude_error"]).max() < 0.06
    assert np.abs(truth["velocity"]).max() < 1e-3  # pairs fire for unlike times, with no net push
    assert not [event for event in flown.log.events() if "saturated" in event.message]
    assert verify(flown.path) is None


def test_a_picture_shows_the_plumes_of_those_that_are_on() -> None:
    built = assemble(*load("detumble-thrusters"))
    model, start = built.vehicle.model, first_start(built, [0])
    stage = Stage(model, "chase", None)
    on_time = np.zeros(12)
    on_time[[3, 7]] = 0.01
    stage.set(0.0, start.physics[0], np.array([1.0, 0.0, 0.0, 0.0]), on_time)
    shown = [i for i in range(12) if model.geom(f"thruster_{i}_plume").rgba[3] > 0.0]
    assert shown == [3, 7]
    # the third pushes up at the bottom edge: its plume points down
    plume = model.geom("thruster_2_plume")
    np.testing.assert_allclose(plume.pos, [0.0, -0.4, -0.8], atol=1e-12)


def test_a_lander_may_have_them_beside_its_engine() -> None:
    rcs = "plant.rcs={positions=[[0.6,0,0],[-0.6,0,0]],directions=[[0,1,0],[0,-1,0]],thrust=5}"
    built = assemble(*load("lander", [rcs]))
    assert built.vehicle.motors[-2:] == ("thruster_0", "thruster_1")
    assert [kind.logged_as for kind in built.actuators.kinds] == ["engine", "thruster_thrust"]
    model = built.vehicle.model
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "rcs_tank") < 0
    state = built.actuators.reset(1)
    assert [name for name, *_ in built.actuators.masses(state, state)] == [
        "body_mass",
        "body_inertia",
    ]
