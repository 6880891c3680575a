"""The physics passport of any model: guards, conservation, order of convergence, step advice.

The model is flown free, without gravity, contact or control, and with a constraint solver that
leaves no residual. It starts from its first keyframe; velocities that are zero there are set to
about 0.1 rad/s or m/s, and what equality constraints hold together moves as one. The conserved
quantities measure the accuracy of its integrator and step. Quantities that cannot be judged this
way, such as energy with soft constraints, are reported with the reason.
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

from mjspace.validation import convergence, model_files, model_ties
from mjspace.validation.benchmark import Bound
from mjspace.validation.conservation import MINUTE, Flight
from mjspace.validation.convergence import Convergence
from mjspace.validation.model_files import Source
from mjspace.validation.results import Data, Row
from mjspace.vehicle import model_checks, stability

STIR = 0.1  # rad/s, m/s
GOALS = (1e-9, 1e-6)  # rad in a minute
ORDERS_OFF = 0.3
"""Allowed deviation of an observed order from the scheme's: steps are coarse, the motion is any."""
ADVISED_OFF = 1.0
"""Allowed deviation for the extrapolation of a step."""
_ORDERS = {"RK4": 4.0, "EULER": 1.0, "IMPLICIT": 1.0, "IMPLICITFAST": 1.0}
_JUMPING = mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS | mujoco.mjtDisableBit.mjDSBL_LIMIT


class Finding(Data):
    """A guard's finding."""

    refused: bool
    """Whether a scenario with this model is refused, or only warned of."""
    text: str


class Passport(Data):
    """Results for a model."""

    model: str
    integrator: str
    step: float  # s
    findings: list[Finding]
    rows: list[Row]
    advice: list[str]
    unjudged: list[str]
    """Quantities that were not judged, with the reason."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether no guard refuses the model and every bound held."""
        return not any(f.refused for f in self.findings) and all(row.passed for row in self.rows)


def issue(path: Path) -> Passport:
    """Measure the model in an MJCF or URDF file, or a compiled one in an MJB file.

    Raises:
        ValueError: MuJoCo cannot compile the file, nothing in it moves, or its step is not
            positive.
        OSError: the file cannot be read.
    """
    source = model_files.read(path)
    model = source.model
    if model.nv == 0:
        raise ValueError("nothing in it moves: it has no joints")
    if not model.opt.timestep > 0.0:
        raise ValueError(f"its timestep is {model.opt.timestep:g} s: it must be positive")
    free = _undisturbed(model)
    start = _stirred(free)
    flight = Flight(free, start, float(model.opt.tolerance))
    smooth = copy.copy(free)
    smooth.opt.disableflags |= _JUMPING
    orderly = not (model_ties.soft(model) or model_ties.springs_yield(model))
    found = convergence.observe(smooth, start) if orderly else []
    return Passport(
        model=str(path),
        integrator=_name(model),
        step=model.opt.timestep,
        findings=list(_findings(source, flight)),
        rows=[*flight.rows(), *_order(smooth, found)],
        advice=[*flight.advice(), *(_advice(smooth, start, found) if orderly else ())],
        unjudged=[*flight.unjudged(), *_left_out(source, flight), *_unresolved(smooth, found)],
    )


def _findings(source: Source, flight: Flight) -> Iterator[Finding]:
    model = source.model
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", model_checks.ModelWarning)
        try:
            model_checks.check(model)
        except ValueError as error:
            yield from (Finding(refused=True, text=line) for line in str(error).splitlines())
    end = flight.broken_off()
    if end is not None:
        text = f"flown free, its state is no longer finite after {end:g} s of {flight.duration:g} s"
        yield Finding(refused=True, text=text)
    texts = [*(str(warning.message) for warning in caught), *source.warnings]
    texts += model_ties.findings(model)
    texts += [] if source.spec is None else model_files.findings(source.spec)
    yield from (Finding(refused=False, text=text) for text in texts)


def _undisturbed(model: Any) -> Any:
    """Return a copy without external forces, contacts, control and automatic reset."""
    free = copy.copy(model)
    free.opt.gravity[:] = 0.0
    free.opt.wind[:] = 0.0
    free.opt.density = free.opt.viscosity = 0.0
    free.opt.tolerance = 0.0  # as in a scenario's flight
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
    # Alternating signs and different speeds, so that every axis and joint takes part.
    index = np.arange(model.nv)
    stir = STIR * (1.0 + 0.3 * np.cos(index)) * (-1.0) ** index
    data.qvel[:] = np.where(data.qvel == 0.0, stir, data.qvel)
    _hold_together(model, data)
    return data


def _hold_together(model: Any, data: Any) -> None:
    """Let velocities satisfy the equality constraints, as an impact that closes them all would.

    v - M^-1 J^T (J M^-1 J^T)^+ J v with their Jacobian J: the nearest in kinetic energy. Soft
    constraints would otherwise begin with a transient, in which little is conserved.
    """
    dense = copy.copy(model)
    dense.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    mujoco.mj_forward(dense, data)
    jacobian = data.efc_J[: data.nefc * model.nv].reshape(-1, model.nv)
    jacobian = jacobian[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    if not len(jacobian):
        return
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(dense, data, mass)
    pushed = np.linalg.solve(mass, jacobian.T)
    impulse = np.linalg.lstsq(jacobian @ pushed, jacobian @ data.qvel, rcond=1e-10)[0]
    data.qvel[:] -= pushed @ impulse


def _left_out(source: Source, flight: Flight) -> Iterator[str]:
    """Yield what the flights leave out, and what has no order of convergence."""
    model = source.model
    soft = model_ties.soft(model)
    if soft:
        yield (
            f"order and step with soft constraints ({', '.join(soft)}): they are stiff springs and "
            f"dampers, whose transients hide the integrator's error"
        )
    if model_ties.springs_yield(model):
        yield "order and step with springs that yield: their force has a corner"
    jumping = ["dry friction"] if model_ties.has_friction(model) else []
    jumping += ["stops that are reached"] if flight.hits_stops else []
    if jumping:
        yield (
            f"order and step with {' and '.join(jumping)}: discontinuous forces have no order; "
            f"both are judged without"
        )
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    if not model.opt.disableflags & off and np.any(model.geom_contype | model.geom_conaffinity):
        yield "contacts: every flight here is without them"
    if model.nu:
        yield (
            f"{model.nu} actuators: every flight here is without control"
            + (", their stiffness and damping about rest apart" if _is_rk4(model) else "")
        )
    if model.nv > stability.LARGEST:
        yield (
            f"the step's stability with springs, dampers and servos: {model.nv} degrees of freedom "
            f"are more than the {stability.LARGEST} up to which it is computed"
        )
    if source.spec is None:
        yield "the compiler's settings: a compiled model does not say how it was made"


def _order(model: Any, found: Convergence) -> Iterator[Row]:
    expected = _ORDERS.get(_name(model))
    observed = convergence.slope(found)
    if expected is None or math.isnan(observed) or _is_unresolved(model, found):
        return
    reason = f"{_name(model)} is of that order where nothing jumps, as friction and stops do"
    yield Row.judged(Bound("order of convergence", "", ORDERS_OFF, reason, expected), observed)


def _is_unresolved(model: Any, found: Convergence) -> bool:
    """Tell whether the error falls faster than the scheme's, as with a decaying stiff motion."""
    return convergence.slope(found) > _ORDERS.get(_name(model), math.inf) + ORDERS_OFF


def _advice(model: Any, start: Any, found: Convergence) -> Iterator[str]:
    if not _is_rk4(model):
        yield f"{_name(model)} is of first order; with RK4 in its place:"
        model = copy.copy(model)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        found = convergence.observe(model, start)
    if not found:
        yield f"no step down to {model.opt.timestep / 4.0:.2g} s resolves this motion: try a tenth"
        return
    what = "attitude" if np.any(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE) else "joints"
    yield from step_advice(found, what)


def step_advice(found: Convergence, what: str) -> Iterator[str]:
    """Yield the steps that keep ``what`` within ``GOALS``, if RK4's order was observed."""
    order = convergence.slope(found)
    if abs(order - _ORDERS["RK4"]) > ADVISED_OFF:
        steps = f"{found[0][0]:.2g} to {found[-1][0]:.2g} s"
        yield (
            f"no step can be advised: over steps of {steps} the error falls with order "
            f"{order:.2g}, not 4, so that no other step can be extrapolated"
        )
        return
    for goal in GOALS:
        step = convergence.step_for(found, goal, MINUTE)
        yield f"a step of {step:.2g} s keeps the {what} within {goal:.0e} rad for a minute"


def _unresolved(model: Any, found: Convergence) -> Iterator[str]:
    if _is_unresolved(model, found):
        yield (
            f"order: over steps of {found[0][0]:.2g} to {found[-1][0]:.2g} s the error falls with "
            f"order {convergence.slope(found):.2g}, faster than {_name(model)}'s own: a stiff "
            f"motion is only just resolved there"
        )


def _is_rk4(model: Any) -> bool:
    return bool(model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4)


def _name(model: Any) -> str:
    return str(mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_"))
