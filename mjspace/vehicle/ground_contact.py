"""What touches the ground: each foot and the hull, how fast it came, and whether it crashed."""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import mujoco
import numpy as np

from mjspace.contract import Array, Event, Measurement
from mjspace.vehicle.step_effect import Instant, State, StepEffect

FOOT, HULL = "ground_foot_", "ground_hull_"
"""Beginnings of the names of the sensors that count a body's contacts with the ground."""
FORCE = "_force"
"""Ending of the name of the sensor beside each, of the net force of those contacts."""
SINKS = 0.005
"""m that a vehicle may begin below the surface: standing still, its pads are 1 mm deep."""

_FIRST, _NET_FORCE = 0, 3  # a contact sensor's ``reduce``: none and netforce
_HIGH = 1e5  # m, above any ground


def add_sensors(spec: Any, ground: str) -> None:
    """Let sensors report the contacts of each body of the vehicle that can touch ``ground``.

    A body on a landing leg's strut is a foot, any other is part of the hull.
    """
    for body in spec.bodies:
        if body.name == "world" or not any(geom.contype for geom in body.geoms):
            continue
        foot = any(joint.name.endswith("_strut") for joint in body.joints)
        name = f"{FOOT if foot else HULL}{body.name}"
        for ending, reported, reduced in (
            ("", mujoco.mjtConDataField.mjCONDATA_FOUND, _FIRST),
            (FORCE, mujoco.mjtConDataField.mjCONDATA_FORCE, _NET_FORCE),
        ):
            spec.add_sensor(
                name=name + ending,
                type=mujoco.mjtSensor.mjSENS_CONTACT,
                objtype=mujoco.mjtObj.mjOBJ_BODY,
                objname=body.name,
                reftype=mujoco.mjtObj.mjOBJ_GEOM,
                refname=ground,
                intprm=[1 << int(reported), reduced, 1],
            )


@dataclass(eq=False)
class GroundContact(StepEffect):
    """The contacts of a batch of vehicles with the ground, looked for at every integration step.

    A crash is a hull that touches, or a strut pressed beyond its stroke.
    """

    name: ClassVar[str] = "the ground contact"
    every_step: ClassVar[bool] = True
    not_compiled = ""
    looks: ClassVar[bool] = True

    feet: Any
    """Of each foot, the index of its number of contacts in ``sensordata``, shape (f,)."""
    hull: Any
    """Of each part of the hull, likewise, shape (h,)."""
    force: Any
    """Of each foot and then each part of the hull, the indices of its force, shape (f + h, 3)."""
    names: tuple[str, ...]
    """Of the feet."""
    struts: Any
    """Columns of the legs' struts in a row of the integration state."""
    stroke: Array
    """By how much each can be pressed [m], shape (f,)."""
    velocity: slice
    """Columns of the bus's velocity, inertial axes, likewise."""
    _batch: Any = field(init=False, repr=False, default=None)
    _sensordata: Any = field(init=False, repr=False, default=None)

    def bind(self, batch: Any) -> None:
        """Take the batch, and its sensors that count contacts."""
        self._batch, self._sensordata = batch, batch.bind("sensordata")

    def reset(self, physics: Array) -> State:
        """Return the state at the start, before it is known what touches.

        Its fields, (N, ...): "ground_foot" and "ground_hull", 1.0 while it touches;
        "ground_touched" and "ground_crashed", 1.0 from the first time on; "touchdown_velocity" and
        "crash_velocity", the bus's, inertial axes [m/s], one integration step before that, and
        until then the present velocity.
        """
        none, velocity = np.zeros((len(physics), 1)), physics[:, self.velocity]
        return {
            "ground_foot": np.zeros((len(physics), len(self.feet))),
            "ground_hull": none,
            "ground_touched": none,
            "ground_crashed": none,
            "touchdown_velocity": velocity,
            "crash_velocity": velocity,
        }

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        """Return the memory with what touches at a control instant."""
        # At stage POS alone, MuJoCo 4.0 computes no kinetic energy in the step that follows.
        self._batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)
        return self._update(memory, physics, time, events)

    def after_step(self, memory: State, instant: Instant) -> State:
        """Return the memory with what touched at ``instant``, if ``observe`` did not look then."""
        if instant.is_control:
            return memory
        return self._update(memory, instant.physics, instant.time, instant.events)

    def _update(self, state: State, physics: Array, now: float, events: list[Event]) -> State:
        """Return the state with what touches at ``now`` [s], and add to the ``events``.

        ``physics`` (N, nstate) are the rows of ``now``, which the sensors describe as well.
        """
        after, report = self.look(state, physics, self._sensordata)
        if report.any():
            events += self._told(state, after, physics, now)
        return after

    def look(self, memory: State, physics: Array, sensordata: Array) -> tuple[State, Array]:
        """Return the memory with what touches now, and where that is a touchdown or a crash."""
        foot: Any = sensordata[:, self.feet] > 0.0
        hull: Any = (sensordata[:, self.hull] > 0.0).any(axis=1, keepdims=True)
        crushed: Any = physics[:, self.struts] > self.stroke
        touched_before, crashed_before = (
            memory[name] > 0.0 for name in ("ground_touched", "ground_crashed")
        )
        touched = touched_before | hull | foot.any(axis=1, keepdims=True)
        crashed = crashed_before | hull | crushed.any(axis=1, keepdims=True)
        velocity = physics[:, self.velocity]
        after = memory | {
            "ground_foot": foot.astype(float),
            "ground_hull": hull.astype(float),
            "ground_touched": touched.astype(float),
            "ground_crashed": crashed.astype(float),
            "touchdown_velocity": np.where(touched, memory["touchdown_velocity"], velocity),
            "crash_velocity": np.where(crashed, memory["crash_velocity"], velocity),
        }
        return after, (touched & ~touched_before) | (crashed & ~crashed_before)

    def _told(self, before: State, after: State, physics: Array, now: float) -> list[Event]:
        """Return the touchdowns and crashes that are new ``after`` and not in ``before``."""
        events = []
        for vehicle in np.flatnonzero(after["ground_touched"] > before["ground_touched"]):
            parts = [self.names[i] for i in np.flatnonzero(after["ground_foot"][vehicle])]
            parts += ["hull"] if after["ground_hull"][vehicle, 0] else []
            speed = _described(after["touchdown_velocity"][vehicle])
            text = f"first contact with the ground: {', '.join(parts)}, at {speed}"
            events.append(Event(now, int(vehicle), "INFO", text))
        for vehicle in np.flatnonzero(after["ground_crashed"] > before["ground_crashed"]):
            text = "the hull hits the ground"
            if not after["ground_hull"][vehicle, 0]:
                i = int(np.argmax(physics[vehicle, self.struts] > self.stroke))
                text = f"{self.names[i]} is pressed beyond its stroke of {self.stroke[i]:g} m"
            text = f"crash: {text}, at {_described(after['crash_velocity'][vehicle])}"
            events.append(Event(now, int(vehicle), "ERROR", text))
        return events

    def add_to_truth(self, memory: State, truth: Measurement) -> Measurement:
        """Return the truth with what touches the ground."""
        foot, hull = memory["ground_foot"], memory["ground_hull"]
        stands = (foot.sum(axis=-1, keepdims=True) >= 2.0) | (hull > 0.0)
        return truth._replace(contact=stands.astype(float), foot_contact=foot, hull_contact=hull)

    def logged(self, memory: State, sensordata: Array) -> dict[str, Array]:
        """Return the forces of the contacts, and how it touched down or crashed."""
        force = np.linalg.norm(sensordata[..., self.force], axis=-1)
        return {
            "foot_force": force[..., : len(self.feet)],
            "hull_force": force[..., len(self.feet) :].sum(axis=-1, keepdims=True),
            "touchdown_velocity": memory["touchdown_velocity"],
            "crash": memory["ground_crashed"],
            "crash_velocity": memory["crash_velocity"],
        }


def of(model: Any, struts: Any, velocity: slice) -> GroundContact | None:
    """Return the contacts of a ``model`` with its ground; None where it has none.

    ``struts`` and ``velocity`` are columns of the integration state, as ``GroundContact`` has them.
    """
    sensors = [model.sensor(i) for i in range(model.nsensor)]
    counts = [s for s in sensors if s.name.startswith((FOOT, HULL)) and not s.name.endswith(FORCE)]
    if not counts:
        return None
    feet = [s for s in counts if s.name.startswith(FOOT)]
    hull = [s for s in counts if s.name.startswith(HULL)]
    force = [model.sensor(s.name + FORCE).adr[0] for s in feet + hull]
    legs = [model.joint(i) for i in range(model.njnt)]
    return GroundContact(
        feet=np.array([s.adr[0] for s in feet], dtype=int),
        hull=np.array([s.adr[0] for s in hull], dtype=int),
        force=np.array(force, dtype=int)[:, None] + np.arange(3),
        names=tuple(s.name.removeprefix(FOOT) for s in feet),
        struts=struts,
        stroke=np.array([leg.user[0] for leg in legs if leg.name.endswith("_strut")]),
        velocity=velocity,
    )


def refuse_buried(model: Any, qpos: Array) -> None:
    """Refuse a vehicle that would begin in the ground: it would be shot up.

    Raises:
        ValueError: a geom is too deep in the ground, with its depth.
    """
    data = mujoco.MjData(model)
    data.qpos = qpos
    mujoco.mj_fwdPosition(model, data)
    deep = {geom: -c.dist for c in data.contact for geom in c.geom if model.geom_contype[geom]}
    for surface in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_HFIELD):
        for geom in np.flatnonzero(model.geom_contype):  # too deep to touch a field of heights
            above = np.array([*data.geom_xpos[geom, :2], _HIGH])
            way = mujoco.mj_rayHfield(model, data, surface, above, np.array([0.0, 0.0, -1.0]))
            if way >= 0.0:
                depth = _HIGH - way - data.geom_xpos[geom, 2]
                deep[geom] = max(depth, deep.get(geom, depth))
    for geom in sorted(deep, key=lambda geom: -deep[geom])[:1]:
        if deep[geom] > SINKS:
            raise ValueError(
                f"the vehicle begins in the ground: its geom {model.geom(geom).name!r} is "
                f"{deep[geom]:.4g} m deep, should be less than {SINKS:g} m: start higher"
            )


def _described(velocity: Array) -> str:
    """Return the speed and the velocity as a person reads them."""
    return f"{np.linalg.norm(velocity):.4g} m/s ({' '.join(f'{v:.4g}' for v in velocity)})"
