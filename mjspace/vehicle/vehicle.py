"""The vehicle: a scenario's table composed from assets/ into one compiled MuJoCo model.

State rows are MuJoCo's: ``qpos[0:3]`` is the bus's position, ``qpos[3:7]`` its attitude (scalar
first, body to inertial); ``qvel[0:3]`` is its velocity in INERTIAL axes, ``qvel[3:6]`` its angular
velocity in BODY axes. The body origin is the vehicle's centre of mass, but for wheel imbalance.
"""

import gzip
import warnings
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.errors import input_error_at, nearest
from mjspace.scenario.equipment import Driven
from mjspace.scenario.model_source import ModelSource
from mjspace.scenario.plant import Initial, PlantTable, Rates
from mjspace.vehicle import composition, indices, mass_properties, model_checks, own_model
from mjspace.vehicle.model_sensors import ModelSensor
from mjspace.vehicle.roles import Recognized


class UnphysicalInertiaWarning(UserWarning):
    """The inertia of the bus is impossible for a mass distribution, but simulated unchanged."""


@dataclass(frozen=True)
class Vehicle:
    """A compiled vehicle and what a law, an actuator and the log use of it."""

    model: Any  # the ``mujoco.MjModel``
    inertia: Array
    """H of the papers: inertia of the whole vehicle about its centre of mass, less the wheels'
    axial inertia, body axes [kg m^2], shape (3, 3); without wheel imbalance."""
    wheel_axes: Array
    """Unit spin axes, body axes, shape (n, 3)."""
    wheel_inertia: Array
    """Axial inertia of each rotor [kg m^2], shape (n,)."""
    wheel_dof: Any
    """Index of each wheel's speed in ``qvel``, shape (n,)."""
    wheel_qpos: Any
    """Index of the angle in ``qpos`` of each wheel whose angle is measured, shape (d,)."""
    gimbal_dof: Any
    """Index of each gimbal's rate in ``qvel``, shape (g,)."""
    gimbal_qpos: Any
    """Index of each gimbal's angle in ``qpos``, shape (g,)."""
    strut_qpos: Any
    """Index of each landing leg's strut in ``qpos``, shape (l,): positive where it is pressed."""
    driven: Driven
    """What of the model its actuators drive, by name."""
    own: Recognized
    """What the motors of a user's own model are; none of another."""
    relative: tuple[ModelSensor, ...]
    """Sensors of the motion of other spacecraft, and at the ports of connections."""
    speed_limit: Array
    """Largest speed of each wheel relative to the bus [rad/s], shape (n,); inf without a limit."""
    momentum: slice
    """In ``sensordata``: total angular momentum about the centre of mass, inertial [N m s]."""
    kinetic: slice
    """In ``sensordata``: kinetic energy [J]."""
    environment: slice
    """In ``sensordata``: force [N], inertial axes, and torque [N m], body axes, on the bus."""

    @property
    def sensors(self) -> tuple[ModelSensor, ...]:
        """The sensors of the compiled model that laws receive by their names."""
        return (*self.own.sensors, *self.relative)

    @property
    def motors(self) -> tuple[str, ...]:
        """The motors that actuators command, by name, in the order of the actuators."""
        return self.driven.motors


def build(
    table: PlantTable, rates: Rates, *, userdata: int, source: ModelSource | None = None
) -> Vehicle:
    """Return the vehicle that ``table`` describes, with ``userdata`` numbers of user data.

    ``source`` is that of a user's own model.

    Raises:
        ValueError: an unknown model or part, wheels that leave no inertia for the bus or are
            impossible as rotors, a model of one's own that cannot fly, or a finding of
            ``model_checks.check``.

    Warns:
        UnphysicalInertiaWarning: the bus inertia violates the triangle inequality, and it is not
            said that this is meant; flown unchanged.
    """
    spec, own, relative = composition.compose(table, source)
    spec.option.timestep = rates.physics
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{rates.integrator.upper()}")
    spec.nuserdata = userdata

    on_bus = (fitted.rotors for fitted in table.equipment.values())
    rotors = next(filter(None, on_bus), mass_properties.Rotors())
    if source is not None:
        model, gyrostat = own_model.compiled(spec), None
    elif table.vehicle_mass is not None:
        whole = np.array(table.vehicle_inertia)
        gyrostat = whole - rotors.axes.T @ (rotors.inertia[:, None] * rotors.axes)
        bodies = inertials(spec.compile())
        others = [each for name, each in bodies.items() if name != composition.bus_of(spec).name]
        inertial = mass_properties.remainder(table.vehicle_mass, whole, others)
        model = _compile(spec, inertial, meant=table.impossible_inertia)
    else:
        stated = mass_properties.own_inertia(composition.bus_of(spec))
        inertial, gyrostat = mass_properties.bus(table, rotors, stated)
        model = _compile(spec, inertial, meant=table.impossible_inertia)
    model_checks.check(model)
    driven = Driven.together([own.driven, *driven_by(model, table, own.driven).values()])
    where = indices.of(model, driven)
    axes, inertia = rotors.axes, rotors.inertia
    if gyrostat is None:
        # Wheels in gimbals, whose axes turn, come after reaction wheels.
        on_bus_dof = where["wheel_dof"][: len(own.wheels) + len(rotors.axes)]
        axes = indices.axes(model, on_bus_dof)
        inertia = indices.axial_inertia(model, on_bus_dof)
        _, _, gyrostat = mass_properties.together(inertials(model).values())
        gyrostat -= axes.T @ (inertia[:, None] * axes)

    return Vehicle(
        model=model,
        own=own,
        relative=relative,
        inertia=indices.frozen(gyrostat),
        wheel_axes=indices.frozen(axes),
        wheel_inertia=indices.frozen(inertia),
        driven=driven,
        speed_limit=indices.frozen(_padded(rotors.speed_limit, len(where["wheel_dof"]))),
        **where,
    )


def on_model(vehicle: Vehicle, model: Any) -> Vehicle:
    """Return ``vehicle`` with another compiled model of it, as from a log.

    Raises:
        KeyError: ``model`` lacks one of the vehicle's joints or sensors.
    """
    return replace(vehicle, model=model, **indices.of(model, vehicle.driven))


def initial_state(vehicle: Vehicle, initial: Initial) -> tuple[Array, Array]:
    """Return (qpos, qvel), shapes (nq,) and (nv,), of the vehicle at time zero.

    Wheel speeds for a desired total momentum are solved with MuJoCo's own momentum matrix, so that
    they hold for wheels anywhere in the bus; where more than three wheels can make it, the least.

    Raises:
        ValueError: a wrong number of speeds, a speed above the limit, an unknown joint, or a
            momentum that the wheels' axes do not span.

    Warns:
        model_checks.ModelWarning: a step too long for imbalanced wheels at the speed limit or,
            without a limit, at the initial speed.
    """
    data = mujoco.MjData(vehicle.model)
    wheels = vehicle.wheel_dof
    data.qpos[0:3] = initial.position
    if initial.attitude is not None:
        data.qpos[3:7] = np.array(initial.attitude) / np.linalg.norm(initial.attitude)
    elif initial.euler is not None:
        mujoco.mju_euler2Quat(data.qpos[3:7], np.array(initial.euler), "XYZ")  # about fixed axes
    data.qvel[0:3] = initial.velocity
    data.qvel[3:6] = initial.rate
    if initial.momentum is not None:
        data.qvel[wheels] = _speeds_for(vehicle, data, np.array(initial.momentum))
    elif initial.wheel_speed is not None:
        if len(initial.wheel_speed) != len(wheels):
            raise ValueError(
                f"initial.wheel_speed: {len(initial.wheel_speed)} speeds for {len(wheels)} wheels"
            )
        data.qvel[wheels] = initial.wheel_speed
    _set_joints(vehicle.model, data, initial)
    speeds, limits = np.abs(data.qvel[wheels]), vehicle.speed_limit
    for speed, limit in zip(speeds, limits, strict=True):
        if speed > limit:
            raise ValueError(
                f"initial: a wheel starts at {speed:.6g} rad/s, above plant.wheels.speed_limit "
                f"{limit:g} rad/s: start slower or raise the limit"
            )
    fastest = np.where(np.isfinite(limits), limits, speeds).max(initial=0.0)
    model_checks.check_imbalance(vehicle.model, fastest)
    return data.qpos.copy(), data.qvel.copy()


def _padded(limits: Array, count: int) -> Array:
    """Return the limits, which are those of the first of so many wheels; the others have none."""
    return np.concatenate([limits, np.full(count - len(limits), np.inf)])


def _set_joints(model: Any, data: Any, initial: Initial) -> None:
    simple = np.isin(model.jnt_type, [mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE])
    known = {model.joint(i).name: i for i in np.flatnonzero(simple)}
    for key, values, to, places in (
        ("joint_position", initial.joint_position, data.qpos, model.jnt_qposadr),
        ("joint_speed", initial.joint_speed, data.qvel, model.jnt_dofadr),
    ):
        for name, value in values.items():
            if name not in known:
                raise ValueError(f"initial.{key}: no hinge or slide {name!r}{nearest(name, known)}")
            to[places[known[name]]] = value


def to_mjb(model: Any) -> bytes:
    """Return the compiled model as MJB: equal models give equal bytes.

    The paths of the files that were compiled are blank: they tell where somebody keeps them.
    """
    mjb, paths = saved(model)
    return mjb[: paths.start] + bytes(model.npaths) + mjb[paths.stop :]


def saved(model: Any) -> tuple[bytes, slice]:
    """Return a compiled model as MuJoCo saves it, and where in that its files' paths are."""
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    mjb = buffer.tobytes()
    start = mjb.rfind(model.paths)
    return mjb, slice(start, start + model.npaths)


def packed(mjb: bytes) -> bytes:
    """Return a compiled model gzipped: equal models give equal bytes."""
    return gzip.compress(mjb, compresslevel=3, mtime=0)


def from_mjb(mjb: bytes) -> Any:
    """Return the ``mujoco.MjModel`` that ``to_mjb`` made bytes of: not for a stranger's."""
    return mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": mjb})


def driven_by(model: Any, table: PlantTable, own: Driven) -> dict[str, Driven]:
    """Return what each piece of equipment of the compiled ``model`` drives, by its key.

    ``own`` is what a user's own model drives.

    Raises:
        ValueError: the model lacks something of it, with the key.
    """
    found = {}
    for key, fitted in table.equipment.items():
        with input_error_at(f"plant.{key}"):
            found[key] = fitted.driven(model)
    left = indices.turned(model, Driven.together([own, *found.values()]).motors)
    for key, fitted in table.equipment.items():
        with input_error_at(f"plant.{key}"):
            found[key] = Driven.together([found[key], fitted.driven_hinges(left)])
    return found


def _compile(spec: Any, inertial: mass_properties.Inertial, *, meant: bool) -> Any:
    body, moments = composition.bus_of(spec), inertial.inertia
    body.mass, body.ipos, _, body.iquat = inertial
    body.fullinertia = np.full(6, np.nan)  # unset: the principal moments hold
    excess = moments[2] - moments[1] - moments[0]
    # MuJoCo's compiler refuses unphysical inertias; its dynamics only need positive ones.
    body.inertia = moments if excess <= 0.0 else np.full(3, moments.mean())
    model = spec.compile()
    if excess > 0.0:
        if not meant:
            eigenvalues = np.array2string(moments, precision=4)
            warnings.warn(
                f"no mass distribution has the bus inertia's eigenvalues {eigenvalues} kg m^2: the "
                f"largest exceeds the sum of the others by {excess:.4g}; flown unchanged",
                UnphysicalInertiaWarning,
                stacklevel=3,
            )
        model.body(body.name).inertia = moments
        mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def inertials(model: Any) -> dict[str, mass_properties.Inertial]:
    """Return the vehicle's bodies by name: mass properties in the bus's axes, joints at rest."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bus = indices.bus_id(model)
    axes, origin = data.xmat[bus].reshape(3, 3), data.xpos[bus]
    found = {}
    for body in range(1, model.nbody):
        if model.body_rootid[body] == model.body_rootid[bus] and model.body_mass[body] > 0.0:
            quat = np.zeros(4)
            mujoco.mju_mat2Quat(quat, (axes.T @ data.ximat[body].reshape(3, 3)).ravel())
            place = axes.T @ (data.xipos[body] - origin)
            found[model.body(body).name] = mass_properties.Inertial(
                float(model.body_mass[body]), place, model.body_inertia[body].copy(), quat
            )
    return found


def _speeds_for(vehicle: Vehicle, data: Any, momentum: Array) -> Array:
    """Return the wheel speeds (n,) [rad/s] for a total ``momentum`` (3,) [N m s], inertial axes."""
    bus = indices.bus_id(vehicle.model)
    matrix = np.zeros((3, vehicle.model.nv))
    mujoco.mj_fwdPosition(vehicle.model, data)
    mujoco.mj_angmomMat(vehicle.model, data, matrix, bus)
    by_wheels = matrix[:, vehicle.wheel_dof]
    desired = momentum - matrix @ data.qvel
    speeds: Array = np.linalg.lstsq(by_wheels, desired, rcond=1e-10)[0]
    missing = desired - by_wheels @ speeds
    if np.linalg.norm(missing) > 1e-9 * np.linalg.norm(desired):
        in_body = data.xmat[bus].reshape(3, 3).T @ missing
        raise ValueError(
            f"initial.momentum: the wheels' axes cannot make {in_body} N m s of it (body axes): "
            f"set wheel_speed instead, or plant.wheels.axes that span it"
        )
    return speeds
