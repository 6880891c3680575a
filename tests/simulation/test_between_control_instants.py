"""Limits, masses and switches act at the integration step; the control period is the law's."""

import copy
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Rows, one_vehicle
from mjspace.simulation.stepper import Stepper
from mjspace.simulation.user_code import reference_at
from mjspace.vehicle.model_checks import ModelWarning

LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray
    on_time: np.ndarray

class Signals(NamedTuple):
    none: np.ndarray

class Plan:
    def __init__(self, torque=(0.0, 0.0, 0.0), on_time=0.0):
        self.torque, self.on_time = np.array(torque, float), on_time
    def reset(self, measurement, reference):
        return None
    def step(self, state, time, measurement, reference):
        return None, Command(self.torque, np.array([self.on_time])), Signals(np.zeros(1))
"""
SATELLITE = """
description = "a small satellite that obeys a plan"
duration = "10 s"
[rates]
physics = "10 ms"
control = "1 s"
[plant]
mass = 3
bus_inertia = [[0.03,0,0],[0,0.03,0],[0,0,0.03]]
[plant.wheels]
axes = AXES
inertia = "3e-6 kg m^2"
mass = "130 g"
[reference]
kind = "references:Hold"
[law]
kind = "plan.py:Plan"
"""
RCS = """
[plant.rcs]
positions = [[0, 0, 0]]
directions = [[0, 0, 1]]
thrust = "5 N"
specific_impulse = 220
propellant = 1
"""


def satellite(folder: Path, axes: str, more: str = "") -> Path:
    (folder / "plan.py").write_text(LAW)
    path = folder / "satellite.toml"
    path.write_text(SATELLITE.replace("AXES", axes) + more)
    return path


def flown(assembly: Assembly) -> tuple[Rows, list[Any]]:
    """Return the rows of a flight of one vehicle, and its events."""
    blocks = list(fly(assembly, first_start(assembly, [0])))
    rows = [one_vehicle(block) for block in blocks]
    joined: Rows = {
        topic: {name: np.concatenate([row[topic][name] for row in rows]) for name in fields}
        for topic, fields in rows[0].items()
    }
    return joined, [event for block in blocks for event in block.events]


@pytest.mark.parametrize("control", [0.02, 1.0, 10.0])
def test_a_rocket_gains_tsiolkovskys_velocity(tmp_path: Path, control: float) -> None:
    path = satellite(tmp_path, "[]", RCS)
    settings = [f"rates.control={control}", f"law.on_time={control}"]
    rows, _ = flown(assemble(*load(path, settings)))
    left = rows["/truth"]["propellant"][-1, 0]
    assert left == pytest.approx(1.0 - 50.0 / (220.0 * STANDARD_GRAVITY), rel=1e-12)
    due = 220.0 * STANDARD_GRAVITY * np.log(4.0 / (3.0 + left))
    # (dm/m)^2 / 12 of a step is 3e-12; 5e-12 measured, with the mass of a step's start 3e-6
    assert rows["/truth"]["velocity"][-1, 2] == pytest.approx(due, rel=1e-11)


def test_the_model_is_one_of_the_burnt_mass(tmp_path: Path) -> None:
    path = satellite(tmp_path, "[[0, 0, 1]]", RCS)
    built = assemble(*load(path, ["law.on_time=0.95"]))
    stepper = Stepper(built, first_start(built, [0]))
    law = FlownLaw(built.law, None, 1)
    for number in range(6):
        period = stepper.sense(number)
        desired = reference_at(built.reference, np.array([period.time]))
        reference = type(desired)(*(rows[0] for rows in desired))
        _, period.command, period.signals = law.step(period.time, period.measurement, reference)
        stepper.begin(period)
        stepper.finish(period)
    model = stepper.batch.get_model(0)
    fresh = copy.copy(model)
    mujoco.mj_setConst(fresh, mujoco.MjData(fresh))
    tank = model.body("rcs_tank").id
    left = stepper.memory["rcs_propellant"][0, 0]
    assert left < 0.99  # of 1 kg
    assert model.body_mass[tank] == pytest.approx(left, rel=2e-5)  # half a step burns 1.2e-5 kg
    for name in ("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0"):
        derived = getattr(model, name)
        np.testing.assert_array_equal(derived, getattr(fresh, name))
        assert (derived != getattr(built.vehicle.model, name)).any(), name


def test_what_burns_on_a_straight_way_has_no_angular_momentum(tmp_path: Path) -> None:
    # Taken about a centre of mass that is too heavy, momentum would appear.
    start = "[initial]\nposition = [10, 20, 0]\nvelocity = [3, 0, 0]\n"
    path = satellite(tmp_path, "[]", RCS + start)
    rows, _ = flown(assemble(*load(path, ["law.on_time=1"])))
    np.testing.assert_allclose(rows["/truth"]["momentum"], 0.0, atol=1e-10)


@pytest.mark.parametrize("control", [0.01, 0.5, 1.0])
def test_no_wheel_passes_its_speed_limit(tmp_path: Path, control: float) -> None:
    path = satellite(tmp_path, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
    limit = "plant.wheels.speed_limit='6500 rpm'"
    torque = "law.torque=[0.001, 0, -0.003]"
    built = assemble(*load(path, [limit, torque, f"rates.control={control}", "duration=3"]))
    rows, events = flown(built)
    most = 6500.0 * np.pi / 30.0
    fastest = np.abs(rows["/truth"]["wheel_speed"]).max(axis=0)
    # 0.68 s to the limit; the bus turns by rounding alone about y
    np.testing.assert_allclose(fastest, [most, 0.0, most], rtol=1e-12, atol=1e-12)
    # x is at its limit after 2.04 s; z after 0.68 s: told with the period that holds the instant
    told = {message: time for time, _, _, message in events}
    instants = {"wheel_2 saturated": 0.68, "wheel_0 saturated": 2.04}
    assert told.keys() == instants.keys()
    for message, instant in instants.items():
        assert told[message] == pytest.approx(control * np.floor(instant / control), abs=0.011)


def test_the_instant_of_a_limit_does_not_depend_on_the_control_period(tmp_path: Path) -> None:
    path = satellite(tmp_path, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
    settings = ["plant.wheels.speed_limit='6500 rpm'", "law.torque=[1e-3, 0, -3e-3]", "duration=3"]
    rows, seldom = (
        flown(assemble(*load(path, [*settings, f"rates.control={control}"])))[0]
        for control in (0.01, 1.0)
    )
    for name, values in seldom["/truth"].items():
        every = rows["/truth"][name][::100]
        np.testing.assert_allclose(values, every, rtol=1e-13, atol=1e-16, err_msg=name)


def test_wheels_that_span_too_little_say_so_and_are_saturated(tmp_path: Path) -> None:
    path = satellite(tmp_path, "[[0, 0, 1]]")
    told = (
        r"plant\.wheels\.axes span 1 of 3 directions: .* about \[0\. 1\. 0\.\] and \[1\. 0\. 0\.\]"
    )
    with pytest.warns(ModelWarning, match=told):
        built = assemble(*load(path, ["law.torque=[1e-4, 0, 0]", "duration=2"]))
    _, events = flown(built)
    assert [(time, message) for time, _, _, message in events] == [(0.0, "wheel_0 saturated")]
    with pytest.warns(ModelWarning):
        built = assemble(*load(path, ["law.torque=[0, 0, 1e-4]", "duration=2"]))
    assert not flown(built)[1]


def test_a_fault_begins_and_ends_with_an_integration_step(tmp_path: Path) -> None:
    path = satellite(tmp_path, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
    fault = "faults=[{motor='wheel_2', kind='dead', at='0.33 s', until='1.57 s'}]"
    rows, events = flown(assemble(*load(path, [fault, "law.torque=[0, 0, -3e-5]", "duration=3"])))
    # dead for 1.24 s of 3: J W' = 3e-5 N m against a bus of 0.03 kg m^2
    inertia = 3e-6 * 0.03 / 0.030003
    spun = rows["/truth"]["wheel_speed"][-1, 2] * inertia
    assert spun == pytest.approx(3e-5 * (3.0 - 1.24), rel=1e-3)  # of the bus's other inertia
    assert [time for time, *_ in events] == pytest.approx([0.33, 1.57])


RELAY = [
    *("checks=[]", "duration=0.6", "rates.physics='1 ms'", "initial.euler=[0, 1e-4, 0]"),
    *("initial.rate=[0, 2e-3, 0]", "plant.rcs.delay='50 ms'", "plant.rcs.minimum_on='3 ms'"),
]


@pytest.mark.parametrize("control", ["10 ms", "0.1 s"])
def test_relays_do_not_know_the_control_period(control: str) -> None:
    often, seldom = (
        flown(assemble(*load("rcs-sliding", [*RELAY, f"rates.control='{period}'"])))[0]["/truth"]
        for period in ("1 ms", control)
    )
    every = (len(often["rate"]) - 1) // (len(seldom["rate"]) - 1)
    assert np.count_nonzero(np.diff(np.sign(often["thrust"][:, 4]))) >= 4  # it switches
    for name, values in seldom.items():
        np.testing.assert_array_equal(values, often[name][::every], err_msg=name)


def test_relays_follow_a_reference_that_turns_between_control_instants() -> None:
    turning = ["reference={kind='references:Slew', attitude=[0.999, 0, 0.0447, 0], duration='1 s'}"]
    settings = [*RELAY, *turning, "plant.rcs.thrust=5"]
    often, seldom = (
        flown(assemble(*load("rcs-sliding", [*settings, f"rates.control='{period}'"])))[0]
        for period in ("1 ms", "20 ms")
    )
    # What the relays do not know is how the acceleration changes in 20 ms; 2e-3 with it unknown.
    off = often["/truth"]["attitude"][::20] - seldom["/truth"]["attitude"]
    turned = often["/truth"]["attitude"][-1] - often["/truth"]["attitude"][0]
    assert np.abs(turned).max() > 1e-2
    assert np.abs(off).max() < 3e-4  # 2.1e-4 measured


@pytest.mark.parametrize("step", [4.0, 1.0])
def test_a_relay_is_late_by_half_an_integration_step(step: float) -> None:
    # A swing from and to 5 deg: U |a| + a'^2/2 grows by 2 U (h/2) |a'| at each of two switches,
    # relatively by 2 h |a'| / a0: 7.83e-3 at 4 ms and 1.93e-3 at 1 ms measured.
    settings = ["checks=[]", "duration=8.4", f"rates.physics='{step} ms'", "rates.control='20 ms'"]
    rows, _ = flown(assemble(*load("rcs-centre", settings)))
    start = np.radians(5.0)
    growth = rows["/law"]["angle"][300:, 0].max() / start - 1.0
    assert growth == pytest.approx(2.0 * 1e-3 * step * 0.085277 / start, rel=0.02)


NOISY = """
from typing import NamedTuple
import numpy as np
from mjspace.contract import TorqueCommand

class State(NamedTuple):
    reading: np.ndarray

class Command(NamedTuple):
    none: np.ndarray

class Inner:
    batched = True
    def reset(self, measurement, reference):
        return State(np.zeros_like(measurement.rate))
    def step(self, state, time, measurement, reference):
        return state, Command(np.zeros_like(measurement.rate)), Command(measurement.rate)
    def inner(self, state, time, command, measurement):
        return State(measurement.rate), TorqueCommand(1e-3 * measurement.rate)
"""


def test_an_inner_loop_sees_the_sensors_and_not_the_truth(tmp_path: Path) -> None:
    path = satellite(tmp_path, "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
    (tmp_path / "noisy.py").write_text(NOISY)
    sensor = [
        "sensors.rate={noise_std='0.01 rad/s', period='20 ms'}",
        "law={kind='noisy.py:Inner'}",
    ]
    rows, _ = flown(assemble(*load(path, [*sensor, "duration=1", "rates.control='0.1 s'"])))
    # The state is what the inner loop was shown last, in the step before: the newest sample.
    shown = rows["/state"]["law_reading"][1:]
    true = rows["/truth"]["rate"][1:]
    assert 0.005 < (shown - true).std() < 0.02
    # It is the sample that was taken at 80 ms of the period, and not that of the control instant.
    assert np.abs(shown - rows["/measurement"]["rate"][:-1]).min() > 0.0
