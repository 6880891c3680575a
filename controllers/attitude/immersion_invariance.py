"""Attitude tracking by immersion and invariance, in Euler angles: paper 000.

The angles are roll, pitch, yaw of R = Rz Ry Rx, body to inertial, unwrapped: a yaw error of 5 rad
is turned through, although 1.3 rad the other way is the same attitude (erratum 12). The law is
local: pitch = +-90 deg is singular and not avoided (erratum 10); see the signal ``singularity``.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
from dataclasses import dataclass
from functools import cached_property
from math import cos, pi, sin
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numba import njit

from mjspace.attitude import to_euler_zyx
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain
from mjspace.gufunc import gufunc

from .euler_kinematics import unwrapped
from .gyrostat import Gyrostat


class State(NamedTuple):
    """Memory of the law: the last angles, for unwrapping."""

    angles: Array
    """Last measured roll, pitch, yaw [rad], unwrapped, (..., 3)."""
    desired_angles: Array
    """Last desired roll, pitch, yaw [rad], unwrapped, (..., 3)."""


class Signals(NamedTuple):
    """Signals of the law."""

    x_e: Array
    """Desired less measured angles [rad], (..., 3)."""
    z: Array
    """Distance from the manifold, x' - x_d' - K x_e [rad/s], (..., 3)."""
    singularity: Array
    """Distance of the pitch from +-90 deg [rad], (..., 1)."""


@dataclass(frozen=True)
class ImmersionInvariance(Gyrostat):
    """Law (15) of paper 000, with p = R^T p_r (erratum 2) computed from the tachometers.

    The torque H J^-1 (v - J' w) - p x w, v = x_d'' + (K + Gamma) x_e' + Gamma K x_e, makes
    z' = -Gamma z and x_e' = -K x_e - z. K and Gamma may be exchanged (erratum 8).
    """

    batched: ClassVar[bool] = True

    target_gain: float = gain("1/s", default=10.0, above=0.0)
    """K: rate of the target system x_e' = -K x_e."""
    manifold_gain: float = gain("1/s", default=5.0, above=0.0)
    """Gamma: rate at which the manifold z = 0 is reached."""
    unwrap_from: Array = gain("rad", (3,), default=(0.0, 0.0, 0.0))
    """The first measured angles are unwrapped to within 180 deg of these."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state, the measured angles unwrapped to ``unwrap_from``."""
        angles = unwrapped(measurement.attitude, self.unwrap_from)
        desired = np.broadcast_to(to_euler_zyx(reference.attitude), angles.shape)
        return State(angles, desired.copy())

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque and the errors."""
        measured = measurement.attitude, measurement.rate, measurement.wheel_speed
        torque, x_e, z, *angles = _law.ufunc(*measured, *reference, *state, *self._vehicle)
        after = State(*angles)
        singularity = 0.5 * pi - np.abs(after.angles[..., 1:2])
        return after, TorqueCommand(torque), Signals(x_e, z, singularity)

    @cached_property
    def _vehicle(self) -> tuple[Array, Array, Array, Array]:
        gains = np.array([self.target_gain, self.manifold_gain])
        return self.inertia, self.wheel_axes, self.wheel_inertia, gains


@njit
def _nearest(angle: Any, before: Any) -> Any:
    """Return ``angle`` plus the whole turns that bring it nearest to ``before``."""
    return angle - 2.0 * pi * np.rint((angle - before) / (2.0 * pi))


@njit
def _euler(q: Any, before: Any) -> Any:
    """Return roll, pitch, yaw of a quaternion, roll and yaw unwrapped."""
    q0, q1, q2, q3 = q
    across, down = 2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3
    pitch = np.arctan2(2.0 * (q0 * q2 - q1 * q3), np.sqrt(across * across + down * down))
    yaw = np.arctan2(2.0 * (q1 * q2 + q0 * q3), q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3)
    return _nearest(np.arctan2(across, down), before[0]), pitch, _nearest(yaw, before[2])


@njit
def _angle_rates(x: Any, w: Any) -> Any:
    """Return x' = J(x) w."""
    swing = sin(x[0]) * w[1] + cos(x[0]) * w[2]
    yaw = swing / cos(x[1])
    return w[0] + sin(x[1]) * yaw, cos(x[0]) * w[1] - sin(x[0]) * w[2], yaw


@njit
def _drift(x: Any, dx: Any, w: Any) -> Any:
    """Return J'(x, x') w, which is x'' at constant w."""
    cp, tp = cos(x[1]), sin(x[1]) / cos(x[1])
    swing = sin(x[0]) * w[1] + cos(x[0]) * w[2]
    dswing = (cos(x[0]) * w[1] - sin(x[0]) * w[2]) * dx[0]
    yaw = (dswing + swing * tp * dx[1]) / cp
    return dswing * tp + swing * dx[1] / (cp * cp), -swing * dx[0], yaw


@gufunc(
    [f"void({'f8[:],' * 8}f8[:,:],f8[:,:],{'f8[:],' * 6}f8[:])"],
    "(q),(v),(n),(q),(v),(v),(v),(v),(v,v),(n,v),(n),(g)->(v),(v),(v),(v),(v)",
)
def _law(
    q: Any, w: Any, wheel_speed: Any, qd: Any, wr: Any, ar: Any, before: Any, desired_before: Any,
    H: Any, axes: Any, Jw: Any, gains: Any,
    torque: Any, x_e: Any, z: Any, angles: Any, desired_angles: Any,
) -> None:  # fmt: skip
    """Write torque, errors and unwrapped angles.

    Plain loops without fused or reordered sums: bit for bit the same alone and in a batch.
    """
    K, Gamma = gains
    x, xd = _euler(q, before), _euler(qd, desired_before)
    dx, dxd = _angle_rates(x, w), _angle_rates(xd, wr)
    carried, bend, turned = _drift(x, dx, w), _drift(xd, dxd, wr), _angle_rates(xd, ar)

    a = np.empty(3)
    for i in range(3):
        angles[i], desired_angles[i], x_e[i] = x[i], xd[i], xd[i] - x[i]
        z[i] = dx[i] - dxd[i] - K * x_e[i]
        # v - J' w, with v = -Gamma z + x_d'' + K (x_d' - x')
        a[i] = turned[i] + bend[i] + K * (dxd[i] - dx[i]) - Gamma * z[i] - carried[i]
    sr, cr, sp, cp = sin(x[0]), cos(x[0]), sin(x[1]), cos(x[1])
    dw = (a[0] - sp * a[2], cr * a[1] + sr * cp * a[2], -sr * a[1] + cr * cp * a[2])

    p = np.empty(3)
    for i in range(3):
        p[i] = H[i, 0] * w[0] + H[i, 1] * w[1] + H[i, 2] * w[2]
    for n in range(Jw.size):
        h = Jw[n] * (axes[n, 0] * w[0] + axes[n, 1] * w[1] + axes[n, 2] * w[2] + wheel_speed[n])
        for i in range(3):
            p[i] += axes[n, i] * h
    gyro = (p[1] * w[2] - p[2] * w[1], p[2] * w[0] - p[0] * w[2], p[0] * w[1] - p[1] * w[0])
    for i in range(3):
        torque[i] = H[i, 0] * dw[0] + H[i, 1] * dw[1] + H[i, 2] * dw[2] - gyro[i]
