"""Latches and springs between two spacecraft: closed forms, momentum, energy and order."""

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjspace.contract import Array
from mjspace.environment.connection import CLOSED, RELEASED, Latch
from mjspace.environment.install import install_callbacks, places_of, userdata, userdata_size
from mjspace.errors import InputError
from mjspace.scenario.environment import Environment
from mjspace.scenario.plant import PlantTable
from mjspace.vehicle import port_frames

# A vehicle with its port on an arm, off its centre, and a target: masses 50 and 4 kg.
BODIES = """<mujoco><option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/></option>
<worldbody>
  <body name="bus"><freejoint/><inertial pos="0.1 0 0" mass="50" diaginertia="4 5 3"/>
    <site name="centre" pos="0.1 0 0"/>
    <body name="arm" pos="0.4 0 0"><joint axis="0 0 1"/>
      <inertial pos="0.2 0.05 0" mass="3" diaginertia="0.1 0.12 0.15" euler="0 0 20"/>
      <site name="port" pos="0.4 0.1 -0.05" euler="0 30 10"/></body></body>
  <body name="cube" pos="1 0 0"><freejoint/>
    <inertial pos="0 0 0.02" mass="4" diaginertia="0.02 0.03 0.025" euler="10 20 0"/>
    <site name="rail" pos="-0.1 0.02 0" euler="0 0 40"/><site name="middle" pos="0 0 0.02"/></body>
</worldbody></mujoco>"""
LOOSE = """<mujoco><option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/></option>
<worldbody>
  <body name="bus"><freejoint/><inertial pos="0 0 0" mass="50" diaginertia="4 4 4"/>
    <site name="port"/></body>
  <body name="cube"><freejoint/><inertial pos="0 0 0" mass="4" diaginertia="0.5 0.5 0.5"/>
    <site name="rail"/></body>
</worldbody></mujoco>"""


@pytest.fixture(autouse=True, scope="module")
def _installed() -> None:
    install_callbacks()


def connected(
    text: str = BODIES, step: float = 1e-3, state: float = CLOSED, **table: Any
) -> tuple[Any, Any]:
    """Return a model with that connection and its data, in that state of the connection."""
    plant = PlantTable.model_validate(
        {"connections": {"c": {"between": ["port", "rail"], **table}}}
    )
    outside, spec = Environment(), mujoco.MjSpec.from_string(text)
    spec.option.timestep = step
    spec.nuserdata = userdata_size(outside, plant)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, outside, plant)
    (place,) = places_of(Latch, outside, plant)
    data.userdata[place] = state
    return model, data


def moving(model: Any, data: Any, seed: int) -> None:
    """Put both bodies anywhere near each other, and let them move."""
    random = np.random.default_rng(seed)
    data.qpos[:] += 0.2 * random.normal(size=model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qvel[:] = random.normal(size=model.nv)


def momenta(model: Any, data: Any) -> Array:
    """Return linear [N s] and angular momentum about the inertial origin [N m s], (6,)."""
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    linear, angular = np.zeros(3), np.zeros(3)
    for body in range(1, model.nbody):
        velocity = np.zeros(6)
        kind = int(mujoco.mjtObj.mjOBJ_BODY)
        mujoco.mj_objectVelocity(model, data, kind, body, velocity, 0)
        axes = data.ximat[body].reshape(3, 3)
        momentum = model.body_mass[body] * velocity[3:]
        linear += momentum
        angular += np.cross(data.xipos[body], momentum)
        angular += axes @ (model.body_inertia[body] * (axes.T @ velocity[:3]))
    return np.concatenate([linear, angular])


def rate_of_momenta(model: Any, data: Any) -> Array:
    """Return the derivative of ``momenta`` under the forces of now, by a central difference."""
    mujoco.mj_forward(model, data)
    state = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    row = np.zeros(mujoco.mj_stateSize(model, state))
    mujoco.mj_getState(model, data, row, state)
    speeds, accelerations, found = data.qvel.copy(), data.qacc.copy(), []
    for nudge in (1e-6, -1e-6):
        mujoco.mj_setState(model, data, row, state)
        mujoco.mj_integratePos(model, data.qpos, speeds, nudge)
        data.qvel[:] = speeds + nudge * accelerations
        found.append(momenta(model, data))
    mujoco.mj_setState(model, data, row, state)
    return (found[0] - found[1]) / 2e-6


@given(seed=st.integers(0, 10**6), state=st.sampled_from([CLOSED, RELEASED]))
def test_neither_latch_nor_springs_make_momentum(seed: int, state: float) -> None:
    springs = {"stiffness": [300.0, 500.0], "stroke": 3.0, "positions": [[0, 0.1, 0], [0, 0, 0.2]]}
    model, data = connected(state=state, opens_at=1.0, springs=springs, frequency=2.0)
    moving(model, data, seed)
    mujoco.mj_forward(model, data)
    force = np.abs(data.qfrc_passive).max()
    # The difference's error: 1e-6 of curvature, 1e-9 of rounding over 2e-6.
    assert np.abs(rate_of_momenta(model, data)).max() <= 1e-6 * max(force, 1.0)


def test_the_latch_is_a_spring_and_a_damper_between_the_ports() -> None:
    model, data = connected(frequency=2.0, damping_ratio=0.3)
    moving(model, data, 4)
    mujoco.mj_forward(model, data)
    both = [model.site(name).id for name in ("port", "rail")]
    (x1, a1), (x2, a2) = ((data.site_xpos[i], data.site_xmat[i].reshape(3, 3)) for i in both)
    jacobians = [np.zeros((6, model.nv)) for _ in both]
    for jacobian, site in zip(jacobians, both, strict=True):
        body = model.site_bodyid[site]
        middle = 0.5 * (x1 + x2)
        mujoco.mj_jac(model, data, jacobian[:3], jacobian[3:], middle, body)
    slip = (jacobians[0] - jacobians[1]) @ data.qvel
    quat, turn = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quat, (a1 @ a2.T).ravel())
    mujoco.mju_quat2Vel(turn, quat, 1.0)
    k, kr, c, cr = data.userdata[[7, 8, 9, 10]]
    force = np.concatenate([-k * (x1 - x2) - c * slip[:3], -kr * turn - cr * slip[3:]])
    np.testing.assert_allclose(
        data.qfrc_passive, (jacobians[0] - jacobians[1]).T @ force, rtol=1e-10, atol=1e-10
    )


@pytest.mark.parametrize("along", [slice(0, 3), slice(3, 6)])
def test_on_the_latch_they_swing_at_its_frequency_with_its_damping(along: slice) -> None:
    # Ports at the centres of mass: x'' + 2 z w x' + w^2 x = 0, of places and of one angle.
    step, w, damping = 2e-3, 2.0 * np.pi * 0.5, 0.2
    model, data = connected(LOOSE, step, frequency=0.5, damping_ratio=damping)
    start = 0.3
    if along.start == 0:
        data.qpos[7] = start
    else:
        data.qpos[10:14] = [np.cos(start / 2.0), np.sin(start / 2.0), 0.0, 0.0]
    for _ in range(1000):
        mujoco.mj_step(model, data)
    damped, time = w * np.sqrt(1.0 - damping**2), 1000 * step
    swing = np.cos(damped * time) + damping * w / damped * np.sin(damped * time)
    expected = start * np.exp(-damping * w * time) * swing
    angle = 2.0 * np.arctan2(data.qpos[11], data.qpos[10])
    other = -2.0 * np.arctan2(data.qpos[4], data.qpos[3])
    found = data.qpos[7] - data.qpos[0] if along.start == 0 else angle + other
    assert found == pytest.approx(expected, abs=1e-9)  # RK4: (w h)^4 / 120


def test_an_undamped_latch_keeps_energy_to_fourth_order() -> None:
    drifts = []
    for step in (8e-3, 4e-3):
        model, data = connected(step=step, frequency=1.0, damping_ratio=0.0)
        pose, _ = port_frames.docked(model, ["port", "rail"], data.qpos, data.qvel)
        data.qpos[8:15] = pose
        data.qvel[:] = 0.1 * np.random.default_rng(2).normal(size=model.nv)
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)

        def energy(model: Any = model, data: Any = data) -> float:
            mujoco.mj_forward(model, data)
            one, two = (data.site(name) for name in ("port", "rail"))
            quat, turn = np.zeros(4), np.zeros(3)
            between = one.xmat.reshape(3, 3) @ two.xmat.reshape(3, 3).T
            mujoco.mju_mat2Quat(quat, between.ravel())
            mujoco.mju_quat2Vel(turn, quat, 1.0)
            k, kr = data.userdata[[7, 8]]
            stretch = np.sum((one.xpos - two.xpos) ** 2)
            return float(data.energy[1] + 0.5 * k * stretch + 0.5 * kr * np.sum(turn**2))

        first, last = energy(), 0.0
        for _ in range(round(4.0 / step)):
            mujoco.mj_step(model, data)
        last = energy()
        drifts.append(abs(last / first - 1.0))
    assert drifts[0] < 1e-6
    assert np.log2(drifts[0] / drifts[1]) > 3.7  # RK4's dissipation is of fifth order


def test_springs_between_turning_bodies_keep_energy_to_fourth_order() -> None:
    # Feet off the axes of ports that turn against each other: a force or a torque in another frame
    # than the spring's would do work. They push all the while: their strokes are not spent.
    feet = [[0.03, 0.2, -0.1], [-0.02, -0.15, 0.25]]
    stiffness, stroke = [6.0, 9.0], [2.0, 1.8]
    springs = {"stiffness": stiffness, "stroke": stroke, "positions": feet}
    drifts = []
    for step in (4e-3, 2e-3):
        model, data = connected(BODIES, step, RELEASED, opens_at=0.0, springs=springs)
        pose, _ = port_frames.docked(model, ["port", "rail"], data.qpos, data.qvel)
        data.qpos[8:15] = pose
        data.qvel[:] = [0.1, 0.0, -0.1, 0.4, -0.3, 0.5, 0.3, 0.0, 0.1, 0.1, -0.9, 0.6, -0.7]
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)

        def energies(model: Any = model, data: Any = data) -> tuple[float, Array]:
            """Return the kinetic energy [J], and that of each spring, from MuJoCo's sites."""
            mujoco.mj_forward(model, data)
            one, two = (data.site(name) for name in ("port", "rail"))
            axes = [each.xmat.reshape(3, 3) for each in (one, two)]
            places = two.xpos - one.xpos + np.array(feet) @ (axes[1] - axes[0]).T
            left = np.array(stroke) - places @ axes[0][:, 0]
            assert (left > 0.0).all()
            return float(data.energy[1]), 0.5 * np.array(stiffness) * left**2

        moving, pressed = energies()
        first, seen = moving + pressed.sum(), [moving]
        for _ in range(round(0.6 / step)):
            mujoco.mj_step(model, data)
            seen.append(energies()[0])
        moving, pressed = energies()
        assert np.ptp(seen) > 0.5 * first  # that passes from the springs to the motion
        between = data.site("port").xmat.reshape(3, 3).T @ data.site("rail").xmat.reshape(3, 3)
        assert np.trace(between) < 0.0  # they have turned against each other by more than 120 deg
        drifts.append(abs((moving + pressed.sum()) / first - 1.0))
    assert drifts[0] < 1e-8
    assert np.log2(drifts[0] / drifts[1]) > 3.7  # RK4's


def test_springs_push_with_all_their_energy() -> None:
    model, data = connected(
        LOOSE, 1e-4, RELEASED, opens_at=0.0, springs={"stiffness": 400.0, "stroke": 0.1}
    )
    for _ in range(3000):
        mujoco.mj_step(model, data)
    # Two masses on a spring: v = s sqrt(k / m), m = 50 * 4 / 54 kg; the spring's end is met to
    # within a step, in which it pushes with up to k v h = 0.04 N for h: 1e-6 m/s.
    assert data.qvel[6] - data.qvel[0] == pytest.approx(
        0.1 * np.sqrt(400.0 * 54.0 / 200.0), abs=2e-6
    )
    assert 50.0 * data.qvel[0] + 4.0 * data.qvel[6] == pytest.approx(0.0, abs=1e-13)
    assert np.abs(data.qvel[[3, 4, 5, 9, 10, 11]]).max() == 0.0


def test_a_spring_off_the_centre_turns_both() -> None:
    springs = {"stiffness": 400.0, "stroke": 0.01, "positions": [[0.0, 0.05, 0.0]]}
    model, data = connected(LOOSE, 1e-4, RELEASED, opens_at=0.0, springs=springs)
    for _ in range(3000):
        mujoco.mj_step(model, data)
    # The push hardly moves them meanwhile: an impulse p at 0.05 m across it, so that
    # k s^2 = p^2 (1/50 + 1/4 + 0.05^2 (1/4 + 1/0.5)).
    impulse = np.sqrt(400.0 * 0.01**2 / (1 / 50 + 1 / 4 + 0.05**2 * (1 / 4 + 1 / 0.5)))
    assert 4.0 * data.qvel[6] == pytest.approx(impulse, rel=1e-3)
    assert 0.5 * data.qvel[11] == pytest.approx(-0.05 * impulse, rel=1e-3)
    assert 4.0 * data.qvel[5] == pytest.approx(0.05 * impulse, rel=1e-3)


def test_an_open_connection_does_nothing() -> None:
    model, data = connected(state=0.0)
    moving(model, data, 1)
    mujoco.mj_forward(model, data)
    assert not data.qfrc_passive.any()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"between": ["prot", "rail"]}, "no port 'prot': did you mean 'port'"),
        ({"between": ["rail", "port"]}, "should be a port of the vehicle and one of another"),
        ({"between": ["port", "centre"]}, "should be a port of the vehicle and one of another"),
        ({"frequency": 1000.0}, "a latch of 1000 Hz grow by .* use a step below 0.000"),
    ],
)
def test_unfit_connections_are_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=rf"plant.connections.c: .*{message}"):
        connected(**{"between": ["port", "rail"], **table})
