"""Yo-yo despin: two weights on unwinding cords, released tangentially or radially."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from mjspace.contract import Array
from mjspace.validation import meter, stand
from mjspace.validation.benchmark import Benchmark, Bound, Conditions, Curve, Picture, Readings

AXIAL = 2.0  # kg m^2, of the bus without the weights
WEIGHTS = 0.5  # kg, both together
DRUM = 0.5  # m, radius
SPIN = 6.0  # rad/s, and the pace at which cord comes off

C = 1.0 + AXIAL / (WEIGHTS * DRUM**2)
TANGENTIAL = DRUM * np.sqrt(C)  # m of cord that leave no spin if let go as they come off
RADIAL = DRUM * (np.sqrt(C) - 1.0)  # m of cord that leave no spin if swung out first
PEAK = 1.5 * np.sqrt(3.0 / C) * AXIAL * SPIN**2 / (2.0 * DRUM)  # N, where phi^2 = c / 3
YO_YOS = ("yo_yo_0", "yo_yo_1")


def unwinding(unwound: Array) -> Array:
    """Return the spin [rad/s] with ``unwound`` radians of cord off the drum.

    Momentum and energy, c w + phi^2 (w + phi') and c w^2 + phi^2 (w + phi')^2 over m a^2, leave
    phi' = w0 and the spin.
    """
    return np.asarray(SPIN * (C - unwound**2) / (C + unwound**2))


def swinging(cord: float, angle: Array) -> tuple[Array, Array]:
    """Return spin and swing rate [rad/s] when a cord of that length [m] has swung by ``angle``.

    The angle [rad] is 0 on the tangent and pi/2 where the cord points outwards. The same two
    integrals, with the weights at r^2 = a^2 + l^2 + 2 a l sin(angle).
    """
    momentum = C * DRUM**2 * SPIN
    lean = cord * (cord + DRUM * np.sin(angle))
    moment = C * DRUM**2 + cord**2 + 2.0 * DRUM * cord * np.sin(angle)
    rate = np.sqrt(momentum * (SPIN * moment - momentum) / (cord**2 * moment - lean**2))
    return (momentum - rate * lean) / moment, rate


def swing_time(cord: float, angles: Array) -> Array:
    """Return when the cord has swung by each of ``angles`` [rad] since it was unwound [s]."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = np.diff(angles) / 2.0
    inside = (angles[:-1] + half)[:, None] + half[:, None] * nodes
    return np.concatenate([[0.0], np.cumsum(half * ((1.0 / swinging(cord, inside)[1]) @ weights))])


OUTWARDS = RADIAL / DRUM / SPIN + swing_time(RADIAL, np.array([0.0, np.pi / 2.0]))[-1]  # s
HALF_SPIN = swinging(0.5 * RADIAL, np.array(np.pi / 2.0))[0]  # rad/s


def let_go(conditions: Conditions) -> Readings:
    """Unwind the cords, release them at their end, and measure the remaining spin."""
    tension = [0.0]

    def read(model: Any, data: Any, time: float) -> None:
        # The cord's tension keeps the weights from sliding outwards.
        tension.append(-data.qfrc_constraint[7] - data.qfrc_constraint[9])

    model, data, begin = _wound(conditions, TANGENTIAL)
    unwound = stand.fly(
        conditions, model, data, (TANGENTIAL / DRUM - begin) / SPIN, before_step=read
    )
    _switch(model, data, "wound", False)
    record = stand.joined(unwound, stand.fly(conditions, model, data, 0.3, samples=20))
    spin = record.qvel[:, 5]
    exact = unwinding(np.minimum(begin + SPIN * record.time, TANGENTIAL / DRUM))
    off = np.abs(spin - exact) / SPIN
    return Readings(
        values={
            "spin": off.max(),
            "spin left": abs(spin[-1]) / SPIN,
            "tension": max(tension),
            "momentum": meter.drift(meter.angular_momentum(record)),
            "energy": meter.drift(meter.kinetic_energy(record)),
        },
        motion=Picture.of("spin [rad/s]", record.time, "w", exact[:, None], spin[:, None]),
        error=Curve("spin error, of the first spin", record.time, off),
    )


def swing_out(conditions: Conditions) -> Readings:
    """Unwind a cord and swing it until it points outwards; then the same at half the length."""
    record, begin = _swing(conditions, RADIAL)
    time = begin / SPIN + record.time
    angles = np.linspace(0.0, 2.0, 200)
    swung = CubicSpline(swing_time(RADIAL, angles), angles)(
        np.maximum(time - RADIAL / DRUM / SPIN, 0.0)
    )
    exact = np.where(swung > 0.0, swinging(RADIAL, swung)[0], unwinding(SPIN * time))
    spin = record.qvel[:, 5]
    off = np.abs(spin - exact) / SPIN
    moment, left = _outwards(record, RADIAL)
    _, half = _outwards(_swing(conditions, 0.5 * RADIAL)[0], 0.5 * RADIAL)
    return Readings(
        values={
            "spin": off.max(),
            "spin left": abs(left) / SPIN,
            "outwards": moment + begin / SPIN,
            "half cord": half,
            "momentum": meter.drift(meter.angular_momentum(record)),
            "energy": meter.drift(meter.kinetic_energy(record)),
        },
        motion=Picture.of("spin [rad/s]", time, "w", exact[:, None], spin[:, None]),
        error=Curve("spin error, of the first spin", time, off),
    )


def _wound(conditions: Conditions, cord: float) -> tuple[Any, Any, float]:
    """Return model, data, and what is unwound [rad]: all but whole hundredths of a second.

    With nothing unwound a weight could not tell turning from sliding, and MuJoCo not either.
    """
    way = -1.0 if conditions.fault == "erratum" else 1.0

    def cut(spec: Any) -> None:
        for name in YO_YOS:
            hinge, slide = spec.joint(f"{name}_unwind"), spec.joint(f"{name}_pay_out")
            spec.body(f"{name}_weight").pos = [DRUM, -way * cord, 0.0]
            hinge.pos, hinge.ref = [-DRUM, way * cord, 0.0], way * cord / DRUM
            slide.axis, slide.ref = [0.0, -way, 0.0], cord
            spec.equality(f"{name}_wound").data[1] = way * DRUM

    model = stand.build(conditions, "yo_yo", adapt=cut)
    data = stand.start(model)
    begin = cord / DRUM % (0.01 * SPIN)
    data.qpos[7:11] = [way * begin, DRUM * begin] * 2
    data.qvel[5] = SPIN if way < 0.0 else unwinding(np.array(begin))
    data.qvel[6:10] = [way * SPIN, DRUM * SPIN] * 2
    return model, data, begin


def _swing(conditions: Conditions, cord: float) -> tuple[stand.Record, float]:
    """Return the flight past where the cords point outwards, and what was unwound before [rad]."""
    model, data, begin = _wound(conditions, cord)
    unwound = stand.fly(conditions, model, data, (cord / DRUM - begin) / SPIN)
    _switch(model, data, "wound", False)
    _switch(model, data, "taut", True)
    return stand.joined(unwound, stand.fly(conditions, model, data, 0.24, samples=240)), begin


def _switch(model: Any, data: Any, equality: str, active: bool) -> None:
    for name in YO_YOS:
        data.eq_active[model.equality(f"{name}_{equality}").id] = active


def _outwards(record: stand.Record, cord: float) -> tuple[float, float]:
    """Return when the first cord points outwards [s], and the spin then [rad/s]; NaN if never."""
    turned = record.qpos[:, 7] - cord / DRUM
    across = DRUM * np.sin(turned) - record.qpos[:, 8] * np.cos(turned)
    moment = [*CubicSpline(record.time, across).roots(extrapolate=False), np.nan][0]
    return moment, float(CubicSpline(record.time, record.qvel[:, 5])(moment))


BENCHMARKS = (
    Benchmark(
        name="yo-yo",
        title="Yo-yo despin, let go tangentially",
        shows=(
            "Constraints can be trusted to 1e-7 if they are linear in the joints, as stiff as the "
            "step allows, and satisfied at a reference pose with a regular mass matrix. With "
            "MuJoCo's default softness 0.6 % of the spin remains, with a singular pose all of it."
        ),
        source=(
            "Fedor, Theory and Design Curves for a Yo-Yo De-Spin Mechanism for Satellites, NASA "
            "TN D-708, 1961; derived here from the two integrals"
        ),
        step=0.001,  # all is over in 0.7 s, when the cord is off; no flight of a minute exists
        bounds=(
            Bound("spin", "of the first", 1e-6, "falls with h^2, the softness; 7e-8 measured"),
            Bound(
                "spin left", "of the first", 1e-6, "as above, and rest stays rest; 7e-8 measured"
            ),
            Bound("tension", "N", 5e-4, "read once a step; 4e-5 measured", PEAK),
            Bound("momentum", "of the total", 3e-10, "w turns by 6 mrad a step; 4e-11 measured"),
            Bound("energy", "of the total", 5e-7, "the spin's error; 3e-8 measured"),
        ),
        fly=let_go,
        catches={
            "erratum": "#10: the cord wound the other way, where the weights just fly off",
            "integrator": "",
            "armature": "",
            "inertia": "",
        },
    ),
    Benchmark(
        name="yo-yo-radial",
        title="Yo-yo despin, swung out",
        shows=(
            "A swinging cord is a curved constraint: MuJoCo neglects its centripetal acceleration "
            "in tendons and lets them stretch by 4 h^2 of it, here by 0.1 mm. That is second order "
            "in the step, and the error of a taut tendon."
        ),
        source="classic closed form, derived here from the two integrals, and one quadrature",
        step=0.001,  # 0.74 s until the cord points outwards, and that is the end
        bounds=(
            Bound("spin", "of the first", 2e-4, "stretch 0.1 mm of 1.6 m; 2e-5 measured"),
            Bound("spin left", "of the first", 1e-4, "as above; 1.1e-5 measured"),
            Bound("outwards", "s", 2e-4, "as above; 1.7e-5 measured", float(OUTWARDS)),
            Bound("half cord", "rad/s", 4e-4, "as above; 4e-5 measured", float(HALF_SPIN)),
            Bound("momentum", "of the total", 5e-8, "RK4 on a cord's stiffness; 5e-9 measured"),
            Bound("energy", "of the total", 1e-3, "45 N over the stretch; 1.1e-4 measured"),
        ),
        fly=swing_out,
        catches={"integrator": "", "armature": "", "inertia": ""},
    ),
)
