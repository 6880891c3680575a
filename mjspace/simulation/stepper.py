"""The stepper: one control period of a batch of vehicles, for flights and environments alike."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mujoco.batch import Batch, SimulationError

from mjspace import attitude, interrupts
from mjspace.contract import Array, Event, Measurement
from mjspace.environment.install import install_callbacks
from mjspace.errors import FlightError, InputError, failure
from mjspace.interrupts import Interrupted
from mjspace.sensors.fault_kinds import PHASE
from mjspace.simulation import mujoco_warnings
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.effects import effects_of
from mjspace.simulation.initial_state import Start
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of
from mjspace.simulation.user_code import sealed
from mjspace.vehicle.indices import bus_id
from mjspace.vehicle.step_effect import Instant, State, StepEffect

InnerLoop = Callable[[float, Any, Measurement], Any]
"""Returns the motors' command of an integration step from (time [s], the law's command,
measurement)."""

STEPS_AT_ONCE = 1000
"""Integration steps without a look at signals."""
_LOCATED = (FlightError, InputError, SimulationError)
"""Errors that say themselves whose they are."""


class Stepper:
    """A batch of vehicles in motion; each control period is ``sense``, ``begin`` and ``finish``."""

    def __init__(
        self,
        assembly: Assembly,
        start: Start,
        members: Sequence[int] = (0,),
        *,
        threads: int = 1,
        inner: InnerLoop | None = None,
        besides: Sequence[StepEffect] = (),
    ) -> None:
        """Put the ``members`` of the campaign at ``start``; ``inner`` is the law's inner loop.

        The effects ``besides`` act after those of the scenario, and remember nothing.
        """
        mujoco_warnings.silence()
        install_callbacks()
        self.batch = Batch(assembly.vehicle.model, len(members), threads)
        self.batch.state[:] = start.physics
        for name, values in start.model.items():
            self.batch.expand(name)[:] = values
        if start.model:
            self.batch.set_const()
        if start.models:
            self.batch.set_models(start.models)
        self._sensordata = self.batch.bind("sensordata")
        bus = bus_id(assembly.vehicle.model)
        self._on_bus = self.batch.bind("xfrc_applied")[:, bus]  # force and torque, inertial axes
        self.layout = StateLayout(assembly)
        self._suite, self.sensors = assembly.sensors(members), start.sensors
        self.memory = start.actuators
        self._actuators, self._inner, self._hold = assembly.actuators, inner, assembly.hold
        self._inputs = self._actuators.inputs(self.batch)
        self.effects = (*effects_of(assembly, self.layout, members), *besides)
        for effect in self.effects:
            effect.bind(self.batch)
        # Most effects have few of the hooks: the others are not called in every step.
        self._hooks = {
            hook: [
                each
                for each in self.effects
                if getattr(getattr(each, hook), "__func__", None) is not default
            ]
            for hook, default in vars(StepEffect).items()
            if callable(default)
        }
        self._hooks_between = {
            hook: [each for each in effects if each.every_step]
            for hook, effects in self._hooks.items()
        }
        rates = assembly.scenario.rates
        self._steps, self._control, self._physics = rates.steps, rates.control, rates.physics
        self._tick = math.gcd(self._steps, *self._suite.ticks)
        self._driven = assembly.driven_stepwise
        self._stepwise = self._driven or any(effect.every_step for effect in self.effects)
        self._always_senses = inner is not None or any(e.needs_truth for e in self.effects)

    def sense(self, number: int) -> ControlPeriod:
        """Return the control period of that number at its control instant, without a command."""
        period = ControlPeriod()
        period.number, period.time = number, number * self._control
        period.physics = physics = self._copy_of_state()
        period.events, period.sensors = [], self.sensors
        self._observe(physics, period.time, period.events)
        period.memory, period.truth = self.memory, self._truth(physics)
        period.measurement = self._measure(number * self._steps, period.truth)
        return period

    def observed(self, number: int) -> State:
        """Return what is remembered once the effects have observed the control instant of now."""
        before = self.memory
        self._observe(self._copy_of_state(), number * self._control, [])
        observed, self.memory = self.memory, before
        return observed

    def check(self, command: Any) -> None:
        """Refuse a law's ``command`` that the actuators cannot obey.

        Raises:
            FlightError: it lacks a field that they take, or the field has another shape.
        """
        self._actuators.check(command, len(self.batch.state))

    def begin(self, period: ControlPeriod, *, flown: bool = True) -> None:
        """Fly the first integration step of a sensed ``period`` that has a command and signals.

        If not ``flown``, as at the end of a flight, MuJoCo only computes what holds now.

        Raises:
            FlightError: the command lacks what the actuators need, or a part raised an error.
            InputError: a fault's signal is not known.
            mujoco.batch.SimulationError: MuJoCo raised an error.
        """
        instant: Any = None
        if self.effects:
            instant = Instant(
                period.time,
                period.physics,
                period.truth,
                period.measurement,
                period.command,
                period.signals,
                period.memory,
                period.events,
            )
            self._each_effect("at_control", instant)
        period.applied, period.saturated = self._drive(
            period.time, period.command, period.measurement, period.truth, instant
        )
        period.wrench = None
        if self.effects:
            period.wrench = self._prepare_step(instant)
        # Derived fields lag the state by one step: this step computes those of now.
        if flown:
            self.batch.step()
        else:
            self.batch.forward()
        period.sensordata = self._sensordata.copy()
        if flown and self.effects:
            self._each_effect("after_step", instant)

    def finish(self, period: ControlPeriod) -> None:
        """Integrate the rest of the ``period``, with the samples due in between.

        Raises:
            FlightError, mujoco.batch.SimulationError: as ``begin``.
            Interrupted: a signal was received within a long period.
        """
        step = 1
        while step < self._steps:
            due = self._always_senses or step % self._tick == 0
            if self._stepwise or due:
                instant = self._between(period, step, due=due)
            if self._stepwise:
                if self._driven:
                    now, _, truth, measurement, *_ = instant
                    _, saturated = self._drive(now, period.command, measurement, truth, instant)
                    np.maximum(period.saturated, saturated, out=period.saturated)
                self._prepare_step(instant)
                self.batch.step()
                self._each_effect("after_step", instant, between=True)
                step += 1
            else:
                count = self._tick - step % self._tick
                self._step(count)
                step += count

    def _step(self, count: int) -> None:
        """Fly so many integration steps, unless a signal is received."""
        for done in range(0, count, STEPS_AT_ONCE):
            if interrupts.received[0]:
                raise Interrupted(interrupts.received[0])
            self.batch.step(nstep=min(STEPS_AT_ONCE, count - done))

    def _between(self, period: ControlPeriod, step: int, *, due: bool) -> Instant:
        """Return the instant between control instants at which that step of the period begins."""
        number = period.number * self._steps + step
        physics = self._copy_of_state()
        if due:
            truth = self._truth(physics)
            measurement = self._measure(number, truth)
        else:
            truth = measurement = self.layout.motion(physics)
        now = number * self._physics
        return Instant(now, physics, truth, measurement, None, None, self.memory, period.events)

    def _copy_of_state(self) -> Array:
        """Return a copy of the state rows; views of it make the truth, and nobody may write."""
        physics: Array = self.batch.state.copy()
        physics.setflags(write=False)
        return physics

    def _truth(self, physics: Array) -> Measurement:
        return sealed(truth_of(physics, self.memory, self.layout, self._actuators, self.effects))

    def _measure(self, step: int, truth: Measurement) -> Measurement:
        phase = self.memory.get(PHASE)
        self.sensors, measurement = self._suite.sample(self.sensors, step, truth, phase)
        return measurement if measurement is truth else sealed(measurement)

    def _drive(
        self,
        now: float,
        command: Any,
        measurement: Measurement,
        truth: Measurement,
        instant: Any,
    ) -> tuple[tuple[Array, ...], Array]:
        """Let the actuators act on the command; return what they apply, and which saturate."""
        if self._inner is not None:
            command = self._inner(now, command, measurement)
        memory, applied, saturated = self._actuators.act(self.memory, command, truth, self._hold)
        for effect in self._hooks["change"]:
            memory, applied = _of(effect, effect.change, memory, applied, instant)
        self.memory = memory
        for views, values in zip(self._inputs, applied, strict=True):
            for view, part in views:
                view[:] = values[:, part]
        return applied, saturated

    def _observe(self, physics: Array, now: float, events: list[Event]) -> None:
        """Let the effects observe a control instant, with the masses of that instant."""
        if self._hooks["observe"]:
            for effect in self._hooks["weigh"]:
                _of(effect, effect.weigh, self.memory)
            self._each_effect("observe", physics, now, events)

    def _each_effect(self, hook: str, *arguments: Any, between: bool = False) -> None:
        """Call the ``hook`` of ``StepEffect`` that changes the memory alone on each effect.

        ``between`` control instants only those act that do so in every integration step.
        """
        for effect in (self._hooks_between if between else self._hooks)[hook]:
            self.memory = _of(effect, getattr(effect, hook), self.memory, *arguments)

    def _prepare_step(self, instant: Instant) -> Array | None:
        """Let the effects act for the step that begins; apply and return the sum of wrenches."""
        self._each_effect("before_step", instant, between=not instant.is_control)
        wrenches = [effect.wrench for effect in self.effects if effect.wrench is not None]
        if not wrenches:
            return None
        total: Array = sum(wrenches[1:], start=wrenches[0])
        self._on_bus[:, :3] = total[:, :3]
        self._on_bus[:, 3:] = attitude.rotate(instant.truth.attitude, total[:, 3:])
        return total


def _of(effect: StepEffect, method: Callable[..., Any], *arguments: Any) -> Any:
    """Return what the ``method`` of ``effect`` returns; an error names the effect."""
    try:
        return method(*arguments)
    except _LOCATED:
        raise
    except BaseException as error:
        raise failure(effect.name, error) from error
