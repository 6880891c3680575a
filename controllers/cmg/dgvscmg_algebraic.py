"""The double-gimbal CMG as the thesis models it: three independent motors.

J. Servín Aguilar, "Control de orientación para satélites con compensación de vibración", UNAM 2022
(paper 001), section 5.2: each motor turns its own inertia, J W' = k_m I_q + z1 (5.4), with an ideal
current loop, and the torque on the bus is -chi eta. The model neglects the gyroscopic torque on the
gimbals' motors (E20) and the inertia that they carry (E19). The law integrates it and commands its
torque from ideal thrusters on a rigid bus, which reproduces the thesis' results. On multibody
physics the thesis' cascade fails (scenario ``dgvscmg-thesis``). All arrays may have leading vehicle
axes.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain
from mjspace.gufunc import gufunc

from ..motors import motor_loops
from . import dgvscmg


class State(NamedTuple):
    """State of the modelled CMG (outer gimbal, inner gimbal, wheel) and of its speed loops."""

    angle: Array
    """Hinge angles [rad], (..., 3)."""
    speed: Array
    """Hinge rates [rad/s], (..., 3)."""
    desired_speed: Array
    """Desired hinge rates [rad/s], (..., 3)."""
    speed_memory: Array
    """Of the speed loops, (..., 3, 9)."""
    applied_torque: Array
    """Torque -chi eta of the last inner period [N m], body axes, (..., 3)."""


class Signals(NamedTuple):
    """Signals of the cascade and of the modelled CMG."""

    sigma_e: Array
    """Attitude error, modified Rodrigues parameters, (..., 3)."""
    torque: Array
    """Commanded torque on the bus [N m], body axes, (..., 3)."""
    torque_error: Array
    """Torque of the CMG in the last inner period, less the commanded one [N m], (..., 3)."""
    authority: Array
    """Jw |W cos(di)| [N m s], (..., 1)."""
    gimbal_angle: Array
    """Outer and inner [rad], (..., 2)."""
    gimbal_rate: Array
    """Outer and inner [rad/s], (..., 2)."""
    wheel_speed: Array
    """[rad/s], (..., 1)."""
    vibration_hat: Array
    """Estimated vibration torque on the wheel [N m], (..., 1)."""
    phi_hat: Array
    """Estimate of psi^2, the square of the vibration's cycles per revolution, (..., 1)."""


@dataclass(frozen=True)
class Algebraic(dgvscmg.Cascade):
    """The ``Cascade`` on the thesis' actuator model instead of motors, gimbals and a wheel.

    The thesis needs W*' for the gimbals and does not define it (E27). Here the desired rates are
    interpolated linearly from one command of the attitude law to the next, a period late.
    """

    start_speed: float = gain("rad/s", default=73.0)
    """Initial speed of the wheel; Table 5.1 has 5 (E22)."""
    vibration: Array = gain(shape=(3,), default=(0.35, 0.5, 3.0))
    """Vibration of the wheel (4.3): amplitude [N m], cycles per revolution, phase [rad]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.all(self.vibration[:2] >= 0.0):
            raise ValueError(
                f"vibration: got {self.vibration.tolist()}, its first two should be 0 or more"
            )

    def _refuse_unstable(self) -> None:
        _ = self._speed_loop  # there is no current loop

    def reset(self, measurement: Measurement, reference: Reference) -> Any:
        """Return the initial state: gimbals at zero and at rest."""
        zero = np.zeros_like(measurement.rate)
        speed = zero + np.array([0.0, 0.0, self.start_speed])
        state = State(zero, speed, speed, self._speed_loop.reset(speed), zero)
        _, command, _ = self._cascaded(state, 0.0, measurement, reference)
        desired = np.concatenate([command.gimbal_rate, speed[..., 2:]], axis=-1)
        return state._replace(desired_speed=desired)

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, dgvscmg.SpeedCommand, Any]:
        """Return the command with the accelerations that bring the gimbals to their rates."""
        _, command, own = self._cascaded(state, time, measurement, reference)
        slope = (command.gimbal_rate - state.desired_speed[..., :2]) / self.control_period
        acceleration = np.concatenate([slope, command.acceleration[..., 2:]], axis=-1)
        signals = Signals(
            own.sigma_e,
            own.torque,
            state.applied_torque - own.torque,
            own.authority,
            state.angle[..., :2],
            state.speed[..., :2],
            state.speed[..., 2:],
            own.vibration_hat,
            own.phi_hat,
        )
        return state, command._replace(acceleration=acceleration), signals

    def inner(
        self, state: Any, time: float, command: dgvscmg.SpeedCommand, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return the CMG's state an inner period later, and the torque on the bus [N m]."""
        q = motor_loops.held_current(state.speed_memory)
        memory, current = self._speed_loop.step(
            state.speed_memory,
            np.stack([np.zeros_like(q), q], axis=-1),
            state.speed,
            state.desired_speed,
            command.acceleration,
            np.zeros_like(q),
        )
        angle, speed, output, torque = _advance.ufunc(
            state.angle, state.speed, self.torque_constant * current, measurement.rate, self._model
        )
        desired = state.desired_speed + self.inner_period * command.acceleration
        return State(angle, speed, desired, memory, output), TorqueCommand(torque)

    def _cascaded(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, dgvscmg.SpeedCommand, dgvscmg.Signals]:
        """Return the cascade's step with the measurements of the modelled CMG."""
        modelled = measurement._replace(
            gimbal_angle=state.angle[..., :2],
            gimbal_rate=state.speed[..., :2],
            wheel_speed=state.speed[..., 2:],
        )
        memory = dgvscmg.State(
            state.desired_speed[..., 2:], state.speed_memory, state.applied_torque
        )
        return super().step(memory, time, modelled, reference)

    @cached_property
    def _speed_loop(self) -> motor_loops.SpeedLoop:
        # Without a current loop the only lag is the current held for one inner period.
        return replace(super()._speed_loop, lead=0.5 * self.inner_period)

    @cached_property
    def _model(self) -> Array:
        own = [self.inner_period, self.rotor_inertia]
        return np.array([*own, *self.vibration, *self.turned_inertia])


@gufunc(
    ["void(f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:])"],
    "(m),(m),(m),(m),(g)->(m),(m),(m),(m)",
)
def _advance(
    angle: Any, speed: Any, drive: Any, rate: Any, model: Any,
    angle_out: Any, speed_out: Any, output: Any, torque: Any,
) -> None:  # fmt: skip
    """Advance the hinges by a period with the midpoint rule; ``drive`` is k_m I_q [N m].

    Model: [period, Jw, vibration's amplitude, cycles and phase, J1, J2, J3]. ``output`` is -chi eta
    at the midpoint (2.55); ``torque`` adds (Jw W s) x w, since the rigid bus has no wheel.
    """
    period, Jw = model[0], model[1]
    middle = angle[2] + 0.5 * period * speed[2]
    vibration = model[2] * math.cos(model[3] * middle + model[4])
    for k in range(3):
        z1 = vibration if k == 2 else 0.0
        speed_out[k] = speed[k] + period * (drive[k] + z1) / model[5 + k]
        angle_out[k] = angle[k] + 0.5 * period * (speed[k] + speed_out[k])
    do, di = 0.5 * (angle[0] + angle_out[0]), 0.5 * (angle[1] + angle_out[1])
    so, co, si, ci = math.sin(do), math.cos(do), math.sin(di), math.cos(di)
    spin = Jw * 0.5 * (speed[2] + speed_out[2])
    outer = spin * ci * 0.5 * (speed[0] + speed_out[0])
    inner = spin * 0.5 * (speed[1] + speed_out[1])
    wheel = Jw * (drive[2] + vibration) / model[7]
    sx, sy, sz = co * ci, so * ci, -si
    output[0] = so * outer + co * si * inner - sx * wheel
    output[1] = -co * outer + so * si * inner - sy * wheel
    output[2] = ci * inner - sz * wheel
    torque[0] = output[0] + spin * (sy * rate[2] - sz * rate[1])
    torque[1] = output[1] + spin * (sz * rate[0] - sx * rate[2])
    torque[2] = output[2] + spin * (sx * rate[1] - sy * rate[0])
