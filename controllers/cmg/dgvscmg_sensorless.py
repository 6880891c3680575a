"""The cascade of the double-gimbal CMG without a speed or angle sensor on its wheel.

The wheel's drive works in its stator's axes: it measures the windings' currents and applies
voltages to them. An observer estimates the rotor's angle and speed from both; speed loop, current
loop, steering and attitude law use the estimates. The thesis (paper 001) leaves this to future
work. The gimbals keep their sensors, since the observer needs a spinning rotor.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, VoltageCommand, gain

from ..motors import sensorless
from . import dgvscmg


class State(NamedTuple):
    """Memory of the cascade, field by field, and of the observer."""

    desired_wheel_speed: Array
    speed_memory: Array
    voltage_integral: Array
    observer: Array
    """Memory of the ``SpeedObserver``, (..., 1, 7)."""
    voltage: Array
    """Applied to the wheel's windings since the last step of the inner loop [V], (..., 1, 2)."""


@dataclass(frozen=True)
class Sensorless(dgvscmg.Cascade):
    """The ``Cascade`` without measured ``wheel_speed`` and ``wheel_angle``.

    Current and voltage of the last motor, the wheel's, are those of the windings.
    """

    start_speed: float = gain("rad/s", default=73.0)
    """Initial estimate of the wheel's speed; its sign must be right."""
    voltage_limit: float = gain("V", default=np.inf, above=0.0, at_most=np.inf)
    """Of the supply of the wheel's motor: the observer needs the voltage as applied."""
    observer_bandwidth: float = gain("rad/s", default=3000.0, above=0.0)
    """Of the observed back-EMF."""
    tracking_bandwidth: float = gain("rad/s", default=1000.0, above=0.0)
    """Of the phase-locked loop for angle and speed."""

    def reset(self, measurement: Measurement, reference: Reference) -> Any:
        """Return the initial state: estimates of ``start_speed`` and an angle of zero."""
        speed = np.full_like(measurement.gimbal_rate[..., :1], self.start_speed)
        cascade = super().reset(measurement._replace(wheel_speed=speed), reference)
        observer = self._observer.reset(speed)
        # A voltage equal to the back-EMF: no current flows.
        return State(*cascade, observer, self._held(observer[..., 2:4], observer))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, dgvscmg.SpeedCommand, dgvscmg.Signals]:
        """Return the cascade's command and signals for the last estimate of the wheel's speed."""
        estimated = measurement._replace(wheel_speed=state.observer[..., 5])
        _, command, signals = super().step(_cascade(state), time, estimated, reference)
        return state, command, signals

    def inner(
        self, state: Any, time: float, command: dgvscmg.SpeedCommand, measurement: Measurement
    ) -> tuple[Any, VoltageCommand]:
        """Return the gimbals' voltages in their rotors' axes and the wheel's in its stator's."""
        gimbals, windings = measurement.current[..., :2, :], measurement.current[..., 2:, :]
        observer = self._observed(state, windings)
        current = np.concatenate([gimbals, sensorless.turned(windings, -observer[..., 4])], axis=-2)
        estimated = measurement._replace(wheel_speed=observer[..., 5], current=current)
        cascade, motors = super().inner(_cascade(state), time, command, estimated)
        wheel = self._held(motors.voltage[..., 2:, :], observer)
        voltage = np.concatenate([motors.voltage[..., :2, :], wheel], axis=-2)
        return State(*cascade, observer, wheel), VoltageCommand(voltage)

    def _observed(self, state: State, windings: Array) -> Array:
        """Return the observer's memory at this instant; the motor's torque gives the known part of
        the acceleration."""
        ahead = state.observer[..., 4] + self._swept(state.observer)
        across = sensorless.turned(windings, -ahead)[..., 1]
        acceleration = self.torque_constant[2:] / self.rotor_inertia * across
        return self._observer.step(state.observer, windings, state.voltage, acceleration)

    def _held(self, voltage: Array, observer: Array) -> Array:
        """Return the windings' voltages for those in the axes of the estimated rotor angle."""
        return sensorless.held_in_stator(
            voltage, observer[..., 4], self._swept(observer), self.voltage_limit
        )

    def _swept(self, observer: Array) -> Array:
        """Return the electrical angle [rad] by which the rotor turns in a period."""
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
