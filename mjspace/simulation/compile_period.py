"""How a control period is taken down as a program: its Python code is called on traced arrays.

What it computes is then a list of calls of NumPy's loops on one memory, which a compiled function
repeats without Python.
"""

import copy
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from mjspace.contract import DesiredMotion
from mjspace.errors import FlightError, place_of
from mjspace.interrupts import Interrupted
from mjspace.sensors.fault_kinds import PHASE
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.hidden_memory import refusing_hidden_memory
from mjspace.simulation.joined import topics_of
from mjspace.simulation.period_program import PeriodProgram, Recorded, Section, recorded_of
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.traced_arrays import TracedArrays, changes, tuple_like
from mjspace.simulation.truth import truth_of
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.replay import prove
from mjspace.vehicle.step_effect import Instant, StepEffect, Write


def compile_period(
    assembly: Assembly,
    layout: StateLayout,
    effects: Sequence[StepEffect],
    example: ControlPeriod,
    reference: DesiredMotion,
    *,
    law: bool,
    sensors: bool = True,
) -> PeriodProgram:
    """Return the program of a period like the ``example``, at which ``reference`` is desired.

    Without the ``law``, which is then called between sensors and actuators; or without both.

    Raises:
        Untraceable: the law or another part does what cannot be taken down, and where.
    """
    try:
        with np.errstate(all="ignore"):
            tracing = _Tracing(assembly, layout, effects, example, reference)
            if not law:
                return tracing.of_command(example, sensors=sensors)
            with refusing_hidden_memory(tracing.law) as tracing.law:
                return tracing.with_law()
    except (FlightError, TypeError, ValueError) as error:
        # Says which actuator, and where; or what a law returned has other fields than before.
        raise Untraceable(str(error)) from error


class _Tracing(TracedArrays):
    """The arrays that a period begins with, in a program's memory."""

    def __init__(
        self,
        assembly: Assembly,
        layout: StateLayout,
        effects: Sequence[StepEffect],
        example: ControlPeriod,
        reference: DesiredMotion,
    ) -> None:
        super().__init__()
        self.assembly, self.layout, self.effects = assembly, copy.copy(layout), effects
        self.time = self.held(example.time)
        instant = np.array([example.time])
        self.known = tuple(self.held(effect.known(instant)[0]) for effect in effects)
        for effect, known in zip(effects, self.known, strict=True):
            self.layout.surroundings = effect.around(self.layout.surroundings, self.traced(known))
        self.physics = self.held(example.physics[:1])
        self.sensordata = self.held(example.sensordata[:1])
        self.reference = tuple_like(reference, map(self.held, reference))
        self.memory = self.held_arrays(example.memory)
        self.law_state = tuple_like(example.law, map(self.held_of_one, example.law))
        self.sensors = self.held_arrays(example.sensors)
        suite = assembly.sensors([0])
        self.constants = self.held_arrays(suite.constants)
        self.draws = self.held_arrays({name: a[0] for name, a in suite.draws([1]).items()})
        self.suite = suite.with_errors(
            self.traced_arrays(self.constants), self.traced_arrays(self.draws)
        )
        law = assembly.law
        self.law: Any = law.law if isinstance(law, UnbatchedLaw) else law
        self.sensed: Any = None  # the truth that the sensors sample

    def with_law(self) -> PeriodProgram:
        """Return the program of sensors, law and actuators.

        Raises:
            Untraceable: as ``compile_period``; or sensors sample between control instants.
        """
        self._refuse_samples_between()
        before = tuple(self.sensors.values())
        with self.program.section() as sensing:
            after, measurement = self._sample()
            # Of ideal sensors a block computes it for all of its periods at once.
            reports = self._reports(measurement) if self.suite.ticks else []
            state, command, signals = self._law_step(measurement)
            state = self.following(self.law_state, state)
            alarms = self._alarms(measurement, command, signals)
            command, signals = self.numbers(command), self.numbers(signals)
        prove(sensing[0], self.program.memory)
        changed = changes(self.law_state, state) + changes(before, after)
        for target, source in changed:
            target[...] = source
        recorded = [*recorded_of("law", self.law_state), *recorded_of("signals", signals)]
        return self._compiled(
            command,
            sensing=Section(sensing[0], changed, alarms),
            recorded=[*recorded, *recorded_of("command", command), *reports],
            kinds={"law": type(self.law_state), "signals": type(signals)},
        )

    def of_command(self, example: ControlPeriod, *, sensors: bool) -> PeriodProgram:
        """Return the program of the actuators under the law's command, and of the ``sensors``.

        Raises:
            Untraceable: as ``compile_period``; or the law has an inner loop.
        """
        if self.assembly.inner:
            raise Untraceable("the law has an inner loop")
        self._refuse_samples_between()
        if any(effect.waits for effect in self.effects):
            raise Untraceable("a step effect waits for a signal")
        before = after = tuple(self.sensors.values())
        reports = []
        with self.program.section() as sensing:
            if sensors:
                after, measurement = self._sample()
                reports = self._reports(measurement)
        prove(sensing[0], self.program.memory)
        held = (self.held_of_one(np.asarray(each, float)) for each in example.command)
        return self._compiled(
            tuple_like(example.command, held),
            sensing=Section(sensing[0], changes(before, after), np.zeros(0)),
            recorded=reports,
            kinds={},
        )

    def _compiled(
        self, command: Any, *, sensing: Section, recorded: list[Recorded], kinds: dict[str, type]
    ) -> PeriodProgram:
        """Return the program that goes on with the actuators; ``recorded`` is of what is before."""
        own = tuple(self.memory.values())
        with self.program.section() as driving:
            truth, motors, inner = self._acted_on(kinds), self.traced_tuple(command), self.law_state
            if self.assembly.inner:
                held = self.suite.report(self.traced_arrays(self.sensors), truth)
                inner, motors = self._law_inner(motors, held)
                inner = self.following(self.law_state, inner)
            memory, applied, saturated = self.assembly.actuators.act(
                self.traced_arrays(self.memory), motors, truth, self.assembly.hold
            )
            instant = self._instant(truth, command)
            for effect in self.effects:
                memory, applied = effect.change(memory, applied, instant)
            outputs = self.numbers(applied)
            (cut,) = self.numbers((saturated,))
            remembered = self.following(own, tuple(memory[name] for name in self.memory))
        prove(driving[0], self.program.memory)
        remembers = dict(zip(self.memory, remembered, strict=True))
        preparing, written, masses = self._preparing(remembers)
        weighing, weighed = self._weighing()
        before = [Recorded("physics", "", self.physics)]
        before += [Recorded("memory", name, array) for name, array in self.memory.items()]
        before += recorded
        after = [Recorded("sensordata", "", self.sensordata)]
        after += [Recorded("applied", str(index), array) for index, array in enumerate(outputs)]
        changed = changes(self.law_state, inner) + changes(own, remembered)
        return PeriodProgram(
            program=self.program,
            weighing=weighing,
            looking=self._looking(),
            sensing=sensing,
            driving=Section(driving[0], changed, np.zeros(0)),
            preparing=preparing,
            time=self.time,
            physics=self.physics,
            sensordata=self.sensordata,
            reference=self.reference,
            memory=self.memory,
            law=self.law_state,
            sensors=self.sensors,
            constants=self.constants,
            draws=self.draws,
            known=self.known,
            command=command,
            has_law="law" in kinds,
            applied=outputs,
            saturated=cut,
            written=written,
            weighed=weighed,
            masses=masses,
            before=before,
            after=after,
            kinds=kinds | {"command": type(command)},
        )

    def _instant(self, truth: Any, command: Any) -> Instant:
        """Return the instant as effects know it that change what the actuators apply."""
        unknown: Any = None
        return Instant(
            time=self.traced(self.time),
            physics=self.traced(self.physics),
            truth=truth,
            measurement=unknown,
            command=command,
            signals=unknown,
            memory=self.traced_arrays(self.memory),
            events=[],
        )

    def _alarms(self, measurement: Any, command: Any, signals: Any) -> np.ndarray:
        """Return where step effects have an event to tell after the law's step."""
        waiting = [effect for effect in self.effects if effect.waits]
        if not waiting:
            return np.zeros(0)
        topics = {"truth": self.sensed, "measurement": measurement}
        topics |= {"command": command, **topics_of(signals)}
        memory = self.traced_arrays(self.memory)
        return self.report([effect.alarm(memory, topics) for effect in waiting])

    def _weighing(self) -> tuple[Section, list[Write]]:
        """Return what sets the masses of a control instant: a section, and what it writes."""
        memory = self.traced_arrays(self.memory)
        with self.program.section() as weighing:
            seen = any(effect.looks for effect in self.effects)
            weighed = self._masses(memory, memory) if seen else []
        prove(weighing[0], self.program.memory)
        return Section(weighing[0], [], np.zeros(0)), weighed

    def _looking(self) -> Section:
        """Return what step effects see."""
        own = tuple(self.memory.values())
        with self.program.section() as looking:
            memory, reports = self.traced_arrays(self.memory), []
            for effect in self.effects:
                if effect.looks:
                    memory, report = effect.look(
                        memory, self.traced(self.physics), self.traced(self.sensordata)
                    )
                    reports.append(report)
            seen = self.following(own, tuple(memory[name] for name in self.memory))
            told = self.report(reports)
        prove(looking[0], self.program.memory)
        return Section(looking[0], changes(own, seen), told)

    def _preparing(
        self, remembered: dict[str, np.ndarray]
    ) -> tuple[Section, list[Write], list[Write]]:
        """Return what step effects change for a step, after which ``remembered`` holds.

        That is a section, what it writes into mjData, and into mjModel.
        """
        memory = self.traced_arrays(self.memory), self.traced_arrays(remembered)
        with self.program.section() as preparing:
            written, reports, followed = list[Write](), [], memory[1]
            for effect, known in zip(self.effects, self.known, strict=True):
                followed = effect.follow(followed, self.traced(self.physics), self.traced(known))
            for effect, known in zip(self.effects, self.known, strict=True):
                writes, report = effect.prepare(
                    followed,
                    self.traced(self.physics),
                    self.traced(self.time),
                    self.traced(known),
                )
                written += self.own_numbers(writes)
                reports.append(report)
            masses = self._masses(*memory)
            told = self.report(reports)
            own = tuple(remembered.values())
            after = self.following(own, tuple(followed[name] for name in remembered))
        prove(preparing[0], self.program.memory)
        return Section(preparing[0], changes(own, after), told), written, masses

    def _masses(self, before: Any, after: Any) -> list[Write]:
        """Return the masses and inertias for a step between what is remembered at its ends."""
        of_bodies = [each for effect in self.effects for each in effect.masses(before, after)]
        return self.own_numbers(
            Write(name, body * values.size, values) for name, body, values in of_bodies
        )

    def _truth(self) -> Any:
        physics, memory = self.traced(self.physics), self.traced_arrays(self.memory)
        return truth_of(physics, memory, self.layout, self.assembly.actuators, self.effects)

    def _acted_on(self, kinds: dict[str, type]) -> Any:
        """Return the truth for actuators: as between control instants, without the sky."""
        if self.assembly.inner or any(effect.needs_truth for effect in self.effects):
            return self._truth()
        if self.assembly.driven_stepwise:
            return self.layout.motion(self.traced(self.physics))
        return self.sensed if "law" in kinds else self._truth()

    def _sample(self) -> tuple[Any, Any]:
        """Return what the sensors remember after a sample, and the measurement."""
        sensors = self.traced_arrays(self.sensors)
        phase = self.traced_arrays(self.memory).get(PHASE)
        self.sensed = self._truth()
        sampled, measurement = self.suite.sample_where_due(sensors, self.sensed, phase)
        before = tuple(self.sensors.values())
        return self.following(before, tuple(sampled[name] for name in self.sensors)), measurement

    def _refuse_samples_between(self) -> None:
        if any(tick % self.assembly.scenario.rates.steps for tick in self.suite.ticks):
            raise Untraceable("sensors sample between control instants")

    def _reports(self, measurement: Any) -> list[Recorded]:
        """Return what is recorded of sensors: what they remembered, and the ``measurement``."""
        values = {name: value for name, value in measurement._asdict().items() if value.size}
        arrays = self.numbers(tuple(values.values()))
        return [
            *(Recorded("sensors", name, array) for name, array in self.sensors.items()),
            *(Recorded("measurement", n, a) for n, a in zip(values, arrays, strict=True)),
        ]

    def _law_step(self, measurement: Any) -> tuple[Any, Any, Any]:
        unbatched = isinstance(self.assembly.law, UnbatchedLaw)
        step = UnbatchedLaw(self.law).step_of_one if unbatched else self.law.step
        state, reference = self.traced_tuple(self.law_state), self.traced_tuple(self.reference)
        with _of_the_law():
            after, command, signals = step(state, self.traced(self.time), measurement, reference)
        return after or (), command, signals or ()

    def _law_inner(self, command: Any, measurement: Any) -> tuple[Any, Any]:
        state = self.traced_tuple(self.law_state)
        with _of_the_law():
            after, motors = self.law.inner(state, self.traced(self.time), command, measurement)
        return after or (), motors


@contextmanager
def _of_the_law() -> Iterator[None]:
    """Name the line of the law that cannot be taken down, or that raised anything else."""
    try:
        yield
    except Interrupted:
        raise
    except BaseException as error:
        raise Untraceable(f"{error} ({place_of(error)})") from error
