"""From a scenario to everything that flies: vehicle, environment, sensors, actuators, law."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.actuators import faults
from mjspace.actuators.actuator_set import ActuatorSet
from mjspace.actuators.base import Actuators, IdealThrusters
from mjspace.actuators.engine import GimballedEngine
from mjspace.actuators.faults import FaultSet
from mjspace.actuators.gimbal_servos import GimbalServos
from mjspace.actuators.magnetorquers import CoilSet
from mjspace.actuators.motor_drives import MotorDrives
from mjspace.actuators.reaction_wheels import ReactionWheels
from mjspace.actuators.thrusters import Thrusters
from mjspace.contract import Array, Law, ReferenceSource
from mjspace.environment.geomagnetism import FieldAlongOrbit, along
from mjspace.environment.install import userdata, userdata_size
from mjspace.errors import input_error_at
from mjspace.scenario.construct import construct, load_object
from mjspace.scenario.landing import Engine
from mjspace.scenario.plant import PlantTable
from mjspace.scenario.scenario import Component, Scenario
from mjspace.scenario.user_files import files_of, source_of
from mjspace.sensors.suite import SensorSuite
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.vehicle import deployments, ground_contact, indices
from mjspace.vehicle.deployments import Deployments
from mjspace.vehicle.vehicle import Vehicle, build, initial_state

METHODS = {
    "law": ("reset(measurement, reference)", "step(state, time, measurement, reference)"),
    "reference": ("at(time)",),
}
"""What a component must have."""


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
    actuators: ActuatorSet
    reference: ReferenceSource
    law: Law
    deployed: Callable[[Any], Deployments] | None
    """Makes a batch's deployments; None where nothing is deployed."""
    disturbance: Callable[..., tuple[Any, Any]] | None
    """The user's own Python disturbance."""
    sources: dict[str, bytes]
    """The files that define the law, the reference and the disturbance, as ``law.py``, and with
    what it needs of its folder in ``law/``: by their names in a log."""

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
        inner = hasattr(self.law, "inner")
        return inner or self.actuators.stateful or self.faults_between

    @property
    def faults_between(self) -> bool:
        """Whether a fault begins or ends between control instants."""
        return faults.between(self.scenario.faults, self.scenario.rates.control)

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
        acceleration: Array = table.acceleration(position)
        return acceleration


def assemble(scenario: Scenario, folder: Path, *, law_folder: Path | None = None) -> Assembly:
    """Return the scenario's assembly; ``folder`` is where the files that it names are.

    The law's own file is in ``law_folder``, where that is given.

    Raises:
        InputError: a part cannot be built, with the scenario's key and what would be right.
    """
    size = userdata_size(scenario.environment, scenario.plant)
    vehicle = _part("plant", partial(build, userdata=size), scenario.plant, scenario.rates)
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
    sources: dict[str, bytes] = {}
    law, flown["law"] = _component("law", scenario.law, facts, law_folder or folder, sources)
    reference, flown["reference"] = _component(
        "reference", scenario.reference, facts, folder, sources
    )
    _part("reference", reference.at, np.array([0.0, scenario.duration]))
    disturbance = None
    kind = scenario.environment.python
    if kind is not None:
        disturbance = _part("environment.python", _function, kind, folder)
        flown["environment"] = scenario.environment.model_copy(
            update={"python": _in_log("disturbance", kind, disturbance, sources)}
        )
    qpos, qvel = _part("initial", initial_state, vehicle, scenario.initial)
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
            userdata,
            vehicle.model,
            scenario.environment,
            scenario.plant,
        ),
        field=_part("environment", along, scenario.environment, scenario.rates, scenario.duration),
        actuators=_part("plant", _actuators, vehicle, scenario, hasattr(law, "inner")),
        reference=reference,
        law=law if getattr(law, "batched", False) else UnbatchedLaw(law),
        deployed=deployments.of(vehicle.model, qpos, parts, scenario.rates.physics),
        disturbance=disturbance,
        sources=sources,
    )
    _part("sensors", assembly.sensors, [0])
    _part("faults", assembly.faults, [0])
    return assembly


def _component(
    role: str, component: Component, facts: dict[str, Any], folder: Path, sources: dict[str, bytes]
) -> tuple[Any, Component]:
    """Return the law or reference and its table as flown; its files are added to ``sources``."""
    with input_error_at(role):
        kind = load_object(component.kind, folder)
        built, flown = construct(component, kind, facts, folder)
        for method in METHODS[role]:
            if not callable(getattr(built, method.partition("(")[0], None)):
                raise ValueError(f"{component.kind} has no method {method}")
    return built, flown.model_copy(update={"kind": _in_log(role, component.kind, kind, sources)})


def _function(kind: str, folder: Path) -> Callable[..., Any]:
    """Return the function that ``kind`` names; ValueError for anything else."""
    found = load_object(kind, folder)
    if not callable(found):
        raise ValueError(f"{kind} is not a function of (time, truth): {type(found).__name__}")
    return found  # type: ignore[no-any-return]


def _in_log(role: str, kind: str, found: Any, sources: dict[str, bytes]) -> str:
    """Add the files that define what was ``found``; return its ``kind`` as the log knows it.

    A file of one's own is in the log as <role>.py or, with what it needs of its folder, in <role>/.
    """
    text, beside = source_of(found).encode(), files_of(found)
    sources[f"{role}.py"] = text
    place, _, name = kind.partition(":")
    if not place.endswith(".py"):
        return kind
    if not beside:
        return f"{role}.py:{name}"
    file = Path(place).name
    sources |= {f"{role}/{other}": content for other, content in {file: text, **beside}.items()}
    return f"{role}/{file}:{name}"


def _actuators(vehicle: Vehicle, scenario: Scenario, inner: bool) -> ActuatorSet:
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
        kinds.append(Thrusters.of(vehicle, table.rcs, rates, inner=inner))
    if table.magnetorquers is not None:
        coils = table.magnetorquers
        axes = np.array(coils.axes) / np.linalg.norm(coils.axes, axis=1, keepdims=True)
        kinds.append(CoilSet(axes, coils.dipole_limit or np.inf, coils.time_constant))
    return ActuatorSet(tuple(kinds))


def _engine(vehicle: Vehicle, table: Engine, scenario: Scenario) -> GimballedEngine:
    """Return the engine, burning at trim unless ``initial.thrust`` says otherwise."""
    gravity = 0.0
    if (around := scenario.environment.gravity) is not None:
        place = np.array(scenario.initial.position, dtype=float)
        gravity = float(np.linalg.norm(around.acceleration(place)))
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
        "gimbal_axes": indices.axes(vehicle.model, vehicle.gimbal_dof),
        "spin_axes": indices.axes(vehicle.model, vehicle.wheel_dof),
        "wheel_inertia": indices.axial_inertia(vehicle.model, vehicle.wheel_dof),
    }


def _part(key: str, build: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    with input_error_at(key):
        return build(*arguments, **named)
