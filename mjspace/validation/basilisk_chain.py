"""MuJoCo against Basilisk: the same gimballed wheel on a free bus, at equal steps.

Two engines with independent code, formulation and attitude parameters.
"""

from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import stand
from mjspace.validation.basilisk_call import call
from mjspace.validation.benchmark import Bound, Conditions, Picture
from mjspace.validation.results import Line, Row, Section

STEP, DURATION, EVERY = 1e-3, 60.0, 0.5  # s
RATE = (-0.1, -0.05, 0.2)  # rad/s, of the bus
HINGES = ("outer", "inner", "wheel")
HINGE_RATES = (0.01, -0.05, 73.0)  # rad/s; those of the thesis on the double-gimbal CMG, Table 2.1
_BOUNDS: tuple[Bound, ...] = (
    Bound(
        "attitude",
        "rad",
        1e-10,
        "both are RK4 at one step: the difference is rounding; 6e-14 measured",
    ),
    Bound("rate", "rad/s", 1e-10, "as the attitude; 2e-15 measured"),
    Bound("gimbal angle", "rad", 1e-10, "as the attitude; 1e-13 measured"),
    Bound("wheel angle", "rad", 1e-10, "some 700 turns: rounding of 4400 rad; 1e-11 measured"),
)


def compare(python: str) -> Section:
    """Fly the vehicle here and in the Basilisk of the interpreter ``python``.

    Raises:
        BasiliskMissingError: the interpreter cannot be run, or has no bsk.
    """
    vehicle = describe(stand.build(Conditions(STEP), "offset_gimbals"))
    ours, theirs = _here(), call(python, "basilisk_chain_flight.py", vehicle)
    quaternions = attitude.from_mrp(np.array(theirs["mrp"]))
    angles = np.array(theirs["angles"])
    off = attitude.rotation_angle(ours.qpos[:, 3:7], quaternions)
    joints = np.abs(ours.qpos[:, 7:] - angles).max(axis=0)
    measured = (
        off.max(),
        np.abs(ours.qvel[:, 3:6] - theirs["rate"]).max(),
        joints[:2].max(),
        joints[2],
    )
    motion = Picture.of("angle [rad]", ours.time, "outer inner", angles[:, :2], ours.qpos[:, 7:9])
    return Section(
        name="basilisk",
        title=f"A gimballed wheel on a free bus, against Basilisk {theirs['version']}",
        shows=(
            "An engine that was written by others, from other equations, moves a bus, two gimbals "
            "and a wheel, none of them symmetric or concentric, as MuJoCo does."
        ),
        source="Basilisk's chain of spinning bodies under its own RK4; the lines are Basilisk's",
        step=STEP,
        rows=[Row.judged(b, float(m)) for b, m in zip(_BOUNDS, measured, strict=True)],
        faults=[],
        x_label=motion.x_label,
        y_label=motion.y_label,
        motion=[Line.of(curve) for curve in motion.curves],
        error_label="attitude error [rad]",
        errors={"RK4": Line(label="attitude error", x=list(ours.time), y=list(off))},
    )


def describe(model: Any) -> dict[str, Any]:
    """Return the vehicle of the compiled model as ``basilisk_chain_flight`` reads it.

    A free bus carries a chain of bodies, each on one hinge at angle zero; body frames are parallel
    to their parents'. SI units, vectors and matrices in the body's own frame.
    """
    bodies = [_body(model, name) for name in ("bus", *HINGES)]
    chain = zip(bodies[1:], HINGES, HINGE_RATES, strict=True)
    return {
        "step": STEP,
        "duration": DURATION,
        "every": EVERY,
        "rate": RATE,
        "bus": bodies[0],
        "chain": [
            body | {"axis": model.joint(hinge).axis.tolist(), "angle": 0.0, "rate": rate}
            for body, hinge, rate in chain
        ],
    }


def _body(model: Any, name: str) -> dict[str, Any]:
    body = model.body(name)
    principal = attitude.to_matrix(body.iquat)
    inertia: Array = principal * body.inertia @ principal.T
    return {
        "mass": float(body.mass[0]),
        "centre": body.ipos.tolist(),
        "position": body.pos.tolist(),
        "inertia": inertia.tolist(),
    }


def _here() -> stand.Record:
    conditions = Conditions(STEP)
    model = stand.build(conditions, "offset_gimbals")
    data = stand.start(model)
    data.qvel[3:6], data.qvel[6:9] = RATE, HINGE_RATES
    return stand.fly(conditions, model, data, DURATION, samples=round(DURATION / EVERY))
