"""A user's own model as the plant: it flies as what it is, and again from its log."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from compiled_flights import assert_same, flown
from own_models import SENSED, built, source, write

from mjspace import attitude
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.scenario.plant import PlantTable, Rates
from mjspace.simulation.assembly import assemble
from mjspace.vehicle.vehicle import Vehicle, build


def vehicle(text: str, **table: Any) -> Vehicle:
    plant = PlantTable(model="model.xml", **table)
    return build(plant, Rates(), userdata=0, source=source(text))


def test_momentum_is_held_and_the_log_flies_again(tmp_path: Path) -> None:
    result = run(write(tmp_path), out=tmp_path / "out")
    assert result.passed
    log = result.log
    assert "model/sensed.xml" in log.attachments
    truth = log.read("/truth", ["momentum", "wheel_speed", "gimbal_angle"])
    assert np.abs(truth["wheel_speed"][-1]).min() > 1e-3
    assert verify(result.path, trust=True) is None
    assert verify(result.path, start=1.0, trust=True) is None


def test_a_jet_alone_changes_the_momentum(tmp_path: Path) -> None:
    path = write(tmp_path)
    law = tmp_path / "law.py"
    still = law.read_text().replace("(*rows, 1), 3.0)", "(*rows, 1), 0.0)")
    log = run(path, out=tmp_path / "a").log
    pushed = log.read("/truth")
    assert log.read("/command", ["applied_force"])["applied_force"].max() == 2.0  # of 3 N
    law.write_text(still)
    held = run(path, out=tmp_path / "b").log.read("/truth", ["momentum"])["momentum"]
    assert np.abs(held - held[0]).max() < 1e-9 * np.abs(held).max()  # RK4, with a servo at 4 ms
    # 2 N at its limit along x, for 20 ms.
    center = np.array([0.01, 0.01, 0.185]) / 9.1
    arm = np.array([0.0, 0.02, -0.15]) - center
    gained = pushed["momentum"][1] - pushed["momentum"][0]
    np.testing.assert_allclose(gained, np.cross(arm, [0.04, 0.0, 0.0]), atol=1e-4)


def test_it_is_flown_compiled_as_in_python_and_in_a_batch(tmp_path: Path) -> None:
    assembly = built(tmp_path, "duration=0.6")
    python = flown(assembly, (0, 1), compiled=False)
    for threads in (1, 2):
        together = flown(assembly, (0, 1), threads=threads)
        assert together.compiled == (
            "compiled: sensors, law, actuators and step effects (the model's own sensors)"
        )
        assert_same(together, python)
    assert flown(assembly).bits(0) == python.bits(0)


def test_its_sensors_are_measured_under_their_names(tmp_path: Path) -> None:
    result = run(write(tmp_path), out=tmp_path / "out")
    seen = result.log.read("/measurement")
    assert {"imu_rate", "star_tracker", "elbow_angle", "model_rate"} <= seen.keys()
    units = result.log.units["/measurement"]
    assert (units["imu_rate"], units["elbow_angle"]) == ("rad/s", "rad")
    assert "acceleration" in seen
    turn = attitude.from_rotation_vector(np.array([0.0, 0.0, np.radians(30.0)]))
    back = attitude.conjugate(turn)
    np.testing.assert_allclose(seen["imu_rate"], attitude.rotate(back, seen["rate"]), atol=1e-14)
    seen_by_tracker = attitude.multiply(seen["attitude"], turn)
    off = attitude.rotation_angle(seen["star_tracker"], seen_by_tracker)
    assert off.max() < 1e-7  # of the angle's cosine
    np.testing.assert_array_equal(seen["elbow_angle"], seen["gimbal_angle"])
    assert np.ptp(seen["elbow_angle"]) > 0.01
    # At the instant of the law's step, the first among them, not a step before.
    np.testing.assert_array_equal(result.log.read("/law")["seen"], seen["star_tracker"])
    assert seen["imu_rate"][0] @ seen["imu_rate"][0] == pytest.approx(0.14, rel=1e-12)


def test_its_mass_properties_are_the_models() -> None:
    own = vehicle(SENSED)
    data = mujoco.MjData(own.model)
    mujoco.mj_forward(own.model, data)
    # By MuJoCo: the momentum of a turn of the whole about each axis, less that of the wheels.
    matrix = np.zeros((3, own.model.nv))
    mujoco.mj_angmomMat(own.model, data, matrix, own.model.body("hub").id)
    whole = own.inertia + own.wheel_axes.T @ (own.wheel_inertia[:, None] * own.wheel_axes)
    np.testing.assert_allclose(whole, matrix[:, 3:6], atol=1e-14)
    np.testing.assert_allclose(own.wheel_axes, np.eye(3), atol=1e-15)


def test_armature_is_left_out_on_request() -> None:
    text = SENSED.replace('axis="1 0 0"', 'axis="1 0 0" armature="0.01"')
    with pytest.raises(ValueError, match="joint 'rw1' has armature"):
        vehicle(text)
    assert not vehicle(text, without_armature=True).model.dof_armature.any()


def test_what_the_scenario_has_itself_is_replaced() -> None:
    text = SENSED.replace(
        '<option timestep="0.004"/>',
        '<option timestep="0.004" gravity="0 0 -9.81" density="1.2" viscosity="1e-5" wind="1 0 0"/>'
        '<keyframe><key qpos="0 0 5 1 0 0 0 0 0 0 0"/></keyframe>',
    )
    model = vehicle(text).model
    assert not model.opt.gravity.any()
    assert (model.opt.density, model.opt.viscosity, model.nkey) == (0.0, 0.0, 0)
    assert model.opt.timestep == Rates().physics
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
    assert model.camera("chase").bodyid[0] == model.body("hub").id


def test_stops_of_its_joints_hold_and_keep_the_momentum(tmp_path: Path) -> None:
    text = SENSED.replace('name="elbow" axis="0 1 0"', 'name="elbow" axis="0 1 0" range="-1 2"')
    path = write(tmp_path, text)
    law = tmp_path / "law.py"
    law.write_text(law.read_text().replace("(*rows, 1), 3.0)", "(*rows, 1), 0.0)"))
    truth = run(path, out=tmp_path / "out").log.read("/truth", ["gimbal_angle", "momentum"])
    assert 2.0 < np.degrees(truth["gimbal_angle"].max()) < 2.5  # the servo presses on it
    change = np.abs(truth["momentum"] - truth["momentum"][0]).max()
    assert change < 1e-6 * np.abs(truth["momentum"]).max()  # where it hits, RK4 is of no order


def test_a_cubesat_of_plain_mjcf_is_the_one_that_is_composed_of_our_parts(tmp_path: Path) -> None:
    parts = """plant={model="satellite_3rw",mass=9.6,
        bus_inertia=[[0.128,0,0],[0,0.104,0],[0,0,0.057]],
        magnetorquers={dipole_limit="0.2 A m^2"},
        wheels={inertia=2.8e-5,transverse_inertia=1.5e-5,mass=0.12,torque_limit="4 mN m",
          axes=[[2,0,SQRT2],[0,2,SQRT2],[-2,0,SQRT2],[0,-2,SQRT2]],
          positions=[[0.03,0,-0.08],[0,0.03,-0.08],[-0.03,0,-0.08],[0,-0.03,-0.08]]}}"""
    parts = " ".join(parts.replace("SQRT2", repr(2.0**0.5)).split())
    short = ["duration=300", "checks=[]"]
    own = run("cubesat-6u", out=tmp_path / "own", overrides=short).log
    composed = run("cubesat-6u", out=tmp_path / "composed", overrides=[*short, parts]).log
    fields = ["attitude", "wheel_speed"]
    ours, theirs = own.read("/truth", fields), composed.read("/truth", fields)
    dot = np.abs(np.sum(ours["attitude"] * theirs["attitude"], axis=-1))
    cross = attitude.multiply(attitude.conjugate(ours["attitude"]), theirs["attitude"])[:, 1:]
    angle = 2.0 * np.arctan2(np.linalg.norm(cross, axis=-1), dot)
    assert angle.max() < 1e-9
    assert np.ptp(ours["wheel_speed"], axis=0).min() > 1.0
    np.testing.assert_allclose(ours["wheel_speed"], theirs["wheel_speed"], rtol=0, atol=1e-6)


def test_a_function_may_build_it_and_its_log_holds_no_code_of_that(tmp_path: Path) -> None:
    path = write(tmp_path)
    (tmp_path / "shape.stl").write_bytes(_stl())
    (tmp_path / "sensed.xml").unlink()
    (tmp_path / "car.py").write_text(
        "import mujoco\n"
        "def build():\n"
        f"    spec = mujoco.MjSpec.from_string('''{SENSED}''')\n"
        "    spec.add_mesh(name='shape', file='shape.stl')\n"
        "    mesh = mujoco.mjtGeom.mjGEOM_MESH\n"
        "    spec.body('hub').add_geom(type=mesh, meshname='shape', mass=0.1)\n"
        "    return spec\n"
    )
    result = run(path, out=tmp_path / "out", overrides=["plant.model=car.py:build", "duration=0.5"])
    assert {"model/built.xml", "model/shape.stl"} <= set(result.log.attachments)
    assert "model.py" not in result.log.attachments
    (tmp_path / "shape.stl").unlink()
    assert verify(result.path, trust=True) is None


def test_a_urdf_gets_a_free_bus_and_wheels(tmp_path: Path) -> None:
    (tmp_path / "craft.urdf").write_text(URDF)
    write(tmp_path)
    law = (tmp_path / "law.py").read_text()
    only = law.replace("measurement.imu_rate", "measurement.rate").replace(
        "control = 0.3 - measurement.elbow_angle", "control = force"
    )
    (tmp_path / "law.py").write_text(only.replace("measurement.star_tracker", "measurement.rate"))
    plant = 'plant={model="craft.urdf",roles={bus="bus",wheels=["spin_*"]}}'
    result = run(tmp_path / "hold.toml", out=tmp_path / "out", overrides=[plant])
    assert result.passed
    applied = result.log.read("/command", ["wheel_torque"])["wheel_torque"]
    assert np.abs(applied).max() == pytest.approx(0.005)  # the joint's effort
    assert verify(result.path, trust=True) is None


def test_a_model_without_motors_drifts(tmp_path: Path) -> None:
    start, end = SENSED.index("<actuator>"), SENSED.index("</actuator>")
    path = write(tmp_path, SENSED[:start] + "<actuator>" + SENSED[end:])
    result = run(path, out=tmp_path / "out", overrides=["law={kind='coast:Coast'}"])
    momentum = result.log.read("/truth", ["momentum"])["momentum"]
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.abs(momentum).max()
    assert verify(result.path) is None


def test_equipment_is_bolted_on_it(tmp_path: Path) -> None:
    path = write(tmp_path)
    law = tmp_path / "law.py"
    text = law.read_text().replace("control: np", "on_time: np.ndarray\n    control: np")
    law.write_text(text.replace("force, control)", "0.0 * force, 0.01 + 0.0 * force, control)"))
    rcs = "plant.rcs={positions=[[0.1,0,0]],directions=[[0,1,0]],thrust=1}"
    damper = "plant.parts.damper={part='tube_damper',position=[0,0,0.1]}"
    result = run(path, out=tmp_path / "out", overrides=[rcs, damper])
    assert result.passed
    command = result.log.read("/command", ["thruster_thrust", "applied_force"])
    assert command["thruster_thrust"][:-1].mean() == pytest.approx(1.0)
    assert not command["applied_force"].any()
    assert built(tmp_path, rcs, damper).vehicle.model.body("damper_ball").parentid[0] == 1
    assert verify(result.path, trust=True) is None


def test_its_joints_are_named_as_it_names_them(tmp_path: Path) -> None:
    """A name of capitals, dots and spaces in bearings and at the start, and again from the log."""
    path = write(tmp_path, SENSED.replace('"elbow"', '"Panel-1.Elbow a"'))
    tables = """
    [plant.hinges."Panel-1.Elbow a"]
    viscous_friction = 0.02
    [initial.joint_position]
    "Panel-1.Elbow a" = 0.4
    [initial.joint_speed]
    "Panel-1.Elbow a" = -0.3
    """
    path.write_text(path.read_text() + "\n".join(map(str.strip, tables.splitlines())))
    model = assemble(*load(path)).vehicle.model
    dof = model.joint("Panel-1.Elbow a").dofadr[0]
    assert model.dof_damping[dof] == pytest.approx(0.03)  # with that of its own
    result = run(path, out=tmp_path / "out", overrides=["duration=0.5"])
    truth = result.log.read("/truth", ["gimbal_angle", "gimbal_rate"])
    assert (truth["gimbal_angle"][0, 0], truth["gimbal_rate"][0, 0]) == (0.4, -0.3)
    assert verify(result.path, trust=True) is None


OWN = "plant={{model='sensed.xml',{}}}"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("plant.model=nothing.xml", r"plant\.model: no file .*nothing\.xml"),
        ("plant.model=x.mjb", r"plant\.model: x\.mjb is compiled, and nothing can be added to it"),
        ("plant.model=hold.toml", r"plant\.model: no model 'hold\.toml': have lander"),
        (
            "initial.joint_speed.Elbow=1",
            r"initial\.joint_speed: no hinge or slide 'Elbow': did you",
        ),
        ("initial.joint_position.hub=1", r"initial\.joint_position: no hinge or slide 'hub': have"),
        (
            OWN.format("hinges={Elbow={}}"),
            r"plant\.hinges\.Elbow: no such hinge: did you mean 'elb",
        ),
        (OWN.format("mass=3"), r"plant\.mass: the model sensed\.xml states it"),
        (
            "plant={model='sensed.xml',roles={wheels=['q']}}",
            r"plant\.roles\.wheels: 'q' matches no",
        ),
        (
            "plant={model='sensed.xml',roles={wheel=['q']}}",
            r"plant\.roles\.wheel: no such key: did",
        ),
        (
            OWN.format("wheels={axes=[[1,0,0]],positions=[[0,0,0]]}"),
            r"are both logged as command\.wheel_torque",
        ),
        (
            "plant.model=law.py:Law",
            r"plant\.model: law\.py:Law returned a Law, should be an mujoco",
        ),
        ("plant.model=law.py:None_", r"plant\.model: 'law\.py' has no 'None_'"),
    ],
)
def test_a_model_that_cannot_be_is_one_line(
    override: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message) as refused:
        assemble(*load(write(tmp_path), [override]))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("</worldbody>", ""), "XML parse error|mismatched tag"),
        (('joint="rw1"', 'joint="rwx"'), "plant.model: .*rwx"),
        (('mass="8"', 'mass="0"'), "mass and inertia of moving bodies must be larger"),
        (('name="rw1" axis="1 0 0"', 'name="rw1" axis="1 0 0" armature="0.1"'), "has armature 0.1"),
    ],
)
def test_a_faulty_file_is_one_line(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    assert change[0] in SENSED
    with pytest.raises(InputError, match=message):
        built(tmp_path, model=SENSED.replace(*change))


def _stl() -> bytes:
    """Return a tetrahedron."""
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], np.float32)
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    normal = np.zeros(3, np.float32).tobytes()
    rows = (normal + corners[list(face)].tobytes() + b"\0\0" for face in faces)
    return bytes(80) + np.uint32(4).tobytes() + b"".join(rows)


def _link(name: str, mass: float, inertia: float) -> str:
    moments = " ".join(f'{axis}="{inertia}"' for axis in ("ixx", "iyy", "izz"))
    return (
        f'<link name="{name}"><inertial><mass value="{mass}"/><origin xyz="0 0 0"/>'
        f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _spin(name: str, axis: str) -> str:
    return (
        f'<joint name="spin_{name}" type="continuous"><parent link="bus"/><child link="{name}"/>'
        f'<axis xyz="{axis}"/><limit effort="0.005" velocity="600"/></joint>'
    )


URDF = (
    '<robot name="craft">'
    + _link("bus", 12.0, 0.25)
    + "".join(_link(name, 0.4, 0.0005) for name in "abc")
    + "".join(_spin(*each) for each in (("a", "1 0 0"), ("b", "0 1 0"), ("c", "0 0 1")))
    + "</robot>"
)
