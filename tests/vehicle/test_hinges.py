"""Bearings of a part's hinges: friction, imbalance and stops, on the satellite with a CMG."""

from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment.install import install_callbacks
from mjspace.errors import InputError
from mjspace.scenario.hinges import Hinge
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.vehicle import mass_properties, model_checks

HUGE = (1e8 * np.eye(3)).tolist()
MOTORS = {"pole_pairs": 4, "resistance": 2.5, "inductance": 4.5e-3, "torque_constant": 1.5}


def built(*overrides: str) -> Assembly:
    """Return the satellite with its CMG, disturbed by nothing, its bus without motion."""
    calm = ["plant.ripple={}", "environment.torques=[]", "initial.wheel_speed=[0]"]
    return assemble(*load("dgvscmg-tracking", [*calm, *overrides]))


def coasting(assembly: Assembly, seconds: float) -> Any:
    """Return the model's state after it has coasted, its motors without current."""
    data = at_start(assembly)
    while data.time < seconds - 1e-9:
        mujoco.mj_step(assembly.vehicle.model, data)
    return data


def at_start(assembly: Assembly) -> Any:
    install_callbacks()
    data = mujoco.MjData(assembly.vehicle.model)
    data.qpos[:], data.qvel[:] = assembly.qpos, assembly.qvel
    data.userdata[:] = assembly.userdata
    mujoco.mj_forward(assembly.vehicle.model, data)
    return data


def momentum(assembly: Assembly, data: Any) -> Array:
    """Return the total angular momentum about the centre of mass, inertial axes."""
    mujoco.mj_forward(assembly.vehicle.model, data)
    return np.array(data.sensordata[assembly.vehicle.momentum])


def test_friction_brakes_each_hinge_and_pushes_what_carries_it() -> None:
    flown = built(
        "plant.hinges.cmg_outer={viscous_friction=0.02}",
        "plant.hinges.cmg_wheel={viscous_friction=1e-3, coulomb_friction='5 mN m'}",
        "initial.wheel_speed=[20]",
        "initial.joint_speed.cmg_outer=0.5",
    )
    data = at_start(flown)
    # In the order of the dofs: outer gimbal, inner gimbal, wheel.
    np.testing.assert_allclose(data.qfrc_passive[6:], [-0.01, 0.0, -0.025], rtol=1e-14)
    np.testing.assert_array_equal(data.qfrc_passive[:6], 0.0)
    before = momentum(flown, data)
    after = coasting(flown, 0.5)
    # Rounding: both ends of a bearing have the torque.
    np.testing.assert_allclose(momentum(flown, after), before, atol=1e-14)
    # Against the bus, which hardly moves, J W' = -b W - c: W = (W0 + c/b) exp(-b t/J) - c/b.
    speed = (20.0 + 5.0) * np.exp(-1e-3 * 0.5 / 0.016) - 5.0
    assert after.qvel[8] == pytest.approx(speed, rel=2e-3)


def test_stops_hold_a_gimbal_and_take_its_momentum_to_the_bus() -> None:
    flown = built(
        "plant.hinges.cmg_outer={lower_stop='-20 deg', upper_stop='30 deg'}",
        "initial.joint_speed.cmg_outer=5",
    )
    data = at_start(flown)
    before, farthest = momentum(flown, data), 0.0
    for _ in range(1500):  # 0.15 s: it would turn by 43 deg
        mujoco.mj_step(flown.vehicle.model, data)
        farthest = max(farthest, data.qpos[7])
    # A spring, critically damped, of 5 ms: 5 rad/s x 5 ms / e = 9.2 mrad beyond. It pushes and
    # never pulls, so that after 10 ms the gimbal leaves it, with 1 / e^2 of its rate.
    assert farthest - np.radians(30.0) == pytest.approx(0.0092, rel=0.02)
    assert data.qvel[6] == pytest.approx(-5.0 * np.exp(-2.0), rel=0.02)
    # Rounding; the solver's own tolerance would leave 7e-8 N m s.
    np.testing.assert_allclose(momentum(flown, data), before, atol=1e-12)


def test_a_stop_under_load_yields_little_and_lets_go() -> None:
    flown = built(
        "plant.hinges.cmg_inner={lower_stop=-0.5}", "initial.joint_position.cmg_inner=-0.45"
    )
    data = at_start(flown)
    data.ctrl[1] = -5.0  # N m, as much as the gyroscopic torque that the motors hold
    for _ in range(3000):
        mujoco.mj_step(flown.vehicle.model, data)
    assert -0.501 < data.qpos[8] < -0.5
    data.ctrl[1] = 0.2
    for _ in range(1000):
        mujoco.mj_step(flown.vehicle.model, data)
    assert data.qpos[8] > -0.45


def test_one_stop_leaves_the_other_side_free() -> None:
    model = built("plant.hinges.cmg_outer={upper_stop=1}").vehicle.model
    assert list(model.joint("cmg_outer").range) == [-np.inf, 1.0]
    assert not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    assert built().vehicle.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONSTRAINT


def test_a_wheel_off_balance_pulls_and_twists_with_its_speed_squared() -> None:
    static, dynamic, speed = 2e-5, 1e-5, 73.0  # kg m, kg m^2, rad/s
    flown = built(
        f"plant.bus_inertia={HUGE}",
        "plant.mass=1e9",
        f"plant.hinges.cmg_wheel={{static_imbalance={static}, dynamic_imbalance={dynamic}}}",
        f"initial.wheel_speed=[{speed}]",
    )
    model = flown.vehicle.model
    data = at_start(flown)
    data.qpos[9] = 1.234
    # Gimbals that are held: their motors take what would turn them.
    for _ in range(3):
        mujoco.mj_forward(model, data)
        data.ctrl[:2] -= [0.018 * data.qacc[6], 0.017 * data.qacc[7]]
    force, torque = 1e9 * data.qacc[:3], 1e8 * data.qacc[3:6]
    assert np.linalg.norm(force) == pytest.approx(static * speed**2, rel=1e-6)
    assert np.linalg.norm(torque) == pytest.approx(dynamic * speed**2, rel=1e-6)
    assert abs(torque[0]) < 1e-6 * dynamic * speed**2  # across the spin axis


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [2 / 3, -1 / 3, 2 / 3]])
@pytest.mark.parametrize("moments", [[0.016, 0.016, 0.016], [0.02, 0.03, 0.04]])
def test_imbalance_is_what_was_asked_and_leaves_the_axial_inertia(
    axis: list[float], moments: list[float]
) -> None:
    turn = np.array([0.5, 0.1, -0.7, 0.5])
    body = mass_properties.Inertial(
        1.6, np.zeros(3), np.array(moments), turn / np.linalg.norm(turn)
    )
    bearing = Hinge(static_imbalance=3e-5, dynamic_imbalance=2e-4)
    askew = mass_properties.off_balance(body, np.array(axis), bearing, "there")
    change = mass_properties.tensor(*askew[2:]) - mass_properties.tensor(*body[2:])
    along = np.array(axis)
    assert np.linalg.norm(askew.ipos) == pytest.approx(3e-5 / 1.6, rel=1e-12)
    assert abs(askew.ipos @ along) < 1e-20
    # 1e-17 of rounding
    assert abs(along @ change @ along) < 1e-16
    np.testing.assert_allclose(np.linalg.norm(change @ along), 2e-4, rtol=1e-12)
    assert np.linalg.norm(change, "fro") == pytest.approx(2e-4 * np.sqrt(2.0), rel=1e-12)
    first, second, third = askew.inertia
    assert first + second >= third


def test_a_stopped_step_is_fast_enough_for_imbalance() -> None:
    overrides = ["plant.hinges.cmg_wheel={static_imbalance=1e-5}", "initial.wheel_speed=[73]"]
    with pytest.warns(model_checks.ModelWarning, match="'cmg_wheel' turns an imbalanced body"):
        built(*overrides, "rates.physics='10 ms'", "rates.control='10 ms'", "law.current_gain=100")


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("plant.hinges.cmg_weel={}", "cmg_weel: no such hinge: did you mean 'cmg_wheel'?"),
        ("plant.hinges.wheel_0={}", "have cmg_outer, cmg_inner, cmg_wheel"),
        ("plant.hinges.cmg_outer={lower_stop=1, upper_stop=1}", "lower_stop 1 rad is not below"),
        ("plant.hinges.cmg_wheel={dynamic_imbalance=0.01}", "cmg_wheel.dynamic_imbalance: 0.01"),
    ],
)
def test_hinges_that_cannot_be_are_refused(override: str, message: str) -> None:
    with pytest.raises(InputError) as told:
        built(override)
    assert message in str(told.value)
    assert "\n" not in str(told.value)
