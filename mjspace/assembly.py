"""From a scenario to everything that flies: vehicle, environment, sensors, actuators, law."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mjspace import addresses, central_gravity, deployments, environment, ground_contact, plant
from mjspace.actuators import Actuators, IdealThrusters
from mjspace.combined_actuators import Together
from mjspace.components import construct, load_object, source_of
from mjspace.contract import Array, Law, ReferenceSource
from mjspace.deployments import Deployments
from mjspace.engine import GimballedEngine
from mjspace.errors import blamed_on
from mjspace.faults import FaultSet
from mjspace.geomagnetism import FieldAlongOrbit, along
from mjspace.gimbal_servos import GimbalServos
from mjspace.landing_tables import Engine
from mjspace.magnetorquers import CoilSet
from mjspace.motor_drives import MotorDrives
from mjspace.one_by_one import OneByOne
from mjspace.plant import Vehicle
from mjspace.reaction_wheels import ReactionWheels
from mjspace.scenario import Component, Scenario
from mjspace.sensors import SensorSuite
from mjspace.tables import PlantTable
from mjspace.thrusters import Thrusters


@dataclass(frozen=True)
class Assembly:
    """What a scenario describes, built: nothing in it changes while it flies."""

    scenario: Scenario
    """As flown: with every gain of the law and the reference written out."""
    vehicle: Vehicle
    qpos: Array
    """At time zero, (nq,)."""
    qvel: Array
    """At time zero, (nv,)."""
    userdata: Array
    """The environment's parameters, one row (nuserdata,)."""
    field: FieldAlongOrbit | None
    """The Earth's magnetic field where the vehicle goes; None where there is none."""
    actuators: Together
    reference: ReferenceSource
    law: Law
    deployed: Callable[[Any], Deployments] | None
    """Makes a batch's deployments; None where nothing is deployed."""
    disturbance: Callable[..., tuple[Any, Any]] | None
    """The user's own Python disturbance."""
    sources: dict[str, str]
    """Texts of the files that define the law, the reference and the disturbance, by role."""

    def sensors(self, members: Sequence[int]) -> SensorSuite:
        """Return the sensors of these members of the campaign, each with its own random streams."""
        scenario = self.scenario
        return SensorSuite(
            scenario.sensors,
            scenario.rates,
            scenario.seed,
            members,
            wheels=len(self.vehicle.wheel_dof),
            gravity=self._gravity,
        )

    @property
    def driven_stepwise(self) -> bool:
        """Whether the actuators act in every integration step; else once in a control period."""
        return hasattr(self.law, "inner") or self.actuators.stateful

    @property
    def hold(self) -> float:
        """For how long what the actuators give is held [s]."""
        rates = self.scenario.rates
        return rates.physics if self.driven_stepwise else rates.control

    def faults(self, members: Sequence[int]) -> FaultSet | None:
        """Return the faults of these members of the campaign; None where nothing goes wrong."""
        scenario = self.scenario
        if not scenario.faults:
            return None
        kinds, motors = self.actuators.kinds, self.vehicle.motors
        return FaultSet(scenario.faults, kinds, motors, self.hold, scenario.seed, members)

    def _gravity(self, position: Array) -> Array:
        """Return the central gravity [m/s^2] at ``position`` [m], both (..., 3)."""
        table = self.scenario.environment.gravity
        if table is None:
            return np.zeros_like(position)
        return central_gravity.acceleration(central_gravity.pack(table), position)


def assemble(scenario: Scenario, folder: Path, *, law_folder: Path | None = None) -> Assembly:
    """Return the scenario's assembly; ``folder`` is where the files that it names are.

    The law's own file is in ``law_folder``, where that is given.

    Raises:
        InputError: a part cannot be built, with the scenario's key and what would be right.
    """
    friction = _friction(scenario.plant)
    ripple = scenario.plant.ripple
    size = environment.userdata_size(scenario.environment, friction, ripple)
    vehicle = _part("plant", partial(plant.build, userdata=size), scenario.plant, scenario.rates)
    facts = {
        "inertia": vehicle.inertia,
        "wheel_axes": vehicle.wheel_axes,
        "wheel_inertia": vehicle.wheel_inertia,
        "control_period": scenario.rates.control,
        "inner_period": scenario.rates.physics,
        **_of_thrusters(scenario.plant),
        **_of_gimbals(scenario.plant, vehicle),
    }
    flown: dict[str, Any] = {}
    sources = {}
    law, flown["law"], sources["law"] = _component("law", scenario.law, facts, law_folder or folder)
    reference, flown["reference"], sources["reference"] = _component(
        "reference", scenario.reference, facts, folder
    )
    disturbance = None
    kind = scenario.environment.python
    if kind is not None:
        disturbance = _part("environment.python", load_object, kind, folder)
        sources["disturbance"] = source_of(disturbance)
        flown["environment"] = scenario.environment.model_copy(
            update={"python": _in_log("disturbance", kind)}
        )
    qpos, qvel = _part("initial", plant.initial_state, vehicle, scenario.initial)
    parts = scenario.plant.parts
    deployments.stow(vehicle.model, qpos, parts)
    if scenario.plant.ground is not None:
        _part("initial.position", ground_contact.refuse_buried, vehicle.model, qpos)
    assembly = Assembly(
        scenario=scenario.model_copy(update=flown),
        vehicle=vehicle,
        qpos=qpos,
        qvel=qvel,
        userdata=_part(
            "environment",
            environment.userdata,
            vehicle.model,
            scenario.environment,
            friction,
            ripple,
        ),
        field=_part("environment", along, scenario.environment, scenario.rates, scenario.duration),
        actuators=_part("plant", _actuators, vehicle, scenario),
        reference=reference,
        law=law if getattr(law, "batched", False) else OneByOne(law),
        deployed=deployments.of(vehicle.model, qpos, parts, scenario.rates.physics),
        disturbance=disturbance,
        sources=sources,
    )
    _part("sensors", assembly.sensors, [0])
    _part("faults", assembly.faults, [0])
    return assembly


def _component(
    role: str, component: Component, facts: dict[str, Any], folder: Path
) -> tuple[Any, Component, str]:
    """Return the law or reference, its table as flown, and the text that defines it."""
    with blamed_on(role):
        kind = load_object(component.kind, folder)
        built, flown = construct(component, kind, facts, folder)
    flown = flown.model_copy(update={"kind": _in_log(role, component.kind)})
    return built, flown, source_of(kind)


def _in_log(role: str, kind: str) -> str:
    """Return ``kind`` as the log knows it, where a file of one's own is attached as <role>.py."""
    place, _, name = kind.partition(":")
    return f"{role}.py:{name}" if place.endswith(".py") else kind


def _actuators(vehicle: Vehicle, scenario: Scenario) -> Together:
    table, rates, kinds = scenario.plant, scenario.rates, list[Actuators]()
    if table.drives:
        driven = [table.drives[name] for name in vehicle.motors if name in table.drives]
        kinds.append(MotorDrives.of(vehicle, driven))
    if table.servos is not None:
        kinds.append(GimbalServos.of(vehicle, table.servos))
    if table.engine is not None:
        kinds.append(_engine(vehicle, table.engine, scenario))
    others = table.ideal_thrusters or table.rcs or table.magnetorquers
    if table.wheels.axes or not (kinds or others):
        alone = not (kinds or others)
        kinds.append(ReactionWheels.of(vehicle, table.wheels.allocation, alone=alone))
    if table.ideal_thrusters:
        kinds.append(IdealThrusters("thruster_torque" if kinds else "torque"))
    if table.rcs is not None:
        kinds.append(Thrusters.of(vehicle, table.rcs, rates))
    if table.magnetorquers is not None:
        coils = table.magnetorquers
        axes = np.array(coils.axes) / np.linalg.norm(coils.axes, axis=1, keepdims=True)
        kinds.append(CoilSet(axes, coils.dipole_limit or np.inf, coils.time_constant))
    return Together(tuple(kinds))


def _engine(vehicle: Vehicle, table: Engine, scenario: Scenario) -> GimballedEngine:
    """Return the engine, burning at trim unless ``initial.thrust`` says otherwise."""
    gravity = 0.0
    if (around := scenario.environment.gravity) is not None:
        place = np.array(scenario.initial.position, dtype=float)
        pull = central_gravity.acceleration(central_gravity.pack(around), place)
        gravity = float(np.linalg.norm(pull))
    return GimballedEngine.of(vehicle, table, gravity=gravity, thrust=scenario.initial.thrust)


def _of_thrusters(table: PlantTable) -> dict[str, Any]:
    """Return what a law may want to know of the vehicle's thrusters."""
    rcs = table.rcs
    if rcs is None:
        return {}
    return {
        "thruster_positions": np.array(rcs.positions),
        "thruster_directions": np.array(rcs.unit_directions),
        "thruster_force": np.full(len(rcs.positions), rcs.thrust),
        "thruster_minimum_on": rcs.minimum_on,
    }


def _of_gimbals(table: PlantTable, vehicle: Vehicle) -> dict[str, Any]:
    """Return what a law may want to know of gimbals with speed loops, and the wheels in them."""
    if table.servos is None:
        return {}
    return {
        "gimbal_axes": addresses.axes(vehicle.model, vehicle.gimbal_dof),
        "spin_axes": addresses.axes(vehicle.model, vehicle.wheel_dof),
        "wheel_inertia": addresses.axial_inertia(vehicle.model, vehicle.wheel_dof),
    }


def _friction(table: PlantTable) -> dict[str, float]:
    """Return the Coulomb friction of the hinges that have some, by name."""
    wheels = {f"wheel_{i}": table.wheels.coulomb_friction for i in range(len(table.wheels.axes))}
    every = wheels | {name: hinge.coulomb_friction for name, hinge in table.hinges.items()}
    return {name: torque for name, torque in every.items() if torque}


def _part(key: str, build: Callable[..., Any], *arguments: Any) -> Any:
    with blamed_on(key):
        return build(*arguments)
