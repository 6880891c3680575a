"""Guards: refuses or warns of models that MuJoCo would simulate wrongly without a message."""

import copy
import warnings
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from mjspace.vehicle import stability
from mjspace.vehicle.stability import Linear, mass_matrix

_RK4_REACHES = 2.785294  # where RK4's stability ends on the negative real axis
_FEWEST_STEPS = 10.0  # a revolution: RK4's error of the wobble is 1.7e-4 there


class ModelWarning(UserWarning):
    """The model is accepted, but its results are less accurate than they seem."""


def check(model: Any) -> None:
    """Refuse or warn of settings of a compiled model that give wrong results silently.

    Raises:
        ValueError: automatic reset, sleep or armature; gravity, or a damper, spring or friction on
            a free flyer; a step too long for a servo, spring, damper or lag. The message names all
            of them, each with its number and its cure.

    Warns:
        ModelWarning: an integrator other than RK4 for bodies on joints, colliding geometry or a
            fluid on a free flyer, a damper or servo of the wrong sign, RK4 on a lag that MuJoCo
            integrates by itself, constraints that are switched off, or a range that is not
            enforced.
    """
    linear = stability.linearized(model)
    refused = [
        *_autoreset(model),
        *_sleep(model),
        *_armature(model),
        *_uniform_gravity(model),
        *_held_free_joint(model),
        *_stiff_joints(model, linear),
        *_short_lags(model),
    ]
    if refused:
        raise ValueError("\n".join(refused))
    for finding in (
        *_integrator(model),
        *_collisions(model),
        *_fluid(model),
        *_driven_joints(model, linear),
        *_inexact_lags(model),
        *_ignored_constraints(model),
        *_ignored_ranges(model),
    ):
        warnings.warn(finding, ModelWarning, stacklevel=3)


def check_imbalance(model: Any, fastest: float) -> None:
    """Warn when the step cannot resolve an imbalanced rotor that turns at ``fastest`` [rad/s].

    Warns:
        ModelWarning: fewer than ten steps per revolution; the message names a suitable step.
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
                f"{1.4e-4 * (10.5 * turn) ** 4:.1g} or more; use a step below "
                f"{2.0 * np.pi / (_FEWEST_STEPS * fastest):.2g} s",
                ModelWarning,
                stacklevel=3,
            )


def _autoreset(model: Any) -> Iterator[str]:
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET:
        yield (
            "automatic reset is on: after a state that is not finite MuJoCo would continue from "
            'the initial one; set <flag autoreset="disable"/>'
        )


def _sleep(model: Any) -> Iterator[str]:
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP and _free(model).any():
        yield (
            f"sleep is enabled: below {model.opt.sleep_tolerance:g} rad/s or m/s MuJoCo stops a "
            'vehicle; remove <flag sleep="enable"/>'
        )


def _armature(model: Any) -> Iterator[str]:
    armatures = "dof_armature", "actuator_armature", "tendon_armature"
    if not any(getattr(model, name).any() for name in armatures):
        return
    bare = copy.copy(model)
    for name in armatures:
        getattr(bare, name)[:] = 0.0
    with_it, without = np.diag(mass_matrix(model)), np.diag(mass_matrix(bare))
    for dof in np.flatnonzero(with_it != without):
        share = 1.0 - without[dof] / with_it[dof]
        yield (
            f"{_joint_name(model, dof)} has armature {with_it[dof] - without[dof]:.4g}: "
            f"{share:.1%} of its momentum would have no reaction on the bus, while the total still "
            f"seems conserved; give the inertia to a body instead"
        )


def _uniform_gravity(model: Any) -> Iterator[str]:
    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    if _free(model).any() and np.any(model.opt.gravity) and not off:
        yield (
            f"gravity is {model.opt.gravity} m/s^2 for a free flyer, and uniform: set "
            f'<option gravity="0 0 0"/>; a scenario\'s environment has its own gravity'
        )


def _held_free_joint(model: Any) -> Iterator[str]:
    for joint in np.flatnonzero(_free(model)):
        dofs = slice(model.jnt_dofadr[joint], model.jnt_dofadr[joint] + 6)
        for what, values in (
            ("damping", (model.dof_damping[dofs], model.dof_dampingpoly[dofs])),
            ("stiffness", (model.jnt_stiffness[joint], model.jnt_stiffnesspoly[joint])),
            ("frictionloss", (model.dof_frictionloss[dofs],)),
        ):
            largest = max(float(np.abs(value).max()) for value in values)
            if largest > 0.0:
                yield (
                    f"free {_joint_name(model, dofs.start)} has {what} {largest:g}: the world "
                    f"would hold the vehicle; use <freejoint/>, which inherits none"
                )


def _stiff_joints(model: Any, linear: Linear | None) -> Iterator[str]:
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4 or linear is None:
        return
    step = model.opt.timestep
    mode = stability.growing(linear, step)
    if mode is not None:
        # The inertia that a torque between the joint's two bodies moves.
        inertia = 1.0 / np.linalg.inv(linear.inertia)[mode.dof, mode.dof]
        # Removes the rounding of the numerical slopes.
        damping, stiffness = (
            round(float(matrix[mode.dof, mode.dof]), 9) + 0.0
            for matrix in (linear.damping, linear.stiffness)
        )
        yield (
            f"{_joint_name(model, mode.dof)} has damping {damping:.4g}, stiffness {stiffness:.4g} "
            f"and inertia {inertia:.4g}: RK4 makes it grow by {mode.growth:.3g} in each step of "
            f"{step:g} s; use a step below {mode.step:.2g} s"
        )


def _driven_joints(model: Any, linear: Linear | None) -> Iterator[str]:
    if linear is None:
        return
    slopes = np.diag(linear.damping)
    for dof in np.flatnonzero(slopes < -1e-6 * np.abs(linear.damping).max()):
        yield (
            f"{_joint_name(model, dof)} has damping {slopes[dof]:.4g}: a damper or servo with "
            f"the wrong sign accelerates it without bound"
        )


def _short_lags(model: Any) -> Iterator[str]:
    """Yield the motors with a first-order lag that RK4 makes grow."""
    step = model.opt.timestep
    for motor in _lagging(model, mujoco.mjtDyn.mjDYN_FILTER):
        lag = model.actuator_dynprm[motor, 0]
        if step > _RK4_REACHES * lag:
            yield (
                f"actuator {model.actuator(motor).name!r} lags by {lag:g} s: RK4 makes its "
                f"activation grow at a step of {step:g} s; use one below {_RK4_REACHES * lag:.2g} s"
            )


def _inexact_lags(model: Any) -> Iterator[str]:
    """Yield the motors whose lag is not what they say.

    MuJoCo 4.0 applies the analytic integral of a step, 1 - exp(-x) with x = step / lag, to the mean
    slope of RK4's stages, which is 1 - x/2 + x^2/6 - x^3/24 of that at the step's start.
    """
    for motor in _lagging(model, mujoco.mjtDyn.mjDYN_FILTEREXACT):
        lag = max(float(model.actuator_dynprm[motor, 0]), mujoco.mjMINVAL)
        x = model.opt.timestep / lag
        kept = 1.0 + np.expm1(-x) * (1.0 - x / 2.0 + x**2 / 6.0 - x**3 / 24.0)
        becomes = f"{-model.opt.timestep / np.log(kept):.4g} s" if 0.0 < kept < 1.0 else "unstable"
        yield (
            f"actuator {model.actuator(motor).name!r} has dyntype filterexact: its lag of {lag:g} "
            f's becomes {becomes} with RK4; use dyntype="filter"'
        )


def _lagging(model: Any, kind: Any) -> Any:
    """Return the motors with that kind of lag which RK4 integrates."""
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4:
        return []
    return np.flatnonzero(model.actuator_dyntype == kind)


def _integrator(model: Any) -> Iterator[str]:
    jointed = model.nbody - 1 > np.count_nonzero(_free(model)) and model.njnt > _free(model).sum()
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_RK4 and jointed:
        name = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
        yield (
            f"the integrator is {name}, first order: with a wheel of 6 N m s the error of the bus "
            f"rate is 10 % within 100 s at a step of 10 ms, 1 % at 1 ms, and at most 1e-11 with "
            f'RK4 (measured); set integrator="RK4" (rates.integrator in a scenario)'
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


def _fluid(model: Any) -> Iterator[str]:
    if _free(model).any() and (model.opt.density > 0.0 or model.opt.viscosity > 0.0):
        yield (
            f"the medium has density {model.opt.density:g} kg/m^3 and viscosity "
            f"{model.opt.viscosity:g} Pa s: it brakes a free flyer; leave both out in space"
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


def _ignored_ranges(model: Any) -> Iterator[str]:
    for joint in np.flatnonzero((model.jnt_limited == 0) & np.any(model.jnt_range, axis=1)):
        low, high = model.jnt_range[joint]
        yield (
            f"{_joint_name(model, model.jnt_dofadr[joint])} has a range, {low:.4g} to {high:.4g}, "
            f'that is not enforced: limited="false"'
        )


def _imbalanced(model: Any, joint: int) -> bool:
    """Tell whether the joint's body has its mass off the axis or its principal axes tilted."""
    body, axis = model.jnt_bodyid[joint], model.jnt_axis[joint]
    offset = np.cross(axis, model.body_ipos[body] - model.jnt_pos[joint])
    principal = np.zeros(9)
    mujoco.mju_quat2Mat(principal, model.body_iquat[body])
    in_body = principal.reshape(3, 3)
    product = np.cross(axis, in_body @ (model.body_inertia[body] * (in_body.T @ axis)))
    # Far below any intended imbalance, far above rounding.
    scale = model.body_inertia[body].max()
    return bool(np.linalg.norm(offset) > 1e-12 or np.linalg.norm(product) > 1e-12 * scale)


def _free(model: Any) -> Any:
    return model.jnt_type == mujoco.mjtJoint.mjJNT_FREE


def _joint_name(model: Any, dof: Any) -> str:
    joint = model.joint(model.dof_jntid[dof])
    if joint.name:
        return f"joint {joint.name!r}"
    return f"joint {joint.id} (unnamed, of body {model.body(model.jnt_bodyid[joint.id]).name!r})"
