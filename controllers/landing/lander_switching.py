"""Variable-structure control of a lander with its switching term, and the gain that this needs.

Paper 003 has psi = rho sgn(S) below (34), and (36), a tanh, against chattering. It sizes rho by
(35): rho >= |B2^-1 (Ka^-1 Rx K T X1' + f2)|, which is the control that would keep S' = 0. From the
motion that control is U - (Ka B2)^-1 S', with all disturbances in it. All arrays may have leading
vehicle axes.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, ThrustCommand, Trajectory, gain

from .lander import VariableStructure

SWITCHING = ("sgn", "tanh")


class State(NamedTuple):
    """Memory of the law: whether the engine was cut, and its last step."""

    cut: Array
    """1.0 from touchdown on, when the engine is cut for good, else 0.0; (..., 1)."""
    S: Array
    """Of the last step, (..., 3)."""
    U: Array
    """Of the last step, (..., 3)."""
    thrust: Array
    """Of the last step [N], (..., 1); zero before the first."""


class Signals(NamedTuple):
    """Signals of the law."""

    position_error: Array
    """Measured less desired position [m], world axes, (..., 3)."""
    Z: Array
    """z3 to z9 of the errors, (..., 7)."""
    S: Array
    """The sliding variables, (..., 3)."""
    desired_thrust: Array
    """Commanded thrust before its limits [N], (..., 1)."""
    desired_gimbal: Array
    """Commanded gimbal angles before their limits, outer and inner [rad], (..., 2)."""
    required_gain: Array
    """Right-hand side of (35) over the last control period, (..., 3), in the units of U: the first
    in N, or in m/s^2 with ``follows_gravity``; gimbals in rad. Zero in the first step."""


@dataclass(frozen=True)
class Switching(VariableStructure):
    """U = -S - psi, psi = rho sgn(S) or rho tanh(rho S / delta), with the gain that (35) asks for.

    A sampled relay switches at the control rate at most: its amplitude is rho in each channel.
    """

    switching: str = "sgn"
    """"sgn", below (34), or "tanh", (36)."""
    control_period: float = gain("s", default=0.02, above=0.0)
    """Time from one step to the next."""
    lateral_inertia: Array = gain("kg m^2", (2,), default=(90.0, 80.0), above=0.0)
    """About body x and y: what the gimbals' torque turns."""
    lever: float = gain("m", default=1.0, above=0.0)
    """Distance of the gimbals below the centre of mass."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.switching not in SWITCHING:
            raise ValueError(
                f"switching: got {self.switching!r}, should be one of {', '.join(SWITCHING)}"
            )

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:  # type: ignore[override]
        """Return the initial state: the engine is not cut."""
        none = np.zeros_like(measurement.position)
        return State(none[..., :1].copy(), none, none.copy(), none[..., :1].copy())

    def step(  # type: ignore[override]
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, ThrustCommand, Signals]:
        """Return the next state, the thrust and gimbal angles, the errors and (35)."""
        base = super().reset(measurement, reference)._replace(cut=state.cut)
        after, command, signals = super().step(base, time, measurement, reference)
        required = self._required(state, signals.S)
        U = -signals.S - self._robust(signals.S)
        kept = State(after.cut, signals.S.copy(), U, command.thrust.copy())
        return kept, command, Signals(*signals, required)

    def _robust(self, S: Array) -> Array:
        if self.switching == "tanh":
            return super()._robust(S)
        robust: Array = self.robust_gain * np.sign(S)
        return robust

    def _required(self, state: State, S: Array) -> Array:
        """Return |U - (Ka B2)^-1 S'| of the last period, (..., 3), zero before the first."""
        torque = self.lever * np.maximum(state.thrust, self.thrust_range[0])
        # The torque is lever F (b1, -b2); the thrust's channel is in N, or m/s^2.
        up = np.ones_like(torque) if self.follows_gravity else np.ones_like(torque) / self.mass
        across = torque / self.lateral_inertia * np.array([1.0, -1.0])
        effect = self.loop_share * self.surface_gain * np.concatenate([up, across], axis=-1)
        change = (S - state.S) / self.control_period
        needed = np.abs(state.U - change / np.where(effect == 0.0, 1.0, effect))
        required: Array = np.where(state.thrust > 0.0, needed, 0.0)
        return required
