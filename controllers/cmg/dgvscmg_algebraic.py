"""The double-gimbal CMG as the thesis models it: three motors that nothing holds back.

J. Servín Aguilar, "Control de orientación para satélites con compensación de vibración", UNAM 2022
(paper 001), section 5.2: each motor turns its own inertia, J W' = k_m I_q + z1 (5.4), with a
current that is at once what is wanted, and the bus is given -chi eta. Neither the gyroscopic torque
on the gimbals' motors is in it (E20) nor the inertia that they carry (E19). The law integrates this
model and asks ideal thrusters on a rigid bus for its torque: so the thesis' cascade does what it
says. On bodies and hinges it does not (scenario ``dgvscmg-thesis``). All arrays may have leading
vehicle axes.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numba import guvectorize

from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from ..motors import motor_loops
from . import dgvscmg


class State(NamedTuple):
    """Of the modelled CMG, outer gimbal, inner gimbal and wheel, and of its speed loops."""

    angle: Array
    """[rad], (..., 3)."""
    speed: Array
    """[rad/s], (..., 3)."""
    wanted: Array
    """Wanted speeds [rad/s], (..., 3)."""
    speed_memory: Array
    """Of the speed loops, (..., 3, 9)."""
    given: Array
    """-chi eta in the last inner period [N m], body axes, (..., 3)."""


class Signals(NamedTuple):
    """What the law shows of its cascade and of the CMG that it models."""

    sigma_e: Array
    """Attitude error, modified Rodrigues parameters, (..., 3)."""
    torque: Array
    """Wanted on the bus [N m], body axes, (..., 3)."""
    torque_error: Array
    """What the CMG gave just before, less that [N m], (..., 3)."""
    authority: Array
    """Jw |W cos(di)| [N m s], (..., 1)."""
    gimbal_angle: Array
    """[rad], outer and inner, (..., 2)."""
    gimbal_rate: Array
    """[rad/s], (..., 2)."""
    wheel_speed: Array
    """[rad/s], (..., 1)."""
    vibration_hat: Array
    """Believed vibration torque on the wheel [N m], (..., 1)."""
    phi_hat: Array
    """Believed square of the vibration's cycles in a turn, (..., 1)."""


@dataclass(frozen=True)
class Algebraic(dgvscmg.Cascade):
    """The ``Cascade`` on the thesis' actuator instead of motors, gimbals and a wheel.

    ``turned_inertia`` is what its motors turn. In place of W*', which the thesis needs for the
    gimbals and does not say how to get (E27), their wanted rates go straight from one of the
    attitude law's to the next, a period behind.
    """

    start_speed: float = gain("rad/s", default=73.0)
    """Of the wheel; Table 5.1 has 5 (E22)."""
    vibration: Array = gain(shape=(3,), default=(0.35, 0.5, 3.0))
    """Of the wheel (4.3): amplitude [N m], cycles in a turn, phase [rad]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.all(self.vibration[:2] >= 0.0):
            raise ValueError(
                f"vibration: got {self.vibration.tolist()}, should begin with 0 or more twice"
            )

    def _refuse_unstable(self) -> None:
        _ = self._speed_loop  # there is no current loop

    def reset(self, measurement: Measurement, reference: Reference) -> Any:
        """Return the state whose gimbals are at zero and at rest."""
        zero = np.zeros_like(measurement.rate)
        speed = zero + np.array([0.0, 0.0, self.start_speed])
        state = State(zero, speed, speed, self._speed_loop.reset(speed), zero)
        _, command, _ = self._asked(state, 0.0, measurement, reference)
        wanted = np.concatenate([command.gimbal_rate, speed[..., 2:]], axis=-1)
        return state._replace(wanted=wanted)

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, dgvscmg.SpeedCommand, Any]:
        """Return the accelerations that bring the gimbals to their rates, and the wheel's."""
        _, command, shown = self._asked(state, time, measurement, reference)
        slope = (command.gimbal_rate - state.wanted[..., :2]) / self.control_period
        acceleration = np.concatenate([slope, command.acceleration[..., 2:]], axis=-1)
        signals = Signals(
            shown.sigma_e,
            shown.torque,
            state.given - shown.torque,
            shown.authority,
            state.angle[..., :2],
            state.speed[..., :2],
            state.speed[..., 2:],
            shown.vibration_hat,
            shown.phi_hat,
        )
        return state, command._replace(acceleration=acceleration), signals

    def inner(
        self, state: Any, time: float, command: dgvscmg.SpeedCommand, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return the torque on the bus [N m], body axes, and the CMG a moment later."""
        q = motor_loops.held_current(state.speed_memory)
        memory, current = self._speed_loop.step(
            state.speed_memory,
            np.stack([np.zeros_like(q), q], axis=-1),
            state.speed,
            state.wanted,
            command.acceleration,
            np.zeros_like(q),
        )
        angle, speed, given, torque = _turned.ufunc(
            state.angle, state.speed, self.torque_constant * current, measurement.rate, self._model
        )
        wanted = state.wanted + self.inner_period * command.acceleration
        return State(angle, speed, wanted, memory, given), TorqueCommand(torque)

    def _asked(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, dgvscmg.SpeedCommand, dgvscmg.Signals]:
        """Return what the cascade asks where the modelled CMG is."""
        modelled = measurement._replace(
            gimbal_angle=state.angle[..., :2],
            gimbal_rate=state.speed[..., :2],
            wheel_speed=state.speed[..., 2:],
        )
        memory = dgvscmg.State(state.wanted[..., 2:], state.speed_memory, state.given)
        return super().step(memory, time, modelled, reference)

    @cached_property
    def _speed_loop(self) -> motor_loops.SpeedLoop:
        # No current loop lags; a current is held for one inner period.
        return replace(super()._speed_loop, lead=0.5 * self.inner_period)

    @cached_property
    def _model(self) -> Array:
        own = [self.inner_period, self.rotor_inertia]
        return np.array([*own, *self.vibration, *self.turned_inertia])


@guvectorize(
    ["void(f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:])"],
    "(m),(m),(m),(m),(g)->(m),(m),(m),(m)",
    cache=True,
)
def _turned(
    angle: Any, speed: Any, drive: Any, rate: Any, model: Any,
    angle_out: Any, speed_out: Any, given: Any, torque: Any,
) -> None:  # fmt: skip
    """Turn the hinges for a period by the midpoint rule; ``drive`` is k_m I_q [N m].

    Model: [period, Jw, vibration's amplitude, cycles and phase, J1, J2, J3]. ``given`` is -chi eta
    at the midpoint (2.55), ``torque`` with (Jw W s) x w, which turns a bus that carries the wheel.
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
    given[0] = so * outer + co * si * inner - sx * wheel
    given[1] = -co * outer + so * si * inner - sy * wheel
    given[2] = ci * inner - sz * wheel
    torque[0] = given[0] + spin * (sy * rate[2] - sz * rate[1])
    torque[1] = given[1] + spin * (sz * rate[0] - sx * rate[2])
    torque[2] = given[2] + spin * (sx * rate[1] - sy * rate[0])
