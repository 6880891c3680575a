"""Attitude error and rate error about body-fixed axes."""

from typing import Any

import numba
import numpy as np

from mjspace.contract import Array, Measurement, Reference


def turn(measurement: Measurement, reference: Reference, axes: Array) -> tuple[Array, Array]:
    """Return the errors (angle [rad], rate [rad/s]) about each of ``axes`` (m, 3), (..., m).

    ``axes`` are unit vectors in body axes. The angle is a component of the rotation vector from the
    desired to the measured attitude, the shorter way; the rate is measured less desired.
    """
    angle, rate = _turn.ufunc(
        measurement.attitude, measurement.rate, reference.attitude, reference.rate, axes
    )
    return angle, rate


# Written out: 3 us for one vehicle, against 0.3 ms with NumPy's calls.
@numba.guvectorize(
    ["void(f8[:],f8[:],f8[:],f8[:],f8[:,:],f8[:],f8[:])"],
    "(q),(r),(q),(r),(m,r)->(m),(m)",
    cache=True,
)
def _turn(
    attitude: Any, rate: Any, desired: Any, desired_rate: Any, axes: Any, angle: Any, slip: Any
) -> None:
    p0, p1, p2, p3 = desired
    q0, q1, q2, q3 = attitude
    # conj(p) q: from the desired axes to the body's.
    w = p0 * q0 + p1 * q1 + p2 * q2 + p3 * q3
    x = p0 * q1 - p1 * q0 - p2 * q3 + p3 * q2
    y = p0 * q2 + p1 * q3 - p2 * q0 - p3 * q1
    z = p0 * q3 - p1 * q2 + p2 * q1 - p3 * q0
    sine = np.sqrt(x * x + y * y + z * z)
    scale = np.copysign(2.0, w)
    if sine > 0.0:
        scale *= np.arctan2(sine, abs(w)) / sine
    r0, r1, r2 = desired_rate
    # R^T r = r + 2 v x (v x r) - 2 w v x r
    c0, c1, c2 = y * r2 - z * r1, z * r0 - x * r2, x * r1 - y * r0
    s0 = rate[0] - r0 - 2.0 * (y * c2 - z * c1 - w * c0)
    s1 = rate[1] - r1 - 2.0 * (z * c0 - x * c2 - w * c1)
    s2 = rate[2] - r2 - 2.0 * (x * c1 - y * c0 - w * c2)
    for i in range(axes.shape[0]):
        e0, e1, e2 = axes[i]
        angle[i] = scale * (e0 * x + e1 * y + e2 * z)
        slip[i] = e0 * s0 + e1 * s1 + e2 * s2
