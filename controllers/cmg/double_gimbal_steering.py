"""Steering of parallel double-gimbal CMGs: a rate of their momentum to gimbal rates.

The outer gimbals turn about one axis a of the bus, the inner ones about a x s0, s0 the spin axis at
angles of zero, across a. CMG i holds h_i = Jw W; with d_o of the outer gimbal, d_i of the inner, r
the direction s0 turned by d_o about a, and t = a x r, its spin axis is cos(d_i) r - sin(d_i) a:

    H = sum h cos(d_i) r - a sum h sin(d_i)

Inner gimbals serve what is along a, and are kept at one angle; outer ones serve what is across, by
the pseudo-inverse, and are spread by motion that makes no torque: H. F. Kennel, Steering law for
parallel mounted double-gimbaled control moment gyros, NASA TM-82390, 1981. His law spreads
neighbours by their angles; here null motion climbs the measure, as in ``cmg_steering``, whose
damping bounds the rates where all are in line. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjspace.algebra import components, dot, times, transpose
from mjspace.contract import Array

_ALIGNED = 1e-3
"""By how much axes may be off parallel or across."""
_TINY = 1e-9
"""Of the wheels' momentum: rates are finite where all spin axes are along a, or no wheel turns."""


@dataclass(frozen=True)
class ParallelCluster:
    """Double-gimbal CMGs whose outer gimbals turn about the same axis.

    Raises:
        ValueError: gimbals that are not an outer and an inner one for each wheel, outer axes that
            are not parallel, or spin and inner axes that are not as above.
    """

    gimbal_axes: Array
    """At angles of zero: unit vectors, body axes, the outer before the inner of each, (2 n, 3)."""
    spin_axes: Array
    """Likewise of the wheels, (n, 3)."""
    wheel_inertia: Array
    """Jw: axial inertia of each wheel [kg m^2], (n,)."""

    def __post_init__(self) -> None:
        """Refuse another arrangement."""
        gimbals, wheels = len(self.gimbal_axes), len(self.spin_axes)
        if gimbals != 2 * wheels:
            raise ValueError(
                f"gimbal_axes: got {gimbals} of {wheels} wheels, should be an outer and an inner "
                "one of each"
            )
        for i, (outer, inner, spin) in enumerate(
            zip(self.gimbal_axes[::2], self.gimbal_axes[1::2], self.spin_axes, strict=True)
        ):
            if np.abs(outer - self.axis).max() > _ALIGNED:
                raise ValueError(
                    f"gimbal_axes: the outer one of CMG {i} is not parallel to CMG 0's"
                )
            if np.abs(np.cross(outer, spin) - inner).max() > _ALIGNED:
                raise ValueError(
                    f"gimbal_axes: the inner one of CMG {i} is not its outer axis x its spin axis"
                )

    @property
    def axis(self) -> Array:
        """a, (3,)."""
        first: Array = self.gimbal_axes[0]
        return first

    def directions(self, gimbal_angle: Array) -> tuple[Array, Array]:
        """Return cosine and sine of each r, from the spin axis of CMG 0 at zero towards a x it.

        Each (..., n); ``gimbal_angle`` (..., 2 n) [rad].
        """
        turned = gimbal_angle[..., ::2] + self._mounted
        return np.cos(turned), np.sin(turned)

    @cached_property
    def to_body(self) -> Array:
        """From components across, across and along a to body axes, (3, 3)."""
        first = self.spin_axes[0]
        return np.stack([first, np.cross(self.axis, first), self.axis], axis=-1)

    @cached_property
    def _mounted(self) -> Array:
        """Angle of each spin axis at zero from that of CMG 0, about a [rad], (n,)."""
        across = self.spin_axes @ self.to_body
        return np.arctan2(across[:, 1], across[:, 0])


def momentum(cluster: ParallelCluster, gimbal_angle: Array, wheel_speed: Array) -> Array:
    """Return the wheels' momentum relative to the bus, body axes [N m s], (..., 3).

    ``gimbal_angle`` (..., 2 n) [rad], ``wheel_speed`` (..., n) [rad/s].
    """
    h = cluster.wheel_inertia * wheel_speed
    inner = gimbal_angle[..., 1::2]
    across = h * np.cos(inner)
    c, s = cluster.directions(gimbal_angle)
    parts = [dot(across, c), dot(across, s), -dot(h, np.sin(inner))]
    return times(cluster.to_body, np.concatenate(parts, axis=-1))


def steer(
    cluster: ParallelCluster,
    momentum_rate: Array,
    gimbal_angle: Array,
    wheel_speed: Array,
    gains: Array,
) -> tuple[Array, Array]:
    """Return gimbal rates (..., 2 n) [rad/s] and the measure (..., 1).

    ``momentum_rate`` (..., 3) [N m] is that of H, body axes. ``gains`` is [m0, lambda0, rate at
    which the inner gimbals become equal (1/s), gain of the null motion (1/s)].

    With w = h cos(d_i) and the columns w t of A, d_i' = -H'.a / sum w + k (mean - d_i), the mean
    with the weights w, so that the second part gives nothing along a. d_o' is A^T (A A^T +
    lambda)^-1 times what is wanted across a less what the inner gimbals give there. The measure m
    is sqrt(det(A A^T)) over sum h^2 / 2, the largest that there is: 1 where the CMGs are spread
    over a circle, 0 where all are in line. lambda is lambda0 (1 - m/m0)^2 sum h^2 / 2 below m0, and
    zero above.
    """
    wanted, wide, equal, null = gains
    h = cluster.wheel_inertia * wheel_speed
    inner = gimbal_angle[..., 1::2]
    w = h * np.cos(inner)
    x, y, z = components(times(transpose(cluster.to_body), momentum_rate))
    total = dot(w, np.ones_like(w))
    size = _TINY * (dot(np.abs(h), np.ones_like(h)) + 1.0)
    total = np.where(np.abs(total) > size, total, size)
    turn_in = -z / total + equal * (dot(w, inner) / total - inner)

    c, s = cluster.directions(gimbal_angle)
    given = h * np.sin(inner) * turn_in
    x, y = x + dot(given, c), y + dot(given, s)
    a, b = -w * s, w * c  # the rows of A
    xx, xy, yy = dot(a, a), dot(a, b), dot(b, b)
    det = np.maximum(xx * yy - xy * xy, 0.0)
    # The largest determinant is that of A A^T = sum h^2 / 2 times one.
    most = 0.5 * dot(h, h) + _TINY
    measure = np.sqrt(det) / most
    lack = np.maximum(1.0 - measure / wanted, 0.0)
    lam = wide * lack * lack * most
    det_damped = (xx + lam) * (yy + lam) - xy * xy

    def across(p: Array, q: Array) -> Array:
        """Return A^T (A A^T + lambda)^-1 of a vector across a, (..., n)."""
        u, v = (yy + lam) * p - xy * q, (xx + lam) * q - xy * p
        turned: Array = (a * u + b * v) / det_damped
        return turned

    turn_out = across(x, y)
    # Of det by d_o, of which a's derivative is -w c and b's is -w s.
    ascent = 2.0 * (-w) * (c * (a * yy - b * xy) + s * (b * xx - a * xy)) / (most * most)
    turn_out = turn_out + null * (ascent - across(dot(a, ascent), dot(b, ascent)))
    pairs = np.stack([turn_out, turn_in], axis=-1)
    rates: Array = pairs.reshape(*pairs.shape[:-2], 2 * pairs.shape[-2])
    return rates, measure
