"""A desired motion defined by its rate: the attitude is integrated to rounding error.

The quaternion's path is continuous, as required by a law that chooses q or -q once at its start.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Reference, gain
from mjspace.gufunc import gufunc

_TURN = 0.05  # [rad] of amplitude and phase in a step; 3e-14 rad after 60 s, 7.5e-14 with 0.1
_BLOCK = 64  # steps
_MOST_STEPS = 1_000_000  # 5 s of integration, 30 MB


@dataclass(frozen=True)
class Sinusoids(Gains):
    """Rates A sin(w t + phase) on the three desired axes, with the attitude that follows from them.

    The motion of Servín Aguilar 2022 (paper 001), chapter 3; with a phase of 90 deg on the first
    axis that of chapter 5. The attitude has no closed form. It is integrated by the sixth-order
    Magnus method (Blanes, Casas and Ros 2000, "Improved high order integrators based on the Magnus
    expansion", BIT 40) on a fixed grid, from time zero in both directions, with one shorter step
    from the grid to the requested time: the result does not depend on earlier calls.
    """

    amplitude: Array = gain("rad/s", (3,), default=(0.125, 0.075, 0.035))
    """Of the rate on each axis."""
    frequency: Array = gain(
        "rad/s", (3,), default=(2.0 * np.pi / 30.0, 5.0 * np.pi / 27.0, 6.0 * np.pi / 28.0)
    )
    """w, of each axis."""
    phase: Array = gain("rad", (3,), default=(0.0, 0.0, 0.0))
    """Of each axis; 90 deg makes a cosine."""
    start_mrp: Array = gain(shape=(3,), default=(0.1707, 0.1205, 0.0621))
    """Attitude at time zero, modified Rodrigues parameters of either set, desired to inertial axes.

    Table 3.1; section 5.3 prints 0.1502 for the second component (E23: undecidable).
    """

    def at(self, time: Array) -> Reference:
        """Return the motion at each ``time`` [s]; before zero too.

        Raises:
            ValueError: a time too many steps of the grid away.
        """
        steps = np.floor(np.abs(time) / self._step)
        if not steps.max(initial=0.0) <= _MOST_STEPS:
            raise ValueError(
                f"amplitude and frequency: at {np.abs(time).max():g} s the attitude is more than "
                f"{_MOST_STEPS} steps of {self._step:.3g} s away, {_TURN:g} rad each"
            )
        steps = steps.astype(int)
        way = np.copysign(1.0, time)
        start = np.empty((len(time), 4))
        for index in {*zip(way.tolist(), (steps // _BLOCK).tolist(), strict=True)}:
            rows = (way == index[0]) & (steps // _BLOCK == index[1])
            start[rows] = self._block(*index)[steps[rows] % _BLOCK]
        grid = way * steps * self._step
        attitude = att.multiply(start, att.from_rotation_vector(self._turn(grid, time - grid)))
        angle = time[:, None] * self.frequency + self.phase
        acceleration = self.amplitude * self.frequency * np.cos(angle)
        return Reference(att.normalize(attitude), self._rate(time), acceleration)

    @cached_property
    def _step(self) -> float:
        """Length of a step of the grid [s]."""
        pace = np.linalg.norm(self.amplitude) + np.abs(self.frequency).max()
        return float(_TURN / max(pace, 1e-6))

    @cached_property
    def _blocks(self) -> dict[tuple[float, int], Array]:
        """Computed blocks of attitudes on the grid, by (direction in time 1.0 or -1.0, number)."""
        return {}

    def _block(self, way: float, number: int) -> Array:
        """Return the attitudes (65, 4) on the grid from step 64 ``number`` on.

        Blocks have a fixed size, and each starts at the end of the one before: the same bits for
        any order of calls and any number of threads.
        """
        for n in range(number + 1):
            if (way, n) in self._blocks:
                continue
            step = np.full(_BLOCK, way * self._step)
            turns = att.from_rotation_vector(
                self._turn(step * np.arange(n * _BLOCK, (n + 1) * _BLOCK), step)
            )
            first = self._blocks[way, n - 1][-1] if n else att.from_mrp(self.start_mrp)
            self._blocks[way, n] = np.vstack([first, _turned.ufunc(first, turns)])
        return self._blocks[way, number]

    def _rate(self, time: Array) -> Array:
        return self.amplitude * np.sin(time[:, None] * self.frequency + self.phase)

    def _turn(self, time: Array, step: Array) -> Array:
        """Return the rotation vectors (n, 3) [rad] of one step [s] from each ``time`` [s] on.

        The rate is sampled at three Gauss points. The commutator of two rotations' generators is
        the cross product; R' = R S(w) multiplies from the right, which reverses its sign.
        """
        h, reach = step[:, None], np.sqrt(0.15) * step
        early, mid, late = (self._rate(time + 0.5 * step + d) for d in (-reach, 0.0, reach))
        a1 = h * mid
        a2 = np.sqrt(15.0) / 3.0 * h * (late - early)
        a3 = 10.0 / 3.0 * h * (late - 2.0 * mid + early)
        c1 = np.cross(a2, a1)
        c2 = np.cross(2.0 * a3 + c1, a1) / -60.0
        turn: Array = a1 + a3 / 12.0 + np.cross(a2 + c2, -20.0 * a1 - a3 + c1) / 240.0
        return turn


@gufunc(["void(f8[:], f8[:, :], f8[:, :])"], "(q),(n,q)->(n,q)")
def _turned(first: Any, turns: Any, attitudes: Any) -> None:
    """Turn an attitude again and again, and keep the product of each turn, normalized."""
    a, b, c, d = first
    for i in range(turns.shape[0]):
        p, q, r, s = turns[i]
        a, b, c, d = (
            a * p - b * q - c * r - d * s,
            a * q + b * p + c * s - d * r,
            a * r - b * s + c * p + d * q,
            a * s + b * r - c * q + d * p,
        )
        length = math.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a / length, b / length, c / length, d / length
        attitudes[i, 0], attitudes[i, 1], attitudes[i, 2], attitudes[i, 3] = a, b, c, d
