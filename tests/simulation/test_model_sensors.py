"""The model's own sensors of forces and accelerations, against closed forms and MuJoCo's own."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from blocks import blocks_of
from compiled_flights import SHORT_BLOCKS, assert_same, flown
from own_models import LAW, SENSED, built, write

from mjspace import attitude
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import start_at

pytestmark = SHORT_BLOCKS

PROBE = """
<mujoco model="probe">
  <worldbody>
    <body name="hub">
      <freejoint/>
      <inertial pos="0 0 0" mass="8" diaginertia="0.2 0.3 0.4"/>
      <geom type="box" size="0.1 0.1 0.1" mass="0"/>
      <site name="imu" pos="0.3 0.1 0" euler="0 0 30"/>
      <site name="jet" pos="0 0 -0.1"/>
      <site name="below" type="box" pos="0 0 -0.1" size="0.15 0.15 0.02"/>
      <body name="mast" pos="0 0 0.1">
        <inertial pos="0 0 0.5" mass="2" diaginertia="0.05 0.05 0.001"/>
        <site name="root" euler="0 90 0"/>
        <site name="tip" pos="0 0 1"/>
      </body>
      <body name="door" pos="0.1 0 0">
        <joint name="door" axis="0 0 1"/>
        <inertial pos="0.4 0 0" mass="0.5" diaginertia="0.001 0.01 0.01"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="jet" site="jet" gear="0 0 1 0 0 0" ctrlrange="0 10"/>
    <motor name="hold" joint="door"/>
  </actuator>
  <sensor>
    <accelerometer name="imu" site="imu"/>
    <framelinacc name="tip" objtype="site" objname="tip"/>
    <frameangacc name="turning" objtype="body" objname="hub"/>
    <force name="root" site="root"/>
    <torque name="bending" site="root"/>
    <touch name="below" site="below"/>
    <jointactuatorfrc name="hinge" joint="door"/>
    <actuatorfrc name="jet" actuator="jet"/>
  </sensor>
</mujoco>
"""
"""A mast that is fixed to a hub, a door on a hinge, and a jet through their centre of mass in x."""
MASS, MAST = 10.5, 2.0  # kg
JET_LAW = """
from typing import NamedTuple
import numpy as np
class Command(NamedTuple):
    thruster_force: np.ndarray
    control: np.ndarray
class Law:
    batched = True
    def reset(self, measurement, reference):
        return None
    def step(self, state, time, measurement, reference):
        rows = measurement.rate.shape[:-1]
        return None, Command(np.full((*rows, 1), FORCE), np.full((*rows, 1), TORQUE)), None
"""
BALANCED = PROBE.replace('pos="0.4 0 0" mass="0.5"', 'pos="0 0 0" mass="0.5"').replace(
    'name="door" pos="0.1 0 0"', 'name="door"'
)
"""With a door whose centre of mass is on the axis of the hub and the mast."""


def probe(
    folder: Path, model: str = PROBE, *, force: float = 0.0, torque: float = 0.0, extra: str = ""
) -> Path:
    """Write the scenario of a probe at rest under constant commands."""
    path = write(folder, model)
    (folder / "law.py").write_text(
        JET_LAW.replace("FORCE", str(force)).replace("TORQUE", str(torque))
    )
    path.write_text(path.read_text().replace("rate = [0.1, -0.2, 0.3]\n", "") + extra)
    return path


def measured(path: Path, *overrides: str) -> dict[str, np.ndarray]:
    return run(path, out=path.parent / "out", overrides=list(overrides)).log.read("/measurement")


def test_an_accelerometer_off_the_centre_of_mass_feels_the_spin(tmp_path: Path) -> None:
    path = probe(tmp_path, BALANCED)
    rate = 2.0  # rad/s, about a principal axis through the centre of mass
    seen = measured(path, f"initial.rate=[0,0,{rate}]", "duration=0.4")
    inwards = -(rate**2) * np.array([0.3, 0.1, 0.0])
    turn = attitude.from_rotation_vector(np.array([0.0, 0.0, np.radians(30.0)]))
    expected = attitude.rotate(attitude.conjugate(turn), inwards)
    # To rounding: the spin is exact.
    np.testing.assert_allclose(seen["imu"], np.tile(expected, (len(seen["imu"]), 1)), atol=1e-12)
    # The force on the mast, whose centre is on the axis, is none; likewise the torque.
    np.testing.assert_allclose(seen["root"], 0.0, atol=1e-12)
    np.testing.assert_allclose(seen["bending"], 0.0, atol=1e-12)


def test_they_tell_of_the_command_that_was_in_force_until_then(tmp_path: Path) -> None:
    path = probe(tmp_path, force=3.0, torque=0.2)
    seen = measured(path, "duration=0.1")
    assert seen["jet"][0] == seen["hinge"][0] == 0.0  # the law has not yet stepped
    np.testing.assert_array_equal(seen["jet"][1:], 3.0)
    np.testing.assert_array_equal(seen["hinge"][1:], 0.2)
    units = run(path, out=tmp_path / "again").log.units["/measurement"]
    assert [units[name] for name in ("imu", "turning", "root", "bending", "hinge")] == [
        *("m/s^2", "rad/s^2", "N", "N m", "N m")
    ]


def test_thrust_over_mass_and_the_force_that_carries_the_mast(tmp_path: Path) -> None:
    path = probe(tmp_path, BALANCED, force=3.0)
    seen = measured(path, "duration=0.2")
    np.testing.assert_allclose(seen["imu"][1:, 2], 3.0 / MASS, rtol=1e-12)
    np.testing.assert_allclose(seen["tip"][1:, 2], 3.0 / MASS, rtol=1e-12)
    # x of the site "root" is down, along -z of the hub.
    np.testing.assert_allclose(seen["root"][1:, 0], -3.0 * MAST / MASS, rtol=1e-12)


@pytest.mark.parametrize("turned", [[1.0, 0.0, 0.0, 0.0], [0.5, 0.1, -0.7, 0.5]])
def test_gravity_is_in_them_as_mujoco_has_its_own(turned: list[float], tmp_path: Path) -> None:
    path = probe(tmp_path, extra="[environment.gravity]\nbody = 'earth'\n")
    assembly = assemble(*load(path))
    model, quat = assembly.vehicle.model, np.array(turned) / np.linalg.norm(turned)
    data = mujoco.MjData(model)
    data.qpos[3:7], data.qvel[:] = quat, 0.3 * np.cos(np.arange(model.nv))
    data.ctrl[:], data.userdata = [4.0, 0.3], assembly.userdata
    row = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, row, mujoco.mjtState.mjSTATE_INTEGRATION)
    read = start_at(assembly, row[None], [0]).actuators
    # The same without our environment, in MuJoCo's uniform gravity.
    gravity = assembly.scenario.environment.gravity.acceleration(np.zeros(3))
    data.userdata[:], model.opt.gravity[:] = 0.0, gravity
    mujoco.mj_forward(model, data)
    model.opt.gravity[:] = 0.0
    for name in ("imu", "tip", "turning", "root", "bending", "hinge", "jet"):
        value, theirs = read[f"model_sensor_{name}"][0], data.sensor(name).data
        # 1 m in 6378 km changes gravity by 3e-7 of it.
        np.testing.assert_allclose(value, theirs, rtol=0, atol=1e-5 * max(1.0, abs(theirs).max()))
    assert abs(read["model_sensor_root"]).max() > 0.5


def test_in_free_fall_nothing_is_felt_and_on_the_ground_its_weight(tmp_path: Path) -> None:
    extra = "[environment.gravity]\n[plant.ground]\n"
    damped = PROBE.replace('axis="0 0 1"', 'axis="0 0 1" damping="1"')
    path = probe(tmp_path, damped, extra=extra)
    g = 1.6242  # m/s^2, the Moon's at the site
    seen = measured(path, "initial.position=[0,0,0.102]", "duration=4")
    np.testing.assert_allclose(seen["root"][0], 0.0, atol=1e-5)
    np.testing.assert_allclose(seen["imu"][0], 0.0, atol=1e-5)
    assert seen["below"][0] == 0.0
    # It stands: the contact is soft and damped.
    np.testing.assert_allclose(seen["imu"][-1], [0.0, 0.0, g], atol=2e-3)
    np.testing.assert_allclose(seen["root"][-1], [-MAST * g, 0.0, 0.0], atol=5e-3)
    np.testing.assert_allclose(seen["below"][-1], [MASS * g], rtol=2e-3)


def test_they_are_compiled_as_in_python_and_replayed(tmp_path: Path) -> None:
    text = SENSED.replace("<sensor>", '<sensor><jointactuatorfrc name="drive" joint="elbow"/>')
    text = text.replace("<sensor>", '<sensor><force name="arm" site="imu"/>')
    assembly = built(tmp_path, "duration=0.6", model=text)
    python = flown(assembly, (0, 1), compiled=False)
    together = flown(assembly, (0, 1), threads=2)
    assert together.compiled.startswith("compiled: sensors, law, actuators and step effects")
    assert_same(together, python)
    assert np.ptp(together.rows["/measurement.drive"]) > 0.01
    law = tmp_path / "law.py"
    law.write_text(law.read_text().replace("torque = -", "torque = -float(time >= 0.1) * "))
    called = assemble(*load(tmp_path / "hold.toml", ["duration=0.3"]))
    assert_same(flown(called), flown(called, compiled=False))
    result = run(tmp_path / "hold.toml", out=tmp_path / "out")
    assert verify(result.path, trust=True) is None
    assert verify(result.path, start=1.0, trust=True) is None


def test_each_is_measured_under_a_name_of_its_own(tmp_path: Path) -> None:
    names = {"time": "model_time", "größe": "gr__e", "class": "model_class", "1st": "model__1st"}
    names |= {"a-b": "a_b", "a.b": "model_a_b", "a b": "model_a_b_", "rate": "model_rate"}
    names["Big"] = "Big"
    sensors = "".join(f'<gyro name="{name}" site="imu"/>' for name in names)
    start, end = SENSED.index("<gyro"), SENSED.index("</sensor>")
    assembly = built(tmp_path, model=SENSED[:start] + sensors + SENSED[end:])
    assert [sensor.field for sensor in assembly.vehicle.own.sensors] == list(names.values())
    (tmp_path / "law.py").write_text(LAW.replace("imu_rate", "Big").replace(
        "measurement.elbow_angle", "measurement.gimbal_angle"
    ).replace("star_tracker", "model_class"))  # fmt: skip
    log = run(tmp_path / "hold.toml", out=tmp_path / "out", overrides=["duration=0.1"]).log
    assert set(names.values()) <= log.read("/measurement").keys()


# Along the jet: through the centre of mass, a gram in each control period.
BURNS = (
    "plant.rcs={positions=[[0,0,-0.1]],directions=[[0,0,1]],thrust=1,specific_impulse=2.0394,"
    "propellant=0.5}"
)


def burning(folder: Path, model: str = BALANCED, *, extra: str = "") -> Path:
    path = probe(folder, model, force=3.0, extra=extra)
    law = folder / "law.py"
    text = law.read_text().replace("class Law", "    on_time: np.ndarray\nclass Law")
    law.write_text(text.replace("0.0)), None", "0.0), np.full((*rows, 1), 0.02)), None"))
    return path


def test_with_masses_that_burn_they_tell_of_those_of_the_instant(tmp_path: Path) -> None:
    path = burning(tmp_path)
    result = run(path, out=tmp_path / "out", overrides=[BURNS, "duration=1"])
    truth = result.log.read("/truth", ["imu", "propellant"])
    mass = MASS + truth["propellant"][:, 0]
    assert mass[0] - mass[-1] == pytest.approx(0.05, rel=1e-3)
    np.testing.assert_allclose(truth["imu"][1:, 2], 4.0 / mass[1:], rtol=1e-9)
    assert verify(result.path, start=0.5, trust=True) is None


@pytest.mark.parametrize("lands", [False, True])
def test_with_masses_that_burn_they_are_compiled_as_in_python(lands: bool, tmp_path: Path) -> None:
    # On the ground the forces of contacts, which depend on what is derived of masses, are felt too.
    damped = PROBE.replace('axis="0 0 1"', 'axis="0 0 1" damping="1"')
    ground = "[environment.gravity]\n[plant.ground]\n"
    path = burning(tmp_path, *([damped] if lands else []), extra=ground if lands else "")
    settings = [BURNS, "duration=1", *(["initial.position=[0,0,0.102]"] if lands else [])]
    built = assemble(*load(path, settings))
    python = flown(built, (0, 1), compiled=False)
    for periods in (7, 40):
        with blocks_of(periods):
            compiled = flown(built, (0, 1), threads=2)
        assert compiled.compiled.startswith("compiled: sensors, law, actuators and step effects")
        assert_same(compiled, python)
    assert bool(python.rows["/measurement.below"].max() > 1.0) is lands


def test_a_scenario_says_how_a_sensor_samples(tmp_path: Path) -> None:
    late = 'accelerometer name="imu" nsample="9" delay="0.02" interval="0.01" '
    plain, delayed = (
        assemble(*load(probe(tmp_path, text, force=3.0), ["duration=0.1"]))
        for text in (PROBE, PROBE.replace('accelerometer name="imu" ', late))
    )
    assert_same(flown(plain), flown(delayed))


def test_a_sensor_that_carries_a_burning_tank_feels_the_weight_that_is_left(tmp_path: Path) -> None:
    """What is between the whole vehicle and nothing is the thrust, whatever it weighs."""
    whole = BALANCED.replace("<sensor>", '<sensor><force name="whole" site="imu"/>')
    path = burning(tmp_path, whole, extra="[environment.gravity]\nbody = 'earth'\n")
    built = assemble(*load(path, [BURNS, "duration=1"]))
    python = flown(built, (0, 1), compiled=False)
    felt = python.rows["/measurement.whole"]
    # 50 g are gone in the end, 0.5 N of weight; MuJoCo's sum of forces rounds 110 N.
    np.testing.assert_allclose(felt[1:, ..., 2], 4.0, atol=1e-9)
    compiled = flown(built, (0, 1), threads=2)
    assert compiled.compiled.startswith("compiled: sensors, law, actuators and step effects")
    assert_same(compiled, python)
