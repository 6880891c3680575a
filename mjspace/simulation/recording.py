"""What a flight records: its control periods, turned into rows block by block."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import Array, DesiredMotion, Event, Measurement
from mjspace.simulation import joined
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of
from mjspace.vehicle.step_effect import State, StepEffect

Rows = dict[str, dict[str, Array]]


@dataclass(frozen=True)
class Block:
    """Consecutive control periods: ``rows[topic][field]`` is (n, N, ...), ``time`` (n,) [s].

    Its arrays are read after it has been yielded, on the log's thread, while the flight goes on:
    they must not be written again. Each block has buffers of its own.
    """

    period: int
    """Of the first row."""
    time: Array
    rows: Rows
    events: list[Event]
    kinds: dict[str, dict[str, type]] = field(default_factory=dict)
    """The named tuples that were recorded on a topic, of those that users' code returns, by what
    their fields' names begin with there."""


def one_vehicle(block: Block, vehicle: int = 0) -> Rows:
    """Return the block's rows without the vehicle axis."""
    return {t: {f: a[:, vehicle] for f, a in fields.items()} for t, fields in block.rows.items()}


def shapes(block: Block) -> dict[str, dict[str, tuple[int, ...]]]:
    """Return the shape of each field for one vehicle at one time."""
    return {t: {f: a.shape[2:] for f, a in fields.items()} for t, fields in block.rows.items()}


def until_trouble(block: Block, layout: StateLayout) -> tuple[Block, str]:
    """Return the block up to the first value that cannot be flown, and its name ('' if none).

    A law's signals may be infinite; the motion and what acts on it must be finite.
    """
    acting = {
        "/state.physics": block.rows["/state"]["physics"][..., layout.moving],
        **{f"/measurement.{name}": a for name, a in block.rows["/measurement"].items()},
        **{f"/command.{name}": a for name, a in block.rows.get("/command", {}).items()},
    }
    first, culprit = len(block.time), ""
    for name, values in acting.items():
        # Each is also false for what is not a number; the first is quicker.
        if (
            values.max(initial=0.0) <= mujoco.mjMAXVAL
            and values.min(initial=0.0) >= -mujoco.mjMAXVAL
        ):
            continue
        good = (np.abs(values) <= mujoco.mjMAXVAL).reshape(len(values), -1).all(axis=1)
        if not good.all() and int(np.argmin(good)) < first:
            first, culprit = int(np.argmin(good)), name
    if not culprit:
        return block, ""
    for name, values in block.rows.get("/estimate", {}).items():
        if not np.isfinite(values[first]).all():
            culprit = f"/estimate.{name}"  # of which the law made what acts
            break
    problem = f"{culprit} is not finite, or beyond 1e10, at t = {block.time[first]:.6g} s"
    rows = {t: {f: v[:first] for f, v in fields.items()} for t, fields in block.rows.items()}
    events = [event for event in block.events if event.time < block.time[first]]
    return replace(block, time=block.time[:first], rows=rows, events=events), problem


OF_SENSORS = ("sensors", "measurement")
"""What sensors leave in a ``ControlPeriod``."""
EVERYTHING = (
    *OF_SENSORS,
    *("law", "signals"),
    *("physics", "memory", "command", "applied", "saturated", "wrench", "sensordata"),
)
_AS_FLOATS = ("law", "command", "signals")


@dataclass(frozen=True)
class Columns:
    """What consecutive control periods hold, by the names of ``ControlPeriod``.

    ``groups["memory"]["current"]`` is (n, N, ...); an array that is no part of another has the name
    "", and the arrays of a tuple without names "0", "1", ....
    """

    groups: dict[str, dict[str, Array]]
    events: list[Event]
    kinds: dict[str, type]
    """The named tuples of "law", "command" and "signals"."""

    def __len__(self) -> int:
        """Return the number of periods."""
        return len(self.physics)

    def __getitem__(self, group: str) -> dict[str, Array]:
        """Return the arrays of a group, none where there is no such."""
        return self.groups.get(group, {})

    @property
    def physics(self) -> Array:
        """MuJoCo's integration state, (n, N, nstate)."""
        return self.groups["physics"][""]

    @property
    def saturated(self) -> Array:
        """True for each motor that saturates, (n, N, motors)."""
        return self.groups["saturated"][""].astype(bool)


class Recording:
    """Control periods, written into columns one by one: nothing is kept of each but its numbers."""

    def __init__(self, first: ControlPeriod, count: int, names: Sequence[str]) -> None:
        """Make room for ``count`` periods like the ``first``, and for these ``names`` of each."""
        self._rows = 0
        self._events: list[Event] = []
        self._kinds = {name: type(getattr(first, name)) for name in _AS_FLOATS}
        self._columns: dict[str, dict[str, Array]] = {}
        self._places: list[tuple[str, list[tuple[Any, Array]]]] = []
        for name in names:
            columns = self._columns[name] = {}
            places = []
            for key, label, value in _fields(first, name):
                array = np.asarray(value)
                kind = float if name in _AS_FLOATS else array.dtype
                columns[label] = column = np.empty((count, *array.shape), kind)
                places.append((key, column))
            self._places.append((name, places))

    def write(self, period: ControlPeriod) -> None:
        """Record a period that is over, or as far as it came."""
        row = self._rows
        for name, places in self._places:
            source = getattr(period, name)
            if name == "measurement":
                source = vars(source)
            for key, column in places:
                column[row] = source[key]
        self._events += period.events
        self._rows += 1

    def sensors_before(self, number: int, now: State) -> State:
        """Return what the sensors remembered before that period; ``now`` if it is not recorded."""
        if number >= self._rows:
            return now
        return {name: column[number].copy() for name, column in self._columns["sensors"].items()}

    def columns(self, count: int | None = None) -> Columns:
        """Return what has been recorded, of the first ``count`` periods or of all, as views."""
        rows = self._rows if count is None else count
        groups = {
            name: {label: column[:rows] for label, column in columns.items()}
            for name, columns in self._columns.items()
        }
        return Columns(groups, self._events, self._kinds)


def _fields(period: ControlPeriod, name: str) -> list[tuple[Any, str, Any]]:
    """Return (key of the value, name of the column, value) of each array of a group.

    What a vehicle lacks, a kind of sensor or motor, is an empty array, and left out.
    """
    group = getattr(period, name)
    if isinstance(group, np.ndarray):
        return [(..., "", group)]
    if isinstance(group, dict):
        return [(key, key, value) for key, value in group.items()]
    if isinstance(group, Measurement):
        return [(key, key, value) for key, value in vars(group).items() if np.size(value)]
    names = getattr(group, "_fields", map(str, range(len(group or ()))))
    arrays = zip(range(len(group or ())), names, group or (), strict=True)
    return [each for each in arrays if name == "applied" or np.size(each[2])]


def block_of(
    number: int,
    reference: DesiredMotion,
    columns: Columns,
    assembly: Assembly,
    layout: StateLayout,
    effects: Sequence[StepEffect],
    saturated_before: Array,
) -> Block:
    """Return the periods from ``number`` on as rows; ``saturated_before`` (N, m) holds before them.

    ``reference`` has arrays of at least as many rows, without a vehicle axis.
    """
    physics, data, memory = columns.physics, columns["sensordata"][""], columns["memory"]
    n, vehicle = len(physics), assembly.vehicle
    desired = {name: a[:n, None] for name, a in reference._asdict().items()}
    truth = truth_of(physics, memory, layout, assembly.actuators, effects)
    of_effects: dict[str, Array] = {}
    for effect in effects:
        of_effects |= effect.logged(memory, data)
    state = {"physics": physics}
    state |= {f"actuator_{name}": a for name, a in memory.items()}
    of_state = joined.columns(columns.kinds["law"], columns["law"])
    state |= {f"{who}_{n}": a for who, arrays in of_state.items() for n, a in arrays.items()}
    state |= {f"sensor_{name}": a for name, a in columns["sensors"].items()}
    signals = joined.columns(columns.kinds["signals"], columns["signals"])
    estimate = signals.get(joined.ESTIMATOR, {})
    environment = data[..., vehicle.environment]
    for wrench in columns["wrench"].values():
        environment = environment + wrench
    rows: Rows = {
        "/state": state,
        "/truth": {
            **_without_empty(truth._asdict()),
            **of_effects,
            **layout.in_orbit(physics),
            "position": physics[..., layout.position],
            "velocity": physics[..., layout.velocity],
            **position_errors(physics[..., layout.position], truth.attitude, desired),
            "momentum": data[..., vehicle.momentum],
            "energy": data[..., vehicle.kinetic],
            "attitude_error": attitude.rotation_angle(truth.attitude, desired["attitude"])[
                ..., None
            ],
            **_estimation_error(truth.attitude, estimate),
        },
        "/measurement": columns["measurement"],
        "/estimate": estimate,
        "/reference": {
            name: np.broadcast_to(a, (n, physics.shape[1], a.shape[-1]))
            for name, a in desired.items()
        },
        "/command": {
            **columns["command"],
            **assembly.actuators.logged(columns["applied"].values()),
        },
        "/law": signals[joined.LAW],
        "/disturbance": {"force": environment[..., :3], "torque": environment[..., 3:]},
    }
    time = (number + np.arange(n, dtype=float)) * assembly.scenario.rates.control
    events = _saturation_events(time, columns.saturated, saturated_before, vehicle.motors)
    of_signals = joined.kinds(columns.kinds["signals"])
    kinds = {
        "/state": {f"{who}_": kind for who, kind in joined.kinds(columns.kinds["law"]).items()},
        "/estimate": {"": of_signals.get(joined.ESTIMATOR, tuple)},
        "/reference": {"": type(reference)},
        "/command": {"": columns.kinds["command"]},
        "/law": {"": of_signals[joined.LAW]},
    }
    logged = {topic: fields for topic, fields in rows.items() if fields}
    return Block(number, time, logged, events + columns.events, kinds)


def position_errors(
    position: Array, quaternion: Array, reference: dict[str, Array]
) -> dict[str, Array]:
    """Return, where the reference has a position, the error from it [m] and the tilt [rad].

    The tilt is the angle between the body's z and the world's.
    """
    if "position" not in reference:
        return {}
    lean = np.sqrt(quaternion[..., 1] ** 2 + quaternion[..., 2] ** 2)
    tilt = 2.0 * np.arcsin(np.minimum(lean, 1.0))
    return {"position_error": position - reference["position"], "tilt": tilt[..., None]}


def _estimation_error(quaternion: Array, estimate: dict[str, Array]) -> dict[str, Array]:
    """Return, where an attitude is estimated, the rotation vector [rad] from it to the true one."""
    if "attitude" not in estimate:
        return {}
    error = attitude.multiply(attitude.conjugate(estimate["attitude"]), quaternion)
    return {"estimation_error": attitude.to_rotation_vector(error)}


def _without_empty(fields: dict[str, Array]) -> dict[str, Array]:
    """Return the fields that have numbers: a vehicle may lack a kind of sensor or motor."""
    return {name: array for name, array in fields.items() if array.size}


def _saturation_events(
    time: Array, saturated: Array, before: Array, motors: Sequence[str]
) -> list[Event]:
    rising = saturated & ~np.concatenate([before[None], saturated[:-1]])
    return [
        Event(float(time[k]), int(vehicle), "WARNING", f"{motors[motor]} saturated")
        for k, vehicle, motor in np.argwhere(rising)
    ]
