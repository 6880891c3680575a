"""Other spacecraft beside the vehicle: where they begin, what they are, and what is refused."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from own_models import HOLD, SENSED, built

from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.vehicle.other_spacecraft import OtherSpacecraft
from mjspace.vehicle.vehicle import inertials

TARGET = "plant.spacecraft.target={mass=4,inertia=[[2,0.3,0],[0.3,1,0],[0,0,1.5]]"
PORTS = ",ports={p={position=[-0.3,0.1,0],euler=['20 deg',0,'30 deg']}}}"
DOCKED = [
    TARGET + PORTS,
    "plant.ports.q={body='arm',position=[0,0,0.3],euler=[0,'-70 deg',0]}",
    "plant.connections.c={between=['q','target_p'],closed=true,frequency=0.5}",
]
TWO = """<mujoco model="docked">
  <option gravity="0 0 0" timestep="0.004"/>
  <worldbody>
    <body name="a"><freejoint/>
      <geom type="box" size="0.5 0.5 0.5" density="100"/><site name="pa" pos="0 0 -0.5"/></body>
    <body name="b/1" pos="0 0 -1"><freejoint/>
      <geom type="box" size="0.5 0.5 0.5" density="100"/><site name="pb" pos="0 0 0.5"/></body>
  </worldbody>
  <equality><weld site1="pa" site2="pb"/></equality>
</mujoco>"""
COAST = "law={kind='coast:Coast'}"


def test_one_that_begins_docked_moves_with_its_port(tmp_path: Path) -> None:
    moving = ["initial.joint_speed={elbow=0.7}", "initial.velocity=[0.1,0,0.3]"]
    assembled = built(tmp_path, *DOCKED, *moving)
    model, data = assembled.vehicle.model, mujoco.MjData(assembled.vehicle.model)
    data.qpos, data.qvel = assembled.qpos, assembled.qvel
    mujoco.mj_forward(model, data)
    ports = [data.site(name) for name in ("q", "target_p")]
    np.testing.assert_allclose(ports[0].xpos, ports[1].xpos, atol=1e-14)
    np.testing.assert_allclose(ports[0].xmat, ports[1].xmat, atol=1e-14)
    velocities = np.zeros((2, 6))
    for velocity, port in zip(velocities, ports, strict=True):
        kind = int(mujoco.mjtObj.mjOBJ_SITE)
        mujoco.mj_objectVelocity(model, data, kind, port.id, velocity, 0)
    np.testing.assert_allclose(velocities[0], velocities[1], atol=1e-14)
    assert np.abs(velocities[0]).min() > 0.01


def test_the_vehicles_own_inertia_leaves_the_others_out(tmp_path: Path) -> None:
    alone, docked = built(tmp_path), built(tmp_path, *DOCKED)
    np.testing.assert_array_equal(alone.vehicle.inertia, docked.vehicle.inertia)
    model = docked.vehicle.model
    body = model.body("target").id
    assert model.body_mass[body] == 4.0
    inertial = inertials(model)  # of the vehicle: the target is another
    assert "target" not in inertial
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[body])
    turned = axes.reshape(3, 3) @ np.diag(model.body_inertia[body]) @ axes.reshape(3, 3).T
    np.testing.assert_allclose(turned, [[2, 0.3, 0], [0.3, 1, 0], [0, 0, 1.5]], atol=1e-12)
    assert model.sensor("momentum").objid[0] == 0  # of all that flies


def test_a_state_of_its_own(tmp_path: Path) -> None:
    state = ",position=[3,2,1],euler=[0,0,'90 deg'],velocity=[0,0.1,0],rate=[0.2,0,0]}"
    assembled = built(tmp_path, TARGET + state)
    joint = assembled.vehicle.model.joint("target")
    pose = assembled.qpos[joint.qposadr[0] :]
    np.testing.assert_allclose(pose, [3, 2, 1, np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-15)
    np.testing.assert_array_equal(assembled.qvel[joint.dofadr[0] :], [0, 0.1, 0, 0.2, 0, 0])


def two(folder: Path, *overrides: str) -> Assembly:
    (folder / "sensed.xml").write_text(TWO)
    (folder / "law.py").write_text("")
    (folder / "hold.toml").write_text(HOLD)
    return assemble(*load(folder / "hold.toml", [COAST, *overrides]))


def test_two_free_bodies_of_a_model_are_two_spacecraft(tmp_path: Path) -> None:
    assembled = two(tmp_path)
    assert [sensor.field for sensor in assembled.vehicle.relative] == [
        *("b_1_position", "b_1_attitude", "b_1_velocity", "b_1_rate")
    ]
    blocks = list(fly(assembled, first_start(assembled, (0,)), (0,)))
    truth = {
        name: np.concatenate([block.rows["/truth"][name] for block in blocks])
        for name in ("b_1_position", "momentum")
    }
    # They begin apart in speed, by 0.22 m/s and 0.37 rad/s, which the weld takes out within 8 ms.
    apart = np.abs(truth["b_1_position"][:, 0] - [0, 0, -1])
    assert apart.max() < 2e-3
    assert apart[10:].max() < 1e-5
    drift = np.abs(truth["momentum"] - truth["momentum"][0]).max()
    assert drift < 1e-3 * np.abs(truth["momentum"]).max()  # while it yields, and of MuJoCo's weld
    assert np.abs(truth["momentum"]).max() > 3.0  # of both about their common centre


def test_a_models_second_body_takes_a_state_and_ports(tmp_path: Path) -> None:
    table = (
        "plant.spacecraft={b={position=[0,0,-3],ports={x={}}}}",
        "plant.roles.bus='a'",
    )
    (tmp_path / "sensed.xml").write_text(TWO)
    text = TWO.replace("b/1", "b")
    (tmp_path / "sensed.xml").write_text(text)
    (tmp_path / "law.py").write_text("")
    (tmp_path / "hold.toml").write_text(HOLD)
    assembled = assemble(*load(tmp_path / "hold.toml", [COAST, *table]))
    assert assembled.qpos[9] == -3.0
    assert assembled.vehicle.model.site("b_x").bodyid[0] == assembled.vehicle.model.body("b").id


CONNECTED = "plant.connections.c={between=['q','target_p'],closed=true}"
PORT = "plant.ports.q={}"


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["plant.spacecraft.target={mass=4}"], "mass and inertia: give both"),
        (["plant.spacecraft.target={}"], "plant.spacecraft.target: give mass and inertia"),
        ([TARGET.replace("target", "arm") + "}"], "arm: the model has a body of that name"),
        ([TARGET.replace("target", "elbow") + "}"], "elbow: the model has a joint of that name"),
        (
            ["plant.spacecraft.target={mass=4,inertia=[[1,0,0],[0,1,0],[0,0,2.1]]}"],
            "plant.spacecraft.target.inertia: no rigid body has the principal moments 1, 1, 2.1 "
            "kg m^2: the largest exceeds the sum of the others by 0.1",
        ),
        (
            ["plant.spacecraft.target={mass=4,inertia=[[1,2,0],[2,1,0],[0,0,2]]}"],
            "plant.spacecraft.target.inertia: not positive definite",
        ),
        (
            [TARGET + PORTS, PORT, CONNECTED.replace(".c=", ".target=")],
            "plant.connections.target: target_position is measured of plant.spacecraft.target too",
        ),
        (
            [TARGET.replace("target", "orbit") + "}"],
            "plant.spacecraft.orbit: orbit_position is a name of mjspace's own: call it otherwise",
        ),
        (
            [TARGET.replace("target", "imu") + "}"],
            "plant.spacecraft.imu: imu_rate is a sensor of plant.model: call it otherwise",
        ),
        (
            [TARGET + PORTS, "plant.ports.target_p={}"],
            "plant.ports.target_p: there is a site 'target_p' already: call it otherwise",
        ),
        (
            [TARGET + ",ports={a_b={}}}", TARGET.replace("target", "target_a") + ",ports={b={}}}"],
            "plant.spacecraft.target_a.ports.b: there is a site 'target_a_b' already",
        ),
        (
            [TARGET + "}", "sensors.target_rate.measures=rate"],
            "sensors.target_rate: the model has a sensor of that name",
        ),
        (
            [TARGET + PORTS, PORT, CONNECTED, "sensors.c_closed.measures=rate"],
            "sensors.c_closed: the model has a sensor of that name",
        ),
        ([TARGET + ",size=[1,2]}"], "size: 2 sides, should be 3"),
        ([TARGET + ",euler=[0,0,0],attitude=[1,0,0,0]}"], "attitude and euler are both given"),
        (["plant.ports.imu={}"], "plant.ports.imu: there is a site 'imu' already"),
        (["plant.ports.q={body='amr'}"], "plant.ports.q: no body 'amr': did you mean 'arm'"),
        (
            [TARGET + ",velocity=[1,0,0],ports={p={}}}", PORT, CONNECTED],
            "spacecraft.target: it begins docked, by connections.c: leave out its position",
        ),
        (
            [TARGET + PORTS, PORT, CONNECTED, CONNECTED.replace(".c=", ".d=")],
            "connections.d: target begins docked by c already",
        ),
        (
            [TARGET + PORTS, PORT, CONNECTED.replace("'q'", "'g'")],
            "connections.c: between: no port 'g'",
        ),
        (
            [f"{TARGET}{PORTS}", "initial.joint_position={target=1}"],
            "initial.joint_position: no hinge or slide 'target'",
        ),
        (
            ["plant.connections.c={between=['a','b'],springs={stiffness=1,stroke=1}}"],
            "springs: they push once the connection opens: give opens_at",
        ),
    ],
)
def test_unfit_spacecraft_are_refused(tmp_path: Path, overrides: list[str], message: str) -> None:
    with pytest.raises(InputError) as error:
        built(tmp_path, *overrides)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_sensor_of_ones_own_keeps_its_name(tmp_path: Path) -> None:
    model = SENSED.replace('"star-tracker"', '"c-closed"')
    settings = [TARGET + PORTS, PORT, CONNECTED]
    with pytest.raises(InputError, match=r"connections\.c: c_closed is a sensor of plant"):
        built(tmp_path, *settings, model=model)


@given(st.integers(0, 10**6))
def test_a_plate_however_it_is_turned_is_a_body(seed: int) -> None:
    # Its largest moment is the sum of the others: rounded, MuJoCo would refuse it.
    axes = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    inertia = axes @ np.diag([1.0, 2.0, 3.0]) @ axes.T
    inertia = 0.5 * (inertia + inertia.T)
    spec = mujoco.MjSpec()
    bus = spec.worldbody.add_body(name="bus")
    table = OtherSpacecraft.model_validate({"mass": 5.0, "inertia": inertia.tolist()})
    table.attach(spec, "plate", bus)
    moments = spec.compile().body("plate").inertia
    np.testing.assert_allclose(np.sort(moments), [1.0, 2.0, 3.0], rtol=1e-12)
