"""Blocks of control periods flown by compiled code, every vehicle on a thread of MuJoCo's batch."""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from mjspace import interrupts
from mjspace.contract import Array, DesiredMotion
from mjspace.environment import struct_offsets
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.block_kernel import ORDERS, block_function
from mjspace.simulation.initial_state import INTEGRATION, Start
from mjspace.simulation.native_batch import NativeBatch, address
from mjspace.simulation.period_program import Copies, PeriodProgram, Recorded
from mjspace.simulation.recording import Columns
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of
from mjspace.vehicle.step_effect import StepEffect, Write

_WORD = 8  # bytes


class CompiledFlight:
    """Vehicles that a compiled period flies.

    Attributes:
        physics: MuJoCo's integration state of each, (N, nstate).
        memory: what the actuators remember, by name, (N, ...).
        sensors: what the sensors remember, likewise.
        law: the law's state, a named tuple of arrays (N, ...), or empty.
        stopped: in which period of the block each had an event to tell, or was stopped by a signal,
            (N,); if in none, how many the block has.
        broken_off: the signal that ended the block within a period, after which it cannot go on;
            0 for none.
    """

    def __init__(
        self,
        assembly: Assembly,
        layout: StateLayout,
        effects: Sequence[StepEffect],
        period: PeriodProgram,
        start: Start,
        members: Sequence[int],
        threads: int,
    ) -> None:
        """Put them into a batch with the fields of MuJoCo's model of the ``start``."""
        self._assembly, self._layout, self._period = assembly, layout, period
        self._effects = effects
        vehicles = len(start.physics)
        # Threads that write masses, and derive what follows from them, have models of their own.
        own = {each.array for each in period.masses} | ({"bvh_aabb"} if period.masses else set())
        self._batch = NativeBatch(assembly.vehicle.model, vehicles, threads, start.model, own)
        self._batch.set_models(start.models)
        self._suite = assembly.sensors(members)
        self.physics = self._batch.state
        named = (period.memory, period.sensors, period.constants)
        remembered = [*(a for arrays in named for a in arrays.values()), *period.law]
        places, size = _packed(remembered)
        self._rows = np.zeros((vehicles, size), np.uint8)
        views = [_view(self._rows, at, each) for at, each in zip(places, remembered, strict=True)]
        one_by_one = iter(views)
        self.memory, self.sensors, constants = (
            {name: next(one_by_one) for name in arrays} for arrays in named
        )
        for name, values in self._suite.constants.items():
            constants[name][...] = values
        law = [next(one_by_one) for _ in period.law]
        self.law = type(period.law)(*law) if law else ()
        self._record_places, self._record_size = _packed(
            [*(each.array for each in (*period.before, *period.after)), period.saturated]
        )
        self.stopped = np.zeros(vehicles, np.int64)
        self.broken_off = 0
        self._tables: list[np.ndarray] = []
        self._orders = self._constant_orders(remembered, places)
        self._begin, self._end = (self._orders[name].reshape(1) for name in ("begin", "end"))
        self._apply = partial(self._batch.apply, block_function().address, self._orders.ctypes.data)

    def set(
        self, physics: Array, memory: dict[str, Array], sensors: dict[str, Array], law: Any
    ) -> None:
        """Put the vehicles there, with what is remembered."""
        self.physics[...] = physics
        self.remember(memory)
        for name, values in self.sensors.items():
            values[...] = sensors[name]
        for target, values in zip(self.law, law, strict=True):
            target[...] = values

    def follow(self, fields: dict[str, Array]) -> None:
        """Take over fields of MuJoCo's model that step effects may have changed, (N, ...)."""
        self._batch.follow(fields)

    def remember(self, memory: dict[str, Array]) -> None:
        """Let actuators and step effects remember that."""
        for name, values in self.memory.items():
            values[...] = memory[name]

    def begin(
        self, first: int, count: int, last: int, desired: DesiredMotion, commands: Sequence[Array]
    ) -> None:
        """Begin a block of ``count`` periods from number ``first`` on.

        ``desired`` has at least a row for each of them. ``commands`` are the arrays of the law's
        commands, (count, N, ...), where the law is not compiled: those of a period are read when
        its steps are flown. The flight's ``last`` period has none.
        """
        self._flown = 0  # halves of periods
        self.stopped[:] = count
        # A vehicle's rows lie together: its thread writes them in turn.
        recorded = np.empty((len(self.physics), count, self._record_size), np.uint8)
        recorded.setflags(write=False)  # but by the compiled function
        self._recorded = recorded.transpose(1, 0, 2)
        period, orders = self._period, self._orders
        orders["first"], orders["last"] = first, last
        orders["record"] = self._recorded.ctypes.data
        orders["period_stride"], orders["vehicle_stride"] = self._recorded.strides[:2]
        draws = self._suite.draws(range(first, first + count))
        # The same for every vehicle, and of each its own.
        rows = [np.ascontiguousarray(array[:count])[:, None] for array in desired]
        times = (first + np.arange(count, dtype=float)) * self._assembly.scenario.rates.control
        known = [np.ascontiguousarray(each.known(times))[:, None] for each in self._effects]
        inputs = (
            (*period.reference, *period.draws.values(), *period.known),
            (*rows, *draws.values(), *known),
        )
        made: Any = () if period.has_law else period.command
        given = (*made, *period.known), (*commands, *known)
        self._of_block: list[Any] = [rows, draws, known, commands]  # kept: read by address
        for name, (targets, sources) in (("inputs", inputs), ("commands", given)):
            table = _table(map(self._input, targets, sources))
            self._of_block.append(table)
            orders[name] = table.ctypes.data, len(table)

    def fly_to_instant(self, period: int) -> None:
        """Fly on to the control instant of that ``period`` of the block, sensors included.

        A warning of MuJoCo's is left to be found in ``warned``.

        Raises:
            mujoco.batch.SimulationError: MuJoCo raised an error.
        """
        self._fly_halves(2 * period + 1)

    def fly_periods(self, count: int) -> None:
        """Fly on until so many periods of the block have been flown; as ``fly_to_instant``.

        Raises:
            mujoco.batch.SimulationError: as ``fly_to_instant``.
        """
        self._fly_halves(2 * count)

    def _fly_halves(self, end: int) -> None:
        self._begin[0], self._end[0] = self._flown, end
        self._apply()
        self._flown = end
        if 2 * self.told < end:
            self.broken_off = interrupts.received[0]

    @property
    def told(self) -> int:
        """The first period of the block in which a step effect has an event to tell, or a signal.

        Nothing is known of it and of what follows. As many as the block has, where there is none.
        """
        return int(self.stopped.min())

    @property
    def has_law(self) -> bool:
        """Whether the law is compiled; else each period is flown under its command."""
        return self._period.has_law

    @property
    def has_sensors(self) -> bool:
        """Whether the sensors are compiled."""
        return self.has_law or any(each.group == "measurement" for each in self._period.before)

    @property
    def warned(self) -> bool:
        """Whether MuJoCo has warned of anything."""
        return bool(self._batch.warning[:, :, 1].any())

    def measured(self) -> dict[str, Array]:
        """Return what sensors report in the block, (count, N, ...), where that is recorded.

        A period's row is filled in at its control instant.
        """
        before = zip(self._record_places, self._period.before, strict=False)
        return {
            each.name: _view(self._recorded, place, each.array)
            for place, each in before
            if each.group == "measurement"
        }

    def columns(self) -> Columns:
        """Return what the block has recorded so far, as views; without the law, if it has none."""
        period, records = self._period, self._recorded[: min(self._flown // 2, self.told)]
        names = ("memory", "command", "applied", "wrench")
        groups: dict[str, dict[str, Array]] = {name: {} for name in names}
        recorded = (*period.before, *period.after, Recorded("saturated", "", period.saturated))
        for place, each in zip(self._record_places, recorded, strict=True):
            values = _view(records, place, each.array)
            if values.size or each.group not in ("law", "command", "signals"):
                kept = values if values.dtype == float else values.astype(float)
                groups.setdefault(each.group, {})[each.name] = kept
        if period.has_law:
            state, memory = groups["physics"][""], groups["memory"]
            if not self._suite.ticks:
                truth = truth_of(
                    state, memory, self._layout, self._assembly.actuators, self._effects
                )
                reports = self._suite.report({}, truth)._asdict()
                groups["measurement"] = {name: a for name, a in reports.items() if a.size}
            for name in ("law", "signals", "sensors"):
                groups.setdefault(name, {})
        return Columns(groups, [], period.kinds)

    def _constant_orders(self, remembered: Sequence[np.ndarray], places: Sequence[int]) -> Any:
        """Return the orders with all that is the same in every block."""
        period, assembly = self._period, self._assembly
        rates, model = assembly.scenario.rates, assembly.vehicle.model
        words_of_model, words_of = struct_offsets.find()
        orders = np.zeros((), ORDERS)
        for function in ("step", "forward", "setConst", "getState", "setState"):
            orders[function] = address(f"mj_{function}")
        orders["state"] = int(INTEGRATION)
        orders["steps"], orders["driven"] = rates.steps, assembly.driven_stepwise
        orders["prepared"] = any(effect.every_step for effect in self._effects)
        orders["control"], orders["physics"] = rates.control, rates.physics
        applied = [
            Write(kind.drives.array, columns.start, values[:, part])
            for kind, values in zip(assembly.actuators.kinds, period.applied, strict=True)
            for columns, part in kind.drives.runs(model)
        ]
        tables = {
            "memory": period.program.memory.view(np.int64),
            **self._sections(),
            "remembered": _table(
                (self._offset(each), place, each.nbytes)
                for each, place in zip(remembered, places, strict=True)
            ),
            "applied": self._writes(applied, words_of),
            "written": self._writes(period.written, words_of),
            "weighed": self._writes(period.weighed, words_of_model),
            "masses": self._writes(period.masses, words_of_model),
            "before": self._record_table(period.before, self._record_places),
            "after": self._record_table(period.after, self._record_places[len(period.before) :]),
        }
        for name, table in tables.items():
            table = np.ascontiguousarray(table)
            self._tables.append(table)  # keeps alive what the orders point to
            orders[name] = table.ctypes.data, len(table)
        orders["received"] = interrupts.received.buffer_info()[0]
        orders["row"], orders["row_stride"] = self._rows.ctypes.data, self._rows.strides[0]
        orders["time"] = self._offset(period.time)
        orders["state_row"] = self._offset(period.physics)
        orders["saturated"] = self._offset(period.saturated), period.saturated.size
        orders["saturated_record"] = self._record_places[-1]
        orders["sensors"] = self._offset(period.sensordata)
        orders["sensors_word"] = words_of.sensordata
        orders["sensors_size"] = period.sensordata.nbytes
        for name in ("body_mass", "body_parentid", "body_subtreemass"):
            orders[name] = getattr(words_of_model, name)
        orders["bodies"] = model.nbody
        orders["most_constraints"] = struct_offsets.most_constraints()
        looking = [effect for effect in self._effects if effect.looks]
        of_forces = any(effect.of_forces for effect in looking)
        orders["observe"] = address("mj_forward" if of_forces else "mj_step1")
        orders["observes_forces"] = of_forces
        orders["looks"] = bool(looking)
        orders["looks_in_steps"] = any(effect.every_step for effect in looking)
        for name in ("looking", "sensing", "preparing"):
            told = getattr(period, name).report
            orders[f"told_{name}"] = (self._offset(told), told.size) if told.size else (0, 0)
        orders["stopped"] = self.stopped.ctypes.data
        return orders

    def _sections(self) -> dict[str, np.ndarray]:
        """Return the tables of the program's sections, whose words follow one another."""
        period, tables = self._period, dict[str, np.ndarray]()
        words, relative, used = [], [], 0
        for name in ("weighing", "looking", "sensing", "driving", "preparing"):
            calls, after, _ = getattr(period, name)
            tables[name] = calls.table + np.array([0, 0, used, used, used])
            if name != "weighing":  # which leads to no other state
                tables[f"after_{name}"] = self._copies(after)
            words.append(calls.words)
            relative.append(calls.relative)
            used += len(calls.words)
        tables["words"], tables["relative"] = np.concatenate(words), np.concatenate(relative)
        return tables

    def _input(self, to: np.ndarray, of: np.ndarray) -> tuple[int, ...]:
        """Return the row of an input of each period ``to`` the memory; (count, N or 1, ...)."""
        of_vehicles = of.strides[1] if of.shape[1] > 1 else 0
        return self._offset(to), of.ctypes.data, of.strides[0], of_vehicles, to.nbytes

    def _offset(self, array: np.ndarray) -> int:
        return self._period.program.offset(array)

    def _copies(self, pairs: Copies) -> np.ndarray:
        return _table((self._offset(to), self._offset(of), to.nbytes) for to, of in pairs)

    def _writes(self, writes: Sequence[Write], words: Any) -> np.ndarray:
        """Return the table of ``writes`` into a struct whose fields stand at these ``words``."""
        return _table(
            (
                getattr(words, each.array),
                _WORD * each.first,
                self._offset(each.values),
                each.values.nbytes,
            )
            for each in writes
        )

    def _record_table(self, recorded: Sequence[Recorded], places: Sequence[int]) -> np.ndarray:
        return _table(
            (place, self._offset(each.array), each.array.nbytes)
            for each, place in zip(recorded, places, strict=False)
        )


def _packed(arrays: Iterable[np.ndarray]) -> tuple[list[int], int]:
    """Return where each array stands in a row of bytes, and the row's size."""
    places, size = [], 0
    for array in arrays:
        places.append(size)
        size += -(-array.nbytes // _WORD) * _WORD
    return places, size


def _view(rows: np.ndarray, place: int, array: np.ndarray) -> Any:
    """Return the values like one vehicle's ``array`` (1, ...) at that place in the ``rows``."""
    part = rows[..., place : place + array.nbytes]
    return part.view(array.dtype).reshape(*rows.shape[:-1], *array.shape[1:])


def _table(rows: Iterable[tuple[int, ...]]) -> np.ndarray:
    return np.array(list(rows), np.int64)
