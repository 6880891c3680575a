"""What touches the ground: each foot and the hull, how fast it came, and whether it crashed."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array, Event, Measurement

FOOT, HULL = "ground_foot_", "ground_hull_"
"""Beginnings of the names of the sensors that count a body's contacts with the ground."""
FORCE = "_force"
"""Ending of the name of the sensor beside each, of the net force of those contacts."""
SINKS = 0.005
"""m that a vehicle may begin below the surface: standing still, its pads are 1 mm deep."""

_FIRST, _NET_FORCE = 0, 3  # a contact sensor's ``reduce``: none and netforce
_HIGH = 1e5  # m, above any ground


def add_sensors(spec: Any, ground: str) -> None:
    """Let each body of the vehicle that can touch the geom ``ground`` show that it does.

    A body on a landing leg's strut is a foot, any other is part of the hull.
    """
    for body in spec.bodies:
        if body.name == "world" or not any(geom.contype for geom in body.geoms):
            continue
        foot = any(joint.name.endswith("_strut") for joint in body.joints)
        name = f"{FOOT if foot else HULL}{body.name}"
        for ending, shows, reduced in (
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
                intprm=[1 << int(shows), reduced, 1],
            )


@dataclass(frozen=True)
class GroundContact:
    """The contacts of a batch of vehicles with the ground; all memory in the state.

    The state's fields, (N, ...): "ground_foot" and "ground_hull", 1.0 while it touches;
    "ground_touched" and "ground_crashed", 1.0 from the first time on; "touchdown_velocity" and
    "crash_velocity", the bus's, inertial axes [m/s], one integration step before that, and until
    then the velocity of now. A crash is a hull that touches, or a strut pressed beyond its stroke.
    """

    feet: Any
    """Of each foot, the index of its number of contacts in ``sensordata``, shape (f,)."""
    hull: Any
    """Of each part of the hull, likewise, shape (h,)."""
    force: Any
    """Of each foot and then each part of the hull, the indices of its force, shape (f + h, 3)."""
    names: tuple[str, ...]
    """Of the feet."""
    struts: Any
    """Where the legs' struts are in a row of the integration state."""
    stroke: Array
    """By how much each can be pressed [m], shape (f,)."""
    velocity: slice
    """Where the bus's velocity is."""

    def reset(self, physics: Array) -> dict[str, Array]:
        """Return the state at the start, before it is known what touches."""
        none, velocity = np.zeros((len(physics), 1)), physics[:, self.velocity]
        return {
            "ground_foot": np.zeros((len(physics), len(self.feet))),
            "ground_hull": none,
            "ground_touched": none,
            "ground_crashed": none,
            "touchdown_velocity": velocity,
            "crash_velocity": velocity,
        }

    def update(
        self, state: dict[str, Array], physics: Array, sensordata: Array, now: float
    ) -> tuple[dict[str, Array], list[Event]]:
        """Return the state with what touches at ``now`` [s], and the events of that.

        ``physics`` (N, nstate) are the rows of ``now``, which ``sensordata`` describes as well.
        """
        foot: Any = sensordata[:, self.feet] > 0.0
        hull: Any = (sensordata[:, self.hull] > 0.0).any(axis=1, keepdims=True)
        crushed: Any = physics[:, self.struts] > self.stroke
        touches = hull | foot.any(axis=1, keepdims=True)
        crashes = hull | crushed.any(axis=1, keepdims=True)
        touched, crashed = state["ground_touched"] > 0.0, state["ground_crashed"] > 0.0
        down, broken = touches & ~touched, crashes & ~crashed
        velocity = physics[:, self.velocity]
        after = state | {
            "ground_foot": foot.astype(float),
            "ground_hull": hull.astype(float),
            "ground_touched": (touched | touches).astype(float),
            "ground_crashed": (crashed | crashes).astype(float),
            "touchdown_velocity": np.where(
                touched | touches, state["touchdown_velocity"], velocity
            ),
            "crash_velocity": np.where(crashed | crashes, state["crash_velocity"], velocity),
        }
        happened = []
        for vehicle in np.flatnonzero(down[:, 0]):
            parts = [self.names[i] for i in np.flatnonzero(foot[vehicle])]
            parts += ["hull"] if hull[vehicle, 0] else []
            speed = _described(after["touchdown_velocity"][vehicle])
            text = f"first contact with the ground: {', '.join(parts)}, at {speed}"
            happened.append(Event(now, int(vehicle), "INFO", text))
        for vehicle in np.flatnonzero(broken[:, 0]):
            text = "the hull hits the ground"
            if not hull[vehicle, 0]:
                i = int(np.argmax(crushed[vehicle]))
                text = f"{self.names[i]} is pressed beyond its stroke of {self.stroke[i]:g} m"
            text = f"crash: {text}, at {_described(after['crash_velocity'][vehicle])}"
            happened.append(Event(now, int(vehicle), "ERROR", text))
        return after, happened

    def seen(self, state: dict[str, Array], truth: Measurement) -> Measurement:
        """Return the truth with what touches the ground."""
        foot, hull = state["ground_foot"], state["ground_hull"]
        stands = (foot.sum(axis=-1, keepdims=True) >= 2.0) | (hull > 0.0)
        return truth._replace(contact=stands.astype(float), foot_contact=foot, hull_contact=hull)

    def logged(self, state: dict[str, Array], sensordata: Array) -> dict[str, Array]:
        """Return what /truth shows besides."""
        force = np.linalg.norm(sensordata[..., self.force], axis=-1)
        return {
            "foot_force": force[..., : len(self.feet)],
            "hull_force": force[..., len(self.feet) :].sum(axis=-1, keepdims=True),
            "touchdown_velocity": state["touchdown_velocity"],
            "crash": state["ground_crashed"],
            "crash_velocity": state["crash_velocity"],
        }


def of(model: Any, struts: Any, velocity: slice) -> GroundContact | None:
    """Return the contacts of a model that has a ground, with its columns; None without."""
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
        ValueError: what would be how deep.
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
