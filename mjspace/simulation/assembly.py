"""From a scenario to everything that flies: vehicle, environment, sensors, actuators, law."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.actuators import faults, model_motors
from mjspace.actuators.actuator_set import ActuatorSet
from mjspace.actuators.faults import FaultSet
from mjspace.contract import Array, Law, ReferenceSource
from mjspace.environment.constants import RADIUS
from mjspace.environment.ephemeris import KnownEphemeris
from mjspace.environment.install import userdata, userdata_size
from mjspace.environment.orbit import orbit_position, orbit_velocity
from mjspace.environment.shadow import visible_from
from mjspace.environment.solar_pressure import shadow_radii
from mjspace.errors import InputError, input_error_at
from mjspace.scenario.construct import construct
from mjspace.scenario.on_reference import on_reference
from mjspace.scenario.plant import Initial
from mjspace.scenario.scenario import Component, Scenario
from mjspace.scenario.trust import Trust, is_address, is_library
from mjspace.sensors.base import OwnSensor, Surroundings
from mjspace.sensors.suite import SensorSuite
from mjspace.simulation import start
from mjspace.simulation.estimated_law import EstimatedLaw, refuse_inner_loop
from mjspace.simulation.known_beforehand import Known, known_of, seen_of
from mjspace.simulation.sources import in_log, metric_functions
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.vehicle import ground, own_model
from mjspace.vehicle.vehicle import Vehicle, build

METHODS = {
    "law": ("reset(measurement, reference)", "step(state, time, measurement, reference)"),
    "reference": ("at(time)",),
    "estimator": ("reset(measurement)", "step(state, time, measurement)"),
}
"""What a component must have."""
MODEL = "model"
"""The folder of a user's own model in a log."""


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
    known: Mapping[str, Known]
    """What is known of the environment as a function of time: the magnetic field, the Sun's
    position, the air's density, a drifting orbit's elements."""
    actuators: ActuatorSet
    reference: ReferenceSource
    law: Law
    """With the estimator, where there is one: ``EstimatedLaw``."""
    inner: bool
    """Whether the law's inner loop commands the actuators in every integration step."""
    disturbance: Callable[..., tuple[Any, Any]] | None
    """The user's own Python disturbance."""
    sources: dict[str, bytes]
    """The files that define law, estimator, reference, disturbance and metrics, as ``law.py``, and
    with what it needs of its folder in ``law/``: by their names in a log."""
    metrics: Mapping[str, Callable[..., Any]]
    """The functions of the user's metrics, by the metrics' names."""

    def sensors(self, members: Sequence[int]) -> SensorSuite:
        """Return the sensors of these members of the campaign, each with its own random streams."""
        scenario = self.scenario
        return SensorSuite(
            scenario.sensors,
            scenario.rates,
            scenario.seed,
            members,
            self.surroundings,
            scenario.faults,
            inner=self.inner,
        )

    @property
    def surroundings(self) -> Surroundings:
        """What the sensors need to know of the vehicle and of where it flies."""
        environment = self.scenario.environment
        orbit, gravity = environment.orbit, environment.gravity
        radii = shadow_radii(environment)
        height = {} if gravity is None else {"height": gravity.height}
        return Surroundings(
            wheels=len(self.vehicle.wheel_dof),
            own_sensors={
                s.field: OwnSensor(s.size, s.unit, s.is_attitude) for s in self.vehicle.sensors
            }
            | {f"{n}_closed": OwnSensor(1, "", False) for n in self.scenario.plant.connections},
            gravity=self._gravity,
            orbit_position=None if orbit is None else partial(orbit_position, orbit),
            orbit_velocity=None if orbit is None else partial(orbit_velocity, orbit),
            planet_radius=0.0 if orbit is None else RADIUS[orbit.body],
            sunlight=lambda place, sun: visible_from(place, sun, *radii),
            **height,
            **{name: one.at for name, one in seen_of(self.known).items()},
        )

    @property
    def driven_stepwise(self) -> bool:
        """Whether the actuators act in every integration step; else once in a control period."""
        return self.inner or self.actuators.stateful or self.faults_between

    @property
    def faults_between(self) -> bool:
        """Whether a fault begins or ends between control instants."""
        return faults.between(self.scenario.faults, self.scenario.rates.control)

    @property
    def hold(self) -> float:
        """For how long what the actuators apply is held [s]."""
        rates = self.scenario.rates
        return rates.physics if self.driven_stepwise else rates.control

    def faults(self, members: Sequence[int]) -> FaultSet | None:
        """Return the faults of these members of the campaign; None where the scenario has none."""
        scenario = self.scenario
        if not scenario.faults:
            return None
        return FaultSet(
            scenario.faults,
            self.actuators.kinds,
            self.hold,
            scenario.seed,
            members,
            scenario.rates.control,
            list(scenario.sensors),
        )

    def _gravity(self, position: Array) -> Array:
        """Return the central gravity [m/s^2] at ``position`` [m], both (..., 3)."""
        table = self.scenario.environment.gravity
        if table is None:
            return np.zeros_like(position)
        acceleration: Array = table.acceleration(position)
        return acceleration


def assemble(
    scenario: Scenario,
    folder: Path,
    *,
    trust: bool = False,
    law_folder: Path | None = None,
    vehicle: Vehicle | None = None,
) -> Assembly:
    """Return the scenario's assembly; ``folder`` holds the files that it names.

    With ``trust`` it may name files elsewhere and any installed module: see ``Trust``. A law from
    ``law_folder``, where there is one, is trusted. The ``vehicle`` is built, unless it is given.

    Raises:
        InputError: a part cannot be built, with the scenario's key and what would be right.
    """
    own = Trust(folder, everything=trust)
    of_law = own if law_folder is None else Trust(law_folder, everything=True)
    if scenario.estimator and (is_library(scenario.law.kind) or is_address(scenario.law.kind)):
        raise InputError(
            "estimator: a law in a shared library or in another process sees the sensors alone: "
            "leave out [estimator], or name a law in Python"
        )
    if is_library(scenario.law.kind):
        from mjspace.simulation.flight_software import shared_library  # which needs an Assembly

        still = without_law(scenario, folder, trust=trust)
        return shared_library.fly_under(still, scenario.law, of_law)
    if is_address(scenario.law.kind):
        from mjspace.simulation.flight_software import socket_law

        still = without_law(scenario, folder, trust=trust)
        return socket_law.fly_under(still, scenario.law, of_law)
    flown: dict[str, Any] = {}
    sources: dict[str, bytes] = {}
    model = None
    if scenario.plant.is_own:
        model = _part("plant.model", own_model.open_source, scenario.plant.model, own)
        sources |= {f"{MODEL}/{name}": content for name, content in model.files.items()}
        flown["plant"] = scenario.plant.model_copy(update={"model": f"{MODEL}/{model.main}"})
    size = userdata_size(scenario.environment, scenario.plant)
    built = partial(build, userdata=size, source=model)
    vehicle = vehicle or _part("plant", built, scenario.plant, scenario.rates)
    facts = facts_of(vehicle, scenario)
    law, flown["law"] = _component("law", scenario.law, facts, of_law, sources)
    facts["ephemeris"] = KnownEphemeris(scenario.environment)  # of a reference alone
    reference, flown["reference"] = _component("reference", scenario.reference, facts, own, sources)
    _part("reference", reference.at, np.array([0.0, scenario.duration]))
    scenario = on_reference(scenario, reference)
    inner = _part("law", _has_inner_loop, law)
    if scenario.estimator is not None:
        _part("estimator", refuse_inner_loop, law)
        estimator, flown["estimator"] = _component(
            "estimator", scenario.estimator, facts, own, sources
        )
        law = EstimatedLaw(estimator, law)
    disturbance = None
    kind = scenario.environment.python
    if kind is not None:
        disturbance = _part("environment.python", own.load, kind)
        flown["environment"] = scenario.environment.model_copy(
            update={"python": in_log("disturbance", kind, disturbance, sources)}
        )
    metrics, flown["metrics"] = metric_functions(scenario.metrics, own, sources)
    qpos, qvel = start.coordinates(vehicle, scenario)
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
        known=_part("environment", known_of, scenario),
        actuators=start.actuators(vehicle, scenario, inner=inner),
        reference=reference,
        law=law if getattr(law, "batched", False) else UnbatchedLaw(law),
        inner=inner,
        disturbance=disturbance,
        sources=sources,
        metrics=metrics,
    )
    _part("faults", assembly.faults, [0])
    _part("sensors", assembly.sensors, [0])
    return assembly


def without_law(scenario: Scenario, folder: Path, *, trust: bool = False) -> Assembly:
    """Return the scenario's assembly under a law that commands nothing, with no source of it.

    What would estimate for the law is left out as well.

    Raises:
        InputError: as ``assemble``.
    """
    still = scenario.model_copy(update={"law": Component(kind="coast:Coast"), "estimator": None})
    assembly = assemble(still, folder, trust=trust)
    sources = {name: text for name, text in assembly.sources.items() if name != "law.py"}
    return replace(assembly, sources=sources)


def starting_at(assembly: Assembly, initial: Initial) -> Assembly:
    """Return the assembly with another initial state, and with what depends on that.

    Raises:
        InputError: the vehicle cannot start there.
    """
    scenario = assembly.scenario.model_copy(update={"initial": initial})
    scenario = on_reference(scenario, assembly.reference)
    qpos, qvel = start.coordinates(assembly.vehicle, scenario)
    actuators = start.actuators(assembly.vehicle, scenario, inner=assembly.inner)
    return replace(assembly, scenario=scenario, qpos=qpos, qvel=qvel, actuators=actuators)


def under_inner_loop(assembly: Assembly) -> Assembly:
    """Return the assembly with actuators that an inner loop commands in every integration step.

    Raises:
        InputError: an actuator cannot be built so.
    """
    scenario = assembly.scenario
    actuators = start.actuators(assembly.vehicle, scenario, inner=True)
    return replace(assembly, actuators=actuators, inner=True)


def facts_of(vehicle: Vehicle, scenario: Scenario) -> dict[str, Any]:
    """Return the vehicle's properties, its ground's map and the periods [s] that a law may take."""
    facts = {
        "inertia": vehicle.inertia,
        "wheel_axes": vehicle.wheel_axes,
        "wheel_inertia": vehicle.wheel_inertia,
        "control_period": scenario.rates.control,
        "inner_period": scenario.rates.physics,
    }
    for table in scenario.plant.equipment.values():
        facts |= table.facts(vehicle)
    return facts | ground.map_of(vehicle.model) | model_motors.facts_of(vehicle)


def _component(
    role: str, component: Component, facts: dict[str, Any], trust: Trust, sources: dict[str, bytes]
) -> tuple[Any, Component]:
    """Return the law, reference or estimator, and its table as flown.

    Its files are added to ``sources``.
    """
    with input_error_at(role):
        kind = trust.load_class(component.kind, METHODS[role])
        built, flown = construct(component, kind, facts, trust)
    return built, flown.model_copy(update={"kind": in_log(role, component.kind, kind, sources)})


def _has_inner_loop(law: Any) -> bool:
    """Tell whether the law has an inner loop; ValueError for one that cannot be flown."""
    has = hasattr(law, "inner")
    if has and not getattr(law, "batched", False):
        raise ValueError(
            f"{type(law).__name__} has an inner loop and is not batched: write it for arrays with "
            "a leading vehicle axis, and set its attribute batched = True"
        )
    return has


def _part(key: str, build: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    with input_error_at(key):
        return build(*arguments, **named)
