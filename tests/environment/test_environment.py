"""What acts on a vehicle from outside is what mechanics says, at every stage of the integrator."""

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np
import pytest
from mujoco import batch
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.base import MAGIC
from mjspace.environment.constants import GM
from mjspace.environment.disturbance_torque import DisturbanceTorque, Sine
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.scenario.environment import Environment
from mjspace.scenario.hinges import Hinge
from mjspace.scenario.plant import PlantTable

CIRCULAR = Orbit(semi_major_axis=7.0e6)
ELLIPTIC = Orbit(
    body="moon",
    semi_major_axis=3.0e6,
    eccentricity=0.3,
    inclination=0.9,
    ascending_node=2.0,
    periapsis=-1.0,
    true_anomaly=0.4,
)
RATE = np.sqrt(GM["earth"] / 7.0e6**3)  # rad/s, of CIRCULAR: a period of 5829 s
TUMBLING = [0.8, -0.2, 0.4, 0.4]  # a unit quaternion

OPTION = """
<option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/>
</option>"""
BODY = f"""<mujoco>{OPTION}
<worldbody><body name="bus"><freejoint/>
  <inertial pos="0 0 0" mass="50" fullinertia="12 14 5 0.7 -0.4 1.1"/>
</body></worldbody>
<sensor><user name="environment" dim="6" needstage="vel"/></sensor></mujoco>"""
INERTIA = np.array([[12.0, 0.7, -0.4], [0.7, 14.0, 1.1], [-0.4, 1.1, 5.0]])
WHEEL = f"""<mujoco>{OPTION}
<worldbody><body name="bus"><freejoint/><inertial pos="0 0 0" mass="50" diaginertia="9 8 7"/>
  <body><joint name="wheel_0" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="2" diaginertia="0.03 0.03 0.05"/></body>
</body></worldbody>
<sensor><subtreeangmom body="bus"/></sensor></mujoco>"""
# Two trees, every kind of joint, a welded body, a massless one and one that cannot move
CHAIN = f"""<mujoco>{OPTION}
<worldbody>
  <body name="fixed" pos="7 7 7"><inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/></body>
  <body name="bus" pos="3 -200 900"><freejoint/>
    <inertial pos="4 0.1 -2" mass="50" diaginertia="12 14 5"/>
    <body name="welded" pos="0 90 0" euler="20 30 40">
      <inertial pos="1 2 3" mass="5" diaginertia="1 2 2.5"/>
      <body name="swung" pos="300 0 0"><joint type="ball"/>
        <inertial pos="0 80 0" mass="4" diaginertia="2 3 4"/>
        <body name="massless" euler="40 10 5">
          <body name="slid" pos="0 0 60"><joint axis="1 2 3"/><joint type="slide" axis="1 1 0"/>
            <inertial pos="10 20 0" mass="6" diaginertia="4 3 2"/></body></body></body></body>
  </body>
  <body name="mast"><joint axis="0 1 0"/>
    <inertial pos="0 0 400" mass="8" diaginertia="9 8 7"/></body>
</worldbody></mujoco>"""


@pytest.fixture(autouse=True, scope="module")
def _installed() -> None:
    install_callbacks()


def compiled(
    xml: str,
    outside: Environment,
    plant: PlantTable | None = None,
    step: float = 1.0,
) -> tuple[Any, Any]:
    """Return the model of ``xml`` and its data, whose userdata holds this environment."""
    spec = mujoco.MjSpec.from_string(xml)
    spec.option.timestep = step
    spec.nuserdata = userdata_size(outside, plant)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, outside, plant)
    return model, data


def rough(friction: Mapping[str, float]) -> PlantTable:
    """Return a plant with this Coulomb friction [N m] of its hinges."""
    hinges = {name: Hinge(coulomb_friction=torque) for name, torque in friction.items()}
    return PlantTable(hinges=hinges)


def axes(quaternion: Array) -> Array:
    """Return the matrix whose columns are the body's axes, in inertial axes."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quaternion) / np.linalg.norm(quaternion))
    return matrix.reshape(3, 3)


def angle_between(first: Array, second: Array) -> float:
    """Return the angle [rad] of the rotation between two attitudes."""
    difference = np.empty(3)
    mujoco.mju_subQuat(difference, first, second / np.linalg.norm(second))
    return float(np.linalg.norm(difference))


def two_body(place: Array, orbit: Orbit) -> Array:
    return -GM[orbit.body] * place / np.linalg.norm(place) ** 3


def velocity_at(orbit: Orbit, time: float) -> Array:
    """Return the orbital velocity [m/s], from a central difference of eighth order."""
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
    return weights @ orbit_position(orbit, time + 10.0 * np.arange(-4, 5)) / 10.0


def libration(orbit: Orbit, rate: Array, duration: float) -> Array:
    """Return the attitude of ``BODY`` after ``duration`` [s], integrated without MuJoCo.

    The orbit is Newton's two-body problem, so that no solution of Kepler's equation enters.
    """

    def motion(_: float, state: Array) -> Array:
        place, velocity, q, w = state[:3], state[3:6], state[6:10], state[10:]
        up = axes(q).T @ place / np.linalg.norm(place)
        gradient = 3.0 * GM[orbit.body] / np.linalg.norm(place) ** 3
        torque = gradient * np.cross(up, INERTIA @ up)
        w_dot = np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))
        q_dot = 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])
        return np.concatenate([velocity, two_body(place, orbit), q_dot, w_dot])

    start = [*orbit_position(orbit, 0.0), *velocity_at(orbit, 0.0), *TUMBLING, *rate]
    return solve_ivp(motion, (0.0, duration), start, "DOP853", rtol=1e-13, atol=1e-13).y[6:10, -1]


def flown(orbit: Orbit, rate: Array, duration: float, step: float) -> Array:
    model, data = compiled(BODY, Environment(orbit=orbit), step=step)
    data.qpos[3:7] = TUMBLING
    data.qvel[3:6] = rate
    mujoco.mj_step(model, data, round(duration / step))
    assert np.abs(data.qpos[:3]).max() == 0.0  # the origin of the frame is in free fall
    return data.qpos[3:7].copy()


@pytest.mark.parametrize("orbit", [CIRCULAR, ELLIPTIC], ids=["circular", "elliptic"])
def test_three_axis_libration(orbit: Orbit) -> None:
    rate = RATE * np.array([0.3, -1.2, 0.5])
    expected = libration(orbit, rate, 6000.0)
    # RK4 of motion at no more than 3 n: 3 n t (3 n h)^4 / 120 = 7e-10 rad; measured 3e-12 and 2e-12
    assert angle_between(flown(orbit, rate, 6000.0, 2.5), expected) < 5e-11


def test_fourth_order_in_the_step() -> None:
    rate = RATE * np.array([0.3, -1.2, 0.5])
    expected = libration(ELLIPTIC, rate, 6400.0)
    steps = np.array([80.0, 40.0, 20.0])
    errors = [angle_between(flown(ELLIPTIC, rate, 6400.0, step), expected) for step in steps]
    orders = -np.diff(np.log2(errors))
    # a torque held over the step, or evaluated at the wrong stage time, gives 1
    assert np.all(np.abs(orders - 4.0) < 0.1), orders


def test_pitch_libration_frequency() -> None:
    roll, pitch, yaw, amplitude, step = 12.0, 14.0, 5.0, np.radians(1.0), 5.0
    xml = BODY.replace('fullinertia="12 14 5 0.7 -0.4 1.1"', 'diaginertia="12 14 5"')
    model, data = compiled(xml, Environment(orbit=CIRCULAR), step=step)
    # body axes along the velocity (y), minus the orbit normal (-z) and the nadir (-x), then pitched
    lvlh = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    pitched = axes(np.array([np.cos(amplitude / 2), 0.0, np.sin(amplitude / 2), 0.0]))
    mujoco.mju_mat2Quat(data.qpos[3:7], (lvlh @ pitched).ravel())
    data.qvel[4] = -RATE
    angles, rates = [], []
    for k in range(4001):
        zenith = axes(data.qpos[3:7]) @ [0.0, 0.0, -1.0]
        behind = RATE * k * step - np.arctan2(zenith[1], zenith[0])
        angles.append(np.remainder(behind + np.pi, 2 * np.pi) - np.pi)
        rates.append(data.qvel[4] + RATE)
        mujoco.mj_step(model, data)
    # zero crossings of the cubic through both ends' angles and rates
    crossings = []
    for k in np.flatnonzero(np.diff(np.sign(angles))).tolist():
        a, b, u, v = angles[k], angles[k + 1], step * rates[k], step * rates[k + 1]
        cubic = np.roots([2 * (a - b) + u + v, 3 * (b - a) - 2 * u - v, u, a])
        inside = cubic[(abs(cubic.imag) < 1e-9) & (abs(cubic.real - 0.5) <= 0.5)]
        crossings.append((k + inside[0].real) * step)
    half_period = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    # a pendulum of twice the pitch angle: its period is longer by 2 K(sin^2 A) / pi
    frequency = np.pi / half_period * ellipk(np.sin(amplitude) ** 2) * 2.0 / np.pi
    assert len(crossings) == 8
    # RK4: (1.22 n h)^4 / 120 = 1.6e-11, which is what is measured
    assert frequency == pytest.approx(RATE * np.sqrt(3.0 * (roll - yaw) / pitch), rel=1e-10)


@pytest.mark.parametrize("orbit", [CIRCULAR, ELLIPTIC], ids=["circular", "elliptic"])
def test_gradient_torque_of_one_body(orbit: Orbit) -> None:
    model, data = compiled(BODY, Environment(orbit=orbit))
    data.qpos[3:7], data.time = TUMBLING, 700.0
    mujoco.mj_forward(model, data)
    place = orbit_position(orbit, 700.0)
    up = axes(TUMBLING).T @ place / np.linalg.norm(place)
    expected = 3.0 * GM[orbit.body] / np.linalg.norm(place) ** 3 * np.cross(up, INERTIA @ up)
    np.testing.assert_array_equal(data.qfrc_passive[:3], 0.0)
    # rounding of some hundred operations, MuJoCo's principal axes among them; measured 7e-15
    np.testing.assert_allclose(data.qfrc_passive[3:], expected, rtol=1e-13)


def test_dumbbell_feels_what_a_body_of_its_inertia_feels() -> None:
    xml = f"""<mujoco>{OPTION}<worldbody><body><freejoint/>
      <inertial pos="0.8 0 0.6" mass="10" diaginertia="0.01 0.01 0.01"/>
      <body><joint axis="0 1 0"/>
        <inertial pos="-0.8 0 -0.6" mass="10" diaginertia="0.01 0.01 0.01"/></body>
      </body></worldbody></mujoco>"""
    model, data = compiled(xml, Environment(orbit=CIRCULAR))
    data.qpos[3:7] = TUMBLING
    mujoco.mj_forward(model, data)
    arm = np.array([0.8, 0.0, 0.6])
    inertia = 20.0 * (np.eye(3) - np.outer(arm, arm))
    up = axes(TUMBLING).T @ [1.0, 0.0, 0.0]
    expected = 3.0 * RATE**2 * np.cross(up, inertia @ up)
    # what is left out is of order (1 m / 7e6 m)^2 = 2e-14
    np.testing.assert_allclose(data.qfrc_passive[3:6], expected, rtol=1e-12)
    # each half is pulled on its own: the hinge carries half of the torque about its axis, to 1e-7
    assert data.qfrc_passive[6] == pytest.approx(expected[1] / 2, rel=1e-6)
    # and the net force is of second order, 1e-7 of the tidal force on one half
    assert np.abs(data.qfrc_passive[:3]).max() < 1e-6 * 10 * RATE**2


def test_every_dof_takes_its_share() -> None:
    model, data = compiled(CHAIN, Environment(orbit=ELLIPTIC))
    generator = np.random.default_rng(3)
    mujoco.mj_integratePos(model, data.qpos, generator.normal(size=model.nv), 1.0)
    data.time = 40.0
    mujoco.mj_forward(model, data)
    origin = orbit_position(ELLIPTIC, 40.0)
    expected = np.zeros(model.nv)
    for body in range(1, model.nbody):
        translation, rotation = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBodyCom(model, data, translation, rotation, body)
        place = origin + data.xipos[body]
        gravity = two_body(place, ELLIPTIC) - two_body(origin, ELLIPTIC)
        principal = data.ximat[body].reshape(3, 3)
        inertia = principal * model.body_inertia[body] @ principal.T
        factor = 3.0 * GM["moon"] / np.linalg.norm(place) ** 5
        torque = factor * np.cross(place, inertia @ place)
        expected += translation.T @ (model.body_mass[body] * gravity) + rotation.T @ torque
    # the reference cancels: 0.6 m/s^2 at 1e-16, times some 70 kg and arms of up to 1 km
    np.testing.assert_allclose(data.qfrc_passive, expected, rtol=0, atol=3e-11)
    assert np.abs(expected).min() > 1e-6  # no dof is left alone


def test_small_offsets_do_not_cancel() -> None:
    model, data = compiled(BODY, Environment(orbit=CIRCULAR))
    data.qpos[:3] = offset = np.array([2.0, -3.0, 5.0]) * 1e-4
    mujoco.mj_forward(model, data)
    expected = -50.0 * RATE**2 * (offset - 3.0 * np.array([offset[0], 0.0, 0.0]))
    # the next order is 3/2 d/R = 1e-10; the difference of two accelerations is good to 1e-6 only
    np.testing.assert_allclose(data.qfrc_passive[:3], expected, rtol=1e-9)


def test_free_fall_beside_the_reference_is_another_kepler_orbit() -> None:
    other = ELLIPTIC.model_copy(update={"eccentricity": 0.304, "inclination": 0.895})
    model, data = compiled(BODY, Environment(orbit=ELLIPTIC), step=2.0)
    data.qpos[:3] = orbit_position(other, 0.0) - orbit_position(ELLIPTIC, 0.0)
    data.qvel[:3] = velocity_at(other, 0.0) - velocity_at(ELLIPTIC, 0.0)
    mujoco.mj_step(model, data, 7000)
    expected = orbit_position(other, 14e3) - orbit_position(ELLIPTIC, 14e3)
    assert np.linalg.norm(expected) > 1e4
    # velocities good to 1e-10 m/s grow to some 3e-6 m over two orbits; measured 1e-6
    assert np.linalg.norm(data.qpos[:3] - expected) < 1e-5


SINES = [
    Sine(amplitude=[0.1, -0.2, 0.3], frequency=0.7, phase=[0.3, 1.0, -2.0]),
    Sine(amplitude=[0.0, 0.4, 0.1], frequency=1.9, phase=[0.0, -0.5, 0.9]),
]
BIAS = np.array([0.02, -0.05, 0.03])


def torque_at(time: float) -> Array:
    sines = [
        np.multiply(s.amplitude, np.sin(s.frequency * time + np.array(s.phase))) for s in SINES
    ]
    return BIAS + np.sum(sines, axis=0)


def impulse(time: float) -> Array:
    """Return the integral of ``torque_at`` from 0 to ``time`` [N m s]."""
    total = BIAS * time
    for s in SINES:
        end = np.cos(s.frequency * time + np.array(s.phase))
        total = total + np.multiply(s.amplitude, np.cos(s.phase) - end) / s.frequency
    return total


def test_body_torque_on_one_axis_integrates_to_its_impulse() -> None:
    keep = np.array([0.0, 0.0, 1.0])
    sines = [s.model_copy(update={"amplitude": [0.0, 0.0, s.amplitude[2]]}) for s in SINES]
    torque = DisturbanceTorque(bias=list(BIAS * keep), sines=sines)
    xml = BODY.replace('fullinertia="12 14 5 0.7 -0.4 1.1"', 'diaginertia="12 14 5"')
    model, data = compiled(xml, Environment(torques=[torque]), step=0.01)
    mujoco.mj_step(model, data, 3000)
    # RK4 of a function of time is Simpson's rule: (frequency h)^4 / 2880 = 5e-11 of some 0.5 N m s
    assert 5.0 * data.qvel[5] == pytest.approx(impulse(30.0)[2], abs=2e-11)
    np.testing.assert_array_equal(data.qvel[3:5], 0.0)


def test_inertial_torque_adds_its_impulse_to_the_momentum() -> None:
    torque = DisturbanceTorque(frame="inertial", bias=list(BIAS), sines=SINES)
    model, data = compiled(BODY, Environment(torques=[torque]), step=0.01)
    data.qpos[3:7], data.qvel[3:6] = TUMBLING, [0.3, -0.1, 0.2]
    before = axes(data.qpos[3:7]) @ INERTIA @ data.qvel[3:6]
    mujoco.mj_step(model, data, 3000)
    after = axes(data.qpos[3:7]) @ INERTIA @ data.qvel[3:6]
    # RK4 of the tumble at some 0.5 rad/s: w t (w h)^4 / 120 = 8e-11 of 4 N m s; measured 3e-11
    np.testing.assert_allclose(after - before, impulse(30.0), rtol=0, atol=3e-10)


def test_frames_and_several_torques_add_up() -> None:
    body = DisturbanceTorque(bias=list(BIAS), sines=SINES)
    inertial = DisturbanceTorque(frame="inertial", bias=[0.5, 0.1, -0.2])
    model, data = compiled(BODY, Environment(torques=[body, inertial, body]), step=0.01)
    data.qpos[3:7], data.time = TUMBLING, 1.23
    mujoco.mj_forward(model, data)
    expected = np.asarray(2.0 * torque_at(1.23)) + axes(TUMBLING).T @ np.array([0.5, 0.1, -0.2])
    np.testing.assert_allclose(data.qfrc_passive[3:], expected, atol=1e-15)  # 1 ulp of 1
    np.testing.assert_array_equal(data.qfrc_passive[:3], 0.0)


def test_time_is_a_whole_number_of_half_steps() -> None:
    torque = DisturbanceTorque(sines=SINES)
    model, data = compiled(BODY, Environment(torques=[torque]), step=0.01)
    readings = []
    for time in (1e4, 1e4 + 2e-7, 1e4 - 2e-7):
        data.time = time
        mujoco.mj_forward(model, data)
        readings.append(data.qfrc_passive[3:].copy())
    np.testing.assert_array_equal(readings[1:], [readings[0]] * 2)
    data.time = 1e4 + 0.005  # a stage
    mujoco.mj_forward(model, data)
    # arguments of 2e4 rad are good to 4e-12
    np.testing.assert_allclose(data.qfrc_passive[3:], torque_at(1e4 + 0.005) - BIAS, atol=4e-12)


def test_coulomb_friction_stops_the_wheel_and_leaves_the_momentum() -> None:
    coefficient, start, rotor, bus = 0.002, 0.9, 0.05, 7.0
    model, data = compiled(WHEEL, Environment(), rough({"wheel_0": coefficient}), step=0.002)
    data.qvel[6] = start
    before = rotor * start
    for duration in (5.0, 10.0, 5.0):
        mujoco.mj_step(model, data, round(duration / 0.002))
        decay = coefficient * (1 / rotor + 1 / bus) * data.time
        # c tanh(s / v) on a reduced inertia: sinh(s / v) falls exponentially
        expected = 0.1 * np.arcsinh(np.sinh(start / 0.1) * np.exp(-decay / 0.1))
        # RK4: rate 0.4 /s, (0.4 h)^4 / 120 is nothing; rounding over 10,000 steps
        assert data.qvel[6] == pytest.approx(expected, abs=1e-12)
        # the bus takes what the wheel gives
        assert bus * data.qvel[5] + rotor * (data.qvel[5] + data.qvel[6]) == pytest.approx(
            before, abs=1e-13
        )
    np.testing.assert_array_equal(data.qfrc_passive[:6], 0.0)


def test_sensor_reports_the_environment_at_the_start_of_the_step() -> None:
    torque = DisturbanceTorque(bias=list(BIAS), sines=SINES)
    model, data = compiled(BODY, Environment(orbit=ELLIPTIC, torques=[torque]), step=0.5)
    data.qpos[:3], data.qpos[3:7], data.time = [30.0, 20.0, 10.0], TUMBLING, 8.0
    mujoco.mj_forward(model, data)
    expected = data.qfrc_passive.copy()
    assert np.abs(expected).min() > 1e-9
    # its centre of mass is the bus's origin
    np.testing.assert_allclose(data.sensordata, expected, rtol=1e-14)
    before = data.sensordata.copy()
    mujoco.mj_step(model, data)
    np.testing.assert_array_equal(data.sensordata, before)
    assert np.abs(data.qfrc_passive - expected).max() > 1e-3  # that of the last stage


BOOM = f"""<mujoco>{OPTION}
<worldbody><body name="bus"><freejoint/>
  <inertial pos="0.1 0 0.2" mass="100" diaginertia="8 10 12"/>
  <body name="boom" pos="0 1 0"><joint name="out" type="slide" axis="0 1 0"/>
    <inertial pos="0 5 0" mass="2" diaginertia="0.01 0.02 0.02"/></body>
</body></worldbody>
<sensor><user name="environment" dim="6" needstage="vel"/></sensor></mujoco>"""


@pytest.mark.parametrize("place", [[0.0, 0.0, 0.0], [4.0, -3.0, 2.0]])
@pytest.mark.parametrize("turned", [[1.0, 0.0, 0.0, 0.0], TUMBLING])
def test_the_logged_torque_is_about_the_centre_of_mass(
    place: list[float], turned: list[float]
) -> None:
    """Gravity's is 3 n^2 u x I u, I about the centre of mass, wherever the bus has wandered to."""
    model, data = compiled(BOOM, Environment(orbit=CIRCULAR), step=1.0)
    data.qpos[:3], data.qpos[3:7] = place, turned
    mujoco.mj_forward(model, data)
    masses, places = np.array([100.0, 2.0]), np.array([[0.1, 0.0, 0.2], [0.0, 6.0, 0.0]])
    arms = places - masses @ places / 102.0
    squares = np.sum(arms**2, axis=1)[:, None, None] * np.eye(3)
    outer = arms[:, :, None] * arms[:, None, :]
    inertia = np.diag([8.01, 10.02, 12.02]) + np.tensordot(masses, squares - outer, 1)
    up = attitude.rotate(attitude.conjugate(np.array(turned)), np.array([1.0, 0.0, 0.0]))
    exact = 3.0 * RATE**2 * np.cross(up, inertia @ up)
    # The field's curvature over 6 m of 7000 km is 1e-6 of 2e-4 N m. About the bus's origin it
    # would be off by 102 kg n^2 times 5 m and 0.2 m, 1.2e-4 N m.
    np.testing.assert_allclose(data.sensordata[3:], exact, atol=1e-8)
    force = data.qfrc_passive[:3]
    np.testing.assert_array_equal(data.sensordata[:3], force)


@pytest.mark.parametrize("foreign", ["no userdata", "other userdata", "another model's"])
def test_foreign_models_are_left_alone(foreign: str) -> None:
    spec = mujoco.MjSpec.from_string(CHAIN if foreign == "another model's" else BODY)
    spec.nuserdata = 0 if foreign == "no userdata" else 30
    model = spec.compile()
    data = mujoco.MjData(model)
    if foreign == "other userdata":
        data.userdata[:] = np.arange(30.0)
    if foreign == "another model's":
        outside = Environment(orbit=CIRCULAR, torques=[DisturbanceTorque(bias=[1.0, 1.0, 1.0])])
        row = compiled(BODY, outside)[1].userdata
        assert row[0] == MAGIC
        data.userdata[: row.size] = row
    mujoco.mj_step(model, data, 3)
    np.testing.assert_array_equal(data.qfrc_passive, 0.0)
    np.testing.assert_array_equal(data.sensordata, 0.0)


def test_a_batch_of_different_environments_is_a_loop_of_single_vehicles() -> None:
    def outside(i: int) -> Environment:
        orbit = ELLIPTIC.model_copy(update={"true_anomaly": 0.5 * i})
        torque = DisturbanceTorque(
            frame="inertial", bias=[0.01 * i, 0.0, 0.1], sines=SINES[: i % 3]
        )
        return Environment(orbit=orbit if i % 2 else None, torques=[torque] * (i % 4))

    plant = rough({"wheel_0": 0.003})
    spec = mujoco.MjSpec.from_string(WHEEL)
    spec.nuserdata = max(userdata_size(outside(i), plant) for i in range(8))
    model = spec.compile()
    many = batch.Batch(model, nsim=8, nthread=2)
    singles = [mujoco.MjData(model) for _ in range(8)]
    for i, single in enumerate(singles):
        single.qpos[:3], single.qvel[3:] = [0.3 * i, 1.0, 2.0], [0.1, 0.02 * i, -0.3, 5.0]
        single.userdata[:] = userdata(model, outside(i), plant)
        many.qpos[i], many.qvel[i], many.userdata[i] = single.qpos, single.qvel, single.userdata
    for _ in range(20):
        many.step(nstep=10)
    for i, single in enumerate(singles):
        mujoco.mj_step(model, single, 200)
        np.testing.assert_array_equal(many.qpos[i], single.qpos)
        np.testing.assert_array_equal(many.qvel[i], single.qvel)
    ends = {many.qvel[i].tobytes() for i in range(8)}
    assert len(ends) == 8


def test_installing_again_restores_the_callback() -> None:
    model, data = compiled(BODY, Environment(torques=[DisturbanceTorque(bias=[1.0, 2.0, 3.0])]))
    mujoco.set_mjcb_passive(None)
    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(data.qfrc_passive, 0.0)
    install_callbacks()
    install_callbacks()
    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(data.qfrc_passive[3:], [1.0, 2.0, 3.0])


def _small(xml: str, numbers: int = 50) -> Callable[[], Any]:
    spec = mujoco.MjSpec.from_string(xml)
    spec.nuserdata = numbers
    return spec.compile()


@pytest.mark.parametrize(
    ("xml", "numbers", "friction", "message"),
    [
        (f"<mujoco>{OPTION}</mujoco>", 50, {}, "no free joint"),
        (BODY, 5, {}, "nuserdata is 5: 16 are needed"),
        (WHEEL, 50, {"wheel_9": 0.1}, "no hinge 'wheel_9'"),
        (BODY.replace('dim="6"', 'dim="5"'), 50, {}, 'dim="6" needstage="vel"'),
        (BODY.replace("vel", "pos"), 50, {}, 'dim="6" needstage="vel"'),
        (BODY.replace("<flag ", '<flag spring="disable" damper="disable" '), 50, {}, "enable one"),
    ],
)
def test_unusable_models_are_refused(
    xml: str, numbers: int, friction: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        userdata(_small(xml, numbers), Environment(orbit=CIRCULAR), rough(friction))
