"""One motor on a test bench tracks a sinusoidal speed and rejects the vibration of its rotor.

Servín 2022 (paper 001), chapter 4. Its motor and gains are the defaults, except for the current
loop's gain (erratum E21: the printed 9e6 1/s needs steps of 3e-7 s).
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf, pi
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Measurement, Reference, VoltageCommand, gain

from .deadbeat import DeadbeatLoop
from .motor_loops import CurrentLoop, SpeedLoop, estimates


class BenchState(NamedTuple):
    """Memory of the motor's loops."""

    speed_memory: Array
    """Memory of the speed loop, (..., 1, 9)."""
    voltage_integral: Array
    """Memory of the current loop: integrals [A s], (..., 1, 2); of ``DeadbeatBench`` (..., 1, 3),
    corrections [V] and the last desired current [A]."""


class BenchSignals(NamedTuple):
    """Signals of the law, each of shape (..., 1)."""

    speed_error: Array
    """Desired less measured speed [rad/s]."""
    desired_current: Array
    """I_q*: commanded current [A]."""
    vibration_hat: Array
    """Estimated vibration torque on the rotor [N m]."""
    phi_hat: Array
    """Estimate of psi^2, the square of the vibration's cycles per revolution."""


@dataclass(frozen=True)
class _Bench(Gains):
    """What the benches share: all but the current loop."""

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    amplitude: float = gain("rad/s", default=20.0)
    """Of the desired speed, mean_speed + amplitude sin(frequency t)."""
    frequency: float = gain("rad/s", default=0.5 * pi)
    """Of the desired speed."""
    mean_speed: float = gain("rad/s", default=0.0)
    """Of the desired speed."""
    rotor_inertia: float = gain("kg m^2", default=0.016, above=0.0)
    """J."""
    pole_pairs: float = gain(default=6.0, at_least=1, whole=True)
    """p."""
    resistance: float = gain("ohm", default=3.0, above=0.0)
    """R."""
    inductance: float = gain("H", default=6e-3, above=0.0)
    """L."""
    torque_constant: float = gain("N m/A", default=2.0, above=0.0)
    """k_m."""
    speed_gain: float = gain("N m s/rad", default=8.0, above=0.0)
    """k_p."""
    integral_gain: float = gain("N m/rad", default=0.0, at_least=0.0)
    """k_i; not in the thesis."""
    observer_gain: float = gain("N m s/rad", default=1.0, at_least=0.0)
    """k_o."""
    vibration_gain: float = gain("N m/rad", default=5.0, at_least=0.0)
    """k_e; zero: no rejection of vibration."""
    adaptation_gain: float = gain("1/(N m)^2", default=0.26, at_least=0.0)
    """k_a; zero: psi^2 stays at ``ratio``."""
    ratio: float = gain(default=0.0, at_least=0.0)
    """Initial psi^2."""
    clock: float = gain("rad/s", default=0.0, at_least=0.0)
    """Of a vibration that depends on time: psi is its frequency over this rate, and at most 1.22.
    Zero: it depends on the rotor's angle."""
    voltage_limit: float = gain("V", default=inf, above=0.0, at_most=inf)
    """Of the supply."""
    current_limit: float = gain("A", default=inf, above=0.0, at_most=inf)
    """Largest commanded current."""

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self._speed_loop, self._current_loop  # refuse unstable gains

    def reset(self, measurement: Measurement, reference: Reference) -> BenchState:
        """Return the initial state: no vibration is estimated."""
        speed = measurement.wheel_speed
        return BenchState(self._speed_loop.reset(speed), self._current_loop.reset(speed))

    def step(
        self, state: BenchState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[BenchState, VoltageCommand, BenchSignals]:
        """Return the next state, the voltage and the estimates; the reference is not used."""
        speed, current = measurement.wheel_speed, measurement.current
        swing = self.amplitude * np.sin(self.frequency * time)
        desired = np.full_like(speed, self.mean_speed + swing)
        ahead = self.frequency * (time + self._lag)
        slope = np.full_like(speed, self.amplitude * self.frequency * np.cos(ahead))
        memory, commanded = self._speed_loop.step(
            state.speed_memory, current, speed, desired, slope, np.zeros_like(speed)
        )
        integral, voltage = self._current_loop.step(
            state.voltage_integral, current, commanded, speed
        )
        found = estimates(memory)
        signals = BenchSignals(desired - speed, commanded, found.z1_hat, found.phi_hat)
        return BenchState(memory, integral), VoltageCommand(voltage), signals

    @cached_property
    def _speed_loop(self) -> SpeedLoop:
        return SpeedLoop(
            inertia=self.rotor_inertia,
            torque_constant=self.torque_constant,
            period=self.control_period,
            speed_gain=self.speed_gain,
            integral_gain=self.integral_gain,
            observer_gain=self.observer_gain,
            vibration_gain=self.vibration_gain,
            adaptation_gain=self.adaptation_gain,
            lead=self._lag,
            ratio=self.ratio,
            clock=self.clock,
            current_limit=self.current_limit,
        )

    @property
    def _lag(self) -> float:
        """Of the current behind the desired one [s]."""
        raise NotImplementedError

    @property
    def _current_loop(self) -> CurrentLoop | DeadbeatLoop:
        raise NotImplementedError


@dataclass(frozen=True)
class SpeedBench(_Bench):
    """Speed and PI current loops of one motor whose speed is ``wheel_speed``, (..., 1)."""

    current_gain: float = gain("1/s", default=3000.0, above=0.0)
    """k_ep; k_ei is k_ep R/L."""

    @property
    def _lag(self) -> float:
        return 1.0 / self.current_gain

    @cached_property
    def _current_loop(self) -> CurrentLoop:
        return CurrentLoop(
            pole_pairs=self.pole_pairs,
            resistance=self.resistance,
            inductance=self.inductance,
            torque_constant=self.torque_constant,
            period=self.control_period,
            proportional_gain=self.current_gain,
            voltage_limit=self.voltage_limit,
        )


@dataclass(frozen=True)
class DeadbeatBench(_Bench):
    """The same motor with the deadbeat current loop in place of the PI."""

    correction: float = gain(default=0.1, at_least=0.0, at_most=1.0)
    """Share of a voltage that the motor's model lacks which is learned in each period."""

    @property
    def _lag(self) -> float:
        return self.control_period

    @cached_property
    def _current_loop(self) -> DeadbeatLoop:
        return DeadbeatLoop(
            pole_pairs=self.pole_pairs,
            resistance=self.resistance,
            inductance=self.inductance,
            torque_constant=self.torque_constant,
            period=self.control_period,
            correction=self.correction,
            voltage_limit=self.voltage_limit,
        )
