"""Pointing by the orbit: a body axis along a direction, a second as near as may be to another.

The directions are those from the frame's origin, where the vehicle is taken to be: 100 m off it, at
a target 500 km away, is 0.01 deg. Rate and acceleration are derivatives of the attitude, by the
ephemeris' velocity, acceleration and jerk. A quaternion's path is continuous from time zero on.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from mjspace import algebra
from mjspace import attitude as att
from mjspace.contract import Array, Ephemeris, Gains, Reference, gain

from .jets import Jet, cross, dot, unit

Direction = Literal["nadir", "velocity", "orbit normal", "sun"]
PARALLEL = 1e-6
"""rad: of two directions that are closer than this, none says how to turn about the other."""
_KNOTS = 5.0  # s; the sign of the quaternion is lost in turns of more than 180 deg in half of it
_AT_ONCE = 512  # knots


def direction(ephemeris: Ephemeris, towards: Direction, time: Array) -> Jet:
    """Return the vector from the frame's origin that is called ``towards``, inertial axes."""
    at = ephemeris.origin(time)
    place = Jet(at.position, at.velocity, at.acceleration)
    moves = Jet(at.velocity, at.acceleration, at.jerk)
    if towards == "nadir":
        return place.times(-1.0)
    if towards == "velocity":
        return moves
    if towards == "orbit normal":
        return cross(place, moves)
    sun = ephemeris.sun(time)
    return Jet(sun.position, sun.velocity, sun.acceleration) - place


def aligned(first: Jet, second: Jet, axis: Array, second_axis: Array) -> Reference:
    """Return axes with ``axis`` along the vector ``first``, ``second_axis`` nearest to ``second``.

    Vectors in inertial axes (n, 3), of any length, and two body axes (3,) that are not parallel.
    Where the two vectors are parallel there are no such axes: the attitude is not a number.

    Harold Black's TRIAD (Markley and Crassidis 2014, section 5.1) with its derivatives: the axes
    e_i turn at w with e_i' = w x e_i, so that w_1 = e_3 . e_2', w_2 = -e_3 . e_1', w_3 = e_2 .
    e_1'.
    """
    e1 = unit(first)
    normal = cross(e1, unit(second))
    close = dot(normal, normal).value < PARALLEL**2
    e3 = unit(Jet(np.where(close, np.nan, normal.value), normal.first, normal.second))
    e2 = cross(e3, e1)
    pairs = ((e3, e2, 1.0), (e3, e1, -1.0), (e2, e1, 1.0))
    rate = [algebra.dot(a.value, b.first) * sign for a, b, sign in pairs]
    bend = [
        (algebra.dot(a.first, b.first) + algebra.dot(a.value, b.second)) * sign
        for a, b, sign in pairs
    ]
    body = _triad(axis, second_axis)
    axes = np.stack([e1.value, e2.value, e3.value], axis=-1)
    return Reference(
        att.from_matrix(algebra.matrix_product(axes, body.T)),
        algebra.times(body, np.concatenate(rate, axis=-1)),
        algebra.times(body, np.concatenate(bend, axis=-1)),
    )


class Pointing(Gains, ABC):
    """Base of a reference that points: it has two directions, and the axes that go along them."""

    @abstractmethod
    def directions(self, time: Array) -> tuple[Jet, Jet]:
        """Return two vectors at each ``time`` [s], inertial axes, of any length."""

    @property
    @abstractmethod
    def axes(self) -> tuple[Array, Array]:
        """The body axes that go along them, the first exactly."""

    def __post_init__(self) -> None:
        """Refuse axes that are parallel, and a direction of another name; ValueError for them."""
        super().__post_init__()
        second = getattr(self, "second", "nadir")
        if second not in get_args(Direction):
            have = ", ".join(map(repr, get_args(Direction)))
            raise ValueError(f"second: got {second!r}, should be one of {have}")
        one, other = (att.normalize(axis) for axis in self.axes)
        if np.linalg.norm(np.cross(one, other)) < PARALLEL:
            raise ValueError(f"second_axis: got {other.tolist()}, which is parallel to axis")

    def at(self, time: Array) -> Reference:
        """Return the motion at each ``time`` [s], shape (n,).

        Raises:
            ValueError: the two directions are parallel, or the ephemeris lacks one of them.
        """
        found = self._principal(time)
        lost = np.isnan(found.attitude[:, 0])
        if lost.any():
            raise ValueError(
                f"{type(self).__name__}: at t = {time[lost][0]:.6g} s the directions of axis and "
                "second_axis are parallel: choose another second, or point so at other times"
            )
        near = self._signed_knots(np.rint(np.maximum(time, 0.0) / _KNOTS).astype(int))
        sign = np.where(np.sum(near * found.attitude, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        return found._replace(attitude=sign * found.attitude)

    def _principal(self, time: Array) -> Reference:
        """Return the motion with the quaternion whose scalar part is not negative."""
        return aligned(*self.directions(time), *(att.normalize(axis) for axis in self.axes))

    def _signed_knots(self, knots: Any) -> Array:
        """Return the attitudes ``knots`` (n,) times ``_KNOTS`` after time zero, all of one sign."""
        blocks = self._blocks
        for _ in range(len(blocks), knots.max(initial=0) // _AT_ONCE + 1):
            self._add_block()
        asked, of_each = np.unique(knots // _AT_ONCE, return_inverse=True)
        near: Array = np.array([blocks[k] for k in asked])[of_each, knots % _AT_ONCE]
        return near

    def _add_block(self) -> None:
        blocks = self._blocks
        first = _AT_ONCE * len(blocks)
        instants: Array = _KNOTS * np.arange(float(first), float(first + _AT_ONCE))
        q = self._principal(instants).attitude
        q = np.concatenate([blocks[-1][-1:] if blocks else q[:1], q])
        for k in np.flatnonzero(np.isnan(q[:, 0])):  # at a moment of parallel directions
            q[k] = q[k - 1] if k else [1.0, 0.0, 0.0, 0.0]
        flips = np.where(np.sum(q[1:] * q[:-1], axis=-1) < 0.0, -1.0, 1.0)
        blocks.append(np.cumprod(flips)[:, None] * q[1:])

    @cached_property
    def _blocks(self) -> list[Array]:
        return []


@dataclass(frozen=True)
class Nadir(Pointing):
    """The local vertical, local horizontal axes, or an attitude that is held in them.

    z points to the planet's centre, y against the orbit's normal, x ahead.
    """

    ephemeris: Ephemeris
    offset: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """Quaternion, scalar first, from the body's axes to those of the orbit; normalized."""

    def directions(self, time: Array) -> tuple[Jet, Jet]:
        """Return the nadir and the orbit's normal reversed."""
        normal = direction(self.ephemeris, "orbit normal", time)
        return direction(self.ephemeris, "nadir", time), normal.times(-1.0)

    @property
    def axes(self) -> tuple[Array, Array]:
        """The body axes that are to be the orbit's z and y."""
        back = att.conjugate(att.normalize(self.offset))
        z, y = att.rotate(back, np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]))
        return z, y


@dataclass(frozen=True)
class SunPointing(Pointing):
    """A body axis to the Sun, and a second as near as may be to a direction of the orbit."""

    ephemeris: Ephemeris
    axis: Array = gain(shape=(3,), default=(0.0, 0.0, 1.0), form="direction")
    """Body axis that points to the Sun."""
    second_axis: Array = gain(shape=(3,), default=(1.0, 0.0, 0.0), form="direction")
    """Body axis that is turned about the first towards ``second``."""
    second: Direction = field(default="orbit normal")

    def directions(self, time: Array) -> tuple[Jet, Jet]:
        """Return the directions of the Sun and of ``second``."""
        sun = direction(self.ephemeris, "sun", time)
        return sun, direction(self.ephemeris, self.second, time)

    @property
    def axes(self) -> tuple[Array, Array]:
        """As declared."""
        return self.axis, self.second_axis


def _triad(axis: Array, second_axis: Array) -> Array:
    """Return the matrix whose columns are ``axis``, nearest to ``second_axis``, their normal."""
    normal = att.normalize(np.cross(axis, second_axis))
    return np.stack([axis, np.cross(normal, axis), normal], axis=-1)
