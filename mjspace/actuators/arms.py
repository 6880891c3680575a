"""Robotic arms on the bus: links on hinges in a row, each turned by a torque motor."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from typing import Annotated, Any, ClassVar

import mujoco
import numpy as np
from pydantic import ConfigDict, Field, RootModel

from mjspace.actuators.base import ActuatorTable, Context
from mjspace.actuators.model_motors import Clipped
from mjspace.contract import Array
from mjspace.scenario.equipment import Driven
from mjspace.scenario.fields import Name, Positive, Si, Table, Unit3
from mjspace.scenario.mounted import Mounted
from mjspace.vehicle.composition import bolt
from mjspace.vehicle.moving_parts import new_part, set_inertia
from mjspace.vehicle.roles import Motor
from mjspace.vehicle.vehicle import Vehicle

_HINGE = 1.6  # radius of what is drawn at a hinge, in radii of its link


class Link(Table):
    """A link: a uniform cylinder along its x axis, behind the hinge at its inboard end."""

    length: Annotated[Positive, Si("m")]
    """From its hinge to the next, or to the arm's tip."""
    mass: Annotated[Positive, Si("kg")]
    radius: Annotated[Positive, Si("m")]
    axis: Unit3 = [0.0, 0.0, 1.0]
    """Of its hinge, in the link's axes; those of all links are the arm's while its angles are
    zero."""
    torque_limit: Annotated[Positive, Si("N m")] | None = None
    """Largest torque of its motor, which has its reaction on what carries the hinge; none when left
    out."""

    @property
    def inertia(self) -> Array:
        """Moments about its centre of mass, along it and across it [kg m^2], (3,)."""
        across = (3.0 * self.radius**2 + self.length**2) / 12.0
        return self.mass * np.array([0.5 * self.radius**2, across, across])


class Arm(Mounted):
    """An arm that extends along its x axis while its angles are zero, the shoulder in its origin.

    Its mass counts as that of ``plant.parts`` does.
    """

    links: Annotated[list[Link], Field(min_length=1)]
    """From the shoulder to the tip."""

    def build(self) -> Any:
        """Return the ``MjSpec`` of links ``link_0``, ... on hinges and motors ``joint_0``, ...."""
        part = new_part()
        tube = part.add_material(name="tube", rgba=[0.86, 0.87, 0.9, 1.0], specular=0.3)
        hub = part.add_material(name="hub", rgba=[0.2, 0.21, 0.24, 1.0], specular=0.6)
        body, reach = part.worldbody, 0.0
        for number, link in enumerate(self.links):
            body = body.add_body(name=f"link_{number}", pos=[reach, 0.0, 0.0])
            reach, r = link.length, link.radius
            set_inertia(body, link.mass, np.array([0.5 * reach, 0.0, 0.0]), link.inertia)
            joint = body.add_joint(name=f"joint_{number}", axis=link.axis)
            motor = part.add_actuator(
                name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
            )
            motor.set_to_motor()
            body.add_geom(size=[_HINGE * r, 0.0, 0.0], material=hub.name)
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                size=[r, 0.0, 0.0],
                fromto=[0.0, 0.0, 0.0, reach, 0.0, 0.0],
                material=tube.name,
            )
        return part


class Arms(ActuatorTable, RootModel[dict[Name, Arm]]):
    """The arms of a vehicle, by a name of one's own."""

    model_config = ConfigDict(frozen=True)
    # Those take every gimbal of the vehicle to be theirs.
    excludes: ClassVar[tuple[str, ...]] = ("drives", "servos", "engine")

    @property
    def fitted(self) -> bool:
        """Whether there are any."""
        return bool(self.root)

    def attach(self, spec: Any) -> None:
        """Bolt each arm to the bus."""
        for name, arm in self.root.items():
            bolt(spec, arm.build(), name, arm)

    def driven(self, model: Any) -> Driven:
        """Return their motors, whose hinges are measured as gimbals."""
        names = tuple(name for name, _ in self._joints())
        return Driven(motors=names, gimbals=names)

    def facts(self, vehicle: Vehicle) -> dict[str, Any]:
        """Return length, mass and inertia across of each link, in the order of the joints."""
        links = [link for _, link in self._joints()]
        return {
            "link_length": np.array([link.length for link in links]),
            "link_mass": np.array([link.mass for link in links]),
            "link_inertia": np.array([link.inertia[1] for link in links]),
        }

    def actuator(self, context: Context) -> "JointMotors":
        """Return their motors."""
        limits = ((name, link.torque_limit or inf) for name, link in self._joints())
        return JointMotors(tuple(Motor(name, name, -limit, limit) for name, limit in limits))

    def _joints(self) -> Iterator[tuple[str, Link]]:
        """Yield each joint's name and link, arm by arm, from the shoulder to the tip."""
        for name, arm in self.root.items():
            for number, link in enumerate(arm.links):
                yield f"{name}_joint_{number}", link


@dataclass(frozen=True)
class JointMotors(Clipped):
    """Torque motors of arms: each applies the commanded torque [N m] within its limit."""

    field: ClassVar[str] = "joint_torque"
    logged_as: ClassVar[str] = "applied_joint_torque"
    unit: ClassVar[str] = "N m"
