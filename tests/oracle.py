"""An independent integration of a sampled closed loop: a gyrostat, its wheels, a law, no MuJoCo.

Newton and Euler for a bus and n wheels, states attitude, rate and wheel speeds: nothing of the
laws' own p = R^T p_r or H w' = p x w + tau is assumed. Classical Runge-Kutta at a fixed step, the
torque held over each control period. In a test: ``from oracle import fly``.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

_NONE = np.zeros(3)


class Flight(NamedTuple):
    """One row for each control instant, the last one included."""

    time: Array
    attitude: Array
    rate: Array
    wheel_speed: Array
    reference: Reference
    torque: Array
    """Applied from the row's instant on; the last row's never is."""
    signals: dict[str, Array]
    states: dict[str, Array]

    @property
    def distance(self) -> Array:
        """|q - qd|, the smaller of the two signs, shape (n,)."""
        q, qd = self.attitude, self.reference.attitude
        return np.minimum(*(np.linalg.norm(q - s * qd, axis=-1) for s in (1.0, -1.0)))


def fly(
    law: Any,
    reference: Any,
    *,
    H: Array,
    wheel_axes: Array,
    Jw: Array,
    q0: Array,
    w0: Array,
    Omega0: Array,
    duration: float,
    period: float = 1e-3,
    substeps: int = 1,
    torque_limit: float = np.inf,
    rate_noise: Array | None = None,
    disturbance: Array = _NONE,
) -> Flight:
    """Return the flight of one vehicle under ``law``.

    ``H`` (3, 3) is the vehicle's inertia less the wheels' axial inertia ``Jw`` (n,) on
    ``wheel_axes`` (n, 3). The motors turn the torque asked for, cut at ``torque_limit`` [N m] on
    each axis, into -pinv(A) torque. ``rate_noise`` (rows, 3) is added to the measured rate.
    ``disturbance`` (3,) [N m] is a constant torque from outside, body axes.
    """
    rows = round(duration / period) + 1
    time = period * np.arange(rows)
    wanted = reference.at(time)
    wheels = len(Jw)
    plant = Plant.of(H, wheel_axes, Jw, disturbance)
    share = -np.linalg.pinv(wheel_axes.T)
    y = np.concatenate([q0, w0, Omega0]).astype(float)
    history, torques = np.empty((rows, 7 + wheels)), np.empty((rows, 3))
    states, signals = [], []
    state = None
    for k in range(rows):
        seen_rate = y[4:7] if rate_noise is None else y[4:7] + rate_noise[k]
        seen = Measurement(attitude=y[None, :4], rate=seen_rate[None], wheel_speed=y[None, 7:])
        now = Reference(*(part[k] for part in wanted))
        if state is None:
            state = law.reset(seen, now)
        history[k] = y
        states.append(state)
        state, command, shown = law.step(state, time[k], seen, now)
        torques[k] = np.clip(command.torque[0], -torque_limit, torque_limit)
        signals.append(shown)
        y = _advance(y, share @ torques[k], period / substeps, substeps, plant)
    return Flight(
        time, history[:, :4], history[:, 4:7], history[:, 7:], wanted, torques,
        _columns(signals), _columns(states),
    )  # fmt: skip


def wheel_speeds(p: Array, H: Array, wheel_axes: Array, Jw: Array, w0: Array) -> Array:
    """Return the wheel speeds (n,) that make the total momentum ``p`` [N m s], body axes."""
    momentum = np.linalg.pinv(wheel_axes.T) @ (p - H @ w0)
    return momentum / Jw - wheel_axes @ w0


def total_momentum(flight: Flight, H: Array, wheel_axes: Array, Jw: Array) -> Array:
    """Return the total momentum [N m s], inertial axes, at each row, (n, 3)."""
    spin = Jw * (flight.rate @ wheel_axes.T + flight.wheel_speed)
    return att.rotate(flight.attitude, flight.rate @ H.T + spin @ wheel_axes)


class Plant(NamedTuple):
    """What the derivative needs, worked out once."""

    solve: Array  # inverse of H
    whole: Array  # H0 = H + A Jw A^T, wheels locked
    axes: Array
    Jw: Array
    disturbance: Array

    @classmethod
    def of(cls, H: Array, wheel_axes: Array, Jw: Array, disturbance: Array) -> "Plant":
        whole = H + wheel_axes.T @ np.diag(Jw) @ wheel_axes
        return cls(np.linalg.inv(H), whole, wheel_axes, Jw, disturbance)


@njit(cache=True)
def _derivative(y: Any, motor: Any, plant: Plant, out: Any) -> None:
    """Write y' into ``out``.

    Each motor: Jw (a.w' + Omega') = u. The whole: H0 w' + A Jw Omega' = momentum x w + d.
    """
    q, w, speed = y[:4], y[4:7], y[7:]
    momentum = np.zeros(3)
    for i in range(3):
        for j in range(3):
            momentum[i] += plant.whole[i, j] * w[j]
        for n in range(speed.size):
            momentum[i] += plant.axes[n, i] * plant.Jw[n] * speed[n]
    net = np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        net[i] = plant.disturbance[i] + momentum[j] * w[k] - momentum[k] * w[j]
        for n in range(speed.size):
            net[i] -= plant.axes[n, i] * motor[n]
        out[1 + i] = 0.5 * (q[0] * w[i] + q[1 + j] * w[k] - q[1 + k] * w[j])
    out[0] = -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2])
    for n in range(speed.size):
        out[7 + n] = motor[n] / plant.Jw[n]
    for i in range(3):
        out[4 + i] = 0.0
        for j in range(3):
            out[4 + i] += plant.solve[i, j] * net[j]
        for n in range(speed.size):
            out[7 + n] -= plant.axes[n, i] * out[4 + i]


@njit(cache=True)
def _advance(y: Any, motor: Any, h: float, steps: int, plant: Plant) -> Any:
    stage = (0.0, 0.5, 0.5, 1.0)
    weight = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
    y, slope = y.copy(), np.zeros(y.size)
    at, change = np.empty(y.size), np.empty(y.size)
    for _ in range(steps):
        change[:] = 0.0
        for s in range(4):
            for i in range(y.size):
                at[i] = y[i] + stage[s] * h * slope[i]
            _derivative(at, motor, plant, slope)
            for i in range(y.size):
                change[i] += weight[s] * h * slope[i]
        for i in range(y.size):
            y[i] += change[i]
        length = np.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2 + y[3] ** 2)
        for i in range(4):
            y[i] /= length
    return y


def _columns(rows: list[Any]) -> dict[str, Array]:
    """Return named tuples with a vehicle axis of one as arrays over the rows."""
    return {name: np.concatenate([getattr(row, name) for row in rows]) for name in rows[0]._fields}
