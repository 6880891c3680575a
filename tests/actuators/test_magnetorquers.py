"""Magnetorquers: limits and lag, and moment x field at every stage of the integrator."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.actuators.magnetorquers import CoilSet
from mjspace.contract import Array, Measurement
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.environment.magnetic_field import FIELD, MOMENT, MagneticField
from mjspace.environment.orbit import Orbit
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

BALL = """<mujoco>
<option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/>
</option>
<worldbody><body name="bus" pos="3 4 5"><freejoint/>
  <inertial pos="0 0 0" mass="50" diaginertia="10 10 10"/>
</body></worldbody></mujoco>"""  # which the gravity gradient does not turn
OUTSIDE = Environment(orbit=Orbit(semi_major_axis=7e6), magnetic_field=MagneticField())
PIECE = np.array(
    [5.0, 1e-8, -2e-8, 3e-8, 1e-6, 2e-6, -1e-6, 3e-5, 1e-5, -2e-5, 4e-3, 4e-3, 4e-3]
)  # s, T
START = attitude.normalize(np.array([0.8, -0.2, 0.4, 0.4]))
STRONG = np.array([60.0, -90.0, 40.0])  # A m^2


def compiled(step: float) -> tuple[Any, Any]:
    install_callbacks()
    spec = mujoco.MjSpec.from_string(BALL)
    spec.option.timestep = step
    spec.nuserdata = userdata_size(OUTSIDE)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, OUTSIDE)
    data.userdata[FIELD], data.userdata[MOMENT] = PIECE, STRONG
    data.qpos[3:7] = START
    return model, data


def torque(time: float, q: Array) -> Array:
    since = time - PIECE[0]
    field = PIECE[1:].reshape(4, 3).T @ since ** np.arange(3.0, -1.0, -1.0)
    return np.cross(STRONG, attitude.rotate(attitude.conjugate(q), field))


def test_torque_is_moment_times_field_in_body_axes() -> None:
    model, data = compiled(1.0)
    data.time = 12.0
    mujoco.mj_forward(model, data)
    # of 0.5 N m: rounding of some fifty operations
    np.testing.assert_allclose(data.qfrc_passive[3:], torque(12.0, START), atol=1e-14)
    assert data.qfrc_passive[3:] @ STRONG == pytest.approx(0.0, abs=1e-13)
    # no force, but for that of the tide on a body 7 m off the origin
    assert np.abs(data.qfrc_passive[:3]).max() < 1e-3


def test_fourth_order_in_the_step() -> None:
    def motion(time: float, state: Array) -> Array:
        q, w = state[:4], state[4:]
        turning = 0.5 * attitude.multiply(q, np.concatenate([[0.0], w]))
        return np.concatenate([turning, torque(time, q / np.linalg.norm(q)) / 10.0])

    start = np.concatenate([START, np.zeros(3)])
    exact = solve_ivp(motion, (0.0, 16.0), start, "DOP853", rtol=1e-12, atol=1e-13).y[:4, -1]
    steps, errors = np.array([0.4, 0.2, 0.1]), []
    for step in steps:
        model, data = compiled(step)
        mujoco.mj_step(model, data, round(16.0 / step))
        errors.append(float(attitude.rotation_angle(data.qpos[3:7], exact)))
    # a torque held over the step, or with the attitude of its start, gives 1
    assert np.all(np.abs(-np.diff(np.log2(errors)) - 4.0) < 0.2), errors


def test_coils_share_and_limit_the_moment() -> None:
    truth = Measurement(attitude=np.zeros((2, 4)), rate=np.zeros((2, 3)))
    skew = attitude.normalize(np.array([[1.0, 1, 0], [1, -1, 0], [0, 0, 1], [0, 1, 1]]))
    coils = CoilSet(skew, dipole_limit=4.0)
    asked = SimpleNamespace(dipole=np.array([[0.3, -0.5, 0.8], [100.0, 0.0, 0.0]]))
    state, moment, cut = coils.act(coils.reset(2), asked, truth, 1.0)
    assert (state, cut.shape) == ({}, (2, 0))
    np.testing.assert_allclose(moment[0], asked.dipole[0], rtol=1e-14)
    np.testing.assert_allclose(moment[1], np.clip(coils.allocation[:, 0] * 100, -4, 4) @ skew)
    assert not coils.stateful


def test_moment_follows_with_a_lag() -> None:
    truth = Measurement(attitude=np.zeros((1, 4)), rate=np.zeros((1, 3)))
    coils, step = CoilSet(np.eye(3), 5.0, time_constant=0.7), 0.25
    asked = SimpleNamespace(dipole=np.array([[2.0, -9.0, 0.0]]))
    state, means = coils.reset(1), []
    for _ in range(8):
        state, mean, _ = coils.act(state, asked, truth, step)
        means.append(mean[0])
    goal, gone = np.array([2.0, -5.0, 0.0]), np.exp(-2.0 / 0.7)
    np.testing.assert_allclose(state["coil_moment"][0], goal * (1.0 - gone), rtol=1e-13)
    # the integral of 1 - exp(-t / 0.7), whatever the step
    total = 2.0 - 0.7 * (1.0 - gone)
    np.testing.assert_allclose(step * np.sum(means, axis=0), goal * total, rtol=1e-13)


@pytest.mark.usefixtures("one_block")
def test_magnetometer_shows_the_field_in_body_axes() -> None:
    built = assemble(*load("b-dot-igrf", ["duration=200", "sensors.magnetic_field.noise_std=0"]))
    (block,) = fly(built, first_start(built, [0]))
    seen, truth = block.rows["/measurement"]["magnetic_field"][:, 0], block.rows["/truth"]
    known = built.surroundings.magnetic_field
    assert known is not None
    field = attitude.rotate(attitude.conjugate(truth["attitude"][:, 0]), known(block.time))
    np.testing.assert_allclose(seen, field, atol=1e-18)
    moment, outside = block.rows["/command"]["magnetic_moment"], block.rows["/disturbance"]
    # What the environment does to the bus is this and the gravity gradient, below 3 n^2 9 kg m^2.
    pushed = outside["torque"][1:, 0] - np.cross(moment[1:, 0], field[1:])
    assert np.abs(pushed).max() < 3.2e-5
    assert np.abs(outside["torque"]).max() > 1e-4


@pytest.mark.usefixtures("one_block")
def test_a_batch_is_as_one_and_a_replay_too(tmp_path: Path) -> None:
    overrides = ["duration=60", "checks=[]", "rates.physics=1"]
    built = assemble(*load("b-dot-igrf", overrides))
    (one,), (many,) = (list(fly(built, first_start(built, range(n)), range(n))) for n in (1, 3))
    alone, beside = one.rows["/state"]["physics"], many.rows["/state"]["physics"]
    np.testing.assert_array_equal(beside[:, 0], alone[:, 0])
    assert np.any(beside[-1, 1] != beside[-1, 2])  # noise of their own
    assert verify(run("b-dot-igrf", overrides=overrides, out=tmp_path / "flight").path) is None


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["plant.magnetorquers={}"], "plant.magnetorquers: needs an"),
        (["sensors.magnetic_field={}"], "sensors.magnetic_field: needs an"),
    ],
)
def test_magnets_need_a_field(overrides: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load("contraction-ideal", overrides)


def test_an_axis_has_a_direction() -> None:
    with pytest.raises(InputError, match=r"axes\.0: got .* no direction"):
        load("b-dot", ["plant.magnetorquers.axes=[[0, 0, 0]]"])


def test_each_coil_has_a_limit_of_its_own() -> None:
    coils = CoilSet(np.eye(3), np.array([0.2, 0.3, np.inf]))
    command = SimpleNamespace(dipole=np.array([[1.0, -1.0, 5.0]]))
    truth = Measurement(rate=np.zeros((1, 3)))
    _, moment, _ = coils.act({}, command, truth, 0.1)
    assert moment.tolist() == [[0.2, -0.3, 5.0]]
