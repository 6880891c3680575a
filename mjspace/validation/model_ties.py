"""Connections of a model to the world, constraints and dissipation: what limits conservation."""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

_FREE = mujoco.mjtJoint.mjJNT_FREE
_FEW = 6
_GEOMS = (int(mujoco.mjtWrap.mjWRAP_SPHERE), int(mujoco.mjtWrap.mjWRAP_CYLINDER))
_BODIES = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))


def findings(model: Any) -> Iterator[str]:
    """Yield what is unusual in the model of one spacecraft: its free joints and fixed bodies."""
    free = [joint for joint in range(model.njnt) if model.jnt_type[joint] == _FREE]
    if not free:
        yield (
            f"no free joint: the vehicle is attached to the world by {_joints(model)}, and its "
            f"momentum cannot be checked; for a free flyer give its bus a <freejoint/>"
        )
    if len(free) > 1:
        bodies = ", ".join(name(model, "body", model.jnt_bodyid[joint]) for joint in free)
        yield (
            f"{len(free)} free joints, of {bodies}: momentum is the total of all, and a scenario "
            f"takes the first alone as its bus"
        )
    fixed = [
        body
        for body in range(1, model.nbody)
        if model.body_weldid[body] == 0 and model.body_mass[body] > 0.0
    ]
    if fixed:
        bodies = ", ".join(f"{name(model, 'body', b)} {model.body_mass[b]:.6g} kg" for b in fixed)
        yield f"fixed to the world, without effect on the motion: {bodies}"


def to_the_world(model: Any) -> list[str]:
    """Return what can exert a force between the moving bodies and the world.

    Momentum is conserved only if there is none.
    """
    held = [_joints(model)] if _hinged_to_world(model) else []
    for joint in np.flatnonzero(model.jnt_type == _FREE):
        dofs = slice(model.jnt_dofadr[joint], model.jnt_dofadr[joint] + 6)
        if (
            np.any(model.dof_damping[dofs])
            or np.any(model.dof_dampingpoly[dofs])
            or np.any(model.dof_frictionloss[dofs])
            or model.jnt_stiffness[joint]
            or np.any(model.jnt_stiffnesspoly[joint])
        ):
            held.append(f"a spring, damper or friction of {name(model, 'joint', joint)}")
    held += [name(model, "equality", number) for number in _anchored_equalities(model)]
    return held + [name(model, "tendon", number) for number in _anchored_tendons(model)]


def soft(model: Any) -> list[str]:
    """Return the constraints that always act, as stiff springs and dampers.

    Friction and stops, whose force is discontinuous, are not among them.
    """
    off = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_EQUALITY
    if model.opt.disableflags & off:
        return []
    return [name(model, "equality", e) for e in np.flatnonzero(model.eq_active0)]


def dissipators(model: Any) -> list[str]:
    """Return what dissipates energy: dampers and friction."""
    damped = (
        ("damping", ("dof_damping", "dof_dampingpoly", "tendon_damping", "tendon_dampingpoly")),
        ("actuators' damping", ("actuator_damping", "actuator_dampingpoly")),
        ("flex damping", ("flex_damping", "flex_edgedamping")),
    )
    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_DAMPER
    found = [what for what, arrays in damped if not off and _any(model, *arrays)]
    return [*found, *(["friction"] if has_friction(model) else [])]


def springs_yield(model: Any) -> bool:
    """Tell whether springs are plastic: their energy is not in MuJoCo's sum, their force kinks."""
    plastic = ("jnt_plasticadr", "tendon_plasticadr", "flex_plasticadr")
    return any(bool(np.any(getattr(model, array) >= 0)) for array in plastic)


def has_friction(model: Any) -> bool:
    """Tell whether dry friction acts."""
    off = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    if model.opt.disableflags & off:
        return False
    return _any(model, "dof_frictionloss", "tendon_frictionloss")


def has_stops(model: Any) -> bool:
    """Tell whether joints or tendons have stops that are enforced."""
    off = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    if model.opt.disableflags & off:
        return False
    return _any(model, "jnt_limited", "tendon_limited")


def name(model: Any, kind: str, number: Any) -> str:
    """Return an element's name for a message, or its number in the model."""
    element = getattr(model, kind)(int(number))
    return f"{kind} {element.name!r}" if element.name else f"{kind} {number}"


def _hinged_to_world(model: Any) -> list[int]:
    """Return the joints, other than free ones, of bodies whose parent cannot move."""
    static = model.body_treeid < 0
    return [
        joint
        for joint in range(model.njnt)
        if model.jnt_type[joint] != _FREE and static[model.body_parentid[model.jnt_bodyid[joint]]]
    ]


def _joints(model: Any) -> str:
    """Return the names of the joints to the world, or their number where there are many."""
    joints = _hinged_to_world(model)
    if len(joints) > _FEW:
        return f"{len(joints)} joints"
    return ", ".join(name(model, "joint", joint) for joint in joints)


def _anchored_equalities(model: Any) -> Iterator[int]:
    if not soft(model):
        return
    for equality in np.flatnonzero(model.eq_active0):
        if model.eq_type[equality] in _BODIES:
            ends = np.array([model.eq_obj1id[equality], model.eq_obj2id[equality]])
            if model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE:
                ends = model.site_bodyid[ends]
            if np.any(model.body_treeid[ends] < 0):
                yield int(equality)


def _anchored_tendons(model: Any) -> Iterator[int]:
    """Yield the spatial tendons that exert forces on bodies that cannot move."""
    forces = (
        *("tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_dampingpoly"),
        *("tendon_frictionloss", "tendon_limited"),
    )
    for tendon in range(model.ntendon):
        if not any(np.any(getattr(model, array)[tendon]) for array in forces):
            continue
        first = model.tendon_adr[tendon]
        for wrap in range(first, first + model.tendon_num[tendon]):
            kind, thing = model.wrap_type[wrap], model.wrap_objid[wrap]
            if kind == mujoco.mjtWrap.mjWRAP_SITE:
                body = model.site_bodyid[thing]
            elif kind in _GEOMS:
                body = model.geom_bodyid[thing]
            else:
                continue
            if model.body_treeid[body] < 0:
                yield tendon
                break


def _any(model: Any, *arrays: str) -> bool:
    return any(np.any(getattr(model, array)) for array in arrays)
