"""The ports of a compiled model: where they are, and how two spacecraft move on a latch."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.errors import nearest
from mjspace.vehicle import stability


def of_site(model: Any, name: str) -> Array:
    """Return a site's body, place [m] and axes (by rows) in that body's principal axes, (13,).

    The place is from the body's centre of mass.
    """
    site = model.site(name).id
    body = model.site_bodyid[site]
    inertial = _matrix(model.body_iquat[body])
    place = inertial.T @ (model.site_pos[site] - model.body_ipos[body])
    axes = inertial.T @ _matrix(model.site_quat[site])
    return np.concatenate([[body], place, axes.ravel()])


def check(model: Any, between: Sequence[str]) -> None:
    """Refuse names that are no ports of two spacecraft, the first of which is the vehicle.

    Raises:
        ValueError: with the name and what would be right.
    """
    names = [model.site(i).name for i in range(model.nsite)]
    for name in between:
        if name not in names:
            raise ValueError(f"between: no port {name!r}{nearest(name, names)}")
    bus = model.body_rootid[model.jnt_bodyid[0]]
    one, two = (model.body_rootid[model.site_bodyid[model.site(name).id]] for name in between)
    if one != bus or two == bus:
        raise ValueError(
            f"between: {between[0]!r} and {between[1]!r}, should be a port of the vehicle and one "
            "of another spacecraft"
        )


def latch(model: Any, between: Sequence[str], w: float, ratio: float) -> tuple[Array, Array]:
    """Return a latch's stiffness [N/m], [N m/rad] and damping [N s/m], [N m s/rad], each (2,).

    On it the two spacecraft, joints at rest, move relative to each other at about ``w`` [rad/s]
    with that damping ``ratio``: the stiffness is w^2 over the mean of the mobility, the
    acceleration of one port relative to the other for a force or a torque between them.

    Raises:
        ValueError: the model's step is too long for it.
    """
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    mobility = np.zeros((6, 6))
    inverse = np.linalg.inv(stability.mass_matrix(model))
    for name in between:
        site, jacobian = model.site(name).id, np.zeros((6, model.nv))
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site)
        axes = np.kron(np.eye(2), data.site_xmat[site].reshape(3, 3).T)
        mobility += axes @ jacobian @ inverse @ jacobian.T @ axes.T
    means = np.array([np.trace(mobility[:3, :3]), np.trace(mobility[3:, 3:])]) / 3.0
    stiffness, damping = w**2 / means, 2.0 * ratio * w / means
    inertia = np.linalg.inv(mobility).astype(float)
    diagonals = (np.diag(np.repeat(each, 3)) for each in (damping, stiffness))
    linear = stability.Linear(inertia, *diagonals)
    mode = stability.growing(linear, model.opt.timestep)
    if mode is not None:
        raise ValueError(
            f"frequency: RK4 makes a latch of {w / (2.0 * np.pi):g} Hz grow by {mode.growth:.3g} "
            f"in each step of {model.opt.timestep:g} s; use a step below {mode.step:.2g} s"
        )
    return stiffness, damping


def docked(model: Any, between: Sequence[str], qpos: Array, qvel: Array) -> tuple[Array, Array]:
    """Return the pose (7,) and motion (6,) of the second port's free body, docked to the first.

    They are as MuJoCo has them in ``qpos`` and ``qvel``; the ports coincide, and the second body
    moves as the first port does. ``qpos`` (nq,) and ``qvel`` (nv,) are the vehicle's.
    """
    data = mujoco.MjData(model)
    data.qpos, data.qvel = qpos, qvel
    mujoco.mj_forward(model, data)
    one, two = (model.site(name).id for name in between)
    axes, place = data.site_xmat[one].reshape(3, 3), data.site_xpos[one]
    root = model.body_rootid[model.site_bodyid[two]]
    at = data.xmat[root].reshape(3, 3)
    port_axes = at.T @ data.site_xmat[two].reshape(3, 3)
    port = at.T @ (data.site_xpos[two] - data.xpos[root])
    turned = axes @ port_axes.T
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, turned.ravel())
    velocity = np.zeros(6)  # rotation, then translation, world axes
    site = int(mujoco.mjtObj.mjOBJ_SITE)
    mujoco.mj_objectVelocity(model, data, site, one, velocity, 0)
    origin = place - turned @ port
    rate, speed = velocity[:3], velocity[3:] + np.cross(velocity[:3], origin - place)
    return np.concatenate([origin, quat]), np.concatenate([speed, turned.T @ rate])


def _matrix(quat: Array) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)
