"""Every scenario as a dm_control environment: measurement and reference in, command out, reward.

Nothing else in mjspace imports this module: dm_control takes a second to import, and from then on
MuJoCo's warnings go to its log.
"""

import copy
import math
from collections import OrderedDict
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import MODEL_FIELDS

from mjspace import attitude
from mjspace.contract import Array, DesiredMotion, Event, Measurement
from mjspace.dm_env import bridge
from mjspace.dm_env.action import Action
from mjspace.environment.install import install_callbacks
from mjspace.errors import InputError
from mjspace.scenario import loading
from mjspace.simulation.assembly import Assembly, without_law
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.initial_state import INTEGRATION, initial_physics, last_period, start_at
from mjspace.simulation.loop import BLOCK_PERIODS
from mjspace.simulation.stepper import Stepper
from mjspace.simulation.user_code import reference_at

TOLERATED_ERROR = np.radians(1.0)
"""Attitude error [rad] that earns the full reward where no check of the scenario bounds it."""


def load(scenario: str | Path, overrides: Iterable[str] = (), *, trust: bool = False) -> Any:
    """Return the ``dm_control.rl.control.Environment`` of a scenario, by name or path.

    ``overrides`` are ``"key=value"``, as ``--set`` takes them. Every episode is the same flight,
    that of member 0, on the stepper of a flight: the commands that a flight logged, as actions,
    leave bit for bit the ``/state`` of that flight. An action takes the place of the estimator,
    the law and its inner loop, and is held for one control period. Another ``seed`` gives other
    noise.
    With ``trust`` the scenario may name files outside its folder and any installed module.

    Raises:
        InputError: bad input, in one line.
    """
    loaded, folder = loading.load(scenario, overrides)
    for number, fault in enumerate(loaded.faults):
        signal = "" if fault.when is None else fault.when.signal
        if signal.removeprefix("/").startswith(("law.", "estimate.")):
            raise InputError(
                f"faults.{number}.when.signal: {signal}: an environment flies no law: give a "
                "signal of truth, measurement or command"
            )
    assembly = without_law(loaded, folder, trust=trust)
    return bridge.Environment(Physics(assembly), Tracking(assembly), n_sub_steps=loaded.rates.steps)


class Physics(bridge.Physics):  # type: ignore[misc]
    """The scenario's vehicle in flight; MuJoCo's model and data follow it from period to period.

    A reset is to the scenario's start, or to the state that a task writes during the reset. A step
    is one control period under the ``command``, with all that a flight has: actuators, sensors,
    faults, deployments, burning propellant. It raises no ``PhysicsError``: read ``diverged``. After
    it, as with dm_control's ``legacy_step``, what depends on position and velocity is up to date.
    Writing to ``data`` changes the flight in a reset alone. Sensors, actuators and effects remember
    more than MuJoCo's data hold: there is no ``copy`` and no pickle.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self._initial = initial_physics(assembly, 1)[0]
        self._steps = assembly.scenario.rates.steps
        self._changed: set[str] = set()
        # The masses of this copy change as propellant burns.
        super().__init__(bridge.MjData(bridge.MjModel(copy.copy(assembly.vehicle.model))))
        with self.reset_context():
            pass

    def reset(self, keyframe_id: int | None = None) -> None:
        """Return to the scenario's start; the vehicle has no keyframes."""
        install_callbacks()
        for name in self._changed:
            _field(self.model.ptr, name)[...] = _field(self._assembly.vehicle.model, name)
        super().reset(keyframe_id)
        self.set_state(self._initial, INTEGRATION)

    def after_reset(self) -> None:
        """Begin a flight at MuJoCo's state and sample the sensors."""
        state = self.get_state(INTEGRATION)
        with np.errstate(all="ignore"):
            self._stepper = Stepper(self._assembly, start_at(self._assembly, state[None], [0]))
        self._command: Any = None
        self._events: list[Event] = []
        self._sense(0)

    def command(self, command: Any) -> None:
        """Set the command, a named tuple of arrays (1, ...), of the control periods to come."""
        self._command = command

    def step(self, nstep: int | None = None) -> None:
        """Fly one control period, with ``nstep`` integration steps.

        Raises:
            ValueError: ``nstep`` is not the number of integration steps in a control period, or no
                command has been set.
            FlightError: a part of the flight, such as the user's disturbance, raised an error.
            InputError: a fault's signal is not known.
        """
        if nstep not in (None, self._steps):
            raise ValueError(
                f"nstep is {nstep}: a step is one control period, {self._steps} integration steps"
            )
        if self._command is None:
            raise ValueError("no command: set one with Physics.command before the first step")
        self._period.command, self._period.signals = self._command, ()
        with np.errstate(all="ignore"):
            self._stepper.begin(self._period)
            self._stepper.finish(self._period)
        self._events = self._period.events
        self._sense(self._period.number + 1)

    def period(self) -> int:
        """Return the number of control periods flown."""
        return self._period.number

    def truth(self) -> Measurement:
        """Return the truth, without a vehicle axis."""
        return self._period.truth._map(lambda values: values[0])

    def measurement(self) -> Measurement:
        """Return what the sensors report, without a vehicle axis."""
        return self._period.measurement._map(lambda values: values[0])

    def memory(self) -> dict[str, Array]:
        """Return what actuators, step effects and sensors remember, by the names of /state."""
        actuators = {f"actuator_{name}": a[0] for name, a in self._period.memory.items()}
        return actuators | {f"sensor_{name}": a[0] for name, a in self._period.sensors.items()}

    def events(self) -> list[Event]:
        """Return what happened in the last control period, such as a fault that began."""
        return list(self._events)

    def momentum(self) -> Array:
        """Return the total angular momentum about the centre of mass, inertial [N m s], (3,)."""
        return np.array(self.data.sensordata[self._assembly.vehicle.momentum])

    def diverged(self) -> bool:
        """Return whether MuJoCo warned: of a number that is not finite, or beyond 1e10."""
        return bool(self._stepper.batch.warning[..., 1].any() or self.data.warning.number.any())

    def _sense(self, number: int) -> None:
        """Begin the control period of that number; MuJoCo's model and data follow."""
        with np.errstate(all="ignore"):
            self._period: ControlPeriod = self._stepper.sense(number)
        self.set_state(self._period.physics[0], INTEGRATION)
        if self._stepper.effects:
            self._copy_model()
        mujoco.mj_step1(self.model.ptr, self.data.ptr)

    def _copy_model(self) -> None:
        """Take over the fields of the model that the flight has changed, such as masses."""
        for name in MODEL_FIELDS:
            values = self._stepper.batch.expanded(name)
            if values is not None:
                _field(self.model.ptr, name)[...] = values[0]
                self._changed.add(name)


class Tracking(bridge.Task):  # type: ignore[misc]
    """Follow the scenario's reference, as closely as its checks ask, until its duration is over."""

    def __init__(self, assembly: Assembly) -> None:
        scenario = assembly.scenario
        self._action = Action(assembly)
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
        """Return the spec of the command's fields that the actuators take, side by side.

        Its name has a label for each number, with its unit. Bounds are what the actuators can
        apply: of wheels, what they apply together about each axis. A torque without a limit is
        bounded by an angular acceleration of 100 rad/s^2 of the largest principal inertia; others
        without a limit are infinite. Each actuator enforces its own limits, the spec none.
        """
        return self._action.spec()

    def before_step(self, action: Array, physics: Physics) -> None:
        """Command the actuators with ``action`` for one control period."""
        physics.command(self._action.command(action))

    def get_observation(self, physics: Physics) -> OrderedDict[str, Array]:
        """Return the measurement, and the reference as the desired motion."""
        named = {
            **physics.measurement()._asdict(),
            **{f"reference_{k}": v for k, v in self._reference(physics)._asdict().items()},
        }
        # Without its sensor, a field is empty.
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


def _field(model: Any, name: str) -> Any:
    """Return the array of the model, or of its options, of that name."""
    option = name.removeprefix("opt.")
    return getattr(model, name) if option == name else getattr(model.opt, option)
