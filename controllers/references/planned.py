"""A desired motion from planned torques: what a rigid body does under them, from rest."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Reference, gain


@dataclass(frozen=True)
class Planned(Gains):
    """The slew of a table of torques, as ``minimum_time:minimum_time_slew`` plans one.

    Each row of ``torque`` acts from its time to the next; after the last time the attitude reached
    then is held. Rate and attitude are integrated from switch to switch, to 1e-12. ``acceleration``
    is such that inertia x acceleration + rate x inertia x rate is the mean of the planned torque
    over the control period to come: a law that holds its torque applies the planned impulse.
    """

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """Of the body that was planned for, about its centre of mass, body axes."""
    control_period: float = gain("s", above=0.0)
    time: Array = gain("s", ("instant",), form="increasing")
    """Of the start, the switches and the end: one more than rows of ``torque``."""
    torque: Array = gain("N m", ("row", 3))
    """Between two of these times, body axes."""
    start_attitude: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """At rest, until the first time: quaternion, scalar first, body to inertial; normalized."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.time) != len(self.torque) + 1:
            raise ValueError(
                f"time: got {len(self.time)} rows, should be {len(self.torque) + 1}, "
                f"one more than of torque"
            )

    def at(self, time: Array) -> Reference:
        """Return the slew at each ``time`` [s], shape (n,); held before it starts and after it."""
        states = np.empty((len(time), 7))
        arc = np.searchsorted(self.time, time, side="right") - 1
        for index, (motion, end) in enumerate(self._arcs):
            if (now := arc == index).any():
                states[now] = motion(time[now]).T
            states[arc > index] = end
        states[arc < 0] = self._start
        rate = states[:, 4:]
        turning = np.einsum("ij,nj->ni", self.inertia, rate)
        torque = self._impulse(time + self.control_period) - self._impulse(time)
        torque = torque / self.control_period
        inverse = np.linalg.inv(self.inertia)
        acceleration = np.einsum("ij,nj->ni", inverse, torque - np.cross(rate, turning))
        return Reference(att.normalize(states[:, :4]), rate, acceleration)

    def _impulse(self, time: Array) -> Array:
        """Return the integral of the torque until each ``time`` [N m s], (n, 3)."""
        of_arcs = np.diff(self.time)[:, None] * self.torque
        total = np.concatenate([np.zeros((1, 3)), np.cumsum(of_arcs, axis=0)])
        return np.stack([np.interp(time, self.time, column) for column in total.T], axis=-1)

    @property
    def _start(self) -> Array:
        return np.concatenate([att.normalize(self.start_attitude), np.zeros(3)])

    @cached_property
    def _arcs(self) -> list[tuple[Any, Array]]:
        """Of each row: attitude and rate (7, n) as a function of time, and at its end (7,)."""
        inverse, found, state = np.linalg.inv(self.inertia), [], self._start
        for start, end, torque in zip(self.time, self.time[1:], self.torque, strict=False):

            def derivative(_: float, x: Array, torque: Array = torque) -> Array:
                rate = x[4:]
                turned = 0.5 * att.multiply(x[:4], att.pure(rate))
                spin = inverse @ (torque - np.cross(rate, self.inertia @ rate))
                return np.concatenate([turned, spin])

            arc = solve_ivp(
                derivative, (start, end), state, "DOP853", None, True, rtol=1e-12, atol=1e-13
            )
            state = arc.y[:, -1]
            found.append((arc.sol, state))
        at_rest = np.concatenate([state[:4], np.zeros(3)])
        found[-1] = (found[-1][0], at_rest)
        return found
