"""A flight with which a person interferes: pushes, changed gains and broken motors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import mujoco
import numpy as np
from mujoco.batch import SimulationError

from mjspace.actuators.faults import Fault
from mjspace.contract import Array, Event
from mjspace.errors import FlightError
from mjspace.log.frames import Poses
from mjspace.sensors.fault_kinds import IN_FORCE, PHASE
from mjspace.simulation.assembly import Assembly, facts_of
from mjspace.simulation.compiled_blocks import stopped_at
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.desired import Desired
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import INTEGRATION, first_start, last_period
from mjspace.simulation.live_gains import gains_of, with_gain
from mjspace.simulation.stepper import Stepper
from mjspace.vehicle.step_effect import Instant, State, StepEffect

BROKEN = ("dead", "stuck")
"""How a motor may be broken: kinds of fault without a value."""
_NEVER = 1e9  # s, when the faults that wait for a person begin by themselves


class Push(StepEffect):
    """A force and a torque on the bus for a while, held over each control period."""

    name: ClassVar[str] = "the push"

    def __init__(self) -> None:
        self.wrench = np.zeros((1, 6))
        self._next, self._until = np.zeros(6), -np.inf

    def begin(self, force: Array, torque: Array, until: float) -> None:
        """Push from the next control period on, with ``force`` [N] in inertial axes.

        ``torque`` [N m] is in body axes. It ends with the first period from ``until`` [s] on.
        """
        self._next, self._until = np.concatenate([force, torque]), until

    def before_step(self, memory: State, instant: Instant) -> State:
        """Apply what is due in the control period that begins at ``instant``."""
        self.wrench = self._next[None] * (instant.time < self._until)
        return memory


class LiveFlight:
    """The first member of a scenario, flown by a stepper as its logged flight is.

    Until somebody interferes it is that flight, bit for bit.

    Attributes:
        assembly: what flies; its law has the gains of now.
        period: the control period that was flown last, or begins the flight.
        desired: the reference of that period.
        events: what has happened so far.
    """

    def __init__(self, assembly: Assembly) -> None:
        """Begin the flight.

        Raises:
            FlightError: it cannot even begin.
        """
        control = assembly.scenario.rates.control
        self._never = control * round(_NEVER / control)
        self.motors = tuple(assembly.vehicle.motors)
        self._waiting = [(motor, kind) for motor in self.motors for kind in BROKEN]
        first = len(assembly.scenario.faults)
        self._columns = {each: first + i for i, each in enumerate(self._waiting)}
        self.assembly = _with_faults(assembly, self._waiting, self._never)
        start = first_start(self.assembly, [0])
        self._law = FlownLaw(self.assembly.law, start.law, 1)
        self._push = Push()
        self._stepper = Stepper(
            self.assembly,
            start,
            inner=self._inner if assembly.inner else None,
            besides=[self._push],
        )
        self._last = last_period(assembly.scenario)
        self._model = assembly.vehicle.model
        self._data = mujoco.MjData(self._model)
        self._reference = Desired(assembly)
        self.events: list[Event] = []
        self._number = 0
        self._step()

    @property
    def over(self) -> bool:
        """Whether the scenario's duration is."""
        return self._number > self._last

    def fly(self, periods: int) -> None:
        """Fly so many control periods more, at most up to the end of the scenario.

        Raises:
            FlightError: the law raised, or the motion is no longer finite.
        """
        for _ in range(min(periods, self._last + 1 - self._number)):
            self._step()

    def push(self, force: Array, torque: Array, seconds: float) -> None:
        """Push the bus from now on, with ``force`` [N] in inertial axes at its centre of mass.

        ``torque`` [N m] is in body axes.
        """
        self._push.begin(force, torque, self.time + seconds)
        parts = [", ".join(f"{part:g}" for part in vector) for vector in (force, torque)]
        self._note("INFO", f"push: force {parts[0]} N, torque {parts[1]} N m, for {seconds:g} s")

    def gains(self) -> dict[str, tuple[Any, Mapping[str, Any]]]:
        """Return value and declaration of each gain of the law that is no fact of the plant."""
        facts = facts_of(self.assembly.vehicle, self.assembly.scenario)
        found = gains_of(self.assembly.law)
        return {name: each for name, each in found.items() if name not in facts}

    def set_gain(self, name: str, value: Any) -> None:
        """Fly on with another gain; the law keeps its state.

        Raises:
            ValueError: it does not fit the gain's declaration.
        """
        law = with_gain(self.assembly.law, name, value)
        self.assembly = replace(self.assembly, law=law)
        self._law = FlownLaw(law, self._law.state, 1)
        self._note("INFO", f"gain {name} = {value}")

    def break_motor(self, motor: str, kind: str) -> None:
        """Let a motor be broken from the next control period on, in one of the ways ``BROKEN``."""
        self._set_phases({(motor, kind): IN_FORCE})
        self._note("WARNING", f"fault: {motor} is {kind}")

    def repair(self) -> None:
        """End what ``break_motor`` began, of every motor."""
        self._set_phases(dict.fromkeys(self._waiting, 0.0))
        self._note("INFO", "every motor repaired")

    @property
    def time(self) -> float:
        """Of the next control instant [s]."""
        return self._number * self.assembly.scenario.rates.control

    def poses(self) -> Poses:
        """Return where the bodies are at the begin of ``period``."""
        state = self.period.physics[0]
        mujoco.mj_setState(self._model, self._data, state, INTEGRATION)
        mujoco.mj_kinematics(self._model, self._data)
        names = tuple(self._model.body(i).name for i in range(1, self._model.nbody))
        place, turn = self._data.xpos[1:].copy(), self._data.xquat[1:].copy()
        return Poses(self.period.time, names, place, turn)

    def _step(self) -> None:
        self.desired = self._reference.at(self._number)
        try:
            with np.errstate(all="ignore"):
                period = self._stepper.sense(self._number)
                period.law, period.command, period.signals = self._law.step(
                    period.time, period.measurement, self.desired
                )
                flown = self._number < self._last
                self._stepper.begin(period, flown=flown)
                if flown:
                    self._stepper.finish(period)
        except (SimulationError, FlightError) as error:
            trouble = stopped_at(self.time, error)
            raise trouble from trouble.__cause__
        if not np.isfinite(period.physics[..., self._stepper.layout.moving]).all():
            raise FlightError(f"the motion is no longer finite at t = {period.time:.6g} s")
        self.period: ControlPeriod = period
        self.events += period.events
        self._number += 1

    def _inner(self, *arguments: Any) -> Any:
        return self._law.inner(*arguments)  # of the law of now

    def _set_phases(self, phases: dict[tuple[str, str], float]) -> None:
        memory = self._stepper.memory
        changed = memory[PHASE].copy()
        for each, phase in phases.items():
            changed[:, self._columns[each]] = phase
        self._stepper.memory = memory | {PHASE: changed}

    def _note(self, level: str, text: str) -> None:
        self.events.append(Event(self.time, 0, level, text))


def _with_faults(assembly: Assembly, waiting: Sequence[tuple[str, str]], never: float) -> Assembly:
    """Return the assembly with a fault more for each motor and kind, which nothing begins."""
    faults = [Fault(motor=motor, kind=kind, at=never) for motor, kind in waiting]
    scenario = assembly.scenario
    faulty = scenario.model_copy(update={"faults": [*scenario.faults, *faults]})
    return replace(assembly, scenario=faulty)
