"""Reaction wheels: a torque on the bus shared among motors, which have limits."""

import warnings
from dataclasses import dataclass, field
from math import inf
from typing import Annotated, Any, ClassVar, Literal

import mujoco
import numpy as np
from pydantic import model_validator

from mjspace.actuators.base import (
    Actuator,
    ActuatorTable,
    Context,
    Fields,
    Input,
    State,
    motors,
    together,
)
from mjspace.actuators.wheel_power import PowerKeys, PowerModel
from mjspace.actuators.wheel_torques import motor_torques, spare, unreachable
from mjspace.contract import Array, Measurement
from mjspace.scenario.equipment import Driven
from mjspace.scenario.fields import (
    Each,
    Meters3,
    Si,
    Switch,
    Unit3,
    of_each,
    refuse_other_count,
)
from mjspace.scenario.hinges import Bearing, Friction
from mjspace.vehicle import mass_properties, model_checks, stability
from mjspace.vehicle.composition import ASSETS, bus_of

_GAP = 0.1  # m, between the hull and the centre of a wheel drawn outside it


class Wheels(ActuatorTable, PowerKeys, Bearing):
    """Reaction wheels: one for each axis, alike but for what is a list with a number for each."""

    cure: ClassVar[str] = "set wheels.axes = [] to fly without wheels"
    before_parts: ClassVar[bool] = True

    axes: list[Unit3] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    """Spin axes in body axes, one row for each wheel; normalized. None: ``[]``."""
    positions: list[Meters3] | None = None
    """Rotor centres in the body [m]; the centre of mass when left out."""
    inertia: Annotated[Each, Si("kg m^2")] = 0.05
    """Axial rotor inertia."""
    transverse_inertia: Annotated[Each, Si("kg m^2")] | None = None
    """Transverse rotor inertia; half the axial when left out."""
    mass: Annotated[Each, Si("kg")] = 2.0
    """Rotor mass."""
    torque_limit: Annotated[Each, Si("N m")] | None = None
    """Largest motor torque; none when left out."""
    speed_limit: Annotated[Each, Si("rad/s")] | None = None
    """Largest speed relative to the bus; at it the motor gives no torque that would raise it."""
    momentum_margin: Switch = False
    """Whether the log has ``truth.wheel_momentum_margin``, (speed limit - |speed|) inertia of each;
    needs ``speed_limit``."""
    allocation: Literal["least_squares", "least_peak"] = "least_squares"
    """Of all motor torques that make the commanded one, those of least norm, or those whose largest
    is least; the latter for one wheel more than the axes span, such as four in a pyramid."""

    @model_validator(mode="after")
    def _one_for_each(self) -> "Wheels":
        if self.positions is not None and len(self.positions) != len(self.axes):
            raise ValueError(
                f"positions: {len(self.positions)} rows for {len(self.axes)} axes: give as many"
            )
        of_rotors = "inertia", "transverse_inertia", "mass", "torque_limit", "speed_limit"
        for key in (*of_rotors, *PowerKeys.model_fields):
            refuse_other_count(key, getattr(self, key), len(self.axes), "axes")
        if self.momentum_margin and self.speed_limit is None:
            raise ValueError("momentum_margin: needs speed_limit, which is missing")
        return self

    @property
    def fitted(self) -> bool:
        """Whether there are any."""
        return bool(self.axes)

    @property
    def rotors(self) -> mass_properties.Rotors:
        """Their mass properties without imbalance, for the balance of the vehicle."""
        axes = np.reshape(np.array(self.axes, dtype=float), (-1, 3))
        axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        centres = np.zeros_like(axes) if self.positions is None else np.array(self.positions)
        count, inertia = len(axes), of_each(self.inertia, len(axes))
        transverse = inertia / 2.0
        if self.transverse_inertia is not None:
            transverse = of_each(self.transverse_inertia, count)
        return mass_properties.Rotors(
            axes,
            centres,
            of_each(self.mass, count),
            inertia,
            transverse,
            of_each(self.speed_limit or inf, count),
        )

    def attach(self, spec: Any) -> None:
        """Bolt each wheel to the bus, its z axis along the spin axis."""
        for index, axis in enumerate(self.rotors.axes):
            self._attach_wheel(spec, index, axis)

    def driven(self, model: Any) -> Driven:
        """Return their motors and hinges."""
        names = _names(len(self.axes))
        return Driven(motors=names, wheels=names)

    def dry_friction(self) -> dict[str, Friction]:
        """Return the dry friction of each wheel's bearing."""
        if self.friction is None:
            return {}
        return dict.fromkeys(_names(len(self.axes)), self.friction)

    def actuator(self, context: Context) -> "ReactionWheels":
        """Return the wheels.

        Warns:
            ModelWarning: they are alone, and there are axes about which they give no torque.
        """
        vehicle, inertia = context.vehicle, np.zeros(0)
        if self.speed_limit or self.efficiency is not None:
            of_all = stability.inertia_at_joints(vehicle.model)
            inertia = of_all[vehicle.wheel_dof[: len(self.axes)]]
        limits = self.torque_limit or inf, self.speed_limit or inf
        wheels = ReactionWheels(
            vehicle.wheel_axes,
            *limits,
            self.allocation,
            inertia,
            power=self.power_model(inertia),
            reserve=self.rotors.inertia if self.momentum_margin else None,
        )
        if context.alone:
            wheels.warn_of_unreachable("plant.wheels.axes")
        return wheels

    def _attach_wheel(self, spec: Any, index: int, axis: Array) -> None:
        (name,) = _names(index + 1)[index:]
        part = mujoco.MjSpec.from_file(str(ASSETS / "parts/reaction_wheel/reaction_wheel.xml"))
        rotor, joint, motor = part.body("rotor"), part.joint("spin"), part.actuator("motor")
        rotor.mass, rotor.ipos, rotor.inertia, rotor.iquat = self._rotor(index)
        joint.damping = [self.viscous_friction, 0.0, 0.0]  # linear, quadratic, cubic
        if self.torque_limit is not None:
            motor.ctrllimited = True
            limit = of_each(self.torque_limit, len(self.axes))[index]
            motor.ctrlrange = [-limit, limit]

        mount = bus_of(spec).add_frame()
        mujoco.mju_quatZ2Vec(mount.quat, axis)
        if self.positions is not None:
            mount.pos = self.positions[index]
        else:
            hull = spec.geom("bus_hull")
            if hull is None:
                raise ValueError("positions: missing, and the model has no hull to put wheels on")
            reach = _exit(hull.size, axis) + _GAP
            for geom in part.geoms:
                geom.pos[2] += reach
        spec.attach(part, prefix=f"{name}_", frame=mount)
        rotor.name = joint.name = motor.name = motor.target = name

    def _rotor(self, index: int) -> mass_properties.Inertial:
        """Return the mass properties of a rotor, its spin axis along z.

        Raises:
            ValueError: no rotor has that transverse inertia, or so large a product of inertia.
        """
        rotors = self.rotors
        axial, transverse = rotors.inertia[index], rotors.transverse_inertia[index]
        if 2.0 * transverse < axial:
            raise ValueError(
                f"plant.wheels.transverse_inertia: {transverse:g} kg m^2 is less than half the "
                f"axial {axial:g} kg m^2: no rotor has that"
            )
        balanced = mass_properties.Inertial(
            float(rotors.mass[index]),
            np.zeros(3),
            np.array([transverse, transverse, axial]),
            np.array([1.0, 0.0, 0.0, 0.0]),
        )
        along_z = np.array([0.0, 0.0, 1.0])
        return mass_properties.off_balance(balanced, along_z, self, "plant.wheels")


def _names(count: int) -> tuple[str, ...]:
    return tuple(f"wheel_{index}" for index in range(count))


def _exit(half_size: Array, axis: Array) -> float:
    """Return how far from its centre [m] a ray along ``axis`` leaves a box of that half size."""
    with np.errstate(divide="ignore"):
        return float(np.min(half_size / np.abs(axis)))


@dataclass(frozen=True)
class ReactionWheels(Actuator):
    """Wheels that share a torque by least norm or by least peak.

    Friction is not compensated: what the bearings take is the law's to find out.
    """

    axes: Array
    """Unit spin axes in body axes, shape (n, 3)."""
    torque_limit: Array | list[float] | float = inf
    """Largest motor torque [N m], of all or of each, shape (n,)."""
    speed_limit: Array | list[float] | float = inf
    """Largest speed relative to the bus [rad/s], of all or of each, shape (n,)."""
    shared_by: Literal["least_squares", "least_peak"] = "least_squares"
    """Of all motor torques that make the commanded one: those of least norm or of least peak."""
    inertia: Array = field(default_factory=lambda: np.zeros(0))
    """Of each rotor against the bus, motor torque over relative acceleration [kg m^2], shape (n,);
    used by the speed limit alone."""
    names: tuple[str, ...] = ()
    """Of their motors; ``wheel_0``, ... when left out."""
    power: PowerModel | None = None
    """What they take from the bus; None: it is not computed."""
    reserve: Array | None = None
    """Axial inertia of each rotor [kg m^2], (n,), for the margin of momentum; None: not logged."""
    logged_as: ClassVar[str] = "wheel_torque"
    unit: ClassVar[str] = "N m"
    takes: ClassVar[Fields] = {"torque": (3, "N m")}
    measures: ClassVar[dict[str, str]] = {
        "wheel_power": "W",
        "wheel_energy": "J",
        "wheel_momentum_margin": "N m s",
    }
    allocation: Array = field(init=False, repr=False)
    """Motor torques for each unit of torque on the bus, shape (n, 3): -pinv(axes^T)."""
    spare: Array = field(init=False, repr=False)
    """Motor torques whose sum on the bus is zero, to be added, shape (n,); zero for least norm."""
    unreachable: Array = field(init=False, repr=False)
    """Unit vectors, body axes, about which no wheel gives any torque, shape (3 - rank, 3)."""
    _torque_limits: Array = field(init=False, repr=False)
    _speed_limits: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if np.isfinite(self.speed_limit).any() and len(self.inertia) != len(self.axes):
            raise ValueError(
                f"speed_limit needs the inertia of each of the {len(self.axes)} rotors: "
                f"{len(self.inertia)} found"
            )
        derived = {
            "allocation": -np.linalg.pinv(self.axes.T),
            "spare": (
                spare(self.axes) if self.shared_by == "least_peak" else np.zeros(len(self.axes))
            ),
            "unreachable": unreachable(self.axes),
            "inertia": self.inertia if len(self.inertia) else np.ones(len(self.axes)),
            "names": self.names or _names(len(self.axes)),
            "_torque_limits": of_each(self.torque_limit, len(self.axes)),
            "_speed_limits": of_each(self.speed_limit, len(self.axes)),
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    @property
    def stateful(self) -> bool:
        """Whether they act in every integration step: for a speed limit, or to add up energy."""
        return self.power is not None or bool(np.isfinite(self.speed_limit).any())

    @property
    def drives(self) -> Input:
        """Their motors."""
        return motors(self.names)

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the torque that the wheels together apply about each axis."""
        largest = together(self.axes, self._torque_limits)
        return {"torque": (-largest, largest)}

    def reset(self, vehicles: int) -> State:
        """Return what adds up their energy, where power is computed: ``PowerModel.reset``."""
        return {} if self.power is None else self.power.reset(vehicles)

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return what ``motor_torque`` does for a ``TorqueCommand``, within limits of power."""
        speed = truth.wheel_speed[..., : len(self.axes)]  # any in gimbals come after them
        torque, saturated = self.motor_torque(command.torque, speed, step)
        if self.power is None:
            return state, torque, saturated
        held, within = self.power.drive(state, torque, speed, step)
        return held, within, np.where(within != torque, 1.0, saturated)

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with electrical power and energy, and the margin of momentum."""
        speed = truth.wheel_speed[..., : len(self.axes)]
        if self.power is not None:
            power, energy = self.power.used(state, speed)
            truth = truth._replace(wheel_power=power, wheel_energy=energy)
        if self.reserve is not None:
            margin = (self._speed_limits - np.abs(speed)) * self.reserve
            truth = truth._replace(wheel_momentum_margin=margin)
        return truth

    def account(
        self, state: State, applied: Array, instead: Array, step: float
    ) -> tuple[State, Array]:
        """Return (state, torque): power is that of the torque that faults have left."""
        return (state if self.power is None else self.power.account(state, instead)), instead

    def motor_torque(self, torque: Array, wheel_speed: Array, step: float) -> tuple[Array, Array]:
        """Return (ctrl, saturated), each of shape (..., n), for the next ``step`` [s].

        ``torque`` (..., 3) is commanded on the bus, body axes [N m]; ``wheel_speed`` (..., n) is
        relative to the bus [rad/s]. ``ctrl`` [N m] is the motors' torque on their rotors, whose
        reaction turns the bus: of all that make ``torque``, as ``shared_by`` says, each wheel's
        then limited to the torque limit, and so that the step ends at the speed limit. What other
        torques on the bus add to a relative speed within the step, the motor does not take away.
        ``saturated`` is 1.0 for a wheel whose torque is limited, else 0.0; and 1.0 for every
        wheel where ``torque`` has a part that none of them can apply.
        """
        applied: tuple[Array, Array] = motor_torques.ufunc(
            torque,
            wheel_speed,
            self.allocation,
            self.spare,
            self._torque_limits,
            self._speed_limits,
            self.inertia,
            self.unreachable,
            step,
        )
        return applied

    def warn_of_unreachable(self, key: str) -> None:
        """Warn where there are axes about which the wheels, which alone act, give no torque.

        Warns:
            ModelWarning: with the axes; ``key`` is what the scenario calls the wheels'.
        """
        if not len(self.unreachable):
            return
        about = " and ".join(str(np.round(axis, 6) + 0.0) for axis in self.unreachable)
        warnings.warn(
            f"{key} span {3 - len(self.unreachable)} of 3 directions: the wheels give no torque "
            f"about {about}, body axes, and report one that is commanded there as saturation",
            model_checks.ModelWarning,
            stacklevel=3,
        )
