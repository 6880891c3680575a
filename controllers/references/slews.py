"""Phases of references, with slews between them that start and end on the moving references."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Reference, ReferenceSource, gain

from .double_s import DoubleS, quickest
from .jets import Jet, bilinear, dot, of_reference, to_reference

_SAMPLES = 400  # of a slew, at which rate and acceleration are held to their limits, and the ends
_SLOWEST = 64.0
"""Times the quickest turn between references at rest: what does not fit then never does."""
_ROUNDED = 1.0 + 1e-9
_SMALL = 0.1
_TERMS = 14
"""Of series below ``_SMALL``: 1e-17 is left out."""


@dataclass(frozen=True)
class Phase(Gains):
    """A reference, and when the slew to it starts."""

    reference: ReferenceSource
    """A table with the reference's ``kind`` and gains."""
    start: float = gain("s", default=0.0)
    """When the phase before is left; that of the first means nothing."""

    def __post_init__(self) -> None:
        """Refuse what is no reference; ValueError for it."""
        super().__post_init__()
        if not hasattr(self.reference, "at"):
            raise ValueError(
                f"reference: got {self.reference!r}, should be a table with a reference's kind"
            )


@dataclass(frozen=True)
class Slew:
    """The way from one phase to the next."""

    start: float
    """[s]."""
    profile: DoubleS
    sign: float
    """1 or -1: with it the one quaternion is less than 180 deg from the other at the start."""

    @property
    def end(self) -> float:
        """[s]."""
        return self.start + self.profile.duration


@dataclass(frozen=True)
class Slews(Gains):
    """References one after another, with slews between them.

    The turn from the moving axes of one reference to those of the next is flown along its rotation
    vector v(t) as exp(s v), where s rises from 0 to 1 as a double S does: at both ends attitude,
    rate and acceleration are those of the references. Between two references at rest that is the
    quickest turn within the limits. Where they move it is slowed down, all of it alike, by the
    least factor with which rate and acceleration of the whole motion are within their limits; the
    limit of the jerk is that of the turn alone.
    """

    phases: Sequence[Phase]
    rate_limit: float = gain("rad/s", above=0.0)
    """Of slews, relative to inertial axes."""
    acceleration_limit: float = gain("rad/s^2", above=0.0)
    """Of slews, relative to inertial axes."""
    jerk_limit: float = gain("rad/s^3", above=0.0)
    """Of slews, relative to the references."""

    def __post_init__(self) -> None:
        """Refuse phases that are not in the order of time; ValueError for them."""
        super().__post_init__()
        tables = isinstance(self.phases, Sequence) and not isinstance(self.phases, str)
        if not tables or not all(isinstance(phase, Phase) for phase in self.phases):
            raise ValueError(f"phases: got {self.phases!r}, should be a list of tables")
        object.__setattr__(self, "phases", tuple(self.phases))
        if not self.phases:
            raise ValueError("phases: got none, should be one or more")
        for number in range(1, len(self.phases)):
            before, start = (phase.start for phase in self.phases[number - 1 : number + 1])
            if not before < start:
                raise ValueError(
                    f"phases.{number}.start: got {start:g} s, should be after that of the phase "
                    f"before, {before:g} s"
                )

    def at(self, time: Array) -> Reference:
        """Return the motion at each ``time`` [s], shape (n,).

        Raises:
            ValueError: a slew does not fit into its limits, or before the next; or as a phase's.
        """
        found = Reference(*(np.empty((len(time), size)) for size in (4, 3, 3)))
        sign, begins = 1.0, -np.inf
        for number, phase in enumerate(self.phases):
            last = number + 1 == len(self.phases)
            until = np.inf if last else self.slews[number].start
            self._fill(found, (time >= begins) & (time < until), phase.reference.at, time, sign)
            if last:
                break
            slew = self.slews[number]
            now = (time >= until) & (time < slew.end)
            self._fill(found, now, lambda t, n=number: self._along(n, self.slews[n], t), time, sign)
            sign, begins = sign * slew.sign, slew.end
        return found

    @staticmethod
    def _fill(found: Reference, now: Any, source: Any, time: Array, sign: float) -> None:
        if now.any():
            attitude, rate, acceleration = source(time[now])[:3]
            found.attitude[now] = sign * attitude
            found.rate[now], found.acceleration[now] = rate, acceleration

    @cached_property
    def slews(self) -> tuple[Slew, ...]:
        """Those between the phases, one fewer.

        Raises:
            ValueError: one does not fit into its limits, or before the next.
        """
        found = tuple(self._planned(number) for number in range(len(self.phases) - 1))
        for number, (slew, after) in enumerate(pairwise(found)):
            if slew.end > after.start:
                raise ValueError(
                    f"phases.{number + 2}.start: got {after.start:g} s, but the slew of the phase "
                    f"before lasts until {slew.end:.6g} s: start later, or raise the limits"
                )
        return found

    def _planned(self, number: int) -> Slew:
        """Return the quickest slew from that phase to the next."""
        start = self.phases[number + 1].start
        one, other = (
            p.reference.at(np.full(2, start)).attitude[0] for p in self.phases[number : number + 2]
        )
        sign = 1.0 if np.sum(one * other) >= 0.0 else -1.0
        profile, angle = quickest(1e-6, *self._limits), 1e-6
        for _ in range(8):  # the angle that the turn has by its middle, which moves with the other
            middle = start + 0.5 * profile.duration
            angle = max(float(self._angle(number, sign, middle)), 1e-6)
            profile = quickest(angle, *self._limits)

        def fits(factor: float) -> bool:
            return self._fits(number, Slew(start, profile.slowed(factor), sign))

        slow = quick = 1.0
        while not fits(slow):
            quick, slow = slow, 2.0 * slow
            if slow > _SLOWEST:
                raise ValueError(
                    f"phases.{number + 1}: no slew from {start:g} s on is within rate_limit and "
                    "acceleration_limit: one of the two references itself turns faster"
                )
        while slow - quick > 1e-4 * slow:
            middle = 0.5 * (slow + quick)
            slow, quick = (middle, quick) if fits(middle) else (slow, middle)
        return Slew(start, profile.slowed(slow), sign)

    @property
    def _limits(self) -> tuple[float, float, float]:
        return self.rate_limit, self.acceleration_limit, self.jerk_limit

    def _angle(self, number: int, sign: float, time: float) -> Array:
        """Return the angle of the turn between two references [rad], 0 to 2 pi."""
        turn = self._turn(number, sign, np.full(2, time)).value[0]
        return 2.0 * np.arctan2(np.linalg.norm(turn[1:]), turn[0])  # type: ignore[no-any-return]

    def _fits(self, number: int, slew: Slew) -> bool:
        """Tell whether rate and acceleration of the slew are within their limits."""
        time = np.linspace(slew.start, slew.end, _SAMPLES)
        time = np.concatenate([time, slew.start + slew.profile.ends])
        motion = self._along(number, slew, time)
        peaks = (np.linalg.norm(each, axis=-1).max() for each in motion[1:])
        return all(p <= _ROUNDED * limit for p, limit in zip(peaks, self._limits, strict=False))

    def _turn(self, number: int, sign: float, time: Array) -> Jet:
        """Return the quaternion from the axes of one reference to those of the next."""
        one, other = (of_reference(p.reference.at(time)) for p in self.phases[number : number + 2])
        back = Jet(*(att.conjugate(each) for each in (one.value, one.first, one.second)))
        return bilinear(att.multiply, back, other).times(sign)

    def _along(self, number: int, slew: Slew, time: Array) -> Reference:
        """Return the motion of a slew at each ``time`` [s]."""
        one = of_reference(self.phases[number].reference.at(time))
        rise = Jet(*(each[:, None] for each in slew.profile.motion(time - slew.start)))
        half = _half_rotation_vector(self._turn(number, slew.sign, time)) * rise
        return to_reference(bilinear(att.multiply, one, _exponential(half)))


def _half_rotation_vector(q: Jet) -> Jet:
    """Return half the rotation vector of a unit quaternion, of up to 360 deg: acos(w)/|v| v.

    k(w) = acos(w)/sqrt(1 - w^2) satisfies (1 - w^2) k' = w k - 1; near w = 1 it is the sum of n!
    (1 - w)^n / (2 n + 1)!!.
    """
    part = [each[:, :1] for each in (q.value, q.first, q.second)]
    w = np.clip(part[0], -1.0, 1.0)
    near = w > 1.0 - _SMALL
    far = np.where(near, 0.0, w)
    square = 1.0 - far * far
    k = np.arctan2(np.sqrt(square), far) / np.sqrt(square)
    slope = (far * k - 1.0) / square
    bend = (k + 3.0 * far * slope) / square
    factors = np.cumprod([1.0, *(n / (2.0 * n + 1.0) for n in range(1, _TERMS))])
    series = np.polynomial.Polynomial(factors)
    x = np.where(near, 1.0 - w, 0.0)
    k = np.where(near, series(x), k)
    slope = np.where(near, -series.deriv()(x), slope)
    bend = np.where(near, series.deriv(2)(x), bend)
    vector = Jet(*(each[:, 1:] for each in (q.value, q.first, q.second)))
    return vector * Jet(*part).through(k, slope, bend)


def _exponential(half: Jet) -> Jet:
    """Return the quaternion of half a rotation vector h: (cos |h|, sin |h|/|h| h).

    Both are functions of z = |h|^2, c(z) and s(z), with c' = -s/2 and s' = (c - s)/(2 z).
    """
    z = dot(half, half)
    near = z.value < _SMALL
    far = np.where(near, 1.0, z.value)
    c, s = np.cos(np.sqrt(far)), np.sin(np.sqrt(far)) / np.sqrt(far)
    slope = 0.5 * (c - s) / far
    bend = (-0.25 * s - 1.5 * slope) / far
    factors = np.cumprod([1.0, *(-0.5 / (n * (2.0 * n + 1.0)) for n in range(1, _TERMS))])
    series = np.polynomial.Polynomial(factors)
    x = np.where(near, z.value, 0.0)
    s = np.where(near, series(x), s)
    slope = np.where(near, series.deriv()(x), slope)
    bend = np.where(near, series.deriv(2)(x), bend)
    scalar = z.through(np.cos(np.sqrt(z.value)), -0.5 * s, -0.5 * slope)
    vector = half * z.through(s, slope, bend)
    rows = zip(
        (scalar.value, scalar.first, scalar.second),
        (vector.value, vector.first, vector.second),
        strict=True,
    )
    return Jet(*(np.concatenate(pair, axis=-1) for pair in rows))
