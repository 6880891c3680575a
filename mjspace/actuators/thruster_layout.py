"""Where on/off thrusters are and which way they push: what the tables of all kinds have."""

from typing import Annotated, Any, ClassVar, Literal, Self

import mujoco
import numpy as np
from pydantic import Field, model_validator

from mjspace.actuators.base import ActuatorTable
from mjspace.contract import Array
from mjspace.scenario.equipment import Driven
from mjspace.scenario.fields import (
    Each,
    EachNonNegative,
    Meters3,
    Si,
    Table,
    Unit3,
    of_each,
    refuse_other_count,
)
from mjspace.vehicle.composition import bus_of
from mjspace.vehicle.vehicle import Vehicle

_HIDDEN = 5  # a group of sites that no picture shows
_NOZZLE_AND_PLUME = (
    # name, shape, size [m], how far out its centre is [m], color
    ("nozzle", mujoco.mjtGeom.mjGEOM_CYLINDER, [0.03, 0.035, 0.0], 0.03, [0.15, 0.15, 0.17, 1.0]),
    ("plume", mujoco.mjtGeom.mjGEOM_ELLIPSOID, [0.06, 0.06, 0.26], 0.3, [0.5, 0.72, 1.0, 0.0]),
)


class ThrusterTable(ActuatorTable, Table):
    """Base of on/off thrusters' tables: alike but for what is a list with a number for each."""

    each: ClassVar[tuple[str, ...]] = ("thrust", "minimum_on")
    """The keys that may be such lists."""

    positions: Annotated[list[Meters3], Field(min_length=1)]
    """Where each pushes, body axes."""
    directions: list[Unit3]
    """Of each one's force on the vehicle, body axes; normalized."""
    thrust: Annotated[Each, Si("N")]
    """Of each, steady."""
    minimum_on: Annotated[EachNonNegative, Si("s")] = 0.0
    """A valve that opens stays open at least that long, even if commanded for less."""
    burns: Literal["within_period", "to_the_end"] = "within_period"
    """What is left of an on-time at the end of its control period: cut off; or burnt in the periods
    that follow, in which a longer on-time lengthens the burn, a shorter one or zero leaves it, and
    a negative one shuts the valve."""

    @model_validator(mode="after")
    def _one_for_each(self) -> Self:
        if len(self.directions) != len(self.positions):
            raise ValueError(
                f"directions: {len(self.directions)} rows for {len(self.positions)} positions: "
                "give as many"
            )
        for key in self.each:
            refuse_other_count(key, getattr(self, key), len(self.positions), "positions")
        return self

    @property
    def unit_directions(self) -> list[list[float]]:
        """``directions``, each of length one."""
        rows = np.array(self.directions)
        unit: list[list[float]] = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).tolist()
        return unit

    @property
    def to_the_end(self) -> float:
        """Whether a burn may be longer than a control period, 1.0 or 0.0, as kernels read it."""
        return float(self.burns == "to_the_end")

    def of_each(self, key: str) -> Array:
        """Return the numbers of each thruster under a ``key``, shape (n,)."""
        return of_each(getattr(self, key), len(self.positions))

    def attach(self, spec: Any) -> None:
        """Add a site, a motor, a nozzle and a plume for each thruster."""
        spec.add_material(name="thruster", emission=0.8)
        places = zip(self.positions, self.unit_directions, strict=True)
        for name, (place, way) in zip(names(len(self.positions)), places, strict=True):
            _attach_thruster(spec, name, place, way)

    def driven(self, model: Any) -> Driven:
        """Return their motors."""
        return Driven(motors=names(len(self.positions)))

    def facts(self, vehicle: Vehicle) -> dict[str, Any]:
        """Return where each thruster pushes and how, its force [N] and its shortest pulse [s].

        The shortest pulse is one number where it is that of all.
        """
        shortest = self.minimum_on
        return {
            "thruster_positions": np.array(self.positions),
            "thruster_directions": np.array(self.unit_directions),
            "thruster_force": self.of_each("thrust"),
            "thruster_minimum_on": np.array(shortest) if isinstance(shortest, list) else shortest,
        }


def names(count: int) -> tuple[str, ...]:
    """Return the names of that many thrusters' motors."""
    return tuple(f"thruster_{index}" for index in range(count))


def _attach_thruster(spec: Any, name: str, place: list[float], way: list[float]) -> None:
    """Let a thruster push on the bus at its place; its plume is hidden until a picture shows it."""
    bus = bus_of(spec)
    bus.add_site(name=name, pos=place, group=_HIDDEN)
    site = {"trntype": mujoco.mjtTrn.mjTRN_SITE, "target": name}
    spec.add_actuator(name=name, gear=[*way, 0.0, 0.0, 0.0], **site)
    out = -np.array(way)
    for drawn, kind, size, ahead, color in _NOZZLE_AND_PLUME:
        geom = bus.add_geom(type=kind, size=size, pos=place + ahead * out, rgba=color)
        geom.name, geom.group, geom.mass = f"{name}_{drawn}", 2, 0.0
        geom.contype = geom.conaffinity = 0
        geom.material = "thruster" if drawn == "plume" else ""
        mujoco.mju_quatZ2Vec(geom.quat, out)
