"""The cascade of the double-gimbal CMG without a tachometer or a resolver on its wheel.

The wheel's drive works in its stator's axes: it measures the windings' currents and holds voltages
on them. An observer finds the rotor's angle and speed from both, and the cascade flies on what it
believes: speed loop, current loop, steering and attitude law alike. The thesis (paper 001) leaves
this to later work; it is ours. The gimbals keep their sensors, since they stand still.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, VoltageCommand, gain

from ..motors import sensorless
from . import dgvscmg


class State(NamedTuple):
    """The cascade's memory, field by field, and the observer's."""

    wheel_wanted: Array
    speed_memory: Array
    voltage_integral: Array
    observer: Array
    """As ``SpeedObserver`` has it, (..., 1, 7)."""
    voltage: Array
    """Held on the wheel's windings since the last step of the inner loop [V], (..., 1, 2)."""


@dataclass(frozen=True)
class Sensorless(dgvscmg.Cascade):
    """The ``Cascade`` that reads neither ``wheel_speed`` nor ``wheel_angle``.

    The currents of the last motor, the wheel's, and its voltages are the windings'.
    """

    start_speed: float = gain("rad/s", default=73.0)
    """What the wheel's speed is believed to be at first; its sign must be right."""
    voltage_limit: float = gain("V", default=np.inf, above=0.0, at_most=np.inf)
    """Of the supply of the wheel's motor: the observer must know what was cut."""
    observer_bandwidth: float = gain("rad/s", default=3000.0, above=0.0)
    """Of the observed back-EMF."""
    tracking_bandwidth: float = gain("rad/s", default=1000.0, above=0.0)
    """Of the loop that reads angle and speed from it."""

    def reset(self, measurement: Measurement, reference: Reference) -> Any:
        """Return the state that believes in ``start_speed`` and an angle of zero."""
        speed = np.full_like(measurement.gimbal_rate[..., :1], self.start_speed)
        cascade = super().reset(measurement._replace(wheel_speed=speed), reference)
        observer = self._observer.reset(speed)
        # As if the back-EMF had been held: no current flows.
        return State(*cascade, observer, self._held(observer[..., 2:4], observer))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, dgvscmg.SpeedCommand, dgvscmg.Signals]:
        """Return what the cascade does for the wheel's speed as it was believed a moment ago."""
        believed = measurement._replace(wheel_speed=state.observer[..., 5])
        _, command, shown = super().step(_cascade(state), time, believed, reference)
        return state, command, shown

    def inner(
        self, state: Any, time: float, command: dgvscmg.SpeedCommand, measurement: Measurement
    ) -> tuple[Any, VoltageCommand]:
        """Return the gimbals' voltages in their rotors' axes, the wheel's on its windings."""
        gimbals, windings = measurement.current[..., :2, :], measurement.current[..., 2:, :]
        observer = self._observed(state, windings)
        current = np.concatenate([gimbals, sensorless.turned(windings, -observer[..., 4])], axis=-2)
        believed = measurement._replace(wheel_speed=observer[..., 5], current=current)
        cascade, asked = super().inner(_cascade(state), time, command, believed)
        wheel = self._held(asked.voltage[..., 2:, :], observer)
        voltage = np.concatenate([asked.voltage[..., :2, :], wheel], axis=-2)
        return State(*cascade, observer, wheel), VoltageCommand(voltage)

    def _observed(self, state: State, windings: Array) -> Array:
        """Return the observer's memory as of now; what turns the wheel is known but for ripple."""
        ahead = state.observer[..., 4] + self._swept(state.observer)
        across = sensorless.turned(windings, -ahead)[..., 1]
        acceleration = self.torque_constant[2:] / self.rotor_inertia * across
        return self._observer.step(state.observer, windings, state.voltage, acceleration)

    def _held(self, voltage: Array, observer: Array) -> Array:
        """Return the windings' voltages for those in the axes of the rotor that is believed in."""
        return sensorless.held_in_stator(
            voltage, observer[..., 4], self._swept(observer), self.voltage_limit
        )

    def _swept(self, observer: Array) -> Array:
        """Return by how much the rotor turns in a period, as an electrical angle [rad]."""
        swept: Array = self.pole_pairs[2:] * self.inner_period * observer[..., 5]
        return swept

    @cached_property
    def _observer(self) -> sensorless.SpeedObserver:
        return sensorless.SpeedObserver(
            pole_pairs=self.pole_pairs[2:],
            resistance=self.resistance[2:],
            inductance=self.inductance[2:],
            torque_constant=self.torque_constant[2:],
            period=self.inner_period,
            bandwidth=self.observer_bandwidth,
            tracking_bandwidth=self.tracking_bandwidth,
        )


def _cascade(state: State) -> dgvscmg.State:
    return dgvscmg.State(*state[:3])
