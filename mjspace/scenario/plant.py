"""The tables of a scenario: rates, plant and initial state."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from mjspace.errors import shortened
from mjspace.scenario import model_source
from mjspace.scenario.boresight import Boresight
from mjspace.scenario.declared import DeclaredIn
from mjspace.scenario.equipment import Equipment
from mjspace.scenario.fields import (
    Angles3,
    Finite,
    JointName,
    KindName,
    Matrix3,
    Meters3,
    Momentum3,
    Name,
    NonNegative,
    Period,
    Positive,
    Quaternion,
    Rate3,
    Si,
    Switch,
    Table,
    Velocity3,
)
from mjspace.scenario.hinges import Hinge
from mjspace.scenario.mounted import Mounted, MovingPart
from mjspace.scenario.ports import Port
from mjspace.units import whole_number


class Rates(Table):
    """How often things happen."""

    physics: Period = 1e-3
    """Integration step."""
    control: Period = 1e-3
    """Control period, a whole number of integration steps: law, actuators and log."""
    integrator: Literal["RK4", "implicitfast", "implicit", "Euler"] = "RK4"
    """MuJoCo's integrator; all but RK4 are first order, and are warned of."""

    @property
    def steps(self) -> int:
        """How many integration steps make up a control period; ValueError for no whole number."""
        return whole_number(self.control, self.physics, "rates.control", "rates.physics")


_WHEELS = DeclaredIn("mjspace.actuators.reaction_wheels:Wheels", optional=False)


_INERTIAS = ("bus_inertia", "gyrostat_inertia", "vehicle_inertia")
_STATED_BY_THE_MODEL = ("mass", "vehicle_mass", *_INERTIAS)


class Part(Mounted):
    """Something bolted to the bus that moves of itself: a nutation damper, a boom, a yo-yo."""

    part: str
    """Name of a folder in assets/parts/."""
    deployment: Annotated[Any, DeclaredIn("mjspace.vehicle.deployments:Deployment")] = None
    """Of a boom or a yo-yo; it moves as it likes when left out."""

    @model_validator(mode="after")
    def _deployable(self) -> "Part":
        if self.deployment is not None:
            self.deployment.check(self.part)
        return self


class Roles(Table):
    """What parts of a model of one's own are, where their kinds do not say it.

    Patterns are a shell's, as ``"rw_*"``, for names of motors or of the joints or sites that they
    act on.
    """

    bus: str | None = None
    """Body that is the bus, and is freed where the model fixes it to the world; that with the free
    joint when left out."""
    wheels: list[str] | None = None
    """Torque motors of hinges that are reaction wheels, or hinges without one, as all of a URDF,
    which then get it; when left out, those of unlimited hinges on
    the bus that turn a balanced body. None: ``[]``."""
    thrusters: list[str] | None = None
    """Forces at sites that are thrusters; all of them when left out."""


class PlantTable(Table):
    """The vehicle: an assembly from assets/, with its mass properties, parts and actuators."""

    model: KindName = "satellite_3rw"
    """Name of a folder in assets/; or a model of one's own, a file in the scenario's folder: MJCF
    (.xml), URDF (.urdf), or ``"file.py:function"`` that returns an ``mujoco.MjSpec``. Such a model
    has its own mass properties, and no wheels but its own and those of ``[plant.wheels]``."""
    roles: Roles = Roles()
    """Of a model of one's own."""
    without_armature: Switch = False
    """Of a model of one's own: whether it flies without the armature of its joints, whose momentum
    would have no reaction on the bus; with it, it is refused."""
    mass: Annotated[Positive, Si("kg")] | None = 100.0
    """Mass of the bus alone; a model of one's own has its own."""
    bus_inertia: Matrix3 | None = None
    """Inertia of the bus alone about its centre of mass, body axes; any symmetric positive-definite
    matrix. The asset's own when neither this nor ``gyrostat_inertia`` is given."""
    gyrostat_inertia: Matrix3 | None = None
    """The papers' H: the whole vehicle about its centre of mass less the wheels' axial inertia; the
    bus inertia follows from it."""
    impossible_inertia: Switch = False
    """Whether it is on purpose that no mass distribution has the bus's inertia, as that of a paper:
    it is flown all the same, then without a warning."""
    vehicle_mass: Annotated[Positive, Si("kg")] | None = None
    """Mass of the whole vehicle, with all that is on it; the bus's follows, not ``mass``."""
    vehicle_inertia: Matrix3 | None = None
    """Inertia of the whole vehicle, joints at rest, about its centre of mass, which is the body
    origin; the bus inertia follows. Needs ``vehicle_mass``."""
    parts: dict[Name, Part] = {}
    """By a name of one's own: ``[plant.parts.damper]``. They add to the bus's mass and inertia, and
    to neither ``gyrostat_inertia`` nor the ``inertia`` that a law is given."""
    panels: dict[
        Name, Annotated[Any, DeclaredIn("mjspace.vehicle.flexible_panel:Panel", optional=False)]
    ] = {}
    """Flexible panels, by a name of one's own: ``[plant.panels.left]``. Their mass counts as that
    of ``parts`` does. The solar panels that are drawn on a satellite of ours then are not."""
    slosh: dict[
        Name, Annotated[Any, DeclaredIn("mjspace.vehicle.slosh:Slosh", optional=False)]
    ] = {}
    """Sloshing propellant, by the tank: ``[plant.slosh.tank]``. Its mass counts as that of
    ``parts`` does."""
    hinges: dict[JointName, Hinge] = {}
    """Bearings of the model's and the parts' hinges, by the hinge: ``[plant.hinges.cmg_wheel]``."""
    ripple: dict[
        JointName,
        Annotated[Any, DeclaredIn("mjspace.environment.torque_ripple:Ripple", optional=False)],
    ] = {}
    """Torque ripple of motors, by the hinge."""
    vibration: dict[
        JointName,
        Annotated[Any, DeclaredIn("mjspace.environment.vibration:Vibration", optional=False)],
    ] = {}
    """Vibration torques of a constant frequency, by the hinge."""
    ground: Annotated[Any, DeclaredIn("mjspace.vehicle.ground:Ground")] = None
    """What is below it; nothing when left out."""
    ports: dict[Name, Port] = {}
    """Places on the vehicle at which other spacecraft are connected, by a name of one's own."""
    boresights: dict[Name, Boresight] = {}
    """Where its instruments look, by a name of one's own: ``[plant.boresights.camera]``."""
    spacecraft: dict[
        Name,
        Annotated[
            Any,
            DeclaredIn("mjspace.vehicle.other_spacecraft:OtherSpacecraft", optional=False),
        ],
    ] = {}
    """Those that fly beside the vehicle, by a name of one's own: ``[plant.spacecraft.target]``."""
    connections: dict[
        Name,
        Annotated[Any, DeclaredIn("mjspace.environment.connection:Connection", optional=False)],
    ] = {}
    """Of the vehicle and others, by a name of one's own: ``[plant.connections.dock]``."""

    # The actuators, in the order in which they act and are logged. A line registers each.
    wheels: Annotated[Any, _WHEELS] = Field(default_factory=lambda: _WHEELS.table())
    """Its reaction wheels; three on the body axes when left out."""
    drives: Annotated[Any, DeclaredIn("mjspace.actuators.motor_drives:DriveTables")] = None
    """Electric motors that turn hinges of the parts, by the hinge: ``[plant.drives.cmg_outer]``. A
    hinge whose name ends in ``wheel`` is a wheel, any other a gimbal."""
    servos: Annotated[Any, DeclaredIn("mjspace.actuators.gimbal_servos:Servos")] = None
    """Speed loops on every hinge of the parts that a motor turns, in place of ``drives``; none when
    left out. Beside reaction wheels where these are given."""
    engine: Annotated[Any, DeclaredIn("mjspace.actuators.engine:Engine")] = None
    """Its engine on gimbals, of a model that has one; no wheels then."""
    ideal_thrusters: Annotated[Any, DeclaredIn("mjspace.actuators.ideal_thrusters:Switched")] = None
    """Whether the torque that the law commands acts on the bus as if by thrusters, unchanged: its
    command's ``torque`` or, beside motors or an engine, its ``thruster_torque``. Not when left
    out."""
    rcs: Annotated[Any, DeclaredIn("mjspace.actuators.thrusters:Rcs")] = None
    """Its reaction-control thrusters; none when left out."""
    cold_gas: Annotated[Any, DeclaredIn("mjspace.actuators.cold_gas:ColdGas")] = None
    """Its cold-gas thrusters, in place of ``rcs``; none when left out."""
    magnetorquers: Annotated[Any, DeclaredIn("mjspace.actuators.magnetorquers:Magnetorquers")] = (
        None
    )
    """None when left out; in an environment with a magnetic field they obey the command's
    ``dipole``."""
    arms: Annotated[Any, DeclaredIn("mjspace.actuators.arms:Arms")] = None
    """Robotic arms, by a name of one's own: ``[plant.arms.left]``. They obey the command's
    ``joint_torque``; their angles and rates are measured as ``gimbal_angle`` and ``gimbal_rate``.
    Not beside ``drives``, ``servos`` or an ``engine``."""

    @property
    def is_own(self) -> bool:
        """Whether the model is the user's."""
        return model_source.is_own(self.model)

    @property
    def moving_parts(self) -> list[tuple[str, MovingPart]]:
        """The parts that move without a motor and are built by their tables, with their names."""
        return [*self.panels.items(), *self.slosh.items()]

    @property
    def equipment(self) -> dict[str, Any]:
        """The tables of all that is fitted, by key, in the order of the keys.

        A vehicle from assets/ without anything else has reaction wheels, if only none of them.
        """
        tables = {name: getattr(self, name) for name in type(self).model_fields}
        fitted = {n: t for n, t in tables.items() if isinstance(t, Equipment) and t.fitted}
        return fitted if fitted or self.is_own else {"wheels": self.wheels}

    @model_validator(mode="before")
    @classmethod
    def _of_own_model(cls, table: Any) -> Any:
        if not isinstance(table, dict) or not isinstance(name := table.get("model"), str):
            return table
        if not model_source.is_own(name):
            return table
        for key in _STATED_BY_THE_MODEL:
            if table.get(key) is not None:
                raise ValueError(f"{key}: the model {shortened(name)} states it")
        return {"wheels": {"axes": []}, **table, "mass": None}

    @model_validator(mode="after")
    def _beside_each_other(self) -> "PlantTable":
        fitted = self.equipment
        for key, table in fitted.items():
            for other in table.excludes:
                if other in fitted:
                    raise ValueError(f"{key} and {other} are both given: {fitted[other].cure}")
        return self

    @model_validator(mode="after")
    def _one_inertia(self) -> "PlantTable":
        given = [name for name in _INERTIAS if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"{given[0]} and {given[1]} are both given: give one")
        if (self.vehicle_mass is None) != (self.vehicle_inertia is None):
            raise ValueError("vehicle_mass and vehicle_inertia: give both or neither")
        return self


class Initial(Table):
    """The state at time zero."""

    attitude: Quaternion | None = None
    """Quaternion, scalar first, body to inertial; its norm is 1, to within 0.001 for rounding.
    Identity when left out."""
    euler: Angles3 | None = None
    """Or roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll), body to inertial."""
    rate: Rate3 = [0.0, 0.0, 0.0]
    """Angular velocity, body axes."""
    position: Meters3 = [0.0, 0.0, 0.0]
    """Of the bus, inertial axes; in the free-fall frame when there is an orbit."""
    velocity: Velocity3 = [0.0, 0.0, 0.0]
    """Of the bus, inertial axes."""
    on_reference: Switch = False
    """Whether attitude and rate are the reference's and, where it has a position, position and
    velocity too; what is given of them as well is refused."""
    wheel_speed: Annotated[list[Finite], Si("rad/s")] | None = None
    """Wheel speeds relative to what carries them; zero when left out. Bias speeds whose momenta
    cancel, as [b, -b, b, -b] in a pyramid, keep the wheels away from zero."""
    joint_position: dict[JointName, Finite] = {}
    """Positions of the model's and the parts' hinges and slides, by name [rad or m]; the model's
    own when left out."""
    joint_speed: dict[JointName, Finite] = {}
    """Speeds of the model's and the parts' hinges and slides, by name [rad/s or m/s]."""
    momentum: Momentum3 | None = None
    """Or the desired total angular momentum about the centre of mass, inertial axes: the wheel
    speeds follow (the smallest, where more than three wheels can make it)."""
    thrust: Annotated[NonNegative, Si("N")] | None = None
    """Of the engine; at trim when left out: what holds the vehicle's weight where it starts, within
    the throttle's range, and none without gravity."""

    @model_validator(mode="after")
    def _one_of_each(self) -> "Initial":
        if self.attitude is not None and self.euler is not None:
            raise ValueError("attitude and euler are both given: give one")
        if self.wheel_speed is not None and self.momentum is not None:
            raise ValueError("wheel_speed and momentum are both given: give one")
        for name in ("attitude", "euler", "rate", "position", "velocity"):
            if self.on_reference and np.any(getattr(self, name)):
                raise ValueError(f"{name} and on_reference are both given: give one")
        return self
