"""The planet's gravity at a landing site: on every body, with its gradient, in the site's frame."""

from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.constants import GM, RADIUS
from mjspace.environment.gravity import CentralGravity
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.scenario.environment import Environment

PAPER = CentralGravity(gm=4.902e12, radius=1738e3)
SMALL = CentralGravity(gm=4.0e3, radius=50.0)  # an asteroid, with a large gradient
INERTIA = np.array([[12.0, 0.7, -0.4], [0.7, 14.0, 1.1], [-0.4, 1.1, 5.0]])
BODY = """<mujoco><option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/></option>
<worldbody><body name="bus"><freejoint/>
  <inertial pos="0 0 0" mass="50" fullinertia="12 14 5 0.7 -0.4 1.1"/>
</body></worldbody></mujoco>"""


@pytest.fixture(autouse=True, scope="module")
def _installed() -> None:
    install_callbacks()


def compiled(gravity: CentralGravity, step: float) -> tuple[Any, Any]:
    outside = Environment(gravity=gravity)
    spec = mujoco.MjSpec.from_string(BODY)
    spec.option.timestep = step
    spec.nuserdata = userdata_size(outside)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, outside)
    return model, data


def fall(gravity: CentralGravity, start: Array, duration: float) -> Array:
    """Return Newton's and Euler's motion, written down without MuJoCo or our code."""
    gm, radius = gravity.parameters()
    centre = np.array([0.0, 0.0, -radius])

    def slope(_: float, y: Array) -> Array:
        r, q, w = y[:3] - centre, y[6:10], y[10:]
        distance = np.linalg.norm(r)
        c, (x, yy, z) = q[0], q[1:]
        u = np.array([[0, -z, yy], [z, 0, -x], [-yy, x, 0]])
        down = (np.eye(3) + 2.0 * c * u + 2.0 * u @ u).T @ r
        torque = 3.0 * gm / distance**5 * np.cross(down, INERTIA @ down)
        w_dot = np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))
        q_dot = 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])
        return np.concatenate([y[3:6], -gm * r / distance**3, q_dot, w_dot])

    return solve_ivp(slope, (0.0, duration), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize(
    ("gravity", "velocity", "duration"),
    [(PAPER, [30.0, -20.0, -10.0], 60.0), (SMALL, [6.0, 1.0, 4.0], 40.0)],
    ids=["moon", "asteroid"],
)
def test_a_tumbling_body_falls_as_newton_says(
    gravity: CentralGravity, velocity: list[float], duration: float
) -> None:
    step = 0.02
    model, data = compiled(gravity, step)
    data.qpos[:] = 30.0, -20.0, 40.0, 0.8, -0.2, 0.4, 0.4
    data.qvel[:] = *velocity, 0.03, -0.1, 0.06
    start = np.concatenate([data.qpos[:3], data.qvel[:3], data.qpos[3:], data.qvel[3:]])
    expected = fall(gravity, start, duration)
    mujoco.mj_step(model, data, round(duration / step))
    np.testing.assert_allclose(
        data.qpos[:3], expected[:3], rtol=0.0, atol=2e-8
    )  # m; 5e-12 and 2e-11 measured, of 2000 km
    turned = attitude.rotation_angle(data.qpos[3:], attitude.normalize(expected[6:10]))
    assert turned < 1e-9  # rad; 8e-11 and 7e-13 measured


def test_at_the_site_it_is_gm_over_the_radius_squared_downwards() -> None:
    site = CentralGravity()
    np.testing.assert_array_equal(site.parameters(), [GM["moon"], RADIUS["moon"]])
    there = site.acceleration(np.zeros((2, 3)))
    np.testing.assert_allclose(there, [[0.0, 0.0, -1.6242]] * 2, atol=5e-5)
    # Beside the site it points to the centre, not down.
    aside = site.acceleration(np.array([2500.0, 0.0, 0.0]))
    assert aside[0] == pytest.approx(-1.6242 * 2500.0 / 1737400.0, rel=1e-4)
