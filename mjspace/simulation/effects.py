"""The step effects of a scenario, in the order in which they act."""

from collections.abc import Sequence

from mjspace.simulation.actuator_faults import ActuatorFaults
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.burning_mass import BurningMass
from mjspace.simulation.connections import Connections
from mjspace.simulation.hysteresis import Hysteresis
from mjspace.simulation.known_beforehand import KnownBeforehand
from mjspace.simulation.model_sensors import ModelSensors
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.user_disturbance import UserDisturbance
from mjspace.vehicle import deployments, ground_contact
from mjspace.vehicle.moving_parts import LoggedParts, reports
from mjspace.vehicle.step_effect import StepEffect


def effects_of(
    assembly: Assembly, layout: StateLayout, members: Sequence[int]
) -> tuple[StepEffect, ...]:
    """Return new effects, not yet bound to a batch, for these members of the campaign."""
    scenario, model = assembly.scenario, assembly.vehicle.model
    sensors, around = assembly.vehicle.sensors, scenario.environment.gravity
    gravity = None if around is None else around.acceleration
    burning = BurningMass.of(assembly.actuators)
    every = (
        ground_contact.of(model, layout.struts, layout.velocity),
        burning,
        ModelSensors.of(model, sensors, gravity, burning),
        Connections.of(assembly),
        ActuatorFaults.of(assembly, members),
        KnownBeforehand.of(assembly.known, scenario),
        Hysteresis.of(assembly, layout),
        UserDisturbance.of(assembly, layout),
        LoggedParts.of(model, reports(scenario.plant.moving_parts)),
        deployments.of(model, assembly.qpos, scenario.plant.parts, scenario.rates.physics),
    )
    return tuple(effect for effect in every if effect is not None)
