"""Every scenario as a dm_control environment: measurement and reference in, command out, reward.

Nothing else in mjspace imports this module: dm_control takes a second to import, and from then on
MuJoCo's warnings go to its log.
"""

import math
from collections import OrderedDict
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from dm_env.specs import BoundedArray

from mjspace import attitude
from mjspace.actuators.reaction_wheels import ReactionWheels
from mjspace.contract import Array, DesiredMotion, Measurement
from mjspace.dm_env import bridge
from mjspace.environment.install import install_callbacks
from mjspace.errors import InputError
from mjspace.scenario import loading
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import INTEGRATION, first_start, last_period
from mjspace.simulation.loop import BLOCK_PERIODS
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.user_code import reference_at
from mjspace.simulation.user_disturbance import HeldDisturbance

TOLERATED_ERROR = np.radians(1.0)
"""Attitude error [rad] that earns the full reward where no check of the scenario bounds it."""
LARGEST_ACCELERATION = 100.0
"""The action's bound as an angular acceleration [rad/s^2], for wheels without a torque limit."""


def load(scenario: str | Path, overrides: Iterable[str] = ()) -> Any:
    """Return the ``dm_control.rl.control.Environment`` of a scenario, by name or path.

    ``overrides`` are ``"key=value"``, as ``--set`` takes them. Every episode is the same flight,
    that of member 0: the scenario's law, flown through the environment, leaves bit for bit the
    states that ``simulation.fly`` leaves. Other noise is another ``seed``.

    Raises:
        InputError: bad input, in one line.
    """
    loaded, folder = loading.load(scenario, overrides)
    assembly = assemble(loaded, folder)
    return bridge.Environment(Physics(assembly), Tracking(assembly), n_sub_steps=loaded.rates.steps)


class Physics(bridge.Physics):  # type: ignore[misc]
    """The scenario's vehicle with its environment and its sensors; controls are motor torques.

    A reset is to the scenario's start, and the sensors sample at every integration step that is
    theirs. A step raises no ``PhysicsError``: ask ``diverged``. After it, as with dm_control's
    ``legacy_step``, all that depends on position and velocity is up to date, and checked. The
    sensors remember more than MuJoCo's data hold: there is no ``copy`` and no pickle.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._columns = StateLayout(assembly)
        self._assembly = assembly
        self._momentum = assembly.vehicle.momentum
        self._rates = assembly.scenario.rates
        self._start = first_start(assembly, [0]).physics[0]
        self._suite = assembly.sensors([0])
        self._period = assembly.scenario.rates.steps
        self._tick = math.gcd(self._period, *self._suite.ticks)
        super().__init__(bridge.MjData(bridge.MjModel(assembly.vehicle.model)))
        with self.reset_context():
            pass

    def reset(self, keyframe_id: int | None = None) -> None:
        """Return to the scenario's start; the vehicle has no keyframes."""
        install_callbacks()
        super().reset(keyframe_id)
        self.set_state(self._start, INTEGRATION)

    def after_reset(self) -> None:
        """Compute all that depends on the state, and sample the sensors."""
        super().after_reset()
        self._steps = 0
        self._sensors = self._suite.reset(self._truth())
        self._sample()

    def step(self, nstep: int = 1) -> None:
        """Integrate ``nstep`` steps, with the samples due after each."""
        end = self._steps + nstep
        while self._steps < end:
            count = min(self._tick - self._steps % self._tick, end - self._steps)
            if self._assembly.disturbance is not None:
                self._push()
                count = 1
            mujoco.mj_step(self.model.ptr, self.data.ptr, count)
            self._steps += count
            if self._steps % self._tick == 0:
                self._sample()
        mujoco.mj_step1(self.model.ptr, self.data.ptr)

    def period(self) -> int:
        """Return the number of control periods flown."""
        return self._steps // self._period

    def truth(self) -> Measurement:
        """Return what ideal sensors see, without a vehicle axis."""
        return Measurement(*(values[0] for values in self._truth()))

    def measurement(self) -> Measurement:
        """Return what the sensors report, without a vehicle axis."""
        return Measurement(*(values[0] for values in self._measurement))

    def momentum(self) -> Array:
        """Return the total angular momentum about the centre of mass, inertial [N m s], (3,)."""
        return np.array(self.data.sensordata[self._momentum])

    def diverged(self) -> bool:
        """Return whether MuJoCo warned: of a number that is not finite, or beyond 1e10."""
        return bool(self.data.warning.number.any())

    def _truth(self) -> Measurement:
        return self._columns.truth(self.get_state(INTEGRATION)[None])

    def _sample(self) -> None:
        with np.errstate(all="ignore"):
            self._sensors, self._measurement = self._suite.sample(
                self._sensors, self._steps, self._truth()
            )

    def _push(self) -> None:
        """Apply the user's own disturbance, held over one integration step."""
        period, step = divmod(self._steps, self._period)
        now = self._steps * self._rates.physics if step else period * self._rates.control
        applied = self.data.xfrc_applied[self.model.name2id("bus", "body")]
        push = HeldDisturbance(self._assembly, self._columns, applied[None])
        push(now, self.get_state(INTEGRATION)[None], self._truth())


class Tracking(bridge.Task):  # type: ignore[misc]
    """Follow the scenario's reference, as closely as its checks ask, until its duration is over."""

    def __init__(self, assembly: Assembly) -> None:
        scenario = assembly.scenario
        wheels = assembly.actuators.kinds[0]
        if not isinstance(wheels, ReactionWheels) or len(assembly.actuators.kinds) > 1:
            raise InputError("plant: an environment's action is a torque for reaction wheels")
        if scenario.faults or assembly.deployed is not None:
            raise InputError("faults and deployments: an environment has none")
        self._wheels, self._inertia = wheels, assembly.vehicle.inertia
        self._control, self._last = scenario.rates.control, last_period(scenario)
        self._bounds = [
            (check.start, math.inf if check.end is None else check.end, check.below)
            for check in scenario.checks
            if check.signal.removeprefix("/").removesuffix("[0]") == "truth.attitude_error"
            and check.statistic in ("max", "peak")
            and check.target is None
            and check.below
        ]

        @lru_cache(maxsize=1)
        def block(number: int) -> DesiredMotion:
            first = number * BLOCK_PERIODS
            end = min(first + BLOCK_PERIODS, self._last + 1)
            times = np.arange(first, end, dtype=np.float64) * self._control
            return reference_at(assembly.reference, times)

        self._block = block

    def initialize_episode(self, physics: Physics) -> None:
        """Change nothing: the physics has been reset to the scenario's start."""

    def action_spec(self, physics: Physics) -> Any:
        """Return the command's: the torque on the bus [N m], body axes, shape (3,).

        Its bounds are what the wheels together can give about each axis. Without a torque limit
        there is no such bound: they are then those of ``LARGEST_ACCELERATION`` of the largest
        principal inertia. Only the wheels' limits are enforced, wheel by wheel.
        """
        largest = LARGEST_ACCELERATION * np.full(3, np.linalg.eigvalsh(self._inertia)[-1])
        if math.isfinite(self._wheels.torque_limit):
            largest = self._wheels.torque_limit * np.abs(self._wheels.axes).sum(axis=0)
        return BoundedArray((3,), np.float64, -largest, largest, name="torque")

    def before_step(self, action: Array, physics: Physics) -> None:
        """Share the torque ``action`` among the wheels, for one control period."""
        with np.errstate(all="ignore"):
            torque, _ = self._wheels.motor_torque(
                np.asarray(action, dtype=float), physics.truth().wheel_speed, self._control
            )
        physics.set_control(torque)

    def get_observation(self, physics: Physics) -> OrderedDict[str, Array]:
        """Return the measurement and, as what is wanted is no secret, the reference."""
        named = {
            **physics.measurement()._asdict(),
            **{f"reference_{k}": v for k, v in self._reference(physics)._asdict().items()},
        }
        # What the vehicle has no sensor for is empty.
        return OrderedDict((name, np.array(v)) for name, v in named.items() if v.size)

    def get_reward(self, physics: Physics) -> float:
        """Return bound / (true attitude error), at most 1; 0 where the state is not finite.

        The bound is the tightest ``below`` of the checks that bound the error at this instant
        (statistic max or peak of truth.attitude_error), or ``TOLERATED_ERROR`` where none does.
        """
        if physics.diverged():
            return 0.0
        now = physics.period() * self._control
        active = [below for start, end, below in self._bounds if start <= now <= end]
        bound = min(active, default=TOLERATED_ERROR)
        reference = self._reference(physics)
        error = attitude.rotation_angle(physics.truth().attitude, reference.attitude)
        return float(bound / max(error, bound))

    def get_termination(self, physics: Physics) -> float | None:
        """Return the last discount: 0 where the state is not finite, 1 at the scenario's end."""
        if physics.diverged():
            return 0.0
        return 1.0 if physics.period() >= self._last else None

    def _reference(self, physics: Physics) -> DesiredMotion:
        number, row = divmod(physics.period(), BLOCK_PERIODS)
        block = self._block(number)
        return type(block)(*(values[row] for values in block))
