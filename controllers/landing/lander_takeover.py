"""A lander with thrusters for its attitude, whose gimballed engine takes over when they fail.

The case that paper 003 is written for: the thrusters of the reaction-control system fail, and one
gimballed engine is left for attitude and descent. The law tells the failure from the motion alone,
by the residual of the angular momentum (A. De Luca and R. Mattone, "Sensorless robot collision
detection and hybrid force/motion control", IEEE ICRA 2005, equation (5), for one rigid body). All
arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mjspace.algebra import cross, dot, times
from mjspace.contract import Array, Measurement, Trajectory, gain

from ..thrusters.allocation import effect, pulses, share, within
from . import lander_vectoring
from .lander_vectoring import ThrustVectoring


class State(NamedTuple):
    """Memory of the law."""

    cut: Array
    """1.0 from touchdown on, when the engine is cut for good, else 0.0; (..., 1)."""
    integral: Array
    """Of the position error [m s], world axes, (..., 3)."""
    carry: Array
    """On-time of each thruster that is carried over [s], (..., n)."""
    expected: Array
    """Angular momentum by what is commanded and the residual [N m s], body axes, (..., 3)."""
    residual: Array
    """Torque that the commands do not explain, low-pass filtered [N m], (..., 3)."""
    failed: Array
    """1.0 once the thrusters are given up, for good, else 0.0; (..., 1)."""


class Command(NamedTuple):
    """Command to the engine and the thrusters."""

    thrust: Array
    """[N], (..., 1)."""
    gimbal: Array
    """Angles of the hinges, the outer before the inner [rad], (..., 2)."""
    on_time: Array
    """Of each thruster in the period [s], (..., n)."""


class Signals(NamedTuple):
    """Signals of the law."""

    position_error: Array
    """Measured less desired position [m], world axes, (..., 3)."""
    pointing_error: Array
    """Sine of the rotation from the thrust axis to the desired one [rad], body x and y, (..., 2).
    """
    desired_thrust: Array
    """Commanded thrust before its limits [N], (..., 1)."""
    desired_torque: Array
    """[N m], body axes, (..., 3)."""
    residual: Array
    """Torque that the commands do not explain [N m], body axes, (..., 3)."""
    failed: Array
    """1.0 once the thrusters are given up, else 0.0; (..., 1)."""


@dataclass(frozen=True, kw_only=True)
class Takeover(ThrustVectoring):
    """``ThrustVectoring`` whose torque the thrusters give, and the gimbals once those have failed.

    The residual r' = k (torque from outside - r) follows from the measured rates and from what was
    commanded to the thrusters. Where it exceeds ``failure_torque``, they are shut for good. Until
    then the engine's gimbals are held straight.
    """

    thruster_positions: Array = gain("m", ("thruster", 3))
    """From the centre of mass, body axes, (n, 3)."""
    thruster_directions: Array = gain(shape=("thruster", 3), form="unit vector")
    """Of the force on the vehicle, body axes, (n, 3)."""
    thruster_force: Array = gain("N", ("thruster",), above=0.0)
    """Of each, (n,)."""
    thruster_minimum_on: Array | float = gain(
        "s", ("thruster",), default=0.0, at_least=0.0, one_for_all=True
    )
    """Shorter pulses are not fired but carried over; of all, or of each, (n,)."""
    observer_gain: float = gain("1/s", default=5.0, above=0.0)
    """k."""
    failure_torque: float = gain("N m", default=0.5, above=0.0, at_most=np.inf)
    """Residual above which the thrusters have failed; infinite: they are never given up."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:  # type: ignore[override]
        """Return the initial state: the thrusters work."""
        own = super().reset(measurement, reference)
        none = np.zeros_like(measurement.position)
        carry = np.zeros((*none.shape[:-1], len(self.thruster_force)))
        momentum = times(self.inertia, measurement.rate)
        return State(*own, carry, momentum, none, none[..., :1].copy())

    def step(  # type: ignore[override]
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, Command, Signals]:
        """Return the next state, the commands to engine and thrusters, and the signals."""
        own = lander_vectoring.State(state.cut, state.integral)
        after, engine, signals = super().step(own, time, measurement, reference)
        _, _, torque = self._wanted(state.integral, measurement, reference)

        momentum = times(self.inertia, measurement.rate)
        residual = self.observer_gain * (momentum - state.expected)
        size = np.sqrt(dot(residual, residual))
        working = (state.failed < 0.5) & (after.cut < 0.5)
        failed = np.where(working & (size > self.failure_torque), 1.0, state.failed)

        fires = (failed < 0.5) & (after.cut < 0.5)
        desired = np.where(fires, np.concatenate([torque, 0.0 * torque], axis=-1), 0.0)
        shares, _ = within(share(desired, self._effects))
        period = self.control_period
        on_time, carry = pulses(shares, state.carry, period, self.thruster_minimum_on)
        on_time = np.where(fires, on_time, 0.0)
        gimbal = np.where(failed > 0.5, engine.gimbal, 0.0)

        applied = times(self._effects[:3], on_time) / period
        explained = applied + residual - cross(measurement.rate, momentum)
        kept = State(*after, carry, state.expected + period * explained, residual, failed)
        shown = Signals(*signals[:3], torque, residual.copy(), failed.copy())
        return kept, Command(engine.thrust, gimbal, on_time), shown

    @cached_property
    def _effects(self) -> Array:
        return effect(self.thruster_positions, self.thruster_directions, self.thruster_force)
