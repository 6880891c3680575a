"""Blocks of control periods flown by compiled code, every vehicle on a thread of MuJoCo's batch."""

from collections.abc import Iterable, Sequence
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

_WORD = 8  # bytes


class CompiledFlight:
    """Vehicles that a compiled period flies.

    Attributes:
        physics: MuJoCo's integration state of each, (N, nstate).
        memory: what the actuators remember, by name, (N, ...).
        sensors: what the sensors remember, likewise.
        law: the law's state, a named tuple of arrays (N, ...), or empty.
        command: the law's command, arrays (N, ...), where the period begins with it.
        broken_off: the signal that ended the block within a period, after which it cannot go on;
            0 for none.
    """

    def __init__(
        self,
        assembly: Assembly,
        layout: StateLayout,
        period: PeriodProgram,
        start: Start,
        members: Sequence[int],
        threads: int,
    ) -> None:
        """Put them into a batch with the fields of MuJoCo's model of the ``start``."""
        self._assembly, self._layout, self._period = assembly, layout, period
        vehicles = len(start.physics)
        self._batch = NativeBatch(assembly.vehicle.model, vehicles, threads, start.model)
        self._suite = assembly.sensors(members)
        self.physics = self._batch.state
        made = () if period.has_law else period.command
        named = (period.memory, period.sensors, period.biases)
        remembered = [*(a for arrays in named for a in arrays.values()), *period.law, *made]
        places, size = _packed(remembered)
        self._rows = np.zeros((vehicles, size), np.uint8)
        views = [_view(self._rows, at, each) for at, each in zip(places, remembered, strict=True)]
        one_by_one = iter(views)
        self.memory, self.sensors, biases = (
            {name: next(one_by_one) for name in arrays} for arrays in named
        )
        views = list(one_by_one)
        for name, bias in self._suite.biases.items():
            biases[name][...] = bias
        self.law = type(period.law)(*views[: len(period.law)]) if period.law else ()
        self.command = views[len(period.law) :]
        self._record_places, self._record_size = _packed(
            [*(each.array for each in (*period.before, *period.after)), period.saturated]
        )
        self._whole = np.zeros(vehicles, np.int64)
        """Whole periods that each vehicle has flown of the last call."""
        self.broken_off = 0
        self._tables: list[np.ndarray] = []
        self._orders = self._constant_orders(remembered, places)
        self._function = block_function().address

    def set(
        self, physics: Array, memory: dict[str, Array], sensors: dict[str, Array], law: Any
    ) -> None:
        """Put the vehicles there, with what is remembered."""
        self.physics[...] = physics
        for own, others in ((self.memory, memory), (self.sensors, sensors)):
            for name, values in own.items():
                values[...] = others[name]
        for target, values in zip(self.law, law, strict=True):
            target[...] = values

    def begin(self, first: int, count: int, last: int) -> None:
        """Begin a block of ``count`` periods from number ``first`` on.

        The flight's ``last`` is not flown.
        """
        self._first, self._flown = first, 0
        self._recorded = np.empty((count, len(self.physics), self._record_size), np.uint8)
        orders = self._orders
        orders["last"] = last
        orders["period_stride"], orders["vehicle_stride"] = self._recorded.strides[:2]

    def fly(self, desired: DesiredMotion) -> None:
        """Fly the whole block with its law; ``desired`` has at least a row for each period.

        A warning of MuJoCo's is left to be found in ``warned``.

        Raises:
            mujoco.batch.SimulationError: MuJoCo raised an error.
        """
        period, count = self._period, len(self._recorded)
        # The same for every vehicle, and of each its own.
        rows = [np.ascontiguousarray(array[:count])[:, None] for array in desired]
        rows += self._suite.draws(range(self._first, self._first + count)).values()
        targets = (*period.reference, *period.draws.values())
        inputs = _table(
            (
                self._offset(to),
                of.ctypes.data,
                of.strides[0],
                of.strides[1] if of.shape[1] > 1 else 0,
                to.nbytes,
            )
            for to, of in zip(targets, rows, strict=True)
        )
        self._orders["inputs"] = inputs.ctypes.data, len(inputs)
        self._fly(count)

    def fly_period(self, command: Any) -> None:
        """Fly the next period of the block under the law's ``command``.

        Raises:
            mujoco.batch.SimulationError: as ``fly``.
        """
        for target, values in zip(self.command, command, strict=True):
            target[...] = values
        self._fly(1)

    def _fly(self, count: int) -> None:
        orders, recorded = self._orders, self._recorded
        orders["first"], orders["count"] = self._first + self._flown, count
        orders["record"] = recorded.ctypes.data + self._flown * recorded.strides[0]
        self._batch.apply(self._function, orders.ctypes.data)
        whole = int(self._whole.min())
        self._flown += whole
        if whole < count:
            self.broken_off = interrupts.received[0]

    @property
    def has_law(self) -> bool:
        """Whether the law is compiled; else each period is flown under its command."""
        return self._period.has_law

    @property
    def warned(self) -> bool:
        """Whether MuJoCo has warned of anything."""
        return bool(self._batch.warning[:, :, 1].any())

    def columns(self) -> Columns:
        """Return what the block has recorded so far, as views; without the law, if it has none."""
        period, records = self._period, self._recorded[: self._flown]
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
                truth = truth_of(state, memory, self._layout, self._assembly.actuators, ())
                reports = self._suite.report({}, truth)._asdict()
                groups["measurement"] = {name: a for name, a in reports.items() if a.size}
            for name in ("law", "signals", "sensors"):
                groups.setdefault(name, {})
        return Columns(groups, [], period.kinds)

    def _constant_orders(self, remembered: Sequence[np.ndarray], places: Sequence[int]) -> Any:
        """Return the orders with all that is the same in every block."""
        period, assembly = self._period, self._assembly
        rates, model = assembly.scenario.rates, assembly.vehicle.model
        _, words_of = struct_offsets.find()
        orders = np.zeros((), ORDERS)
        for name in ("step", "forward"):
            orders[name] = address(f"mj_{name}")
        orders["get_state"], orders["state"] = address("mj_getState"), int(INTEGRATION)
        orders["steps"], orders["stepwise"] = rates.steps, assembly.driven_stepwise
        orders["control"], orders["physics"] = rates.control, rates.physics
        sensing, driving = period.sensing, period.driving
        shifted = driving.table.copy()
        shifted[:, 2:] += len(sensing.words)
        drives = [kind.drives for kind in assembly.actuators.kinds]
        tables = {
            "memory": period.program.memory.view(np.int64),
            "words": np.concatenate([sensing.words, driving.words]),
            "relative": np.concatenate([sensing.relative, driving.relative]),
            "sensing": sensing.table,
            "driving": shifted,
            "remembered": _table(
                (self._offset(each), place, each.nbytes)
                for each, place in zip(remembered, places, strict=True)
            ),
            "after_sensing": self._copies(period.after_sensing),
            "after_driving": self._copies(period.after_driving),
            "applied": _table(
                (
                    getattr(words_of, driven.array),
                    _WORD * driven.slice_of(model).start,
                    self._offset(values),
                    values.nbytes,
                )
                for driven, values in zip(drives, period.applied, strict=True)
            ),
            "before": self._record_table(period.before, self._record_places),
            "after": self._record_table(period.after, self._record_places[len(period.before) :]),
        }
        for name, table in tables.items():
            table = np.ascontiguousarray(table)
            self._tables.append(table)  # keeps alive what the orders point to
            orders[name] = table.ctypes.data, len(table)
        orders["received"] = interrupts.received.buffer_info()[0]
        orders["whole"] = self._whole.ctypes.data
        orders["row"], orders["row_stride"] = self._rows.ctypes.data, self._rows.strides[0]
        orders["time"] = self._offset(period.time)
        orders["state_row"] = self._offset(period.physics)
        orders["saturated"] = self._offset(period.saturated), period.saturated.size
        orders["saturated_record"] = self._record_places[-1]
        orders["sensors"] = self._offset(period.sensordata)
        orders["sensors_word"] = words_of.sensordata
        orders["sensors_size"] = period.sensordata.nbytes
        return orders

    def _offset(self, array: np.ndarray) -> int:
        return self._period.program.offset(array)

    def _copies(self, pairs: Copies) -> np.ndarray:
        return _table((self._offset(to), self._offset(of), to.nbytes) for to, of in pairs)

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
