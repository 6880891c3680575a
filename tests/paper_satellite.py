"""The satellite of papers 000 and 002, and its flights by the independent integration."""

from typing import Any

import numpy as np
from oracle import Flight, fly, wheel_speeds

from mjspace import attitude as att
from mjspace.contract import Array

H = np.array([[15.0, 5.0, 5.0], [5.0, 10.0, 7.0], [5.0, 7.0, 20.0]])
AXES, JW = np.eye(3), np.full(3, 0.05)
P_R = np.array([1.0, -1.0, 0.0])
"""Total momentum, inertial axes [N m s]."""
THETA = np.array([15.0, 5.0, 5.0, 10.0, 7.0, 20.0, *P_R])
TURNED = att.from_euler_zyx(np.array([1.0, 1.0, -5.0]))
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def flight(
    law: Any,
    reference: Any,
    duration: float,
    *,
    q0: Array = LEVEL,
    period: float = 1e-3,
    **rest: Any,
) -> Flight:
    """Return a flight from rest, or from ``w0`` [rad/s], with the papers' momentum."""
    w0 = rest.pop("w0", np.zeros(3))
    p = att.rotate(att.conjugate(q0), P_R)
    return fly(
        law, reference, H=H, wheel_axes=AXES, Jw=JW, q0=q0, w0=w0,
        Omega0=wheel_speeds(p, H, AXES, JW, w0), duration=duration, period=period, **rest,
    )  # fmt: skip


def peak(array: Array) -> float:
    return float(np.abs(array).max())
