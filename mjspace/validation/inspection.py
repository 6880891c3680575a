"""What mjspace recognizes in a user's own model, and what keeps it from flying."""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from pydantic import computed_field

from mjspace.actuators.model_motors import actuators_of
from mjspace.contract import Array
from mjspace.environment.install import userdata_size
from mjspace.scenario.environment import Environment
from mjspace.scenario.model_source import ModelSource
from mjspace.scenario.plant import PlantTable, Rates
from mjspace.scenario.trust import CommandLineText, Trust
from mjspace.validation import model_files
from mjspace.validation.passport import Finding
from mjspace.validation.results import Data
from mjspace.vehicle import mass_properties, own_model, roles
from mjspace.vehicle.indices import bus_id
from mjspace.vehicle.model_sensors import ModelSensor, sensors_of
from mjspace.vehicle.roles import Motor
from mjspace.vehicle.vehicle import Vehicle, build, inertials


class Body(Data):
    """A body of the model."""

    name: str
    parent: str
    joints: list[str]
    """``"spin (hinge)"``; none: fixed to its parent."""
    mass: float
    """[kg]."""
    principal_moments: list[float]
    """About its own centre of mass [kg m^2]."""


class Wheel(Data):
    """A reaction wheel."""

    motor: str
    hinge: str
    axis: list[float]
    """Body axes of the bus, joints at rest."""
    inertia: float
    """Axial [kg m^2]."""
    torque_limit: float | None
    """[N m]; None without one."""


class Thruster(Data):
    """A force at a site."""

    motor: str
    site: str
    position: list[float]
    """From the bus's origin, its axes [m]."""
    direction: list[float]
    """Of the force, likewise."""
    force_limit: float | None
    """[N]; None without one."""


class OtherMotor(Data):
    """A motor that is commanded in MuJoCo's own terms."""

    motor: str
    drives: str
    range: list[float | None]


class Sensor(Data):
    """A sensor of the model's own."""

    name: str
    measured_as: str
    """The field of the measurement."""
    kind: str
    size: int
    unit: str


class Field(Data):
    """A field of a law's command."""

    size: int
    unit: str


class Whole(Data):
    """The vehicle as it would fly."""

    bus: str
    mass: float
    """[kg]."""
    center_of_mass: list[float]
    """From the bus's origin, its axes [m]."""
    inertia: list[list[float]]
    """About the centre of mass, the bus's axes, with the wheels at rest in them [kg m^2]."""
    wheels: list[Wheel]
    thrusters: list[Thruster]
    others: list[OtherMotor]
    gimbals: list[str]
    """Hinges whose angle and rate are measured."""
    command: dict[str, Field]
    """Fields of a law's command."""
    beside: list[str]
    """Other free bodies, which fly beside it as spacecraft without a law."""


class Inspection(Data):
    """What is in a model file, and whether it can fly."""

    model: str
    step: float
    """Its own [s], or that of a scenario that says nothing where no flight can have that."""
    bodies: list[Body]
    sensors: list[Sensor]
    cameras: list[str]
    vehicle: Whole | None
    """None where it cannot fly."""
    findings: list[Finding]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def flies(self) -> bool:
        """Whether a scenario can have the model as its plant."""
        return self.vehicle is not None


def inspect_file(path: Path, plant: dict[str, Any]) -> tuple[ModelSource, Inspection]:
    """Return the source of the user's model at ``path``, and what is recognized in it.

    ``plant`` has other keys of [plant].

    Raises:
        ValueError: it cannot be read; as ``inspect``.
    """
    source = own_model.open_source(CommandLineText(str(path)), Trust(Path()))
    return source, inspect(source, PlantTable(model=source.name, **plant))


def inspect(source: ModelSource, table: PlantTable) -> Inspection:
    """Return what is recognized in the model of a plant.

    Raises:
        ValueError: MuJoCo cannot read or compile it.
    """
    spec = own_model.read(source)
    own_model.name_all(spec)
    own_model.free(spec, table.roles.bus)
    model = own_model.compiled(spec)
    texts = [*_replaced(model), *_of_sensors(model, spec), *model_files.findings(spec)]
    findings = [Finding(refused=False, text=text) for text in texts]
    vehicle = _vehicle(source, table, model, findings)
    return Inspection(
        model=source.name,
        step=_rates(model).physics,
        bodies=[_body(model, i) for i in range(1, model.nbody)],
        sensors=[
            Sensor(name=s.name, measured_as=s.field, kind=s.kind, size=s.size, unit=s.unit)
            for s in sensors_of(model)
        ],
        cameras=[model.camera(i).name or f"camera {i}" for i in range(model.ncam)],
        vehicle=None if vehicle is None else _whole(vehicle),
        findings=findings,
    )


def _rates(model: Any) -> Rates:
    step = float(model.opt.timestep)
    return Rates(physics=step, control=step) if 1e-9 <= step <= 0.1 else Rates()


def _vehicle(
    source: ModelSource, table: PlantTable, model: Any, findings: list[Finding]
) -> Vehicle | None:
    size = userdata_size(Environment(), table)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            vehicle = build(table, _rates(model), userdata=size, source=source)
            if not vehicle.motors:
                text = "no motor: a law cannot command anything; bolt wheels or thrusters on"
                findings.append(Finding(refused=False, text=text))
        except ValueError as error:
            findings += [Finding(refused=True, text=line) for line in str(error).splitlines()]
            vehicle = None
    findings += [Finding(refused=False, text=str(each.message)) for each in caught]
    return vehicle


def _replaced(model: Any) -> Iterator[str]:
    """Yield what of the model the scenario replaces."""
    integrator = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
    if integrator != "RK4":
        yield f"its integrator, {integrator}, is replaced by that of the scenario, RK4"
    if model.opt.gravity.any():
        yield f"its gravity, {model.opt.gravity} m/s^2, is replaced by the scenario's environment"
    if model.opt.density or model.opt.viscosity:
        yield "its medium (density, viscosity) is left out"
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT and model.ngeom:
        touching = (model.geom_contype | model.geom_conaffinity).any()
        if touching:
            yield "contacts are switched off, unless it lands on a [plant.ground]"
    exact = np.flatnonzero(model.actuator_dyntype == mujoco.mjtDyn.mjDYN_FILTEREXACT)
    if exact.size:
        names = ", ".join(repr(model.actuator(motor).name) for motor in exact)
        yield (
            f"dyntype filterexact of {names} is flown as filter, which is the same lag: MuJoCo's "
            "RK4 is of first order in the other"
        )
    if model.nkey:
        yield f"its {model.nkey} keyframes are left out: [initial] says how it begins"


def _of_sensors(model: Any, spec: Any) -> Iterator[str]:
    """Yield what of the model's sensors the scenario replaces."""
    known = dict(zip(sensors_of(model), spec.sensors, strict=True))
    noisy = [own for own, sensor in known.items() if sensor.noise]
    if noisy:
        yield (
            f"the noise of {_listed(noisy)} is not flown, as MuJoCo does not use it: with "
            f'[sensors.{noisy[0].field}] measures = "model", noise_std = {known[noisy[0]].noise:g} '
            "it is"
        )
    sampled = [s for s, each in known.items() if each.nsample or each.delay or any(each.interval)]
    if sampled:
        yield (
            f"delay and interval of {_listed(sampled)} are left out: [sensors.{sampled[0].field}] "
            'measures = "model" has delay and period'
        )
    magnetometers = [own for own in known if own.kind == "magnetometer"]
    if magnetometers:
        yield (
            f"{_listed(magnetometers)} read the model's uniform magnetic field, not that of the "
            "scenario, which [sensors.magnetic_field] measures"
        )


def _listed(sensors: list[ModelSensor]) -> str:
    return f"its sensors {', '.join(repr(sensor.name) for sensor in sensors)}"


def _body(model: Any, body: int) -> Body:
    first, count = model.body_jntadr[body], model.body_jntnum[body]
    kinds = [
        mujoco.mjtJoint(model.jnt_type[j]).name.removeprefix("mjJNT_").lower()
        for j in range(first, first + count)
    ]
    names = [model.joint(j).name for j in range(first, first + count)]
    return Body(
        name=model.body(body).name,
        parent=model.body(model.body_parentid[body]).name,
        joints=[f"{name} ({kind})" for name, kind in zip(names, kinds, strict=True)],
        mass=float(model.body_mass[body]),
        principal_moments=model.body_inertia[body].tolist(),
    )


def _whole(vehicle: Vehicle) -> Whole:
    own, model = vehicle.own, vehicle.model
    mass, centre, inertia = mass_properties.together(inertials(model).values())
    places, ways = roles.places_and_directions(model, own.thrusters)
    takes = {
        name: Field(size=int(np.prod(shape)), unit=unit)
        for kind in actuators_of(vehicle, alone=False)
        for name, (shape, unit) in kind.takes.items()
    }
    return Whole(
        bus=model.body(bus_id(model)).name,
        mass=mass,
        center_of_mass=centre.tolist(),
        inertia=inertia.tolist(),
        wheels=[
            Wheel(
                motor=each.name,
                hinge=each.drives,
                axis=axis.tolist(),
                inertia=float(axial),
                torque_limit=_finite(each.either_way),
            )
            for each, axis, axial in zip(
                own.wheels, vehicle.wheel_axes, vehicle.wheel_inertia, strict=True
            )
        ],
        thrusters=[_thruster(*each) for each in zip(own.thrusters, places, ways, strict=True)],
        others=[
            OtherMotor(
                motor=each.name,
                drives=each.drives,
                range=[_finite(each.least), _finite(each.largest)],
            )
            for each in own.others
        ],
        gimbals=list(own.gimbals),
        command=takes,
        beside=[
            model.body(model.jnt_bodyid[joint]).name
            for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[1:]
        ],
    )


def _thruster(motor: Motor, place: Array, way: Array) -> Thruster:
    return Thruster(
        motor=motor.name,
        site=motor.drives,
        position=place.tolist(),
        direction=way.tolist(),
        force_limit=_finite(motor.largest),
    )


def _finite(number: float) -> float | None:
    return float(number) if abs(number) < float("inf") else None
