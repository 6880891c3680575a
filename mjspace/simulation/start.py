"""What of an assembly depends on where the scenario starts: coordinates and actuators."""

import numpy as np

from mjspace.actuators import model_motors
from mjspace.actuators.actuator_set import ActuatorSet
from mjspace.actuators.base import Context
from mjspace.contract import Array
from mjspace.errors import input_error_at
from mjspace.scenario.scenario import Scenario
from mjspace.vehicle import deployments, ground_contact, other_spacecraft
from mjspace.vehicle.vehicle import Vehicle, driven_by, initial_state


def coordinates(vehicle: Vehicle, scenario: Scenario) -> tuple[Array, Array]:
    """Return (qpos (nq,), qvel (nv,)) at time zero.

    Raises:
        InputError: the vehicle cannot start there.
    """
    with input_error_at("initial"):
        qpos, qvel = initial_state(vehicle, scenario.initial)
    deployments.stow(vehicle.model, qpos, scenario.plant.parts)
    with input_error_at("plant"):
        other_spacecraft.set_states(vehicle.model, scenario.plant, qpos, qvel)
    if scenario.plant.ground is not None:
        with input_error_at("initial.position"):
            ground_contact.refuse_buried(vehicle.model, qpos)
    return qpos, qvel


def actuators(vehicle: Vehicle, scenario: Scenario, *, inner: bool) -> ActuatorSet:
    """Return the actuators of all that is fitted to the vehicle, in the order of plant's keys.

    Those of a model of one's own come before. ``inner`` tells whether an inner loop commands them.

    Raises:
        InputError: one cannot be built.
    """
    with input_error_at("plant"):
        return _actuators(vehicle, scenario, inner=inner)


def _actuators(vehicle: Vehicle, scenario: Scenario, *, inner: bool) -> ActuatorSet:
    tables, gravity = scenario.plant.equipment, _gravity(scenario)
    kinds = model_motors.actuators_of(vehicle, alone=not any(t.fitted for t in tables.values()))
    alone = len(tables) == 1 and not kinds
    driven = driven_by(vehicle.model, scenario.plant, vehicle.own.driven)
    for key, table in tables.items():
        with input_error_at(f"plant.{key}"):
            context = Context(
                vehicle, driven[key], scenario.rates, scenario.initial, gravity, inner, kinds, alone
            )
            kinds += (table.actuator(context),)
    return ActuatorSet(kinds)


def _gravity(scenario: Scenario) -> float:
    """Return the central gravity where the vehicle starts [m/s^2]; 0 without."""
    if (around := scenario.environment.gravity) is None:
        return 0.0
    place = np.array(scenario.initial.position, dtype=float)
    return float(np.linalg.norm(around.acceleration(place)))
