"""An independent integration of the lander's sampled closed loop: one rigid body, no MuJoCo.

Newton and Euler in the axes of paper 003, Cartesian, with a quaternion: central gravity, its
gradient, thrust at chi = (-1, 0, 0) m. Nothing of the law's angles or local axes is used.
Classical Runge-Kutta, the command held over each control period. In a test:
``from lander_oracle import fly``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Trajectory
from mjspace.validation.kinematics import quaternion_slope

MU, MOON_RADIUS = 4.902e12, 1.738e6  # m^3/s^2 and m, table 1
EXHAUST = 320.0 * 9.80665  # m/s: Isp g0
_slope: Any = njit(quaternion_slope)


@dataclass(frozen=True)
class Vehicle:
    """What flies; the defaults are the paper's, with an engine that obeys at once."""

    mass: float = 100.0  # kg
    inertia: tuple[float, float, float] = (100.0, 90.0, 80.0)  # kg m^2, paper's axes
    gradient: float = 1.0  # share of the gravity gradient's torque
    depletes: float = 0.0  # share of the burnt propellant that leaves the mass
    thrust_lag: float = 0.0  # s
    gimbal_lag: float = 0.0  # s
    gimbal_rate: float = np.inf  # rad/s, of a rate-limited lag
    least_thrust: float = -np.inf  # N
    most_thrust: float = np.inf  # N


@dataclass(frozen=True)
class Start:
    """Table 3, in the paper's cylindrical terms; angles and rates zero but for psi = theta."""

    height: float = 1000.0
    reach: float = 2500.0
    azimuth: float = 0.6435
    climb: float = -10.0
    away: float = -24.0
    turn: float = -0.0028
    angles: tuple[float, float, float] = (0.0, 0.0, 0.0)  # alpha, phi, gamma
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)  # paper's axes


class Flight(NamedTuple):
    """One row for each control instant, until the vehicle's origin is down or the time is over."""

    time: Array
    position: Array
    velocity: Array
    attitude: Array
    rate: Array
    error: Array
    """Position less the wanted one [m], world axes."""
    thrust: Array
    gimbal: Array
    """b1, b2 [rad]."""
    propellant: Array

    @property
    def tilt(self) -> Array:
        """Of the thrust's axis from the vertical [rad], (n,)."""
        return np.arccos(1.0 - 2.0 * (self.attitude[:, 1] ** 2 + self.attitude[:, 2] ** 2))


def fly(
    law: Any,
    reference: Any,
    *,
    duration: float,
    start: Start = Start(),
    vehicle: Vehicle = Vehicle(),
    period: float = 0.02,
    substeps: int = 1,
    ground: float = -np.inf,
    sense: Callable[[Measurement], Measurement] = lambda truth: truth,
) -> Flight:
    """Return the flight of one vehicle until it is at ``ground`` [m] or ``duration`` [s] is over.

    The last row is interpolated on the ground. Positions are those of the vehicle's origin, less
    the reference's ``stance``, as if it stood on its origin. The law sees what ``sense`` makes of
    the truth, once a period.
    """
    rows = round(duration / period) + 1
    time, stance = period * np.arange(rows), reference.stance
    wanted = reference.at(time)
    y, parameters = _initial(start, vehicle, stance), _parameters(vehicle)
    history, errors = np.empty((rows, 17)), np.empty((rows, 3))
    state = None
    last = rows - 1
    for k in range(rows):
        truth = _seen(y)
        seen = sense(truth)
        now = Trajectory(*(part[k] for part in wanted))
        if state is None:
            state = law.reset(seen, now)
        state, command, _ = law.step(state, time[k], seen, now)
        (thrust,), (outer, inner) = command.thrust[0], command.gimbal[0]
        asked = np.array([thrust, inner, outer])
        _settle(y, asked, parameters)
        history[k], errors[k] = y, truth.position[0] - now.position
        if y[0] - stance <= ground:
            last = k
            break
        y = _advance(y, asked, period / substeps, substeps, parameters)
    return _flight(time, history, errors, last, ground, stance)


def slope_of(y: Array, vehicle: Vehicle = Vehicle()) -> Array:
    """Return y' of the state (17,), in the paper's axes.

    Position less the Moon's radius, velocity, quaternion, rate, F, b1, b2, burnt propellant.
    """
    slope = np.empty(17)
    _derivative(y, y[13:16], _parameters(vehicle), slope)
    return slope


def _initial(start: Start, vehicle: Vehicle, stance: float) -> Array:
    c, s = np.cos(start.azimuth), np.sin(start.azimuth)
    alpha, phi, gamma = start.angles
    r, across = start.reach, start.reach * start.turn
    place = [start.height + stance, r * c, r * s]
    speed = [start.climb, start.away * c - across * s, start.away * s + across * c]
    # C = Rz Ry Rx, passive, is the conjugate of q = qx(psi) qy(phi) qz(gamma).
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, angle in zip(np.eye(3), (alpha + start.azimuth, phi, gamma), strict=True):
        q = att.multiply(q, att.from_rotation_vector(angle * axis))
    weight = vehicle.mass * MU / (MOON_RADIUS + place[0]) ** 2
    return np.array([*place, *speed, *q, *start.rate, weight, 0.0, 0.0, 0.0])


def _seen(y: Array) -> Measurement:
    """Return the state in our axes: (x, y, z) is the paper's (Y, Z, X)."""
    row = y[_OURS][None]
    attitude, rate, place, speed = row[:, :4], row[:, 4:7], row[:, 7:10], row[:, 10:]
    return Measurement(
        attitude=attitude, rate=rate, wheel_speed=_NOTHING, position=place, velocity=speed
    )


_OURS = np.array([6, 8, 9, 7, 11, 12, 10, 1, 2, 0, 4, 5, 3])
_NOTHING = np.zeros((1, 0))


def _flight(
    time: Array, history: Array, errors: Array, last: int, ground: float, stance: float
) -> Flight:
    rows = slice(0, last + 1)
    t, y, e = time[rows].copy(), history[rows].copy(), errors[rows].copy()
    if y[-1, 0] - stance < ground and last:
        share = (y[-2, 0] - stance - ground) / (y[-2, 0] - y[-1, 0])
        for part in (t, y, e):
            part[-1] = part[-2] + share * (part[-1] - part[-2])
    attitude, rate, place, speed = np.split(y[:, _OURS], [4, 7, 10], axis=1)
    place = place - [0.0, 0.0, stance]
    return Flight(t, place, speed, attitude, rate, e, y[:, 13], y[:, 14:16], y[:, 16])


def _parameters(vehicle: Vehicle) -> Array:
    v = vehicle
    numbers = [v.mass, *v.inertia, v.gradient, v.depletes, v.thrust_lag, v.gimbal_lag]
    return np.array([*numbers, v.gimbal_rate, v.least_thrust, v.most_thrust])


@njit(cache=True)
def _settle(y: Any, asked: Any, parameters: Any) -> None:
    """Let what has no lag obey at once."""
    thrust_lag, gimbal_lag, _, least, most = parameters[6:]
    if thrust_lag == 0.0:
        y[13] = min(max(asked[0], least), most)
    if gimbal_lag == 0.0:
        y[14], y[15] = asked[1], asked[2]


@njit(cache=True)
def _derivative(y: Any, asked: Any, parameters: Any, out: Any) -> None:
    m, J1, J2, J3, gradient, depletes, thrust_lag, gimbal_lag, fastest, least, most = parameters
    X, Y, Z = MOON_RADIUS + y[0], y[1], y[2]
    q0, q1, q2, q3, w1, w2, w3 = y[6], y[7], y[8], y[9], y[10], y[11], y[12]
    F, b1, b2 = y[13], y[14], y[15]
    f1, f2, f3 = F * np.cos(b1) * np.cos(b2), F * np.cos(b1) * np.sin(b2), F * np.sin(b1)
    distance = np.sqrt(X * X + Y * Y + Z * Z)
    pull = MU / distance**3
    m -= depletes * y[16]

    # R: body to inertial.
    r11, r12, r13 = 1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)
    r21, r22, r23 = 2 * (q1 * q2 + q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 - q0 * q1)
    r31, r32, r33 = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)
    out[0], out[1], out[2] = y[3], y[4], y[5]
    out[3] = -pull * X + (r11 * f1 + r12 * f2 + r13 * f3) / m
    out[4] = -pull * Y + (r21 * f1 + r22 * f2 + r23 * f3) / m
    out[5] = -pull * Z + (r31 * f1 + r32 * f2 + r33 * f3) / m
    out[6], out[7], out[8], out[9] = _slope(q0, q1, q2, q3, w1, w2, w3)

    u1 = (r11 * X + r21 * Y + r31 * Z) / distance
    u2 = (r12 * X + r22 * Y + r32 * Z) / distance
    u3 = (r13 * X + r23 * Y + r33 * Z) / distance
    tide = 3.0 * pull * gradient
    # chi x Fa = (0, f3, -f2) at chi = (-1, 0, 0) m.
    out[10] = ((J2 - J3) * w2 * w3 + tide * (J3 - J2) * u2 * u3) / J1
    out[11] = ((J3 - J1) * w3 * w1 + tide * (J1 - J3) * u3 * u1 + f3) / J2
    out[12] = ((J1 - J2) * w1 * w2 + tide * (J2 - J1) * u1 * u2 - f2) / J3

    out[13] = out[14] = out[15] = 0.0
    if thrust_lag > 0.0:
        out[13] = (min(max(asked[0], least), most) - F) / thrust_lag
    if gimbal_lag > 0.0:
        for i in range(2):
            out[14 + i] = min(max((asked[1 + i] - y[14 + i]) / gimbal_lag, -fastest), fastest)
    out[16] = F / EXHAUST


@njit(cache=True)
def _advance(y: Any, asked: Any, h: float, steps: int, parameters: Any) -> Any:
    y, at, slope, change = y.copy(), y.copy(), np.zeros(y.size), np.zeros(y.size)
    for _ in range(steps):
        change[:] = 0.0
        for stage, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
            for i in range(y.size):
                at[i] = y[i] + stage * h * slope[i]
            _derivative(at, asked, parameters, slope)
            for i in range(y.size):
                change[i] += weight / 6.0 * h * slope[i]
        for i in range(y.size):
            y[i] += change[i]
        length = np.sqrt(y[6] ** 2 + y[7] ** 2 + y[8] ** 2 + y[9] ** 2)
        for i in range(6, 10):
            y[i] /= length
    return y
