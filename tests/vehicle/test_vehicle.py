"""The vehicle as compiled: mass properties, momentum, reaction, imbalance."""

import warnings
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjspace.actuators.reaction_wheels import Wheels
from mjspace.contract import Array
from mjspace.scenario.plant import Initial, Part, PlantTable, Rates
from mjspace.vehicle import model_checks
from mjspace.vehicle import vehicle as plant

PAPER = [[15.0, 5.0, 5.0], [5.0, 10.0, 7.0], [5.0, 7.0, 20.0]]  # H of papers 000 and 002
PYRAMID = [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [1.0, -1.0, 1.0]]
AWAY = [[0.3, 0.0, 0.1], [0.0, 0.2, -0.1], [-0.1, 0.05, 0.4]]  # m

finite = st.floats(-1.0, 1.0)
vectors = arrays(float, 3, elements=finite)
matrices = arrays(float, (3, 3), elements=finite)


def build(**table: Any) -> plant.Vehicle:
    return plant.build(PlantTable(**table), Rates(), userdata=0)


def mass_matrix(model: Any) -> Array:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix


def at(vehicle: plant.Vehicle, initial: Initial) -> Any:
    data = mujoco.MjData(vehicle.model)
    data.qpos[:], data.qvel[:] = plant.initial_state(vehicle, initial)
    mujoco.mj_forward(vehicle.model, data)
    return data


def whole(vehicle: plant.Vehicle) -> Array:
    """Return H0, the inertia of the whole vehicle with its wheels locked."""
    axial = vehicle.wheel_axes.T * vehicle.wheel_inertia @ vehicle.wheel_axes
    result: Array = vehicle.inertia + axial
    return result


@settings(max_examples=60, deadline=None)
@given(root=matrices.map(lambda root: root.round(3)), positions=st.sampled_from([None, AWAY]))
def test_any_gyrostat_inertia_is_what_mujoco_flies(root: Array, positions: Any) -> None:
    # At least 2 kg m^2 about each axis leaves a bus once the wheels' share is taken off. To MuJoCo
    # axes that are within 1.4e-6 of the principal ones are those (mju_eig3): hence the rounding.
    wanted = 10.0 * root @ root.T + 2.0 * np.eye(3)
    wanted = (wanted + wanted.T) / 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", plant.UnphysicalInertiaWarning)
        vehicle = build(gyrostat_inertia=wanted.tolist(), wheels=Wheels(positions=positions))
    np.testing.assert_array_equal(vehicle.inertia, wanted)
    matrix = mass_matrix(vehicle.model)
    # A few roundings of a moment of up to 32 kg m^2, each 7e-15.
    np.testing.assert_allclose(matrix[3:6, 3:6], whole(vehicle), rtol=0.0, atol=1e-13)
    # The origin is the centre of mass: rotation carries no linear momentum.
    np.testing.assert_allclose(matrix[0:3, 3:6], 0.0, atol=1e-14)


@settings(max_examples=30, deadline=None)
@given(root=matrices, axes=st.sampled_from([PYRAMID, np.eye(3).tolist(), [[0.0, 0.6, 0.8]]]))
def test_inertia_from_the_bus_is_what_mujoco_flies(root: Array, axes: Any) -> None:
    inertia = 10.0 * root @ root.T + np.eye(3)
    inertia = (inertia + inertia.T) / 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", plant.UnphysicalInertiaWarning)
        vehicle = build(bus_inertia=inertia.tolist(), wheels=Wheels(axes=axes, mass=5.0))
    block = mass_matrix(vehicle.model)[3:6, 3:6]
    np.testing.assert_allclose(block, whole(vehicle), rtol=0.0, atol=1e-13)  # as above


def test_paper_matrix_flies_as_printed_and_says_so() -> None:
    with pytest.warns(plant.UnphysicalInertiaWarning, match=r"5\.6586 11\.8982 27\.2932.*9\.736"):
        vehicle = build(gyrostat_inertia=PAPER)
    meant = build(gyrostat_inertia=PAPER, impossible_inertia=True)  # or the warning is an error
    np.testing.assert_array_equal(meant.model.body_inertia, vehicle.model.body_inertia)
    block = mass_matrix(vehicle.model)[3:6, 3:6]
    # H0 = H + Jw 1, equations/attitude.md section 4; measured 1e-14.
    np.testing.assert_allclose(block, np.array(PAPER) + 0.05 * np.eye(3), rtol=0.0, atol=1e-13)


def test_unphysical_inertia_survives_the_log() -> None:
    with pytest.warns(plant.UnphysicalInertiaWarning):
        model = build(gyrostat_inertia=PAPER).model
    mjb = plant.to_mjb(model)
    again = plant.from_mjb(mjb)
    np.testing.assert_array_equal(mass_matrix(again), mass_matrix(model))
    assert plant.to_mjb(again) == mjb


def test_own_inertia_of_the_asset_is_kept() -> None:
    np.testing.assert_allclose(
        build().model.body("bus").inertia, [12.0, 15.0, 18.0], rtol=1e-15
    )  # the asset's, ascending


def test_wheels_too_heavy_for_the_inertia_are_refused_with_what_fits() -> None:
    small = np.diag([0.05, 0.06, 0.07]).tolist()
    with pytest.raises(ValueError, match=r"wheel inertia below 0\.05 kg"):
        build(gyrostat_inertia=small, wheels=Wheels(inertia=0.06))
    with pytest.warns(plant.UnphysicalInertiaWarning):
        build(gyrostat_inertia=small, wheels=Wheels(inertia=0.0499))


def test_wheels_too_far_out_are_refused() -> None:
    small = np.diag([0.15, 0.16, 0.17]).tolist()
    with pytest.raises(ValueError, match="use lighter wheels or place them nearer"):
        build(gyrostat_inertia=small, wheels=Wheels(positions=AWAY))


@pytest.mark.parametrize(
    ("wheels", "message"),
    [
        ({"transverse_inertia": 0.02}, "less than half the axial"),
        (
            {"dynamic_imbalance": 0.02},
            r"plant\.wheels\.dynamic_imbalance: 0\.02 .* rotating body, 0\.0025 kg",
        ),
    ],
)
def test_rotors_that_cannot_be_are_refused(wheels: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build(wheels=Wheels(**wheels))


def test_unknown_model_lists_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"no model 'cubesat': have .*satellite_3rw"):
        build(model="cubesat")


@settings(max_examples=60, deadline=None)
@given(momentum=vectors, rate=vectors, euler=vectors, velocity=vectors, case=st.integers(0, 2))
def test_wheel_speeds_make_the_wanted_momentum(
    momentum: Array, rate: Array, euler: Array, velocity: Array, case: int
) -> None:
    wheels = (Wheels(), Wheels(axes=PYRAMID), Wheels(positions=AWAY))[case]
    data = at(
        vehicle := build(wheels=wheels),
        Initial(
            momentum=momentum.tolist(),
            rate=rate.tolist(),
            euler=euler.tolist(),
            velocity=velocity.tolist(),
            position=[3.0, -2.0, 1.0],
        ),
    )
    # About 30 N m s of bus momentum cancel, each rounded at 4e-15; measured 3e-14.
    np.testing.assert_allclose(data.sensordata[vehicle.momentum], momentum, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(data.qvel[0:6], [*velocity, *rate])


def test_wheel_speeds_are_those_of_the_gyrostat_equations() -> None:
    with pytest.warns(plant.UnphysicalInertiaWarning):
        vehicle = build(gyrostat_inertia=PAPER)
    data = at(vehicle, Initial(momentum=[1.0, -1.0, 0.0], rate=[0.2, -0.142, 0.0]))
    # Omega = (p - H w) / Jw - w, attitude.md section 1; p / Jw = 20 rad/s is rounded at 4e-15.
    np.testing.assert_allclose(data.qvel[6:], [-26.0, -11.458, -0.12], rtol=0.0, atol=1e-12)


def test_four_wheels_take_the_smallest_speeds() -> None:
    vehicle = build(wheels=Wheels(axes=PYRAMID))
    speeds = at(vehicle, Initial(momentum=[1.0, 2.0, 3.0])).qvel[vehicle.wheel_dof]
    # The pyramid's null motion is (1, -1, 1, -1): the least speeds have none; 70 rad/s at 1e-16.
    assert abs(speeds @ [1.0, -1.0, 1.0, -1.0]) < 1e-12


def test_momentum_out_of_the_wheels_reach_is_refused() -> None:
    vehicle = build(wheels=Wheels(axes=[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    with pytest.raises(ValueError, match="cannot make"):
        plant.initial_state(vehicle, Initial(momentum=[0.0, 0.0, 1.0]))
    plant.initial_state(vehicle, Initial(momentum=[1.0, 1.0, 0.0]))


def test_speeds_must_fit_the_wheels() -> None:
    vehicle = build(wheels=Wheels(speed_limit=100.0))
    with pytest.raises(ValueError, match="2 speeds for 3 wheels"):
        plant.initial_state(vehicle, Initial(wheel_speed=[1.0, 2.0]))
    with pytest.raises(ValueError, match=r"-?101 rad/s, above .*100 rad/s"):
        plant.initial_state(vehicle, Initial(wheel_speed=[1.0, -101.0, 0.0]))


def test_euler_angles_are_yaw_pitch_roll() -> None:
    roll, pitch, yaw = 0.3, -0.5, 2.0
    cosine, sine = np.cos, np.sin
    rx = np.array([[1, 0, 0], [0, cosine(roll), -sine(roll)], [0, sine(roll), cosine(roll)]])
    ry = np.array([[cosine(pitch), 0, sine(pitch)], [0, 1, 0], [-sine(pitch), 0, cosine(pitch)]])
    rz = np.array([[cosine(yaw), -sine(yaw), 0], [sine(yaw), cosine(yaw), 0], [0, 0, 1]])
    data = at(build(), Initial(euler=[roll, pitch, yaw]))
    # Products of three rotations, each rounded at 1e-16.
    np.testing.assert_allclose(data.body("bus").xmat.reshape(3, 3), rz @ ry @ rx, atol=1e-15)


@pytest.mark.parametrize(
    "wheels",
    [Wheels(), Wheels(axes=PYRAMID, positions=[*AWAY, [0.0, 0.0, -0.3]], viscous_friction=1e-3)],
)
def test_momentum_is_conserved_without_torque(wheels: Wheels) -> None:
    vehicle = build(wheels=wheels)
    wanted = [1.0, -2.0, 3.0]
    data = at(vehicle, Initial(rate=[0.1, 0.2, -0.3], momentum=wanted))
    mujoco.mj_step(vehicle.model, data, 3000)
    mujoco.mj_forward(vehicle.model, data)
    # Precession below 0.5 rad/s: RK4 is exact at 1 ms; 3000 roundings of 4e-16 add up to 1e-12.
    np.testing.assert_allclose(data.sensordata[vehicle.momentum], wanted, rtol=0.0, atol=1e-11)


def test_a_motor_turns_the_bus_as_much_as_its_rotor() -> None:
    vehicle = build(bus_inertia=np.diag([15.0, 12.0, 18.0]).tolist(), wheels=Wheels(inertia=0.05))
    data = mujoco.MjData(vehicle.model)
    torque, time = 0.2, 5.0
    data.ctrl[0] = torque
    mujoco.mj_step(vehicle.model, data, 5000)
    # About x the bus and the two other rotors, across, have 15.05 kg m^2: their rate is -T t / I,
    # and the wheel's relative to the bus T t / Jw more. Armature would leave the bus at rest.
    np.testing.assert_allclose(data.qvel[3], -torque * time / 15.05, rtol=1e-11)
    np.testing.assert_allclose(
        data.qvel[vehicle.wheel_dof[0]], torque * time * (1 / 0.05 + 1 / 15.05), rtol=1e-11
    )


def test_friction_brakes_a_wheel_against_the_bus() -> None:
    vehicle = build(
        bus_inertia=np.diag([15.0, 12.0, 18.0]).tolist(), wheels=Wheels(viscous_friction=0.01)
    )
    data = at(vehicle, Initial(wheel_speed=[10.0, 0.0, 0.0]))
    mujoco.mj_step(vehicle.model, data, 5000)
    # Relative speed decays at c (1/Jw + 1/I); RK4's error per second is (0.2 dt)^4, far below.
    expected = 10.0 * np.exp(-0.01 * (1 / 0.05 + 1 / 15.05) * 5.0)
    np.testing.assert_allclose(data.qvel[vehicle.wheel_dof[0]], expected, rtol=1e-11)


def test_torque_limit_holds_in_the_model_too() -> None:
    vehicle = build(wheels=Wheels(torque_limit=0.1))
    data = mujoco.MjData(vehicle.model)
    data.ctrl[:] = [5.0, -5.0, 0.05]
    mujoco.mj_forward(vehicle.model, data)
    np.testing.assert_array_equal(data.actuator_force, [0.1, -0.1, 0.05])


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 2.0, -2.0]])
def test_static_imbalance_pulls_with_its_speed_squared(axis: list[float]) -> None:
    speed, imbalance = 300.0, 2e-5  # rad/s, kg m
    vehicle = build(wheels=Wheels(axes=[axis], static_imbalance=imbalance), mass=1e9)
    data = at(vehicle, Initial(wheel_speed=[speed]))
    data.qpos[7:] = 1.234
    mujoco.mj_forward(vehicle.model, data)
    # So heavy a bus stands still but for what the rotor pulls: Us W^2, across the spin axis. The
    # bus gives way by 2 kg in 1e9 kg.
    force = 1e9 * data.qacc[0:3]
    np.testing.assert_allclose(np.linalg.norm(force), imbalance * speed**2, rtol=1e-7)
    assert abs(force @ vehicle.wheel_axes[0]) < 1e-7 * imbalance * speed**2


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 2.0, -2.0]])
def test_dynamic_imbalance_twists_with_its_speed_squared(axis: list[float]) -> None:
    speed, imbalance = 300.0, 2e-6  # rad/s, kg m^2
    huge = 1e8 * np.eye(3)
    vehicle = build(
        wheels=Wheels(axes=[axis], dynamic_imbalance=imbalance), bus_inertia=huge.tolist()
    )
    data = at(vehicle, Initial(wheel_speed=[speed]))
    torque = 1e8 * data.qacc[3:6]
    # Ud W^2, across the spin axis; the bus gives way by 0.05 in 1e8 kg m^2.
    np.testing.assert_allclose(np.linalg.norm(torque), imbalance * speed**2, rtol=1e-8)
    assert abs(torque @ vehicle.wheel_axes[0]) < 1e-8 * imbalance * speed**2


def test_imbalance_leaves_an_unphysical_inertia_as_it_is() -> None:
    with pytest.warns(plant.UnphysicalInertiaWarning):
        vehicle = build(gyrostat_inertia=PAPER, wheels=Wheels(dynamic_imbalance=1e-4))
    block = mass_matrix(vehicle.model)[3:6, 3:6]
    # A disc has no length, and 0.025 kg m^2 of spread across its axis: to be askew by Ud it needs
    # a length of Ud^2 / 0.025 = 4e-7 kg m^2, which counts about both axes across.
    np.testing.assert_allclose(np.abs(block - whole(vehicle)).max(), 1e-4, rtol=1e-2)
    np.testing.assert_allclose(np.trace(block - whole(vehicle)), 3 * 2 * 4e-7, rtol=1e-3)


def test_a_vehicle_cannot_be_changed() -> None:
    vehicle = build()
    with pytest.raises(ValueError, match="read-only"):
        vehicle.inertia[0, 0] = 1.0


def test_the_table_decides_rates_and_user_data() -> None:
    rates = Rates(physics=2e-3, control=1e-2, integrator="implicitfast")
    with pytest.warns(model_checks.ModelWarning, match="first order"):
        model = plant.build(PlantTable(), rates, userdata=7).model
    assert model.opt.timestep == 2e-3
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert model.nuserdata == 7


def test_parts_are_bolted_on_after_the_wheels() -> None:
    parts = {
        "damper": Part(part="tube_damper", position=[0.0, 0.8, 0.0], euler=[0.0, np.pi / 2, 0.0]),
        "ring": Part(part="ring_damper"),
    }
    bare, fitted = build(), build(parts=parts)
    assert list(fitted.wheel_dof) == list(bare.wheel_dof)
    assert fitted.model.nv == bare.model.nv + 2
    assert fitted.model.body_mass.sum() == pytest.approx(bare.model.body_mass.sum() + 0.1 + 1.2)
    np.testing.assert_array_equal(fitted.inertia, bare.inertia)
    data = mujoco.MjData(fitted.model)
    mujoco.mj_kinematics(fitted.model, data)
    np.testing.assert_allclose(data.body("damper_ball").xpos, [0.0, 0.8, 0.0], atol=1e-15)
    # the tube's z is turned to the bus's x
    np.testing.assert_allclose(data.joint("damper_slide").xaxis, [1.0, 0.0, 0.0], atol=1e-15)


def test_a_part_with_a_constraint_has_it_enforced() -> None:
    disabled = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    assert build().model.opt.disableflags & disabled
    model = build(parts={"cord": Part(part="yo_yo")}).model
    assert not model.opt.disableflags & disabled
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT


def test_an_unknown_part_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(
        ValueError, match=r"plant\.parts\.it\.part: no part 'solar_sail': have antenna, boom"
    ):
        build(parts={"it": Part(part="solar_sail")})


def test_a_part_s_name_is_an_identifier() -> None:
    with pytest.raises(ValueError, match="pattern"):
        PlantTable(parts={"my damper": Part(part="ring_damper")})


def test_wheels_that_are_not_alike_leave_the_vehicle_its_inertia() -> None:
    inertia, mass = [0.05, 0.08, 0.02, 0.06], [2.0, 3.0, 1.0, 2.5]
    places = [[0.3, 0.0, 0.1], [0.0, 0.2, 0.0], [-0.1, 0.0, -0.2], [0.0, -0.4, 0.3]]
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    wheels = Wheels.model_validate(
        {
            "axes": axes,
            "positions": places,
            "inertia": inertia,
            "mass": mass,
            "speed_limit": [9] * 4,
        }
    )
    vehicle = build(wheels=wheels)
    data = mujoco.MjData(vehicle.model)
    mujoco.mj_forward(vehicle.model, data)
    matrix = np.zeros((3, vehicle.model.nv))
    mujoco.mj_angmomMat(vehicle.model, data, matrix, vehicle.model.body("bus").id)
    of_wheels = vehicle.wheel_axes.T @ (np.array(inertia)[:, None] * vehicle.wheel_axes)
    np.testing.assert_allclose(matrix[:, 3:6], vehicle.inertia + of_wheels, atol=1e-13)
    np.testing.assert_allclose(data.subtree_com[1], 0.0, atol=1e-15)
    assert vehicle.wheel_inertia.tolist() == inertia
    assert vehicle.model.body("wheel_1").mass[0] == 3.0
    with pytest.raises(ValueError, match=r"above plant\.wheels\.speed_limit 9 rad/s"):
        plant.initial_state(vehicle, Initial(wheel_speed=[0.0, 0.0, 9.5, 0.0]))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("inertia", [0.05, 0.05], "inertia: 2 numbers for 3 axes: give one, or as many"),
        ("mass", [], "mass: 0 numbers for 3 axes"),
        ("torque_limit", -1, "got -1, should be greater than 0"),
        ("speed_limit", True, "got True, should be a valid number"),
    ],
)
def test_numbers_of_wheels_that_do_not_fit_are_refused(key: str, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Wheels.model_validate({key: value})
