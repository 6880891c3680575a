"""Cascaded control of a satellite with a double-gimbal variable-speed CMG, from attitude to volts.

Attitude law, steering law, three speed loops with adaptive rejection of the wheel's vibration, and
three current loops. J. Servín Aguilar, "Control de orientación para satélites con compensación de
vibración", UNAM 2022 (paper 001), chapter 5. Additions for multibody physics: the gimbals' motors
hold the gyroscopic torque, which the thesis neglects (E20), and each speed loop has the inertia
that its motor turns (E19). All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Measurement, Reference, Unit, VoltageCommand, gain

from ..attitude import pd_plus
from ..motors import motor_loops
from . import steering


class State(NamedTuple):
    """Memory of the motors' loops; the attitude and steering laws have none."""

    desired_wheel_speed: Array
    """Desired absolute speed of the wheel about its axis [rad/s], (..., 1)."""
    speed_memory: Array
    """Of the speed loops, (..., 3, 9)."""
    voltage_integral: Array
    """Of the current loops [A s], (..., 3, 2)."""


class SpeedCommand(NamedTuple):
    """Command of the attitude loop to the motors' loops, for one period."""

    gimbal_rate: Annotated[Array, Unit("rad/s")]
    """Desired rates of outer and inner gimbal [rad/s], (..., 2)."""
    acceleration: Annotated[Array, Unit("rad/s^2")]
    """Desired acceleration of each hinge [rad/s^2], (..., 3); zero for the gimbals."""
    load: Annotated[Array, Unit("N m")]
    """Gyroscopic torque that each motor has to hold [N m], (..., 3); zero for the wheel's."""


class Signals(NamedTuple):
    """Signals of the cascade."""

    sigma_e: Array
    """Attitude error, modified Rodrigues parameters, (..., 3)."""
    s: Array
    """Composite error [rad/s], body axes, (..., 3)."""
    torque: Array
    """Commanded torque on the bus [N m], body axes, (..., 3)."""
    authority: Array
    """Jw |W cos(di)| [N m s], zero where the steering is singular, (..., 1)."""
    speed_error: Array
    """Desired less measured speed of each hinge [rad/s], the wheel's absolute, (..., 3)."""
    vibration_hat: Array
    """Estimated vibration torque on the wheel [N m], (..., 1)."""
    phi_hat: Array
    """Estimate of psi^2, the square of the vibration's cycles per revolution, (..., 1)."""


@dataclass(frozen=True)
class Cascade(Gains):
    """The attitude law (5.9), steering (5.7), speed loops (4.19)-(4.22), current loops (4.36)."""

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """Mb: of the bus alone, body axes."""
    control_period: float = gain("s", above=0.0)
    """Of the attitude law and the steering."""
    inner_period: float = gain("s", above=0.0)
    """Of the motors' loops."""
    rotor_inertia: float = gain("kg m^2", default=0.016, above=0.0)
    """Jw: of the wheel about its spin axis."""
    attitude_gain: float = gain("1/s", default=1.0, above=0.0)
    """lam."""
    rate_gain: float = gain("N m s/rad", default=10.0, above=0.0)
    """Kc, the same on each axis."""
    disturbance_bound: float = gain("N m", default=0.05, at_least=0.0)
    """tbar: largest norm of the disturbance."""
    smoothing: float = gain("W", default=1e-6, above=0.0)
    """eps: smoothing of the relay that compensates the disturbance; see ``pd_plus.Robust``."""
    steering_damping: float = gain(default=0.01, at_least=0.0)
    """g0: cos(di) at which the damping halves the outer gimbal's rate."""
    momentum_damping: float = gain("N m s", default=0.01, at_least=0.0)
    """Momentum of the wheel at which the damping halves the gimbals' rates; not in the thesis."""
    gimbal_rate_limit: float = gain("rad/s", default=inf, above=0.0, at_most=inf)
    """Largest commanded rate; it limits the torque perpendicular to the spin axis. Not in the
    thesis."""
    wheel_acceleration_limit: float = gain("rad/s^2", default=inf, above=0.0, at_most=inf)
    """Largest commanded acceleration; not in the thesis."""
    gyroscopic_feedforward: float = gain(default=1.0, at_least=0.0, at_most=1.0)
    """Share of the gyroscopic torque that is fed forward to the gimbals' motors; thesis: 0."""
    turned_inertia: Array = gain("kg m^2", (3,), default=(0.018, 0.017, 0.016), above=0.0)
    """J: inertia that each motor turns: outer gimbal, inner gimbal, wheel."""
    speed_gain: Array = gain("N m s/rad", (3,), default=(2.0, 2.0, 0.32), above=0.0)
    """k_p."""
    integral_gain: Array = gain("N m/rad", (3,), default=(0.0, 0.0, 0.0), at_least=0.0)
    """k_i; not in the thesis."""
    observer_gain: Array = gain("N m s/rad", (3,), default=(0.0, 0.0, 1.0), at_least=0.0)
    """k_o."""
    vibration_gain: Array = gain("N m/rad", (3,), default=(0.0, 0.0, 5.0), at_least=0.0)
    """k_e; zero: no rejection of vibration."""
    adaptation_gain: Array = gain("1/(N m)^2", (3,), default=(0.0, 0.0, 1.0), at_least=0.0)
    """k_a."""
    vibration_limit: Array = gain("N m", (3,), default=3 * (inf,), at_least=0.0, at_most=inf)
    """Largest amplitude of the estimated vibration: bounds the torque of the rejection. Not in the
    thesis."""
    current_limit: Array = gain("A", (3,), default=3 * (inf,), above=0.0, at_most=inf)
    """Largest commanded I_q."""
    speed_steps: int = gain(default=1, at_least=1, whole=True)
    """Inner periods in one period of the speed loops; the current loops run in each."""
    current_gain: float = gain("1/s", default=3000.0, above=0.0)
    """k_ep; k_ei is k_ep R/L."""
    pole_pairs: Array = gain(shape=(3,), default=(4.0, 4.0, 6.0), at_least=1, whole=True)
    """p of each motor."""
    resistance: Array = gain("ohm", (3,), default=(2.5, 2.5, 3.0), above=0.0)
    """R."""
    inductance: Array = gain("H", (3,), default=(4.5e-3, 4.5e-3, 6e-3), above=0.0)
    """L."""
    torque_constant: Array = gain("N m/A", (3,), default=(1.5, 1.5, 2.0), above=0.0)
    """k_m."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._refuse_unstable()
        inner = self.control_period / self.inner_period
        if abs(inner / self.speed_steps - round(inner / self.speed_steps)) > 1e-9:
            ratio = f"control_period / inner_period, {inner:g}"
            raise ValueError(f"speed_steps: got {self.speed_steps}, should divide {ratio}")

    def _refuse_unstable(self) -> None:
        _ = self._speed_loop, self._current_loop  # refuse unstable gains

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state: the wheel keeps its speed, no vibration is estimated."""
        speed, carried = _speeds(measurement), _carried(measurement)
        return State(
            (speed + carried)[..., 2:],
            self._speed_loop.reset(speed, carried),
            self._current_loop.reset(speed),
        )

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, SpeedCommand, Signals]:
        """Return the gimbals' rates and the wheel's acceleration for the commanded torque."""
        angle, wheel_speed = measurement.gimbal_angle, measurement.wheel_speed
        torque, sigma_e, s = pd_plus.commanded_torque(
            measurement.attitude,
            measurement.rate,
            steering.momentum(
                self.inertia, measurement.rate, angle, wheel_speed, self.rotor_inertia
            ),
            reference,
            self.inertia,
            self._attitude_gains,
        )
        eta, authority = steering.steer(
            torque,
            angle,
            wheel_speed,
            self.rotor_inertia,
            self.steering_damping,
            self.momentum_damping,
        )
        eta = steering.within(eta, self._limits)
        load = steering.gimbal_load(measurement.rate, angle, eta, wheel_speed, self.rotor_inertia)
        still, none = np.zeros_like(load), np.zeros_like(wheel_speed)
        command = SpeedCommand(
            eta[..., :2],
            np.concatenate([still, eta[..., 2:]], axis=-1),
            np.concatenate([self.gyroscopic_feedforward * load, none], axis=-1),
        )
        found = motor_loops.estimates(state.speed_memory[..., 2:, :])
        desired = np.concatenate([command.gimbal_rate, state.desired_wheel_speed], axis=-1)
        error = desired - _speeds(measurement) - _carried(measurement)
        signals = Signals(sigma_e, s, torque, authority, error, found.z1_hat, found.phi_hat)
        return state, command, signals

    def inner(
        self, state: State, time: float, command: SpeedCommand, measurement: Measurement
    ) -> tuple[State, VoltageCommand]:
        """Return the motors' voltages for the desired speeds."""
        speed = _speeds(measurement)
        memory, wheel_speed = state.speed_memory, state.desired_wheel_speed
        # A traced time cannot be rounded; with a loop in every inner period it need not be.
        if self.speed_steps == 1 or round(time / self.inner_period) % self.speed_steps == 0:
            memory, _ = self._speed_loop.step(
                memory,
                measurement.current,
                speed,
                np.concatenate([command.gimbal_rate, wheel_speed], axis=-1),
                command.acceleration,
                command.load,
                _carried(measurement),
            )
            wheel_speed = wheel_speed + self._speed_loop.period * command.acceleration[..., 2:]
        current = motor_loops.held_current(memory)
        integral, voltage = self._current_loop.step(
            state.voltage_integral, measurement.current, current, speed
        )
        return State(wheel_speed, memory, integral), VoltageCommand(voltage)

    @cached_property
    def _attitude_gains(self) -> Array:
        control = [self.attitude_gain, self.rate_gain]
        return np.array([*control, self.disturbance_bound, self.smoothing])

    @cached_property
    def _limits(self) -> Array:
        return np.array([*[self.gimbal_rate_limit] * 2, self.wheel_acceleration_limit])

    @cached_property
    def _speed_loop(self) -> motor_loops.SpeedLoop:
        return motor_loops.SpeedLoop(
            inertia=self.turned_inertia,
            torque_constant=self.torque_constant,
            period=self.speed_steps * self.inner_period,
            speed_gain=self.speed_gain,
            integral_gain=self.integral_gain,
            observer_gain=self.observer_gain,
            vibration_gain=self.vibration_gain,
            adaptation_gain=self.adaptation_gain,
            lead=1.0 / self.current_gain + 0.5 * (self.speed_steps - 1) * self.inner_period,
            vibration_limit=self.vibration_limit,
            current_limit=self.current_limit,
        )

    @cached_property
    def _current_loop(self) -> motor_loops.CurrentLoop:
        return motor_loops.CurrentLoop(
            pole_pairs=self.pole_pairs,
            resistance=self.resistance,
            inductance=self.inductance,
            torque_constant=self.torque_constant,
            period=self.inner_period,
            proportional_gain=self.current_gain,
        )


def _speeds(measurement: Measurement) -> Array:
    """Return the hinges' speeds: outer gimbal, inner gimbal, wheel [rad/s], (..., 3)."""
    return np.concatenate([measurement.gimbal_rate, measurement.wheel_speed], axis=-1)


def _carried(measurement: Measurement) -> Array:
    """Return the rate of each rotor's carrier about the rotor's axis [rad/s], (..., 3)."""
    return steering.carried(measurement.rate, measurement.gimbal_angle, measurement.gimbal_rate)
