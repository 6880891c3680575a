"""Refuses or warns of models that MuJoCo would fly wrongly without saying so."""

import copy
import warnings
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array

_FEWEST_STEPS = 10.0  # a revolution: RK4's error of the wobble is 1.7e-4 there


class ModelWarning(UserWarning):
    """The model flies, but not as exactly as it may seem."""


def check(model: Any) -> None:
    """Refuse or warn of what would be silently wrong in a compiled model.

    Raises:
        ValueError: automatic reset, armature, gravity or damping on a free flyer, a step too long
            for a servo or a damper; all of them are named, each with its number and its cure.

    Warns:
        ModelWarning: an integrator other than RK4 for bodies on joints, colliding geometry on a
            free flyer, or constraints that are switched off.
    """
    refused = [
        *_autoreset(model),
        *_armature(model),
        *_uniform_gravity(model),
        *_braked_free_joint(model),
        *_stiff_joints(model),
    ]
    if refused:
        raise ValueError("\n".join(refused))
    for finding in (*_integrator(model), *_collisions(model), *_ignored_constraints(model)):
        warnings.warn(finding, ModelWarning, stacklevel=3)


def check_imbalance(model: Any, fastest: float) -> None:
    """Warn when the step cannot resolve an imbalanced rotor that turns at ``fastest`` [rad/s].

    Warns:
        ModelWarning: fewer than ten steps a revolution, with the step that would do.
    """
    turn = fastest * model.opt.timestep / (2.0 * np.pi)  # revolutions in a step
    if turn <= 1.0 / _FEWEST_STEPS:
        return
    for joint in range(model.njnt):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE and _imbalanced(model, joint):
            # Measured: 1.4e-4 of the amplitude at 10.5 steps a revolution, and fourth order.
            warnings.warn(
                f"joint {model.joint(joint).name!r} turns an imbalanced body and has "
                f"{1.0 / turn:.3g} steps a revolution at {fastest:.4g} rad/s: its wobble is off by "
                f"{1.4e-4 * (10.5 * turn) ** 4:.1g} or more; a step below "
                f"{2.0 * np.pi / (_FEWEST_STEPS * fastest):.2g} s would do",
                ModelWarning,
                stacklevel=3,
            )


def _autoreset(model: Any) -> Iterator[str]:
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET:
        yield (
            "automatic reset is on: after a state that is not finite MuJoCo would go on from the "
            'initial one; set <flag autoreset="disable"/>'
        )


def _armature(model: Any) -> Iterator[str]:
    bare = copy.copy(model)
    bare.dof_armature[:] = 0.0
    bare.actuator_armature[:] = 0.0
    bare.tendon_armature[:] = 0.0
    with_it, without = np.diag(mass_matrix(model)), np.diag(mass_matrix(bare))
    for dof in np.flatnonzero(with_it != without):
        share = 1.0 - without[dof] / with_it[dof]
        yield (
            f"joint {_joint_name(model, dof)!r} has armature {with_it[dof] - without[dof]:.4g}: "
            f"{share:.1%} of its momentum would have no reaction on the bus, while the total still "
            f"seems conserved; give the inertia to a body instead"
        )


def _uniform_gravity(model: Any) -> Iterator[str]:
    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    if _free(model).any() and np.any(model.opt.gravity) and not off:
        yield (
            f"gravity is {model.opt.gravity} m/s^2 for a free flyer, and uniform: set "
            f'<option gravity="0 0 0"/>; the environment has the real one'
        )


def _braked_free_joint(model: Any) -> Iterator[str]:
    for joint in np.flatnonzero(_free(model)):
        damping = model.dof_damping[model.jnt_dofadr[joint]]
        if damping > 0.0:
            yield (
                f"free joint {model.joint(joint).name!r} has damping {damping:g}: the world would "
                f"brake the vehicle; use <freejoint/>, which inherits none"
            )


def _stiff_joints(model: Any) -> Iterator[str]:
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4:
        return
    damping, stiffness = _servo(model)
    inertia = inertia_at_joints(model)
    step = model.opt.timestep
    for dof in np.flatnonzero((damping > 0.0) | (stiffness > 0.0)):
        if model.jnt_type[model.dof_jntid[dof]] == mujoco.mjtJoint.mjJNT_FREE:
            continue
        z = step * np.roots([1.0, damping[dof] / inertia[dof], stiffness[dof] / inertia[dof]])
        growth = np.abs(1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0).max()
        if growth > 1.0 + 1e-12:
            yield (
                f"joint {_joint_name(model, dof)!r} has damping {damping[dof]:.4g}, stiffness "
                f"{stiffness[dof]:.4g} and inertia {inertia[dof]:.4g}: RK4 makes it grow by "
                f"{growth:.3g} in each step of {step:g} s; a step below "
                f"{2.78 * step / np.abs(z).max():.2g} s would do"
            )


def _integrator(model: Any) -> Iterator[str]:
    jointed = model.nbody - 1 > np.count_nonzero(_free(model)) and model.njnt > _free(model).sum()
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4 and jointed:
        name = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
        yield (
            f"the integrator is {name}, first order: with a wheel of 6 N m s it puts the bus rate "
            f"10 % off within 100 s at a step of 10 ms, 1 % at 1 ms, where RK4 errs by 1e-11 and "
            f'less (measured); set integrator="RK4" (rates.integrator in a scenario)'
        )


def _collisions(model: Any) -> Iterator[str]:
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    flying = np.isin(model.body_rootid[model.geom_bodyid], model.jnt_bodyid[_free(model)])
    touch = (model.geom_contype[:, None] & model.geom_conaffinity) != 0
    apart = model.geom_bodyid[:, None] != model.geom_bodyid
    colliding = np.count_nonzero(((touch | touch.T) & apart)[flying][:, flying].any(axis=0))
    if colliding and not model.opt.disableflags & off:
        yield (
            f"contacts are on and {colliding} geoms may collide: a free flyer's own parts would "
            f'touch; set <flag contact="disable"/> or contype="0" conaffinity="0"'
        )


def _ignored_constraints(model: Any) -> Iterator[str]:
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONSTRAINT:
        return
    limits = np.count_nonzero(model.jnt_limited)
    frictions = np.count_nonzero(model.dof_frictionloss)
    if limits or frictions or model.neq:
        yield (
            f"constraints are disabled, so {limits} joint limits, {frictions} friction losses and "
            f"{model.neq} equalities are ignored; bearings take plant.wheels.coulomb_friction"
        )


def _imbalanced(model: Any, joint: int) -> bool:
    """Tell whether the joint's body has its mass off the axis or its principal axes tilted."""
    body, axis = model.jnt_bodyid[joint], model.jnt_axis[joint]
    offset = np.cross(axis, model.body_ipos[body] - model.jnt_pos[joint])
    principal = np.zeros(9)
    mujoco.mju_quat2Mat(principal, model.body_iquat[body])
    in_body = principal.reshape(3, 3)
    product = np.cross(axis, in_body @ (model.body_inertia[body] * (in_body.T @ axis)))
    # Far below any imbalance that is meant, far above rounding.
    scale = model.body_inertia[body].max()
    return bool(np.linalg.norm(offset) > 1e-12 or np.linalg.norm(product) > 1e-12 * scale)


def _servo(model: Any) -> tuple[Array, Array]:
    """Return each dof's damping and stiffness, those of joint servos included, shapes (nv,)."""
    damping, stiffness = model.dof_damping.copy(), np.zeros(model.nv)
    single = np.flatnonzero(model.jnt_type >= int(mujoco.mjtJoint.mjJNT_SLIDE))  # slides, hinges
    stiffness[model.jnt_dofadr[single]] = model.jnt_stiffness[single]
    for actuator in np.flatnonzero(model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT):
        dof = model.jnt_dofadr[model.actuator_trnid[actuator, 0]]
        gear = model.actuator_gear[actuator, 0] ** 2
        damping[dof] += gear * model.actuator_damping[actuator]
        if model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE:
            stiffness[dof] -= gear * model.actuator_biasprm[actuator, 1]
            damping[dof] -= gear * model.actuator_biasprm[actuator, 2]
    return damping, stiffness


def inertia_at_joints(model: Any) -> Array:
    """Return, for each dof, what a torque between the joint's two bodies has to move, (nv,)."""
    return 1.0 / np.diag(np.linalg.inv(mass_matrix(model))) if model.nv else np.zeros(0)


def mass_matrix(model: Any) -> Array:
    """Return the mass matrix (nv, nv), joints at rest."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix


def _free(model: Any) -> Any:
    return model.jnt_type == mujoco.mjtJoint.mjJNT_FREE


def _joint_name(model: Any, dof: Any) -> str:
    return str(model.joint(model.dof_jntid[dof]).name)
