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


@dataclass
class Recording:
    """The control periods of a block, of which the last may end early."""

    first: int
    """Number of the first period."""
    reference: DesiredMotion
    """Arrays of at least as many rows as will be recorded, without a vehicle axis."""
    periods: list[ControlPeriod] = field(default_factory=list)

    def __len__(self) -> int:
        """Return the number of periods."""
        return len(self.periods)

    def _column(self, name: str) -> list[Any]:
        return list(map(attrgetter(name), self.periods))

    def block(
        self,
        assembly: Assembly,
        layout: StateLayout,
        effects: Sequence[StepEffect],
        saturated_before: Array,
    ) -> Block:
        """Return the recorded periods as rows; ``saturated_before`` (N, m) holds before them."""
        n, vehicle = len(self), assembly.vehicle
        physics = np.array(self._column("physics"))
        data = np.array(self._column("sensordata"))
        reference = {name: a[:n, None] for name, a in self.reference._asdict().items()}
        memory = _stacked(self._column("memory"))
        truth = truth_of(physics, memory, layout, assembly.actuators, effects)
        of_effects: dict[str, Array] = {}
        for effect in effects:
            of_effects |= effect.logged(memory, data)
        state = {"physics": physics}
        state |= {f"actuator_{name}": a for name, a in memory.items()}
        state |= {f"law_{name}": a for name, a in _fields(self._column("law")).items()}
        state |= {f"sensor_{name}": a for name, a in _stacked(self._column("sensors")).items()}
        environment = data[..., vehicle.environment]
        if self.periods[0].wrench is not None:
            environment = environment + np.array(self._column("wrench"))
        rows: Rows = {
            "/state": state,
            "/truth": {
                **_without_empty(truth._asdict()),
                **of_effects,
                "position": physics[..., layout.position],
                "velocity": physics[..., layout.velocity],
                **_position_errors(physics[..., layout.position], truth.attitude, reference),
                "momentum": data[..., vehicle.momentum],
                "energy": data[..., vehicle.kinetic],
                "attitude_error": attitude.rotation_angle(truth.attitude, reference["attitude"])[
                    ..., None
                ],
            },
            "/measurement": _measured(self._column("measurement")),
            "/reference": {
                name: np.broadcast_to(a, (n, physics.shape[1], a.shape[-1]))
                for name, a in reference.items()
            },
            "/command": {
                **_fields(self._column("command")),
                **assembly.actuators.logged(self._column("applied")),
            },
            "/law": _fields(self._column("signals")),
            "/disturbance": {"force": environment[..., :3], "torque": environment[..., 3:]},
        }
        control = assembly.scenario.rates.control
        time = (self.first + np.arange(n, dtype=float)) * control
        events = _saturation_events(
            time,
            np.array(self._column("saturated"), bool),
            saturated_before,
            vehicle.motors,
        )
        events += [event for period in self.periods for event in period.events]
        first = self.periods[0]
        kinds = {
            "/state": type(first.law),
            "/reference": type(self.reference),
            "/command": type(first.command),
            "/law": type(first.signals),
        }
        return Block(self.first, time, {t: f for t, f in rows.items() if f}, events, kinds)


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
