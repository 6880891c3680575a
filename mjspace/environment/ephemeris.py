"""Where the frame's origin, the Sun and places on the Earth are, with their time derivatives."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from mjspace.contract import Array, Path
from mjspace.environment.compiled import compiled
from mjspace.environment.earth_rotation import EARTH_ROTATION, sidereal_angle
from mjspace.environment.orbit import orbit_position
from mjspace.scenario.environment import Environment

_DEGREE = 16
_PIECES = 16
"""In a turn at the rate of the periapsis."""
_DAY = 86400.0


@dataclass(frozen=True)
class KnownEphemeris:
    """The ephemeris of a scenario's environment: see ``mjspace.contract.Ephemeris``.

    Orbit and Sun are piecewise Chebyshev interpolants of what the environment flies by, and the
    derivatives those of the polynomials: consistent with each other, whatever the orbit's model.
    Within 1e-8 m of ``orbit_position``, and 4e-16 of the Kepler orbit's acceleration; measured. The
    elements of an orbit that drifts hold in flight for a control period: at control instants the
    flight's origin is where this one is, and the velocity is that from instant to instant.
    """

    environment: Environment

    def origin(self, time: Array) -> Path:
        """Return the motion of the frame's origin from the planet's centre, inertial axes.

        Raises:
            ValueError: there is no orbit.
        """
        if self.environment.orbit is None:
            raise ValueError("it points by the orbit: add [environment.orbit]")
        return self._origin.at(time)

    def sun(self, time: Array) -> Path:
        """Return the Sun's motion from the Earth's centre, inertial axes.

        Raises:
            ValueError: it is not known where the Sun is.
        """
        if not self.environment.has_sun:
            raise ValueError(
                "it points by the Sun, whose place is known in an orbit around the Earth from an "
                "epoch on: add environment.epoch"
            )
        return self._sun.at(time)

    def fixed_to_earth(self, place: Array, time: Array) -> Path:
        """Return the motion of a ``place`` (3,) [m] in Earth-fixed axes, in inertial axes.

        The Earth turns uniformly from mean sidereal time at the epoch on, as under its magnetic
        field; without polar motion.

        Raises:
            ValueError: it is not known how the Earth is turned.
        """
        if not self.environment.has_sun:
            raise ValueError(
                "it points at a place on the Earth, which turns: add environment.epoch, in an "
                "orbit around the Earth"
            )
        angle = self._sidereal_angle + EARTH_ROTATION * time
        cosine, sine = np.cos(angle), np.sin(angle)
        x, y, z = place
        ahead = np.stack([-x * sine - y * cosine, x * cosine - y * sine, 0.0 * angle], axis=-1)
        level = np.stack([x * cosine - y * sine, x * sine + y * cosine, 0.0 * angle], axis=-1)
        w = EARTH_ROTATION
        return Path(level + np.array([0.0, 0.0, z]), w * ahead, -w * w * level, -(w**3) * ahead)

    @cached_property
    def _origin(self) -> "_Interpolant":
        orbit = self.environment.orbit
        elements = orbit.rows(np.zeros(1))[0]
        rate, eccentricity = elements[1], elements[3]
        length = 2.0 * math.pi / (_PIECES * rate) * (1.0 - eccentricity) ** 1.5
        return _Interpolant(partial(orbit_position, orbit), length)

    @cached_property
    def _sun(self) -> "_Interpolant":
        from mjspace.environment import sun  # which imports ERFA

        return _Interpolant(partial(sun.position, self._epoch), _DAY)

    @cached_property
    def _sidereal_angle(self) -> float:
        return sidereal_angle(self._epoch)

    @property
    def _epoch(self) -> datetime:
        zero = self.environment.time_zero
        assert zero is not None  # where it has a Sun
        return zero


@compiled
def _motion(factors: Any, piece: Any, own: Any) -> Any:
    """Return polynomials and their first three derivatives at ``own`` times (n,), as (4, n, 3).

    ``factors`` (m, degree + 1, 3) begin with the highest power's; each time has its ``piece``.
    Horner's scheme, which yields the k-th derivative divided by k!.
    """
    found = np.empty((4, len(own), 3))
    for i in range(len(own)):
        x = own[i]
        for axis in range(3):
            value = slope = half_bend = sixth_jerk = 0.0
            for factor in factors[piece[i], :, axis]:
                sixth_jerk = sixth_jerk * x + half_bend
                half_bend = half_bend * x + slope
                slope = slope * x + value
                value = value * x + factor
            found[0, i, axis], found[1, i, axis] = value, slope
            found[2, i, axis], found[3, i, axis] = 2.0 * half_bend, 6.0 * sixth_jerk
    return found


@dataclass(frozen=True)
class _Interpolant:
    """A smooth position as one polynomial of time after another."""

    position: Callable[[Array], Array]
    """(n, 3) [m] at times (n,) [s]."""
    length: float
    """Of a piece [s]; its Chebyshev series is fitted to twice that, since towards the ends of a
    series the third derivative makes 1e6 times as much of the rounding."""
    _pieces: dict[int, Array] = field(default_factory=dict)
    """The factors of those that have been asked for, (degree + 1, 3), of powers of the piece's own
    time, -1/2 to 1/2, the highest first."""

    def at(self, time: Array) -> Path:
        """Return the motion at each ``time`` [s], (n,)."""
        number = np.floor(time / self.length).astype(int)
        asked, of_each = np.unique(number, return_inverse=True)
        factors = np.array([self._piece(int(k)) for k in asked]).reshape(-1, _DEGREE + 1, 3)
        rows = _motion(factors, of_each, time / self.length - number - 0.5)
        return Path(*(row / self.length**order for order, row in enumerate(rows)))

    def _piece(self, number: int) -> Array:
        if number not in self._pieces:
            place: Any = lambda own: self.position(self.length * (own + number + 0.5))  # noqa: E731
            series: Any = chebyshev.chebinterpolate(place, _DEGREE)
            factors = np.zeros((_DEGREE + 1, 3))
            for axis in range(3):
                powers = chebyshev.cheb2poly(series[:, axis])  # without zeros at its end
                factors[: len(powers), axis] = powers
            self._pieces[number] = factors[::-1].copy()
        return self._pieces[number]
