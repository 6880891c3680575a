"""An unbalanced wheel: its force and torque on a clamped base, and the jitter of a free bus."""

from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import stand
from mjspace.validation.benchmark import (
    Benchmark,
    Bound,
    Conditions,
    Curve,
    Order,
    Picture,
    Readings,
)

STATIC = 5e-6  # kg m, the wheel's mass times its offset
DYNAMIC = 2e-6  # kg m^2, the integral of x z dm
SPEED = 600.0  # rad/s, 95.5 Hz
ONE_TURN = 2.0 * np.pi / SPEED  # s
MASS = 105.0  # kg, of all
TRANSVERSE = 10.0  # kg m^2, of all, about x and about y
AXIAL = 0.01  # kg m^2, of the wheel

DISPLACEMENT = STATIC / MASS  # m
TILT = DYNAMIC / (TRANSVERSE - AXIAL)  # rad


def exact_load(angle: Array) -> tuple[Array, Array]:
    """Return force [N] and torque [N m] that hold the clamped base, each (n, 3).

    ``angle`` (n,) [rad] is the wheel's.  The force is towards the axis, the torque is W z x H of a
    momentum whose part across z is -DYNAMIC W along the wheel's x.
    """
    zero = np.zeros_like(angle)
    force = -STATIC * SPEED**2 * np.stack([np.cos(angle), np.sin(angle), zero], axis=1)
    torque = -DYNAMIC * SPEED**2 * np.stack([-np.sin(angle), np.cos(angle), zero], axis=1)
    return force, torque


def exact_jitter(angle: Array) -> tuple[Array, Array]:
    """Return displacement [m] and tilt [rad] of the free bus, x + i y, each (n,).

    The centre of mass of all stays; It f' - i Jw W f - DYNAMIC W exp(i W t) = 0, the momentum
    across z, gives the tilt f.
    """
    turn = np.exp(1j * angle)
    return -DISPLACEMENT * turn, -1j * TILT * turn


def jitter(conditions: Conditions) -> Readings:
    """Measure the rotating wheel's force on a clamped bus, then the jitter of the free bus."""
    angle, load = _weigh(conditions)
    force, torque = exact_load(angle)
    record = _shake(conditions)
    time, turn = record.time, np.exp(1j * SPEED * record.time)
    displacement, tilt = exact_jitter(SPEED * time)
    moved = record.qpos[:, :2] @ [1.0, 1j]
    tilted = attitude.to_rotation_vector(record.qpos[:, 3:7])[:, :2] @ [1.0, 1j]
    # The motion is jitter, drift, and nutation at Jw W / It.
    steady = np.ones_like(turn)
    nutation = np.exp(1j * AXIAL * SPEED / TRANSVERSE * time)
    shaken, _, _ = _amplitudes(moved, turn, steady, time)
    swayed, _, excited = _amplitudes(tilted, turn, steady, nutation)
    return Readings(
        values={
            "force": np.abs(load[:, :3] - force).max() / (STATIC * SPEED**2),
            "torque": np.abs(load[:, 3:] - torque).max() / (DYNAMIC * SPEED**2),
            "displacement": abs(shaken / displacement[0] - 1.0),
            "tilt": abs(swayed / tilt[0] - 1.0),
            "nutation": abs(excited) / TILT,
        },
        motion=_first_turns(time, tilted),
        error=Curve("tilt error, of the tilt", time, np.abs(tilted - tilt) / TILT),
    )


def _first_turns(time: Array, tilted: Array) -> Picture:
    fine = np.linspace(0.0, 4.0 * ONE_TURN, 200)
    _, tilt = exact_jitter(SPEED * fine)
    early = time <= fine[-1]
    curves = []
    for name, truth, flown in (("x", tilt.real, tilted.real), ("y", tilt.imag, tilted.imag)):
        curves += [
            Curve(name, fine, truth),
            Curve(f"{name}, MuJoCo", time[early], flown[early], dots=True),
        ]
    return Picture("time [s]", "tilt of the free bus [rad]", tuple(curves))


def _weigh(conditions: Conditions) -> tuple[Array, Array]:
    """Return the wheel's exact angle [rad] (n,), and force and torque on the mount (n, 6)."""
    model = _model(conditions, clamped=True)
    data = stand.start(model)
    data.qvel[0] = SPEED
    readings = []

    def read(_: Any, data: Any, time: float) -> None:
        # Sensors are of the start of the previous step; there is none at the first.
        if time > 0.0:
            readings.append(data.sensordata.copy())

    stand.fly(conditions, model, data, ONE_TURN, before_step=read)
    return SPEED * conditions.step * np.arange(len(readings), dtype=np.float64), np.array(readings)


def _shake(conditions: Conditions) -> stand.Record:
    """Fly the free bus, starting on its steady jitter."""
    model = _model(conditions, clamped=False)
    data = stand.start(model)
    (displacement,), (tilt,) = exact_jitter(np.zeros(1))
    data.qpos[3:7] = attitude.from_rotation_vector(np.array([tilt.real, tilt.imag, 0.0]))
    data.qpos[0], data.qpos[1] = displacement.real, displacement.imag
    # The derivative of a rotating vector is i W times the vector.
    data.qvel[0], data.qvel[1] = -SPEED * displacement.imag, SPEED * displacement.real
    data.qvel[3], data.qvel[4] = -SPEED * tilt.imag, SPEED * tilt.real
    data.qvel[6] = SPEED
    return stand.fly(conditions, model, data, 0.5 if conditions.short else 2.0, samples=1000)


def _model(conditions: Conditions, *, clamped: bool) -> Any:
    def adapt(spec: Any) -> None:
        if clamped:
            spec.delete(spec.joint("free"))
        if conditions.fault == "sign":
            spec.body("wheel").fullinertia[4] *= -1.0  # xz

    return stand.build(conditions, "unbalanced_wheel", adapt=adapt)


def _amplitudes(values: Array, *columns: Array) -> Array:
    """Return the least-squares coefficients of the columns for ``values`` (n,)."""
    return np.asarray(np.linalg.lstsq(np.stack(columns, axis=1), values)[0])


BENCHMARKS = (
    Benchmark(
        name="imbalance",
        title="Static and dynamic imbalance of a wheel",
        shows=(
            "MuJoCo's force and torque sensors measure an unbalanced wheel to rounding, and RK4 "
            "has the jitter of a free bus to eight digits at 105 steps a turn. One step a turn is "
            "enough for a balanced wheel, but gives a wrong jitter."
        ),
        source="Newton and Euler for a turning rotor; closed forms, derived here",
        step=1e-4,
        bounds=(
            Bound(
                "force",
                "of itself",
                1e-12,
                "that of the wheel's angle, 100 roundings; 1e-14 measured",
            ),
            Bound(
                "torque",
                "of itself",
                5e-12,
                "rounding of I W^2 = 2160 N m, 3000 times as large; 5e-13 measured",
            ),
            Bound("displacement", "of itself", 1e-7, "(W h)^4 / 960 = 1.35e-8, as measured"),
            Bound("tilt", "of itself", 1e-7, "(W h)^4 / 960 = 1.35e-8, as measured"),
            Bound(
                "nutation",
                "of the tilt",
                4e-5,
                "(W h)^4 / 2880 of the jitter's rate, 1000 times as slow: 4.5e-6, as measured",
            ),
        ),
        fly=jitter,
        catches={
            "sign": "the product of inertia entered as the integral of x z dm, without its minus",
            "integrator": "",
            "inertia": "",
        },
        order=Order(("displacement", "tilt"), (4e-4, 2e-4, 1e-4)),
    ),
)
