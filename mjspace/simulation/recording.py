"""What a flight records: a list entry for each control period, turned into rows block by block."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import TICK, Array, DesiredMotion, Event, Measurement
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.state_layout import StateLayout

Rows = dict[str, dict[str, Array]]


@dataclass(frozen=True)
class Block:
    """Consecutive control periods: ``rows[topic][field]`` is (n, N, ...), ``time`` (n,) [s]."""

    period: int
    """Of the first row."""
    time: Array
    rows: Rows
    events: list[Event]


def one_vehicle(block: Block, vehicle: int = 0) -> Rows:
    """Return the block's rows without the vehicle axis."""
    return {t: {f: a[:, vehicle] for f, a in fields.items()} for t, fields in block.rows.items()}


def shapes(block: Block) -> dict[str, dict[str, tuple[int, ...]]]:
    """Return the shape of each field for one vehicle at one time."""
    return {t: {f: a.shape[2:] for f, a in fields.items()} for t, fields in block.rows.items()}


def until_trouble(block: Block, columns: StateLayout) -> tuple[Block, str]:
    """Return the block up to the first value that cannot be flown, and which it is ('' if none).

    A law may well signal infinity; what must be good is the motion and what acts on it.
    """
    acting = {
        "/state.physics": block.rows["/state"]["physics"][..., columns.moving],
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
    return Block(block.period, block.time[:first], rows, events), problem


@dataclass
class Recording:
    """One list entry for each control period of a block; arrays have a vehicle axis."""

    period: int
    reference: DesiredMotion
    """Arrays of at least as many rows as will be recorded, without a vehicle axis."""
    physics: list[Array] = field(default_factory=list)
    actuators: list[dict[str, Array]] = field(default_factory=list)
    sensors: list[dict[str, Array]] = field(default_factory=list)
    law: list[Any] = field(default_factory=list)
    measurement: list[Measurement] = field(default_factory=list)
    command: list[Any] = field(default_factory=list)
    given: list[tuple[Array, ...]] = field(default_factory=list)
    saturated: list[Array] = field(default_factory=list)
    signals: list[Any] = field(default_factory=list)
    push: list[Array] = field(default_factory=list)
    sensordata: list[Array] = field(default_factory=list)
    happened: list[Event] = field(default_factory=list)

    def __len__(self) -> int:
        """Return the number of whole periods: the sensor data is recorded last."""
        return len(self.sensordata)

    def block(self, assembly: Assembly, columns: StateLayout, saturated_before: Array) -> Block:
        """Return the recorded periods as rows."""
        n, vehicle = len(self), assembly.vehicle
        physics = np.array(self.physics[:n])
        data = np.array(self.sensordata)
        reference = {name: a[:n, None] for name, a in self.reference._asdict().items()}
        actuators = {
            name: np.array([s[name] for s in self.actuators[:n]]) for name in self.actuators[0]
        }
        truth = assembly.actuators.seen(actuators, columns.truth(physics))
        on_ground = {}
        if columns.ground is not None:
            truth = columns.ground.seen(actuators, truth)
            on_ground = columns.ground.logged(actuators, data)
        state = {"physics": physics}
        state |= {f"actuator_{name}": a for name, a in actuators.items()}
        state |= {f"law_{name}": a for name, a in _fields(self.law[:n]).items()}
        state |= {
            f"sensor_{name}": np.array([s[name] for s in self.sensors[:n]])
            for name in self.sensors[0]
        }
        environment = data[..., vehicle.environment]
        if self.push:
            environment = environment + np.array(self.push[:n])
        rows: Rows = {
            "/state": state,
            "/truth": {
                **_without_empty(truth._asdict()),
                **on_ground,
                "position": physics[..., columns.position],
                "velocity": physics[..., columns.velocity],
                **_about_the_place(physics[..., columns.position], truth.attitude, reference),
                "momentum": data[..., vehicle.momentum],
                "energy": data[..., vehicle.kinetic],
                "attitude_error": attitude.rotation_angle(truth.attitude, reference["attitude"])[
                    ..., None
                ],
            },
            "/measurement": _without_empty(
                {
                    name: np.array([vars(measured)[name] for measured in self.measurement[:n]])
                    for name in self.measurement[0]._fields
                }
            ),
            "/reference": {
                name: np.broadcast_to(a, (n, physics.shape[1], a.shape[-1]))
                for name, a in reference.items()
            },
            "/command": {
                **_fields(self.command[:n]),
                **assembly.actuators.logged(self.given[:n]),
            },
            "/law": _fields(self.signals[:n]),
            "/disturbance": {"force": environment[..., :3], "torque": environment[..., 3:]},
        }
        control = assembly.scenario.rates.control
        time = (self.period + np.arange(n, dtype=float)) * control
        events = _saturation_events(
            time, np.array(self.saturated[:n], bool), saturated_before, vehicle.motors
        )
        # Also those within the last period; a period that could not be recorded has none.
        end = time[-1] + control - TICK
        events += [event for event in self.happened if event.time < end]
        return Block(self.period, time, {t: f for t, f in rows.items() if f}, events)


def _about_the_place(
    position: Array, quaternion: Array, reference: dict[str, Array]
) -> dict[str, Array]:
    """Return, for a vehicle that is wanted somewhere, how far it is from there, and how upright.

    The tilt [rad] is between the body's z and the world's.
    """
    if "position" not in reference:
        return {}
    lean = np.sqrt(quaternion[..., 1] ** 2 + quaternion[..., 2] ** 2)
    tilt = 2.0 * np.arcsin(np.minimum(lean, 1.0))
    return {"position_error": position - reference["position"], "tilt": tilt[..., None]}


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
