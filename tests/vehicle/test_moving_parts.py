"""Moving parts bolted on anywhere: momentum, a batch, and where they stand among the joints."""

from typing import Any

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, flown
from hypothesis import given, settings
from hypothesis import strategies as st
from moving_parts import PANEL, SIDES, built

from mjspace.errors import InputError

pytestmark = SHORT_BLOCKS

place = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3)
turn = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3)
mounts = st.fixed_dictionaries({"position": place, "euler": turn})
small = st.floats(-0.1, 0.1)
slow = st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3)


@settings(deadline=None, max_examples=10)
@given(mounts, mounts, mounts, small, small, slow)
def test_momentum_is_conserved_wherever_they_are_bolted_on(
    panel: dict[str, Any],
    spring: dict[str, Any],
    pendulum: dict[str, Any],
    bent: float,
    off: float,
    rate: list[float],
) -> None:
    # The body turns so slowly that the pendulum stays far from 90 deg, where it is singular.
    plant = {
        "panels": {"wing": PANEL | {"segments": 2} | panel},
        "slosh": {
            "full": {"model": "spring", "mass": 8.0, "frequency": 0.4} | spring,
            "empty": {"model": "pendulum", "mass": 3.0, "arm": 0.3} | pendulum,
        },
    }
    joints = {"wing_hinge_1": bent, "full_slide_y": off, "empty_swing_x": off}
    initial = {"joint_position": joints, "rate": rate}
    rows = flown(built(plant, initial=initial, duration=0.5)).rows
    momentum = rows["/truth.momentum"][:, 0]
    # RK4 at 2 ms and 3 Hz of the panel's second mode: 6e-9 was the largest of 400.
    assert np.abs(momentum - momentum[0]).max() < 2e-8


def test_each_vehicle_of_a_batch_moves_as_alone() -> None:
    start = {"joint_position": {"left_hinge_0": 0.05}}
    tank = {"tank": {"model": "spring", "mass": 5.0, "frequency": 0.5}}
    assembly = built({"panels": {"left": PANEL | SIDES["left"]}, "slosh": tank}, initial=start)
    alone, three = flown(assembly), flown(assembly, (0, 1, 2))
    for field in ("left_deflection", "left_hinge_angle", "tank_displacement"):
        values = three.rows[f"/truth.{field}"]
        assert values.shape[1] == 3
        assert values[:, 2].tobytes() == alone.rows[f"/truth.{field}"][:, 0].tobytes()


def test_they_come_behind_the_joints_and_motors_that_a_vehicle_has() -> None:
    parts = {"damper": {"part": "tube_damper"}}
    plain = built({"parts": parts}).vehicle
    moving: dict[str, Any] = {
        "panels": {"a": PANEL | {"segments": 1}},
        "slosh": {"b": {"model": "spring", "mass": 1.0, "frequency": 1.0}},
        "arms": {"c": {"links": [{"length": 1.0, "mass": 1.0, "radius": 0.05}]}},
    }
    both = built({"parts": parts} | moving).vehicle

    def names(vehicle: Any) -> list[str]:
        return [vehicle.model.joint(i).name for i in range(vehicle.model.njnt)]

    new = ["a_hinge_0", "b_slide_x", "b_slide_y", "c_joint_0"]
    assert sorted(names(both)) == sorted([*names(plain), *new])
    assert [name for name in names(both) if name not in new] == names(plain)
    assert both.motors == (*plain.motors, "c_joint_0")
    assert both.model.actuator("wheel_2").id == plain.model.actuator("wheel_2").id


def test_a_bearing_may_be_given_to_a_panels_hinge() -> None:
    left = {"panels": {"left": PANEL | SIDES["left"]}}
    model = built(left | {"hinges": {"left_hinge_3": {"viscous_friction": 0.5}}}).vehicle.model
    assert model.dof_damping[model.joint("left_hinge_3").dofadr[0]] == 0.5
    with pytest.raises(InputError, match=r"plant.hinges.left_hinge_9: no such hinge.*left_hinge_"):
        built(left | {"hinges": {"left_hinge_9": {"viscous_friction": 0.5}}})
