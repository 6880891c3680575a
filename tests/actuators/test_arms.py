"""Robotic arms: the bus turns as the closed forms say, momentum stays, limits hold."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, assert_same, flown
from moving_parts import built

from mjspace.errors import FlightError, InputError
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

pytestmark = SHORT_BLOCKS

LINK = {"length": "1.2 m", "mass": "6 kg", "radius": "50 mm", "torque_limit": "2 N m"}
WHEELLESS: dict[str, Any] = {"wheels": {"axes": []}}
LAW = """
from typing import NamedTuple
import numpy as np
class Command(NamedTuple):
    torque: np.ndarray
    joint_torque: np.ndarray
class Push:
    batched = True
    def __init__(self, amplitude: list, frequency: float = 2.0):
        self.amplitude, self.frequency = np.array(amplitude), frequency
    def reset(self, measurement, reference):
        return None
    def step(self, state, time, measurement, reference):
        rows = measurement.rate.shape[:-1]
        joints = self.amplitude * np.cos(self.frequency * time) + 0.0 * measurement.gimbal_angle
        return None, Command(np.zeros((*rows, 3)), joints), ()
"""


def armed(folder: Path, plant: dict[str, Any], amplitude: list[float], **other: Any) -> Assembly:
    (folder / "push.py").write_text(LAW)
    law = {"kind": "push.py:Push", "amplitude": amplitude}
    return built(plant, folder=folder, law=law, **other)


def one(*links: dict[str, Any], **mount: Any) -> dict[str, Any]:
    return {"arms": {"left": {"links": list(links), **mount}}}


def test_the_bus_turns_by_the_closed_form_of_a_planar_arm(tmp_path: Path) -> None:
    """Without momentum (A + B cos q) theta' = -(Ip + u c^2 + u r c cos q) q', derived here.

    A = I + Ip + u (r^2 + c^2), B = 2 u r c; u is the reduced mass, r the shoulder's distance, c
    half a link. The integral: theta = -q/2 - (Ip + u c^2 - I - u r^2) atan(t tan(q/2))/sqrt(A^2 -
    B^2), with t^2 = (A - B)/(A + B).
    """
    bus, inertia, shoulder, mass, c = 50.0, 8.0, 0.5, 6.0, 0.6
    own = mass * (3.0 * 0.05**2 + 1.2**2) / 12.0
    plant = one(LINK, position=[shoulder, 0, 0]) | {
        "mass": bus,
        "bus_inertia": np.diag([7.0, 9.0, inertia]).tolist(),
    }
    rates = {"physics": 5e-3, "control": 5e-3}
    assembly = armed(tmp_path, plant | WHEELLESS, [1.5], duration=3.0, rates=rates)
    rows = flown(assembly).rows
    q = rows["/truth.gimbal_angle"][:, 0, 0]
    attitude = rows["/truth.attitude"][:, 0]
    reduced = mass * bus / (mass + bus)
    a = inertia + own + reduced * (shoulder**2 + c**2)
    b = 2.0 * reduced * shoulder * c
    turned = np.arctan(np.sqrt((a - b) / (a + b)) * np.tan(0.5 * q)) / np.sqrt(a * a - b * b)
    expected = -0.5 * q - (own + reduced * c**2 - inertia - reduced * shoulder**2) * turned
    assert np.abs(q).max() > 0.2
    # A torque held over steps of 5 ms, in RK4: measured 2e-13.
    assert np.abs(2.0 * np.arctan2(attitude[:, 3], attitude[:, 0]) - expected).max() < 1e-11


def test_momentum_is_conserved_while_an_arm_of_three_joints_moves(tmp_path: Path) -> None:
    axes = ([0, 0, 1], [0, 1, 0], [1, 0, 0])
    plant = one(*(LINK | {"axis": axis} for axis in axes), position=[0.4, 0.1, 0.3])
    assembly = armed(tmp_path, plant, [1.9, 1.0, 0.05], duration=3.0)
    rows = flown(assembly).rows
    assert np.abs(rows["/truth.gimbal_rate"]).max() > 0.5
    # Zero at the start; RK4 at 2 ms.
    assert np.abs(rows["/truth.momentum"]).max() < 1e-9


def test_arms_are_commanded_in_their_order_and_within_their_limits(tmp_path: Path) -> None:
    arms = {
        "left": {"links": [LINK, LINK | {"torque_limit": 0.5}], "position": [0, 0.5, 0]},
        "right": {"links": [{k: v for k, v in LINK.items() if k != "torque_limit"}]},
    }
    assembly = armed(tmp_path, {"arms": arms}, [-3.0, 0.6, 9.0], duration=0.02)
    flight = flown(assembly)
    assert assembly.vehicle.motors[-3:] == ("left_joint_0", "left_joint_1", "right_joint_0")
    assert np.array_equal(flight.rows["/command.applied_joint_torque"][0, 0], [-2.0, 0.5, 9.0])
    told = {event.message for event in flight.events}
    assert told == {"left_joint_0 saturated", "left_joint_1 saturated"}
    assert (
        flight.rows["/truth.gimbal_rate"][-1, 0, 0]
        < 0.0
        < flight.rows["/truth.gimbal_rate"][-1, 0, 2]
    )


def test_an_arm_bolted_on_a_model_of_ones_own_flies_compiled(tmp_path: Path) -> None:
    (tmp_path / "box.xml").write_text(
        '<mujoco><worldbody><body name="hull"><freejoint/>'
        '<geom type="box" size="0.4 0.4 0.4" mass="60"/></body></worldbody></mujoco>'
    )
    plant = one(LINK, LINK | {"axis": [0, 1, 0]}, euler=["20 deg", 0, 0], position=[0.4, 0, 0])
    assembly = armed(tmp_path, {"model": "box.xml"} | plant, [1.5, 0.3], duration=1.0)
    compiled = flown(assembly)
    assert compiled.compiled.startswith("compiled")
    assert_same(compiled, flown(assembly, compiled=False))
    # 60 kg at the origin and 12 kg of the arm: it counts in the inertia of one's own model.
    assert assembly.vehicle.model.body_subtreemass[1] == pytest.approx(72.0)
    assert assembly.vehicle.inertia[2, 2] > 60 * 0.8**2 / 6 + 12.0


def test_a_law_without_joint_torques_is_told_of_the_field() -> None:
    assembly = built(one(LINK))
    with pytest.raises(
        FlightError, match=r"no field 'joint_torque': it must be of shape \(..., 1\)"
    ):
        list(fly(assembly, first_start(assembly, [0]), [0]))


@pytest.mark.parametrize(
    ("plant", "text"),
    [
        (one(), "plant.arms.left.links: got .* at least 1 item"),
        (one(LINK | {"axis": [0, 0, 0]}), "plant.arms.left.links.0.axis"),
        (one(LINK | {"mass": -1}), "plant.arms.left.links.0.mass: got -1"),
        (one({"length": 1.0, "mass": 1.0}), "plant.arms.left.links.0.radius: missing"),
        (
            one(LINK) | WHEELLESS | {"servos": {"wheel_speed": 1.0}},
            "servos and arms are both given|arms and servos",
        ),
    ],
)
def test_unfit_keys_are_refused(plant: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        built(plant)
