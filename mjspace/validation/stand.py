"""The test stand: builds a benchmark's model, with an injected fault if requested, and flies it.

Forces of a benchmark are evaluated in MuJoCo's stages, through ``mjcb_passive``, as a function of
state and time alone. The callback is global, so that flights need separate processes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.scenario.environment import Environment
from mjspace.validation.benchmark import Conditions, Fault

Load = Callable[[Any, Any, float], Array]
"""(model, data, time [s]) -> generalized force, shape (nv,). Positions and velocities are those of
the stage. Use ``time``, not ``data.time``, which has rounding errors."""

MODELS = Path(str(files("mjspace.assets"))) / "validation"


@dataclass(frozen=True, eq=False)
class Record:
    """A sampled flight, including its start and its end; compared by identity."""

    model: Any
    time: Array  # s, shape (n,)
    qpos: Array  # shape (n, nq)
    qvel: Array  # shape (n, nv)


def build(
    conditions: Conditions,
    name: str,
    *,
    adapt: Callable[[Any], None] | None = None,
    outside: Environment | None = None,
) -> Any:
    """Return the compiled ``assets/validation/<name>.xml``, with the fault of ``conditions``.

    ``adapt`` changes the ``MjSpec`` before it is compiled; ``outside`` is the environment that is
    passed to ``start``.
    """
    spec = mujoco.MjSpec.from_file(str(MODELS / f"{name}.xml"))
    if adapt is not None:
        adapt(spec)
    integrator = "Euler" if conditions.fault == "integrator" else conditions.integrator
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.timestep = conditions.step
    if outside is not None:
        spec.nuserdata = userdata_size(outside)
    model = spec.compile()
    _inject(model, conditions.fault)
    return model


def start(model: Any, outside: Environment | None = None) -> Any:
    """Return a new ``MjData``, with ``outside`` as mjspace's native environment if it is set."""
    data = mujoco.MjData(model)
    install_callbacks()
    if outside is not None:
        data.userdata[:] = userdata(model, outside)
    return data


def fly(
    conditions: Conditions,
    model: Any,
    data: Any,
    duration: float,
    *,
    load: Load | None = None,
    before_step: Callable[[Any, Any, float], None] | None = None,
    samples: int = 200,
) -> Record:
    """Advance ``data`` by ``duration`` [s], rounded to a whole number of steps.

    A state that is not finite ends the flight; it is the last row of the record.
    """
    step, begin = model.opt.timestep, data.time
    steps = round(duration / step)
    marks = np.unique(np.linspace(0, steps, min(samples, steps) + 1).astype(int))
    rows = [(begin, data.qpos.copy(), data.qvel.copy())]
    install = _installer(load)
    install()
    try:
        for first, last in pairwise(marks):
            if before_step is None and conditions.fault != "held":
                mujoco.mj_step(model, data, last - first)
            else:
                for index in range(first, last):
                    if before_step is not None:
                        before_step(model, data, begin + index * step)
                    if conditions.fault == "held":
                        _hold_loads(model, data)
                        mujoco.mj_step(model, data)
                        install()
                    else:
                        mujoco.mj_step(model, data)
            rows.append((begin + last * step, data.qpos.copy(), data.qvel.copy()))
            if not np.all(np.isfinite(data.qvel)):
                break
    finally:
        install_callbacks()
    time, qpos, qvel = map(np.array, zip(*rows, strict=True))
    return Record(model, time, qpos, qvel)


def joined(*records: Record) -> Record:
    """Return the phases of one flight as one record; each begins where the last one ended."""
    first, *others = records
    return Record(
        first.model,
        np.concatenate([first.time, *(r.time[1:] for r in others)]),
        np.concatenate([first.qpos, *(r.qpos[1:] for r in others)]),
        np.concatenate([first.qvel, *(r.qvel[1:] for r in others)]),
    )


def _installer(load: Load | None) -> Callable[[], None]:
    if load is None:
        return install_callbacks

    def passive(model: Any, data: Any) -> None:
        half = 0.5 * model.opt.timestep
        data.qfrc_passive += load(model, data, round(data.time / half) * half)

    return lambda: mujoco.set_mjcb_passive(passive)


def _hold_loads(model: Any, data: Any) -> None:
    """Hold the present loads for a whole step, like a loop that sets forces before each step."""
    mujoco.mj_forward(model, data)
    acting = data.qfrc_passive.copy()
    mujoco.set_mjcb_passive(None)
    mujoco.mj_forward(model, data)
    data.qfrc_applied = acting - data.qfrc_passive


def _inject(model: Any, fault: Fault | None) -> None:
    if fault == "armature":
        jointed = model.jnt_dofadr[model.jnt_type != mujoco.mjtJoint.mjJNT_FREE]
        # A single body's free joint inherits armature from the default class.
        dofs = [d for d in jointed if d >= 0] or list(range(3, 6))
        model.dof_armature[dofs] += 0.1 * model.dof_M0[dofs]
    elif fault == "inertia":
        model.body_inertia[1] *= [1.01, 0.99, 1.01]
    else:
        return
    mujoco.mj_setConst(model, mujoco.MjData(model))
