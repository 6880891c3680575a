"""The motors of a user's own model: reaction wheels, thrusters, and whatever else it has."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mjspace.actuators.base import Actuator, Fields, Input, Limits, State, motors
from mjspace.actuators.reaction_wheels import ReactionWheels
from mjspace.contract import Array, Measurement
from mjspace.vehicle import stability
from mjspace.vehicle.roles import Motor, places_and_directions
from mjspace.vehicle.vehicle import Vehicle


def actuators_of(vehicle: Vehicle, *, alone: bool) -> tuple[Actuator, ...]:
    """Return the actuators of the model's own motors; none where it has none.

    Warns:
        ModelWarning: there is nothing but wheels, and axes about which they give no torque;
            ``alone``: nothing is bolted on.
    """
    own = vehicle.own
    kinds: list[Actuator] = []
    if own.wheels:
        wheels = _wheels(vehicle)
        if alone and not (own.thrusters or own.others):
            wheels.warn_of_unreachable("the axes of the model's wheels")
        kinds.append(wheels)
    if own.thrusters:
        kinds.append(ModelThrusters(own.thrusters))
    if own.others:
        kinds.append(ModelMotors(own.others))
    return tuple(kinds)


def facts_of(vehicle: Vehicle) -> dict[str, Any]:
    """Return what a law that leaves out a gain of that name takes from the model's thrusters."""
    thrusters = vehicle.own.thrusters
    if not thrusters:
        return {}
    places, ways = places_and_directions(vehicle.model, thrusters)
    return {
        "thruster_positions": places,
        "thruster_directions": ways,
        "thruster_force": np.array([each.largest for each in thrusters]),
    }


def _wheels(vehicle: Vehicle) -> ReactionWheels:
    count = len(vehicle.own.wheels)
    return ReactionWheels(
        vehicle.wheel_axes[:count],
        np.array([each.either_way for each in vehicle.own.wheels]),
        inertia=stability.inertia_at_joints(vehicle.model)[vehicle.wheel_dof[:count]],
        names=tuple(each.name for each in vehicle.own.wheels),
    )


@dataclass(frozen=True)
class Clipped(Actuator):
    """Motors that obey a command for each at once, within their limits."""

    each: tuple[Motor, ...]
    """In the order of the command's numbers."""
    field: ClassVar[str]
    """Of the command."""

    @property
    def takes(self) -> Fields:
        """Their field of the command."""
        return {self.field: (len(self.each), self.unit)}

    @property
    def drives(self) -> Input:
        """The motors."""
        return motors(motor.name for motor in self.each)

    def limits(self) -> Limits:
        """Return their limits."""
        least = np.array([motor.least for motor in self.each])
        return {self.field: (least, np.array([motor.largest for motor in self.each]))}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, the command within its limits, 1.0 where that is another)."""
        desired = getattr(command, self.field)
        least, largest = self.limits()[self.field]
        applied = np.minimum(np.maximum(desired, least), largest)
        return state, applied, np.where(applied != desired, 1.0, 0.0)


@dataclass(frozen=True)
class ModelThrusters(Clipped):
    """Forces at sites that are throttled: each pushes with the commanded force [N]."""

    field: ClassVar[str] = "thruster_force"
    logged_as: ClassVar[str] = "applied_force"
    unit: ClassVar[str] = "N"


@dataclass(frozen=True)
class ModelMotors(Clipped):
    """All other motors: each gets the commanded number as MuJoCo's ``ctrl``, in its own unit."""

    field: ClassVar[str] = "control"
    logged_as: ClassVar[str] = "applied_control"
    unit: ClassVar[str] = ""
