"""The physics passport of any MJCF model: guards, conservation, order of convergence, step advice.

The model is flown free, without gravity, contact or control: moving as its first keyframe says
and, where that leaves a speed at zero, at a tenth of a radian or metre per second. What is
conserved then shows how far its integrator and step can be trusted.
"""

import copy
import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from pydantic import computed_field

from mjspace import guards
from mjspace.contract import Array
from mjspace.validation import convergence, meter, stand
from mjspace.validation.benchmark import Bound, Conditions
from mjspace.validation.convergence import Convergence
from mjspace.validation.results import Data, Row

MINUTE = 60.0  # s, that conservation is watched and steps are advised for
STIR = 0.1  # rad/s, m/s
CONSERVED = 1e-8
"""Relative drift in a minute that is allowed: a thousandth of what a star tracker sees."""
GOALS = (1e-9, 1e-6)  # rad in a minute
ORDERS_OFF = 0.3
"""How far an observed order may be from the scheme's: steps are coarse, and the motion any."""
_ORDERS = {"RK4": 4.0, "EULER": 1.0, "IMPLICIT": 1.0, "IMPLICITFAST": 1.0}


class Finding(Data):
    """What a guard said of the model."""

    refused: bool
    """Whether a scenario with this model would be refused, or only warned of."""
    text: str


class Passport(Data):
    """What was found out about a model."""

    model: str
    integrator: str
    step: float  # s
    findings: list[Finding]
    rows: list[Row]
    advice: list[str]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether no guard refuses the model and every bound held."""
        return not any(f.refused for f in self.findings) and all(row.passed for row in self.rows)


def issue(path: Path) -> Passport:
    """Measure the model in an MJCF file, or a compiled one in an MJB file.

    Raises:
        ValueError: MuJoCo cannot compile the file, or nothing in it moves.
        OSError: the file cannot be read.
    """
    model = _load(path)
    findings = list(_findings(model))
    free = _undisturbed(model)
    start = _stirred(free)
    found = convergence.observe(free, start)
    return Passport(
        model=str(path),
        integrator=_name(model),
        step=model.opt.timestep,
        findings=findings,
        rows=[*_conservation(free, start), *_order(free, found)],
        advice=list(_advice(free, start, found)),
    )


def _load(path: Path) -> Any:
    path.open("rb").close()  # MuJoCo's own message does not say why a file cannot be read
    try:
        if path.suffix not in (".xml", ".mjb"):
            raise ValueError("give an MJCF model, .xml, or a compiled one, .mjb")
        if path.suffix == ".mjb":
            model = mujoco.MjModel.from_binary_path(str(path))
        else:
            # Parts are found beside a file that is named in full.
            model = mujoco.MjSpec.from_file(str(path.resolve())).compile()
    except ValueError as error:
        raise ValueError(", ".join(str(error).splitlines())) from error
    if model.nv == 0:
        raise ValueError("nothing in it moves: it has no joints")
    return model


def _findings(model: Any) -> Iterator[Finding]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", guards.ModelWarning)
        try:
            guards.check(model)
        except ValueError as error:
            yield from (Finding(refused=True, text=line) for line in str(error).splitlines())
    yield from (Finding(refused=False, text=str(warning.message)) for warning in caught)


def _undisturbed(model: Any) -> Any:
    """Return a copy on which nothing acts from outside, and that does not reset itself."""
    free = copy.copy(model)
    free.opt.gravity[:] = 0.0
    free.opt.wind[:] = 0.0
    free.opt.density = free.opt.viscosity = 0.0
    free.opt.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_CONTACT
        | mujoco.mjtDisableBit.mjDSBL_ACTUATION
        | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    )
    return free


def _stirred(model: Any) -> Any:
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    # Alternating signs and no two speeds alike: no axis and no joint stays out of it.
    index = np.arange(model.nv)
    stir = STIR * (1.0 + 0.3 * np.cos(index)) * (-1.0) ** index
    data.qvel[:] = np.where(data.qvel == 0.0, stir, data.qvel)
    return data


def _conservation(model: Any, start: Any) -> Iterator[Row]:
    record = stand.fly(Conditions(model.opt.timestep), model, copy.copy(start), MINUTE)
    energy = meter.kinetic_energy(record) + meter.potential_energy(record)
    spin, size = _of_the_bus(model, start) or (0.0, energy[0])
    if spin:
        reason = "nothing acts from outside: what drifts is the integrator's error, or armature"
        yield Row.judged(
            Bound("angular momentum", "of the bus", CONSERVED, reason),
            meter.drift(meter.angular_momentum(record), spin),
        )
        place = meter.centre_of_mass(record)
        straight = place[0] + np.outer(record.time - record.time[0], _mean_velocity(record))
        reason = "it moves on a straight line, whatever turns inside"
        yield Row.judged(
            Bound("centre of mass", "m", CONSERVED, reason),
            float(np.linalg.norm(place - straight, axis=1).max()),
        )
    if _dissipates(model):
        bound = Bound("energy gained", "of the bus", CONSERVED, "dampers only take")
        yield Row.judged(bound, float(np.diff(energy).max(initial=0.0) / size))
    else:
        bound = Bound("energy", "of the bus", CONSERVED, "nothing in the model dissipates")
        yield Row.judged(bound, meter.drift(energy, size))


def _of_the_bus(model: Any, start: Any) -> tuple[float, float] | None:
    """Return momentum [N m s] and energy [J] of the first free flyer, turning as one body.

    The share of a fast wheel would hide the errors of the bus. None for a fixed base.
    """
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    if not free.size:
        return None
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, start)
    mujoco.mj_fullM(model, start, matrix)
    turning = slice(model.jnt_dofadr[free[0]] + 3, model.jnt_dofadr[free[0]] + 6)
    rate = start.qvel[turning]
    momentum = matrix[turning, turning] @ rate
    return float(np.linalg.norm(momentum)), float(0.5 * rate @ momentum)


def _mean_velocity(record: stand.Record) -> Array:
    mass = record.model.body_mass[record.model.body_weldid != 0].sum()
    velocity: Array = meter.linear_momentum(record)[0] / mass
    return velocity


def _dissipates(model: Any) -> bool:
    return bool(
        np.any(model.dof_damping)
        or np.any(model.dof_frictionloss)
        or np.any(model.tendon_damping)
        or np.any(model.tendon_frictionloss)
        or np.any(model.dof_dampingpoly)
    )


def _order(model: Any, found: Convergence) -> Iterator[Row]:
    expected = _ORDERS.get(_name(model))
    observed = convergence.slope(found)
    if expected is None or math.isnan(observed):
        return
    reason = f"{_name(model)} is of that order where nothing jumps, as contacts and limits do"
    yield Row.judged(Bound("order of convergence", "", ORDERS_OFF, reason, expected), observed)


def _advice(model: Any, start: Any, found: Convergence) -> Iterator[str]:
    if _name(model) != "RK4":
        yield f"{_name(model)} is of first order; with RK4 in its place:"
        model = copy.copy(model)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        found = convergence.observe(model, start)
    if not found:
        yield f"no step down to {model.opt.timestep / 4.0:.2g} s resolves this motion: try a tenth"
        return
    for goal in GOALS:
        step = convergence.step_for(found, goal, MINUTE)
        yield f"a step of {step:.2g} s keeps the attitude within {goal:.0e} rad for a minute"


def _name(model: Any) -> str:
    return str(mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_"))
