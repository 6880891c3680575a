"""Attitude and power tracking with a cluster of single-gimbal variable-speed CMGs.

Their wheels store energy: a power profile is tracked by wheel torques that leave the attitude
alone. The attitude law is that of ``cmg_cluster``, the steering that of ``vscmg_steering``. All
arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, Unit, gain

from ..references.powered import PoweredReference
from . import vscmg_steering
from .cmg_cluster import ClusterGains


class State(NamedTuple):
    """Memory of this law."""

    start_energy: Array
    """Of the wheels less what the profile had stored, at the start [J], (..., 1)."""


class VariableSpeedCommand(NamedTuple):
    """Command to gimbals with speed loops, and to wheels that obey torques."""

    gimbal_rate: Annotated[Array, Unit("rad/s")]
    """Relative to what carries each [rad/s], (..., n)."""
    wheel_torque: Annotated[Array, Unit("N m")]
    """Of each wheel's motor, on its rotor [N m], (..., n)."""


class Signals(NamedTuple):
    """Signals of this law."""

    sigma_e: Array
    """Attitude error, modified Rodrigues parameters, (..., 3)."""
    s: Array
    """Composite error [rad/s], body axes, (..., 3)."""
    torque: Array
    """Commanded torque on the bus [N m], body axes, (..., 3)."""
    power: Annotated[Array, Unit("W")]
    """Commanded into the wheels [W], (..., 1)."""
    energy_error: Annotated[Array, Unit("J")]
    """Measured less desired energy in the wheels [J], (..., 1)."""
    spread: Annotated[Array, Unit("rad/s")]
    """Of the wheel speeds: largest less least [rad/s], (..., 1)."""


@dataclass(frozen=True)
class PowerTracking(ClusterGains):
    """PD+ commands the torque on the bus, the profile the power; null motion equalizes the wheels.

    The wheels' energy sum Jw W^2 / 2 is fed back to the power. It is that of their speeds relative
    to the gimbals; a bus that turns at w changes it by less than w / W of itself.
    """

    batched: ClassVar[bool] = True

    energy_gain: float = gain("1/s", default=1.0, at_least=0.0)
    """Power for each joule that is lacking."""
    equalizing_gain: float = gain("1/s", default=0.0, at_least=0.0)
    """At which wheel speeds approach their mean, as far as null motion allows it."""
    gimbal_scale: float = gain("rad/s", default=1.0, above=0.0)
    """Gimbal rate that costs as much as ``wheel_scale``."""
    wheel_scale: float = gain("N m", default=0.1, above=0.0)
    """Torque of a wheel's motor."""

    def reset(self, measurement: Measurement, reference: PoweredReference) -> State:
        """Return the energy in the wheels."""
        return State(self._energy(measurement) - reference.energy)

    def step(
        self, state: State, time: float, measurement: Measurement, reference: PoweredReference
    ) -> tuple[State, VariableSpeedCommand, Signals]:
        """Return the state, gimbal rates [rad/s] and wheel torques [N m] (..., n), the signals."""
        torque, sigma_e, s = self.commanded_torque(measurement, Reference(*reference[:3]))
        speed = measurement.wheel_speed
        error = self._energy(measurement) - state.start_energy - reference.energy
        power = reference.power - self.energy_gain * error
        mean = np.sum(speed, axis=-1, keepdims=True) / len(self.wheel_inertia)
        rate, wheel_torque = vscmg_steering.share(
            self.cluster,
            torque,
            power,
            measurement.gimbal_angle,
            speed,
            self.equalizing_gain * self.wheel_inertia * (mean - speed),
            self._scales,
        )
        spread = np.max(speed, axis=-1, keepdims=True) - np.min(speed, axis=-1, keepdims=True)
        signals = Signals(sigma_e, s, torque, power, error, spread)
        return state, VariableSpeedCommand(rate, wheel_torque), signals

    def _energy(self, measurement: Measurement) -> Array:
        speed = measurement.wheel_speed
        total: Array = np.sum(0.5 * self.wheel_inertia * speed * speed, axis=-1, keepdims=True)
        return total

    @cached_property
    def _scales(self) -> Array:
        return np.array([self.gimbal_scale, self.wheel_scale])
