"""Every scenario as a dm_control environment: measurement and reference in, command out, reward.

Nothing else in mjspace imports this module: dm_control takes a second to import, and from then on
MuJoCo's warnings go to its log.
"""

import copy
from collections import OrderedDict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from dm_env.specs import BoundedArray
from mujoco.batch import MODEL_FIELDS

from mjspace.contract import Array, Event, Measurement
from mjspace.dm_env import bridge
from mjspace.environment.install import install_callbacks
from mjspace.learning.action import Action
from mjspace.learning.no_law import refuse_what_needs_a_law
from mjspace.learning.signals import Signals
from mjspace.learning.task import Task
from mjspace.scenario import loading
from mjspace.scenario.scenario import Scenario
from mjspace.simulation.assembly import Assembly, without_law
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.desired import Desired
from mjspace.simulation.initial_state import INTEGRATION, initial_physics, last_period, start_at
from mjspace.simulation.stepper import Stepper


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
    refuse_what_needs_a_law(loaded)
    physics = Physics(without_law(loaded, folder, trust=trust))
    task = Task(loaded, folder, physics.signals(), trust=trust)
    return bridge.Environment(physics, Tracking(loaded, task), n_sub_steps=loaded.rates.steps)


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
        self._desired, self.action = Desired(assembly), Action(assembly)
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
        self._flown = self.action.command(np.zeros((1, len(self.action.labels))))
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
        self._events, self._flown = self._period.events, self._command
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

    def signals(self) -> Signals:
        """Return what a task may observe and reward, with a vehicle axis."""
        desired = self._desired.at(self._period.number)
        return Signals(self._stepper.layout, self._period, desired, self._flown)

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
    """The scenario's task, until its duration is over."""

    def __init__(self, scenario: Scenario, task: Task) -> None:
        self._task, self._last = task, last_period(scenario)

    def initialize_episode(self, physics: Physics) -> None:
        """Change nothing: the physics has been reset to the scenario's start."""

    def action_spec(self, physics: Physics) -> Any:
        """Return the spec of the command's fields that the actuators take, side by side.

        Its name has a label for each number, with its unit. Bounds are what the actuators can
        apply: of wheels, what they apply together about each axis. A torque without a limit is
        bounded by an angular acceleration of 100 rad/s^2 of the largest principal inertia; others
        without a limit are infinite. Each actuator enforces its own limits, the spec none.
        """
        action = physics.action
        name = "\t".join(action.labels)
        return BoundedArray(action.least.shape, np.float64, action.least, action.largest, name)

    def before_step(self, action: Array, physics: Physics) -> None:
        """Command the actuators with ``action`` for one control period."""
        physics.command(physics.action.command(np.asarray(action)[None]))

    def get_observation(self, physics: Physics) -> OrderedDict[str, Array]:
        """Return what the scenario's task observes: by default measurement and reference."""
        observed = self._task.observation(physics.signals())
        return OrderedDict((name, np.array(rows[0])) for name, rows in observed.items())

    def get_reward(self, physics: Physics) -> float:
        """Return the reward of the scenario's task; 0 where the state is not finite."""
        reward, _ = self._judged(physics)
        return reward

    def get_termination(self, physics: Physics) -> float | None:
        """Return the last discount: 0 where the task ends the episode, 1 at the scenario's end."""
        _, ends = self._judged(physics)
        if ends:
            return 0.0
        return 1.0 if physics.period() >= self._last else None

    def _judged(self, physics: Physics) -> tuple[float, bool]:
        diverged = np.array([physics.diverged()])
        reward, ends = self._task.judged(physics.signals(), diverged)
        return float(reward[0]), bool(ends[0])


def _field(model: Any, name: str) -> Any:
    """Return the array of the model, or of its options, of that name."""
    option = name.removeprefix("opt.")
    return getattr(model, name) if option == name else getattr(model.opt, option)
