"""What a flight records: its control periods, turned into rows block by block."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import Array, DesiredMotion, Event, Measurement
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of
from mjspace.vehicle.step_effect import StepEffect

Rows = dict[str, dict[str, Array]]


@dataclass(frozen=True)
class Block:
    """Consecutive control periods: ``rows[topic][field]`` is (n, N, ...), ``time`` (n,) [s]."""

    period: int
    """Of the first row."""
    time: Array
    rows: Rows
    events: list[Event]
    kinds: dict[str, type] = field(default_factory=dict)
    """The named tuple that was recorded on a topic, of those that users' code returns."""


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
        **{f"/command.{name}": a for name, a in block.rows["/command"].items()},
    }
    first, culprit = len(block.time), ""
    for name, values in acting.items():
        # Also false for what is not a number.
        good = (np.abs(values) <= mujoco.mjMAXVAL).reshape(len(values), -1).all(axis=1)
        if not good.all() and int(np.argmin(good)) < first:
            first, culprit = int(np.argmin(good)), name
    if not culprit:
        return block, ""
    problem = f"{culprit} is not finite, or beyond 1e10, at t = {block.time[first]:.6g} s"
    rows = {t: {f: v[:first] for f, v in fields.items()} for t, fields in block.rows.items()}
    events = [event for event in block.events if event.time < block.time[first]]
    return replace(block, time=block.time[:first], rows=rows, events=events), problem


@dataclass(frozen=True)
class Columns:
    """What consecutive control periods hold, by the names of ``ControlPeriod``; (n, N, ...)."""

    physics: Array
    sensordata: Array
    memory: dict[str, Array]
    sensors: dict[str, Array]
    measurement: dict[str, Array]
    law: dict[str, Array]
    command: dict[str, Array]
    signals: dict[str, Array]
    applied: tuple[Array, ...]
    saturated: Array
    wrench: Array | None
    events: list[Event]
    kinds: dict[str, type]
    """The named tuples of "law", "command" and "signals"."""


def columns_of(periods: Sequence[ControlPeriod]) -> Columns:
    """Return the ``periods``, of which there is at least one, with a period axis."""
    first = periods[0]

    def column(name: str) -> list[Any]:
        return list(map(attrgetter(name), periods))

    return Columns(
        physics=np.array(column("physics")),
        sensordata=np.array(column("sensordata")),
        memory=_stacked(column("memory")),
        sensors=_stacked(column("sensors")),
        measurement=_measured(column("measurement")),
        law=_fields(column("law")),
        command=_fields(column("command")),
        signals=_fields(column("signals")),
        applied=tuple(map(np.array, zip(*column("applied"), strict=True))),
        saturated=np.array(column("saturated")),
        wrench=None if first.wrench is None else np.array(column("wrench")),
        events=[event for period in periods for event in period.events],
        kinds={name: type(getattr(first, name)) for name in ("law", "command", "signals")},
    )


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
    physics, data, memory = columns.physics, columns.sensordata, columns.memory
    n, vehicle = len(physics), assembly.vehicle
    desired = {name: a[:n, None] for name, a in reference._asdict().items()}
    truth = truth_of(physics, memory, layout, assembly.actuators, effects)
    of_effects: dict[str, Array] = {}
    for effect in effects:
        of_effects |= effect.logged(memory, data)
    state = {"physics": physics}
    state |= {f"actuator_{name}": a for name, a in memory.items()}
    state |= {f"law_{name}": a for name, a in columns.law.items()}
    state |= {f"sensor_{name}": a for name, a in columns.sensors.items()}
    environment = data[..., vehicle.environment]
    if columns.wrench is not None:
        environment = environment + columns.wrench
    rows: Rows = {
        "/state": state,
        "/truth": {
            **_without_empty(truth._asdict()),
            **of_effects,
            "position": physics[..., layout.position],
            "velocity": physics[..., layout.velocity],
            **_position_errors(physics[..., layout.position], truth.attitude, desired),
            "momentum": data[..., vehicle.momentum],
            "energy": data[..., vehicle.kinetic],
            "attitude_error": attitude.rotation_angle(truth.attitude, desired["attitude"])[
                ..., None
            ],
        },
        "/measurement": columns.measurement,
        "/reference": {
            name: np.broadcast_to(a, (n, physics.shape[1], a.shape[-1]))
            for name, a in desired.items()
        },
        "/command": {**columns.command, **assembly.actuators.logged(columns.applied)},
        "/law": columns.signals,
        "/disturbance": {"force": environment[..., :3], "torque": environment[..., 3:]},
    }
    time = (number + np.arange(n, dtype=float)) * assembly.scenario.rates.control
    saturated = columns.saturated.astype(bool)
    events = _saturation_events(time, saturated, saturated_before, vehicle.motors)
    kinds = {
        "/state": columns.kinds["law"],
        "/reference": type(reference),
        "/command": columns.kinds["command"],
        "/law": columns.kinds["signals"],
    }
    logged = {topic: fields for topic, fields in rows.items() if fields}
    return Block(number, time, logged, events + columns.events, kinds)


def _position_errors(
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


def _stacked(states: list[dict[str, Array]]) -> dict[str, Array]:
    """Return named arrays of several periods with a period axis."""
    return {name: np.array([state[name] for state in states]) for name in states[0]}


def _measured(measurements: list[Measurement]) -> dict[str, Array]:
    """Return what each sensor reported as arrays with a period axis; without what is empty."""
    names = measurements[0]._fields
    return _without_empty({n: np.array([vars(m)[n] for m in measurements]) for n in names})


def _fields(tuples: list[Any]) -> dict[str, Array]:
    """Return the named tuples' fields as arrays with a period axis; without what is empty."""
    if not tuples[0]:
        return {}
    names, columns = tuples[0]._fields, zip(*tuples, strict=True)
    return _without_empty({n: np.array(c, float) for n, c in zip(names, columns, strict=True)})


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
