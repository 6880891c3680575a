"""Nutation dampers: a ball in a tube, a ring of fluid; spin about the major and the minor axis."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
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
from mjspace.validation.kinematics import quaternion_slope

Vector = tuple[float, float, float]

TIME = np.linspace(0.0, 60.0, 61)  # s
NUTATING: Vector = (0.01, 0.0, 2.0)  # rad/s, at the start
BUS_MASS, BALL_INERTIA = 100.0, 8.4e-6  # kg, kg m^2
MOUNT = 0.8  # m, from the bus's centre of mass along x to the tube


@dataclass(frozen=True)
class Tube:
    """A bus with a ball that slides along z in its tube."""

    bus: Vector  # kg m^2, principal moments
    mass: float = 0.1  # kg, of the ball
    stiffness: float = 0.1  # N/m
    damping: float = 0.2  # N s/m

    model = "tube_damped"
    internal = (0.0, 0.0)
    """z and p at the start, the ball at rest in the middle."""

    @property
    def momentum(self) -> Vector:
        """About the centre of mass at the start [N m s]."""
        I1, _, I3 = (moment + BALL_INERTIA for moment in self.bus)
        return I1 * NUTATING[0], 0.0, (I3 + self._reduced_mass * MOUNT**2) * NUTATING[2]

    @property
    def _reduced_mass(self) -> float:
        return BUS_MASS * self.mass / (BUS_MASS + self.mass)

    def adapt(self, spec: Any) -> None:
        """Set these parameters in a ``MjSpec``."""
        spec.body("bus").inertia = self.bus
        spec.body("damper_ball").mass = self.mass
        spec.joint("damper_slide").stiffness[0] = self.stiffness
        spec.joint("damper_slide").damping[0] = self.damping

    def motion(self, h: Vector, z: float, p: float) -> tuple[Vector, tuple[float, ...]]:
        """Return the bus's rates, and the slopes of ``z`` [m] and of its momentum ``p`` [N s].

        ``h`` is the whole momentum in body axes. With the reduced mass m and r = (b, 0, z) the
        kinetic energy is w.J(z) w / 2 + m w.(r x r') + m z'^2 / 2, so that p = m (z' - b w2).
        """
        m, b = self._reduced_mass, MOUNT
        I1, I2, I3 = (moment + BALL_INERTIA for moment in self.bus)
        J11, J13, J33 = I1 + m * z * z, -m * b * z, I3 + m * b * b
        determinant = J11 * J33 - J13 * J13
        w1 = (J33 * h[0] - J13 * h[2]) / determinant
        w2 = (h[1] + b * p) / (I2 + m * z * z)
        w3 = (J11 * h[2] - J13 * h[0]) / determinant
        speed = p / m + b * w2
        driven = m * (z * (w1 * w1 + w2 * w2) - b * w1 * w3)
        return (w1, w2, w3), (speed, driven - self.stiffness * z - self.damping * speed)


@dataclass(frozen=True)
class Ring:
    """A bus with a ring of fluid about its x axis, its centre the bus's."""

    whole: Vector  # kg m^2, principal moments with the ring's
    axial: float = 0.3  # kg m^2, of the ring, and half of it about a diameter
    damping: float = 0.3  # N m s/rad

    model = "ring_damped"

    @property
    def internal(self) -> tuple[float]:
        """p at the start, the ring at rest in its tube."""
        return (self.axial * NUTATING[0],)

    @property
    def momentum(self) -> Vector:
        """About the centre of mass at the start [N m s]."""
        h1, h2, h3 = (moment * rate for moment, rate in zip(self.whole, NUTATING, strict=True))
        return h1, h2, h3

    def adapt(self, spec: Any) -> None:
        """Set these parameters in a ``MjSpec``."""
        ring = self.axial * np.array([1.0, 0.5, 0.5])
        spec.body("bus").inertia = np.array(self.whole) - ring
        spec.body("damper_ring").inertia = ring[::-1]
        spec.joint("damper_spin").damping[0] = self.damping

    def motion(self, h: Vector, p: float) -> tuple[Vector, tuple[float, ...]]:
        """Return the bus's rates, and the slope of the ring's axial momentum ``p`` [N m s].

        ``h`` is the whole momentum in body axes; p = J (w1 + slip), and p' = -c slip.
        """
        I1, I2, I3 = self.whole
        w1 = (h[0] - p) / (I1 - self.axial)
        return (w1, h[1] / I2, h[2] / I3), (-self.damping * (p / self.axial - w1),)


@cache
def exact(case: Tube | Ring) -> tuple[Array, Array]:
    """Return rates (n, 3) [rad/s] and attitudes (n, 4) at ``TIME``.

    The momentum is constant, so attitude and the damper's own state are the whole of the motion.
    Lagrange's equations, the bus's rates eliminated; derived here.
    """
    hx, hy, hz = case.momentum

    def in_body(a: float, b: float, c: float, d: float) -> Vector:
        t1, t2, t3 = 2 * (c * hz - d * hy), 2 * (d * hx - b * hz), 2 * (b * hy - c * hx)
        return (
            hx - a * t1 + c * t3 - d * t2,
            hy - a * t2 + d * t1 - b * t3,
            hz - a * t3 + b * t2 - c * t1,
        )

    def slope(_: float, state: Array) -> tuple[float, ...]:
        a, b, c, d, *internal = state.tolist()
        rate, change = case.motion(in_body(a, b, c, d), *internal)
        return *quaternion_slope(a, b, c, d, *rate), *change

    start = (1.0, 0.0, 0.0, 0.0, *case.internal)
    states = solve_ivp(slope, TIME[[0, -1]], start, "DOP853", TIME, rtol=1e-13, atol=1e-15).y.T
    rates = [case.motion(in_body(*state[:4]), *state[4:])[0] for state in states.tolist()]
    return np.array(rates), attitude.normalize(states[:, :4])


def nutation(momentum: Array, attitudes: Array) -> Array:
    """Return the angle [rad] between z axis and momentum (3,), for attitudes (n, 4)."""
    h = attitude.rotate(attitude.conjugate(attitudes), momentum)
    return np.arctan2(np.hypot(h[:, 0], h[:, 1]), h[:, 2])


def decay_time(angle: Array) -> float:
    """Return the time constant [s] of an angle at ``TIME``, of its decay or of its growth."""
    return float(1.0 / np.abs(np.polyfit(TIME, np.log(angle), 1)[0]))


def damped(conditions: Conditions, cases: Mapping[str, Tube | Ring]) -> Readings:
    """Fly each body for a minute, even in short: a time constant is measured."""
    times, angles, off, spins, momenta = {}, [], [], [], []
    for name, case in cases.items():
        model = stand.build(conditions, case.model, adapt=case.adapt)
        data = stand.start(model)
        data.qvel[3:6] = NUTATING
        record = stand.fly(conditions, model, data, TIME[-1], samples=len(TIME) - 1)
        flown, (rates, attitudes) = record.qpos[:, 3:7], exact(case)
        angles.append([nutation(np.array(case.momentum), q) for q in (attitudes, flown)])
        times[name] = decay_time(angles[-1][1])
        off.append(attitude.rotation_angle(flown, attitudes))
        spins.append(np.abs(record.qvel[:, 3:6] - rates).max())
        momenta.append(meter.drift(meter.angular_momentum(record)))
    names = " ".join(name.split()[-1] for name in cases)
    worst = np.max(off, axis=0)
    return Readings(
        values={**times, "attitude": worst.max(), "rate": max(spins), "momentum": max(momenta)},
        motion=Picture.of("nutation angle [rad]", TIME, names, *np.transpose(angles, (1, 2, 0))),
        error=Curve("attitude error [rad]", TIME, worst),
    )


TUBES = {
    "decay, major": Tube((8.0, 8.0, 12.0)),
    "growth, minor": Tube((12.0, 12.0, 8.0)),
    "decay, strong": Tube((8.0, 8.0, 12.0), mass=1.0, stiffness=0.99, damping=0.6),
}
RINGS = {"decay, major": Ring((8.0, 8.0, 12.0)), "growth, minor": Ring((12.0, 12.0, 8.0))}

BENCHMARKS = (
    Benchmark(
        name="tube-damper",
        title="Nutation damper: a ball in a tube",
        shows=(
            "A damper stabilizes spin about the major axis and destabilizes spin about the minor "
            "axis, each with its exact time constant. Where that is 171 s, Euler's own growth of "
            "nutation makes it 1290 s at 10 ms, and implicit's own decay 92 s."
        ),
        source=(
            "The damper is Hughes, Spacecraft Attitude Dynamics, 1986, chapter 5; "
            "Lagrange's equations with the momentum eliminated, derived here"
        ),
        step=0.01,
        bounds=(
            Bound("decay, major", "s", 1e-6, "6e-8 measured, as a rate 2e-12 /s", 170.95155184),
            Bound("growth, minor", "s", 1e-6, "7e-9 measured", 64.19921293),
            Bound(
                "decay, strong", "s", 1e-6, "an energy sink says 5.96; 9e-9 measured", 12.96358233
            ),
            Bound(
                "attitude",
                "rad",
                5e-9,
                "RK4's phase error l t (l h)^4 / 120 = 5e-9, of 0.007 rad; 1.5e-11 measured",
            ),
            Bound("rate", "rad/s", 1e-10, "that error of 0.01 rad/s is 5e-11; 3e-11 measured"),
            Bound("momentum", "of the bus", 3e-10, "as the attitude; 6e-12 measured"),
        ),
        fly=partial(damped, cases=TUBES),
        catches={"integrator": "", "armature": "", "inertia": ""},
        order=Order(("attitude", "rate"), (0.2, 0.1, 0.05)),
    ),
    Benchmark(
        name="ring-damper",
        title="Nutation damper: a ring of fluid",
        shows=(
            "The same with a body that rotates against viscous friction: its hinge's damping "
            "dissipates energy and conserves momentum."
        ),
        source=(
            "The damper is Wertz, Spacecraft Attitude Determination and Control, 1978, section "
            "18.4; Lagrange's equations with the momentum eliminated, derived here"
        ),
        step=0.01,
        bounds=(
            Bound("decay, major", "s", 2e-7, "1.4e-8 measured", 34.16234829),
            Bound("growth, minor", "s", 2e-7, "1.6e-8 measured", 128.64403249),
            Bound("attitude", "rad", 5e-9, "as with the tube; 1.3e-11 measured"),
            Bound("rate", "rad/s", 1e-10, "as with the tube; 1.2e-11 measured"),
            Bound("momentum", "of the bus", 3e-10, "as with the tube; 4e-12 measured"),
        ),
        fly=partial(damped, cases=RINGS),
        catches={"integrator": "", "armature": "", "inertia": ""},
        order=Order(("attitude", "rate"), (0.2, 0.1, 0.05)),
    ),
)
