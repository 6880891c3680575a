"""The loop: one control period, repeated, for one vehicle or many, in blocks of logged rows."""

import math
import time as clock
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError

from mjspace.actuators.actuator_set import set_masses
from mjspace.contract import Array, DesiredMotion, Measurement
from mjspace.environment.install import install_callbacks
from mjspace.environment.magnetic_field import FIELD
from mjspace.errors import FlightError
from mjspace.simulation import mujoco_warnings
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.events import with_declared_events
from mjspace.simulation.initial_state import Start, last_period
from mjspace.simulation.recording import Block, Recording, until_trouble
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.user_code import (
    check_same_shapes,
    check_state,
    check_step,
    check_vehicle_axis,
    failure,
    read_only,
    reference_at,
    sealed,
    shapes_of,
)
from mjspace.simulation.user_disturbance import HeldDisturbance

BLOCK_PERIODS = 500
BLOCK_BYTES = 8_000_000  # of many vehicles: what has been recorded should still be in the cache
BLOCK_SECONDS = 0.25  # of wall time: a kill may cost three blocks, and should not cost a second


def fly(
    assembly: Assembly,
    start: Start,
    members: Sequence[int] = (0,),
    *,
    threads: int = 1,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[Block]:
    """Fly the scenario from ``start`` to its end and yield what happened, block by block.

    A row holds the state at its time, and the measurement, reference and command of that instant;
    the last row's command is not flown. ``stop`` is asked each period and ends the flight.

    Raises:
        FlightError: the flight cannot go on; every good period has been yielded before.
        InputError: an event of the scenario is of no signal of this flight; nothing was yielded.
    """
    flight = _Flight(assembly, start, members, threads)
    last = last_period(assembly.scenario)
    saturated = np.zeros((len(members), len(assembly.vehicle.motors)), dtype=bool)
    declared = assembly.scenario.events
    inside = np.zeros((len(members), len(declared)), dtype=bool)
    period = start.period
    while period <= last:
        tape, trouble = flight.record(period, last, stop)
        if trouble is not None and not len(tape):
            raise trouble
        block, problem = until_trouble(
            tape.block(assembly, flight.columns, saturated), flight.columns
        )
        if len(block.time):
            block, inside = with_declared_events(block, declared, inside)
            yield block
        if problem:
            raise FlightError(problem)
        if trouble is not None:
            raise trouble
        if stop():
            return
        saturated = tape.saturated[-1].astype(bool)
        period += len(tape)


class _Flight:
    """The batch in flight, and what the sensors and the law remember."""

    def __init__(
        self, assembly: Assembly, start: Start, members: Sequence[int], threads: int
    ) -> None:
        scenario = assembly.scenario
        mujoco_warnings.silence()
        install_callbacks()
        self.assembly, self.columns = assembly, StateLayout(assembly)
        self.suite = assembly.sensors(members)
        self.sensors, self.law_state = start.sensors, start.law
        self.batch = Batch(assembly.vehicle.model, len(members), threads)
        self.batch.state[:] = start.physics
        for name, values in start.model.items():
            self.batch.expand(name)[:] = values
        if start.model:
            self.batch.set_const()
        self.applied = assembly.actuators.inputs(self.batch, assembly.vehicle.motors)
        self.deployments = assembly.deployed and assembly.deployed(self.batch)
        self.field = assembly.field
        if self.field is not None:
            self.acting_field = self.batch.bind("userdata")[:, FIELD]
        self.sensordata = self.batch.bind("sensordata")
        self.actuators, self.actuator_state = assembly.actuators, start.actuators
        self.faults = assembly.faults(members)
        self.timed_faults = self.faults if assembly.faults_between else None
        self.inner = getattr(assembly.law, "inner", None)
        self.returned: Any = None
        self.shapes: list[tuple[int, ...]] | None = None
        self.push = None
        if assembly.disturbance is not None:
            applied = self.batch.bind("xfrc_applied")[:, assembly.vehicle.model.body("bus").id]
            self.push = HeldDisturbance(assembly, self.columns, applied)
        self.hold, self.driven_stepwise = assembly.hold, assembly.driven_stepwise
        self.ground = self.columns.ground
        others = (self.push, self.deployments, self.ground)
        self.stepwise = self.driven_stepwise or any(part is not None for part in others)
        self.steps = scenario.rates.steps
        self.tick = math.gcd(self.steps, *self.suite.ticks)
        recorded = 4 * self.batch.state.nbytes  # each period, with law, signals and measurement
        self.periods = max(1, min(BLOCK_PERIODS, BLOCK_BYTES // recorded))

    def record(
        self, first: int, last: int, stop: Callable[[], bool]
    ) -> tuple[Recording, FlightError | None]:
        """Fly a block of periods and return the tape, and why it cannot go on, if it cannot."""
        control = self.assembly.scenario.rates.control
        end = min(first + self.periods - 1, last)
        times = np.arange(first, end + 1, dtype=float) * control
        wanted = reference_at(self.assembly.reference, times)
        tape = Recording(first, wanted)
        due = clock.monotonic() + BLOCK_SECONDS
        now = first * control
        try:
            # A law's infinities are found in what it commands, not in NumPy's warnings.
            with np.errstate(all="ignore"):
                rows: Any = zip(*wanted, strict=True)
                for period, row in enumerate(rows, first):
                    now, reference = period * control, type(wanted)(*row)
                    self._fly_period(tape, period, now, reference, flown=period < last)
                    if stop() or clock.monotonic() > due:
                        break
        except (SimulationError, FlightError) as error:
            trouble = FlightError(f"stopped at t = {now:.6g} s: {error}")
            trouble.__cause__ = error.__cause__ or error
            return tape, trouble
        raised = np.flatnonzero(self.batch.warning[:, :, 1].any(axis=0))
        if len(raised):
            warning = mujoco.mjtWarning(int(raised[0])).name
            return tape, FlightError(
                f"MuJoCo warned ({warning}) between t = {first * control:.6g} s and now"
            )
        return tape, None

    def _fly_period(
        self, tape: Recording, period: int, now: float, reference: DesiredMotion, *, flown: bool
    ) -> None:
        physics = self.batch.state.copy()
        if self.ground is not None:
            # At stage POS alone, MuJoCo 4.0 shows no kinetic energy after the step that follows.
            self.batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)
            self._touch(tape, now, physics)
        truth = self._truth(physics)
        tape.physics.append(physics)
        tape.sensors.append(self.sensors)
        tape.actuators.append(self.actuator_state)
        measurement = self._measure(period * self.steps, truth)
        before, command, signals = self._step_law(now, measurement, reference)
        if self.faults is not None:
            topics = {"truth": truth, "measurement": measurement, "command": command}
            self.actuator_state, happened = self.faults.decide(
                self.actuator_state, now, topics | {"law": signals}
            )
            tape.happened += happened
        given, saturated = self._drive(now, command, measurement, truth)
        if self.field is not None:
            self.acting_field[:] = self.field.piece(now)
        if self.push is not None:
            tape.push.append(self.push(now, physics, truth))
        if self.deployments is not None:
            tape.happened += self.deployments(now)
        # Derived fields lag the state by one substep: the first substep computes those of `now`.
        if flown:
            self.batch.step()
        else:
            self.batch.forward()
        tape.law.append(before)
        tape.measurement.append(measurement)
        tape.command.append(command)
        tape.given.append(given)
        tape.saturated.append(saturated)
        tape.signals.append(signals)
        tape.sensordata.append(self.sensordata.copy())
        if flown and self.steps > 1:
            self._rest_of_period(tape, period * self.steps, command)

    def _measure(self, step: int, truth: Measurement) -> Measurement:
        self.sensors, measurement = self.suite.sample(self.sensors, step, truth)
        return measurement if measurement is truth else sealed(measurement)

    def _step_law(
        self, now: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return the law's state before its step, its command and its signals."""
        law = self.assembly.law
        try:
            if self.law_state is None:
                state = law.reset(measurement, reference)
                check_state(state)
                self.law_state = read_only(state or ())
            before = self.law_state
            returned = law.step(before, now, measurement, reference)
        except FlightError:
            raise
        except Exception as error:
            raise failure("the law", error) from error
        self._check_returned(before, returned)
        state, command, signals = returned
        self.law_state = read_only(state or ())
        return before, read_only(command), read_only(signals or ())

    def _check_returned(self, before: Any, returned: Any) -> None:
        """Refuse what the law's step must not return, on its first step or any later one."""
        names = ("state", "command", "signals")
        if self.returned is None:
            check_step(returned)
            for name, part in zip(names, returned, strict=True):
                check_vehicle_axis(name, part, len(self.batch.state))
            self.returned = (before, *returned[1:])
            self.shapes = shapes_of(self.returned)
        if shapes_of(returned) != self.shapes:
            check_step(returned)
            for name, part, first in zip(names, returned, self.returned, strict=True):
                check_same_shapes(name, part, first)

    def _drive(
        self, now: float, command: Any, measurement: Measurement, truth: Measurement
    ) -> tuple[tuple[Array, ...], Array]:
        """Let the motors act on the command; return their torques, and which of them are cut."""
        if self.inner is not None:
            try:
                self.law_state, command = self.inner(self.law_state, now, command, measurement)
            except Exception as error:
                raise failure("the law's inner loop", error) from error
            read_only(self.law_state)
        before = self.actuator_state
        after, given, saturated = self.actuators.act(before, command, truth, self.hold)
        self.actuator_state = after
        if self.faults is not None:
            self.actuator_state, given = self.faults.change(self.actuator_state, given, now)
        for view, torque in zip(self.applied, given, strict=True):
            view[:] = torque
        set_masses(self.batch, self.actuators.masses(before, self.actuator_state))
        return given, saturated

    def _truth(self, physics: Array) -> Measurement:
        """Return the truth as views of ``physics``, which nobody may write to any more."""
        physics.setflags(write=False)
        truth = self.actuators.seen(self.actuator_state, self.columns.truth(physics))
        if self.ground is not None:
            truth = self.ground.seen(self.actuator_state, truth)
        return sealed(truth)

    def _touch(self, tape: Recording, now: float, physics: Array) -> None:
        """Note what touches the ground at ``now``, which the derived fields describe."""
        if self.ground is not None:
            state, data = self.actuator_state, self.sensordata
            self.actuator_state, happened = self.ground.update(state, physics, data, now)
            tape.happened += happened

    def _rest_of_period(self, tape: Recording, first_step: int, command: Any) -> None:
        """Integrate from the period's first substep to its end, with the samples due in between."""
        step, physics_step = 1, self.assembly.scenario.rates.physics
        looks_always = self.inner is not None or self.push is not None
        while step < self.steps:
            looks = looks_always or step % self.tick == 0
            if self.stepwise or looks:
                now = (first_step + step) * physics_step
                physics = self.batch.state.copy()
                seen = truth = self._truth(physics) if looks else self.columns.motion(physics)
                if looks:
                    seen = self._measure(first_step + step, truth)
                if self.push is not None:
                    self.push(now, physics, truth)
                if self.timed_faults is not None:
                    state = self.actuator_state
                    self.actuator_state, begun = self.timed_faults.decide(state, now, None)
                    tape.happened += begun
                if self.driven_stepwise:
                    _, saturated = self._drive(now, command, seen, truth)
                    tape.saturated[-1] = np.maximum(tape.saturated[-1], saturated)
                if self.deployments is not None:
                    tape.happened += self.deployments(now)
            count = 1 if self.stepwise else self.tick - step % self.tick
            self.batch.step(nstep=count)
            if self.stepwise:
                self._touch(tape, now, physics)
            step += count
