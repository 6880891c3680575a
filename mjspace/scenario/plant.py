"""The tables of a scenario: rates, plant and initial state."""

from typing import Annotated, Any, Literal

from pydantic import model_validator

from mjspace.scenario.fields import (
    Angles3,
    DeclaredIn,
    Finite,
    Matrix3,
    Meters3,
    Momentum3,
    Name,
    NonNegative,
    Positive,
    Quaternion,
    Rate3,
    Seconds,
    Si,
    Switch,
    Table,
    Unit3,
    Velocity3,
)
from mjspace.scenario.hinges import Bearing, Hinge
from mjspace.scenario.landing import Engine, Ground
from mjspace.scenario.magnetics import Magnetorquers
from mjspace.scenario.motors import Pmsm
from mjspace.scenario.servos import Servos
from mjspace.scenario.thrusters import Rcs
from mjspace.units import whole_number


class Rates(Table):
    """How often things happen."""

    physics: Seconds = 1e-3
    """Integration step."""
    control: Seconds = 1e-3
    """Control period, a whole number of integration steps: law, actuators and log."""
    integrator: Literal["RK4", "implicitfast", "implicit", "Euler"] = "RK4"
    """MuJoCo's integrator; all but RK4 are first order, and are warned of."""

    @property
    def steps(self) -> int:
        """How many integration steps make up a control period; ValueError for no whole number."""
        return whole_number(self.control, self.physics, "rates.control", "rates.physics")


class Wheels(Bearing):
    """Reaction wheels: one for each axis; every wheel is alike."""

    axes: list[Unit3] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    """Spin axes in body axes, one row for each wheel; normalized. None: ``[]``."""
    positions: list[Meters3] | None = None
    """Rotor centres in the body [m]; the centre of mass when left out."""
    inertia: Annotated[Positive, Si("kg m^2")] = 0.05
    """Axial rotor inertia."""
    transverse_inertia: Annotated[Positive, Si("kg m^2")] | None = None
    """Transverse rotor inertia; half the axial when left out."""
    mass: Annotated[Positive, Si("kg")] = 2.0
    """Rotor mass."""
    torque_limit: Annotated[Positive, Si("N m")] | None = None
    """Largest motor torque; none when left out."""
    speed_limit: Annotated[Positive, Si("rad/s")] | None = None
    """Largest speed relative to the bus; at it the motor gives no torque that would raise it."""
    allocation: Literal["least_squares", "least_peak"] = "least_squares"
    """Of all motor torques that make the wanted one, those of least norm, or those whose largest is
    least; the latter for one wheel more than the axes span, such as four in a pyramid."""

    @model_validator(mode="after")
    def _alike(self) -> "Wheels":
        if self.positions is not None and len(self.positions) != len(self.axes):
            raise ValueError(
                f"positions: {len(self.positions)} rows for {len(self.axes)} axes: give as many"
            )
        return self


class Part(Table):
    """Something bolted to the bus that moves of itself: a nutation damper, a boom, a yo-yo."""

    part: str
    """Name of a folder in assets/parts/."""
    position: Meters3 = [0.0, 0.0, 0.0]
    """Of its origin in the bus."""
    euler: Angles3 = [0.0, 0.0, 0.0]
    """Roll, pitch, yaw of its axes in the bus's."""
    deployment: Annotated[Any, DeclaredIn("mjspace.vehicle.deployments:Deployment")] | None = None
    """Of a boom or a yo-yo; it moves as it likes when left out."""

    @model_validator(mode="after")
    def _deployable(self) -> "Part":
        if self.deployment is None:
            return self
        if self.part not in ("boom", "yo_yo"):
            raise ValueError(f"deployment: a {self.part} has none, a boom or a yo_yo has")
        given = self.deployment.length is not None, self.deployment.rate is not None
        if given != (self.part == "boom",) * 2:
            raise ValueError("deployment: length and rate are a boom's, which needs both")
        return self


class PlantTable(Table):
    """The vehicle: an assembly from assets/, with its mass properties and wheels."""

    model: str = "satellite_3rw"
    """Name of a folder in assets/."""
    mass: Annotated[Positive, Si("kg")] = 100.0
    """Mass of the bus alone."""
    bus_inertia: Matrix3 | None = None
    """Inertia of the bus alone about its centre of mass, body axes; any symmetric positive-definite
    matrix. The asset's own when neither this nor ``gyrostat_inertia`` is given."""
    gyrostat_inertia: Matrix3 | None = None
    """The papers' H: the whole vehicle about its centre of mass less the wheels' axial inertia; the
    bus inertia follows from it."""
    vehicle_mass: Annotated[Positive, Si("kg")] | None = None
    """Mass of the whole vehicle, with all that is on it; the bus's follows, not ``mass``."""
    vehicle_inertia: Matrix3 | None = None
    """Inertia of the whole vehicle, joints at rest, about its centre of mass, which is the body
    origin; the bus inertia follows. Wants ``vehicle_mass``."""
    wheels: Wheels = Wheels()
    parts: dict[Name, Part] = {}
    """By a name of one's own: ``[plant.parts.damper]``. They add to the bus's mass and inertia, and
    to neither ``gyrostat_inertia`` nor the ``inertia`` that a law is given."""
    hinges: dict[Name, Hinge] = {}
    """Bearings of the parts' hinges, by the hinge: ``[plant.hinges.cmg_wheel]``."""
    drives: dict[Name, Pmsm] = {}
    """Electric motors that turn hinges of the parts, by the hinge: ``[plant.drives.cmg_outer]``. A
    hinge whose name ends in ``wheel`` is a wheel, any other a gimbal."""
    servos: Servos | None = None
    """Speed loops on every hinge of the parts that a motor turns, in place of ``drives``; none when
    left out."""
    ripple: dict[Name, Annotated[Any, DeclaredIn("mjspace.environment.torque_ripple:Ripple")]] = {}
    """Torque ripple of motors, by the hinge."""
    ideal_thrusters: Switch = False
    """Whether a torque that the law asks for acts on the bus as if by thrusters, as it is: its
    command's ``torque`` or, beside motors or an engine, its ``thruster_torque``."""
    magnetorquers: Magnetorquers | None = None
    """None when left out; in an environment with a magnetic field they obey the command's
    ``dipole``."""
    engine: Engine | None = None
    """What its engine on gimbals does, of a model that has one; no wheels then."""
    rcs: Rcs | None = None
    """Its reaction-control thrusters; none when left out."""
    ground: Ground | None = None
    """What is below it; nothing when left out."""

    @model_validator(mode="after")
    def _one_kind_of_motor(self) -> "PlantTable":
        kinds = {
            "drives": bool(self.drives),
            "servos": self.servos is not None,
            "engine": self.engine is not None,
        }
        given = [name for name, is_given in kinds.items() if is_given]
        if given and self.wheels.axes:
            raise ValueError("one kind of motor: set wheels.axes = [] to fly without wheels")
        if len(given) > 1:
            raise ValueError(f"{given[0]} and {given[1]} are both given: give one")
        return self

    @model_validator(mode="after")
    def _one_inertia(self) -> "PlantTable":
        names = ("bus_inertia", "gyrostat_inertia", "vehicle_inertia")
        given = [name for name in names if getattr(self, name) is not None]
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
    wheel_speed: Annotated[list[Finite], Si("rad/s")] | None = None
    """Wheel speeds relative to what carries them; zero when left out. Bias speeds whose momenta
    cancel, as [b, -b, b, -b] in a pyramid, keep the wheels away from zero."""
    joint_position: dict[Name, Finite] = {}
    """Positions of the parts' joints, by name [rad or m]; the model's own when left out."""
    joint_speed: dict[Name, Finite] = {}
    """Speeds of the parts' joints, by name [rad/s or m/s]."""
    momentum: Momentum3 | None = None
    """Or the wanted total angular momentum about the centre of mass, inertial axes: the wheel
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
        return self
