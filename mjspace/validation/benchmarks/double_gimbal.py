"""A satellite with a double-gimbal variable-speed CMG, its gimbals driven or free."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import dgvscmg_equations as dgvscmg
from mjspace.validation import meter, stand
from mjspace.validation.benchmark import (
    Benchmark,
    Bound,
    Conditions,
    Curve,
    Order,
    Picture,
    Readings,
)
from mjspace.validation.dgvscmg_equations import NONE

BUS = np.array([[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]])  # kg m^2
THESIS = dgvscmg.Vehicle(BUS, 0.001 * np.eye(3), 0.001 * np.eye(3), 0.016 * np.eye(3))
# Heavy gimbals with different principal moments, so that every term matters.
UNLIKE = dgvscmg.Vehicle(
    BUS, np.diag([0.30, 0.20, 0.15]), np.diag([0.12, 0.20, 0.25]), np.diag([0.016, 0.009, 0.009])
)
ATTITUDE = attitude.from_mrp(np.array([0.4, -0.3, 0.2]))
RATE = np.array([-0.1, -0.05, 0.2])  # rad/s
DRIVEN = np.array([0.01, -0.05, 73.0])  # rad/s, of outer gimbal, inner gimbal and wheel
FREE = np.array([0.01, -0.05, 20.0])  # rad/s, at the start
GAIN = 0.2  # N m s/rad and N m/rad, of a gimbal's servo: the open loop is unstable
STRIDE = 0.2  # s, between the knots of the torques: slow, so that degree 7 is exact to rounding


def exact(
    accelerations: Callable[[Array], Array], joint_rates: Array, duration: float
) -> Callable[[Array], Array]:
    """Return the states (n, 13) at times (n,) of the motion with ``accelerations(state)`` (6,)."""
    solution = solve_ivp(
        lambda _, y: dgvscmg.derivative(y, accelerations(y)),
        (0.0, duration),
        np.concatenate([ATTITUDE, np.zeros(3), RATE, joint_rates]),
        "DOP853",
        dense_output=True,
        rtol=1e-13,
        atol=1e-14,
    ).sol
    return lambda time: np.asarray(solution(time).T)


def printed_slip(vehicle: dgvscmg.Vehicle, y: Array) -> Array:
    """Return the error (3,) [N m] of (2.47) as printed, with M_b w instead of M w.

    Erratum E1: w x (M_go + M_gi + M_w) w is missing.
    """
    mass, _ = dgvscmg.balance(vehicle, y)
    return dgvscmg.cross_matrix(y[7:10]) @ (mass[:3, :3] - vehicle.bus) @ y[7:10]


def drive(conditions: Conditions, vehicle: dgvscmg.Vehicle) -> Readings:
    """Turn the gimbals at constant rates, by the torques of the equations and a weak servo."""

    def driven(y: Array) -> tuple[Array, Array]:
        erratum = conditions.fault == "erratum"
        return dgvscmg.driven(vehicle, y, outside=printed_slip(vehicle, y) if erratum else NONE)

    duration = 15.0 if conditions.short else 60.0
    motion = exact(lambda y: driven(y)[0], DRIVEN, duration)
    knots = np.linspace(0.0, duration, round(duration / STRIDE) + 1)
    torque = make_interp_spline(knots, [driven(y)[1] for y in motion(knots)], k=7)
    half = 0.5 * conditions.step
    theory = torque(half * np.arange(round(duration / half) + 1))

    def motors(_: Any, data: Any, time: float) -> Array:
        force = np.zeros(9)
        force[6:] = theory[round(time / half)]
        force[6:8] += GAIN * (DRIVEN[:2] * (1.0 + time) - data.qpos[7:9] - data.qvel[6:8])
        return force

    record, measured = _fly(conditions, vehicle, DRIVEN, duration, motors)
    theory = theory[: 2 * len(measured) : 2]
    few = slice(None, None, max(1, len(measured) // 200))
    begin = conditions.step * np.arange(len(measured), dtype=np.float64)
    off, values = _compare(record, motion(record.time))
    return Readings(
        values=values | {"joint torque": float(np.abs(measured - theory).max())},
        motion=Picture.of(
            "motor torque [N m]", begin[few], "outer inner", theory[few, :2], measured[few, :2]
        ),
        error=off,
    )


def release(conditions: Conditions) -> Readings:
    """Fly gimbals with different principal moments, and the wheel, without motors."""

    def free(y: Array) -> Array:
        erratum = conditions.fault == "erratum"
        return dgvscmg.free(UNLIKE, y, outside=printed_slip(UNLIKE, y) if erratum else NONE)

    duration = 15.0 if conditions.short else 60.0
    record, _ = _fly(conditions, UNLIKE, FREE, duration)
    truth = exact(free, FREE, duration)(record.time)
    off, values = _compare(record, truth)
    of_bus = float(0.5 * RATE @ BUS @ RATE)
    return Readings(
        values=values | {"energy": meter.drift(meter.kinetic_energy(record), scale=of_bus)},
        motion=Picture.of(
            "gimbal angle [rad]", record.time, "outer inner", truth[:, 4:6], record.qpos[:, 7:9]
        ),
        error=off,
    )


def _compare(record: stand.Record, truth: Array) -> tuple[Curve, dict[str, float]]:
    off = attitude.rotation_angle(record.qpos[:, 3:7], truth[:, :4])
    of_bus = float(np.linalg.norm(BUS @ RATE))
    values = {
        "attitude": float(off.max()),
        "bus rate": float(np.abs(record.qvel[:, 3:6] - truth[:, 7:10]).max()),
        "gimbal angle": float(np.abs(record.qpos[:, 7:9] - truth[:, 4:6]).max()),
        "momentum": meter.drift(meter.angular_momentum(record), scale=of_bus),
    }
    return Curve("attitude error [rad]", record.time, off), values


def _fly(
    conditions: Conditions,
    vehicle: dgvscmg.Vehicle,
    joint_rates: Array,
    duration: float,
    motors: stand.Load | None = None,
) -> tuple[stand.Record, Array]:
    """Return the flight, and the torques on the axes [N m] (steps - 1, 3) where the steps begin."""

    def equip(spec: Any) -> None:
        for name in ("outer", "inner", "wheel"):
            spec.body(name).inertia = np.diag(getattr(vehicle, name))

    model = stand.build(conditions, "double_gimbal", adapt=equip)
    data = stand.start(model)
    data.qpos[3:7] = ATTITUDE
    data.qvel[3:9] = *RATE, *joint_rates
    measured = []

    def read_sensors(_: Any, data: Any, time: float) -> None:
        # Sensors are of the start of the previous step; there is none at the first.
        if time > 0.0:
            measured.append(data.sensordata[[2, 4, 6]])  # outer z, inner y, wheel x

    record = stand.fly(conditions, model, data, duration, load=motors, before_step=read_sensors)
    return record, np.array(measured)


_SOURCE = (
    "J. Servin Aguilar, Control de orientacion para satelites con compensacion de vibracion, UNAM "
    "2022, {}, corrected, integrated by DOP853 to 1e-13"
)
_ERRATUM = "(2.47) as printed, with M_b w for the whole M w in the gyroscopic term (E1)"
BENCHMARKS = (
    Benchmark(
        name="double-gimbal",
        title="Double-gimbal variable-speed CMG, driven",
        shows=(
            "The flight of the thesis that derives the equations, its Table 2.1: the gimbals turn "
            "at constant rates, through the singularity at 90 deg, and the motors' torques are "
            "those of the equations."
        ),
        source=_SOURCE.format("(2.47), (2.48) and the torques under (2.62)"),
        step=0.005,
        bounds=(
            Bound("attitude", "rad", 2e-11, "1e-12 measured, 12 000 steps' rounding"),
            Bound("bus rate", "rad/s", 2e-12, "1.6e-13 measured, rounding"),
            Bound("gimbal angle", "rad", 2e-11, "as the joint torque; 1.4e-12 measured"),
            Bound(
                "joint torque",
                "N m",
                3e-10,
                "RK4 at the gimbals' nutation, 67 rad/s, hence the step; 2.7e-11 measured",
            ),
            Bound("momentum", "of the bus", 1e-12, "6e-14 measured, rounding"),
        ),
        fly=partial(drive, vehicle=THESIS),
        catches={
            "integrator": "",
            "held": "the motors' torques held over the step",
            "inertia": "",
        },
    ),
    Benchmark(
        name="unlike-gimbals",
        title="Driven gimbals with different principal moments",
        shows=(
            "The thesis' gimbals have equal principal moments, for which the printed equation and "
            "the corrected one agree. With different ones the printed one is off by 0.4 deg in 15 "
            "s."
        ),
        source=_SOURCE.format("(2.47), (2.48) and the torques under (2.62)"),
        step=0.01,
        bounds=(
            Bound("attitude", "rad", 2e-11, "7e-13 measured, 6000 steps' rounding"),
            Bound("bus rate", "rad/s", 2e-12, "1.4e-13 measured, rounding"),
            Bound("gimbal angle", "rad", 3e-11, "as the joint torque; 2.4e-12 measured"),
            Bound("joint torque", "N m", 2e-11, "RK4 at a nutation of 4 rad/s; 1.5e-12 measured"),
            Bound("momentum", "of the bus", 2e-12, "2e-13 measured, rounding"),
        ),
        fly=partial(drive, vehicle=UNLIKE),
        catches={
            "integrator": "",
            "held": "the motors' torques held over the step",
            "erratum": _ERRATUM,
            "inertia": "",
        },
    ),
    Benchmark(
        name="free-gimbals",
        title="Double gimbal without motors",
        shows=(
            "Without motors the wheel keeps its direction, the gimbals swing as the bus tumbles "
            "around it, and errors are not hidden by a servo: armature on a gimbal causes degrees."
        ),
        source=_SOURCE.format("(2.47), (2.48) and the torques under (2.62), all zero"),
        step=0.01,
        bounds=(
            Bound(
                "attitude",
                "rad",
                5e-9,
                "the gimbals' error by their share of the inertia; 7e-10 measured",
            ),
            Bound("bus rate", "rad/s", 1e-9, "as the attitude; 1.1e-10 measured"),
            Bound(
                "gimbal angle",
                "rad",
                4e-8,
                "RK4's phase error of the gimbals' nutation over 60 s; 4e-9 measured",
            ),
            Bound("momentum", "of the bus", 2e-11, "RK4's, as the energy; 1.7e-12 measured"),
            Bound("energy", "of the bus", 2e-10, "exchanged at the nutation; 1.8e-11 measured"),
        ),
        fly=release,
        catches={"armature": "", "integrator": "", "erratum": _ERRATUM, "inertia": ""},
        order=Order(("attitude", "gimbal angle"), (0.04, 0.02, 0.01)),
    ),
)
