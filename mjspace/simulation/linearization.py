"""A scenario's vehicle, linearized about its initial state by central differences in MuJoCo.

The states are errors from the nominal motion: ``position`` of the bus, inertial axes; ``attitude``,
the rotation vector from the nominal to the true body axes, in body axes; angles of hinges; and
their rates: ``velocity``, inertial axes, ``rate``, body axes, speeds of hinges. The rows of A that
are kinematics are exact, as attitude' = rate - w x attitude at the nominal rate w.
"""

from collections.abc import Iterable, Iterator
from math import prod
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.algebra import cross_matrix
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, without_law
from mjspace.simulation.flight_software.interface import Field, Fields, interface_of, named_tuple
from mjspace.simulation.initial_state import INTEGRATION, initial_physics, start_at
from mjspace.simulation.linear_plant import LinearPlant
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.stepper import Stepper
from mjspace.vehicle.vehicle import Vehicle

_OF_HINGES = ("wheel_speed", "gimbal_angle", "gimbal_rate", "wheel_angle")
_STEP = 1e-5
"""Of a state, in SI, or as a part of it where it is larger than 1."""
_PART = 1e-3
"""Step of an input, as a part of its limit, or in SI where it has none."""
_LINEAR = 1e-3
"""How much the slopes to either side of an input may differ, as a part of them."""


def linearize(
    scenario: str | Path, overrides: Iterable[str] = (), *, trust: bool = False
) -> LinearPlant:
    """Return the vehicle of a scenario, by name or path, linearized about its initial state.

    The command about which it is linearized is zero. The law does not matter; ``overrides`` and
    ``trust`` are as in ``mjspace.run``.

    Raises:
        InputError: bad input; or an actuator that has a state of its own, or that is not linear in
            its command, as a thruster that is on or off.
    """
    loaded, folder = load(scenario, overrides)
    return linear_plant(without_law(loaded, folder, trust=trust))


def linear_plant(assembly: Assembly) -> LinearPlant:
    """Return the vehicle of an assembly, linearized as ``linearize`` does.

    Raises:
        InputError: likewise.
    """
    _refuse_memory(assembly)
    interface = interface_of(assembly)
    steps = _input_steps(assembly, interface.command)
    model, vehicle = assembly.vehicle.model, assembly.vehicle
    names, units = zip(*_states(vehicle), strict=True)
    kept = [i for i, name in enumerate(names) if name]
    nominal = initial_physics(assembly, 1)[0]
    moved, step = _perturbed(model, nominal)
    nx, nu = 2 * model.nv, len(steps)
    # The nominal vehicle; each state moved up and down; each input moved up and down.
    physics = np.concatenate([nominal[None], moved, np.repeat(nominal[None], 2 * nu, axis=0)])
    commands = np.zeros((len(physics), nu))
    commands[1 + 2 * nx :: 2] = np.diag(steps)
    commands[2 + 2 * nx :: 2] = np.diag(-steps)
    h = np.concatenate([step, steps])

    def slopes(values: Array) -> Array:
        return ((values[1::2] - values[2::2]) / (2.0 * h[:, None])).T

    accelerations, truth = _at_once(assembly, physics, commands, interface.command)
    _refuse_bent(accelerations[0], accelerations[1 + 2 * nx :], list(_names(interface.command)))
    dynamics = slopes(accelerations)
    kinematics = np.hstack([np.zeros((model.nv, model.nv)), np.eye(model.nv)])
    rate = nominal[StateLayout(assembly).rate]
    kinematics[3:6, 3:6] = -cross_matrix(rate)  # after the position of the free joint
    after = _after_a_period(assembly, physics, commands, interface.command)
    moves = slopes(np.array([_difference(model, after[0], row) for row in after]))
    measured = dict(_outputs(assembly, interface.measurement))
    outputs = np.concatenate([_reported(truth, field) for field in measured.values()], axis=1)
    of_states = np.ix_(kept, kept)
    sensors = assembly.scenario.sensors
    noise = [np.full(prod(f.shape), _noise(sensors.get(name))) for name, f in measured.items()]
    return LinearPlant(
        A=np.vstack([kinematics, dynamics[:, :nx]])[of_states],
        B=np.vstack([np.zeros((model.nv, nu)), dynamics[:, nx:]])[kept],
        C=slopes(outputs)[:, kept],
        D=np.zeros((outputs.shape[1], nu)),
        Ad=moves[:, :nx][of_states],
        Bd=moves[:, nx:][kept],
        control_period=assembly.scenario.rates.control,
        states=np.array([names[i] for i in kept]),
        inputs=np.array(list(_names(interface.command))),
        outputs=np.array(list(_names(measured))),
        state_units=np.array([units[i] for i in kept]),
        input_units=np.array(list(_units(interface.command))),
        output_units=np.array(list(_units(measured))),
        noise_std=np.concatenate(noise),
    )


def _states(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """Yield name and unit of each degree of freedom, and of its rate; "" for an angle left out.

    That is a wheel's whose angle is not measured: nothing depends on it but imbalance.
    """
    model = vehicle.model
    wheels, gimbals = list(vehicle.wheel_dof), list(vehicle.gimbal_dof)
    encoded = [
        int(model.jnt_dofadr[np.flatnonzero(model.jnt_qposadr == q)[0]]) for q in vehicle.wheel_qpos
    ]

    def hinge(dof: int) -> tuple[str, str]:
        """Return the names of a hinge's angle and of its rate."""
        name = model.joint(int(model.dof_jntid[dof])).name
        if dof in wheels:
            at = f"[{wheels.index(dof)}]"
            return (f"wheel_angle{at}" if dof in encoded else "", f"wheel_speed{at}")
        if dof in gimbals:
            return f"gimbal_angle[{gimbals.index(dof)}]", f"gimbal_rate[{gimbals.index(dof)}]"
        return f"{name}.position", f"{name}.velocity"

    def slides(dof: int) -> bool:
        return bool(model.jnt_type[model.dof_jntid[dof]] == mujoco.mjtJoint.mjJNT_SLIDE)

    hinges = range(6, model.nv)
    yield from ((f"position[{i}]", "m") for i in range(3))
    yield from ((f"attitude[{i}]", "rad") for i in range(3))
    yield from ((hinge(dof)[0], "m" if slides(dof) else "rad") for dof in hinges)
    yield from ((f"velocity[{i}]", "m/s") for i in range(3))
    yield from ((f"rate[{i}]", "rad/s") for i in range(3))
    yield from ((hinge(dof)[1], "m/s" if slides(dof) else "rad/s") for dof in hinges)


def _perturbed(model: Any, nominal: Array) -> tuple[Array, Array]:
    """Return states with each coordinate moved up and down, (4 nv, nstate), and the steps (2 nv,).

    The coordinates are those of ``qvel``: a rotation is about body axes.
    """
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, nominal, INTEGRATION)
    qpos, qvel = data.qpos.copy(), data.qvel.copy()
    tangent = np.zeros(model.nv)
    at_zero = mujoco.MjData(model).qpos
    mujoco.mj_differentiatePos(model, tangent, 1.0, at_zero, qpos)
    steps = _STEP * np.maximum(1.0, np.abs(np.concatenate([tangent, qvel])))
    rows = []
    for i, step in enumerate(steps):
        for sign in (1.0, -1.0):
            data.qpos, data.qvel = qpos, qvel
            if i < model.nv:
                move = np.zeros(model.nv)
                move[i] = sign * step
                mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            else:
                data.qvel[i - model.nv] += sign * step
            row = np.empty_like(nominal)
            mujoco.mj_getState(model, data, row, INTEGRATION)
            rows.append(row)
    return np.array(rows), steps


def _stepper(
    assembly: Assembly, physics: Array, commands: Array, fields: Fields
) -> tuple[Stepper, Any]:
    """Return vehicles at ``physics``, and their first period under the ``commands``, (N, m)."""
    members = [0] * len(physics)
    stepper = Stepper(assembly, start_at(assembly, physics, members), members)
    period = stepper.sense(0)
    sizes = np.cumsum([prod(field.shape) for field in fields.values()])[:-1]
    parts = np.split(commands, sizes, axis=1)
    shapes = [(len(physics), *field.shape) for field in fields.values()]
    arrays = [part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)]
    period.law, period.signals = (), ()
    period.command = named_tuple("Command", fields)(*arrays)
    return stepper, period


def _at_once(
    assembly: Assembly, physics: Array, commands: Array, fields: Fields
) -> tuple[Array, Any]:
    """Return the accelerations in the coordinates of ``qvel``, (N, nv), and the truth."""
    stepper, period = _stepper(assembly, physics, commands, fields)
    accelerations = stepper.batch.bind("qacc")
    stepper.begin(period, flown=False)
    return accelerations.copy(), period.truth


def _after_a_period(assembly: Assembly, physics: Array, commands: Array, fields: Fields) -> Array:
    """Return the states after a control period, (N, nstate)."""
    stepper, period = _stepper(assembly, physics, commands, fields)
    stepper.begin(period)
    stepper.finish(period)
    after: Array = stepper.batch.state.copy()
    return after


def _difference(model: Any, nominal: Array, other: Array) -> Array:
    """Return the other state's error from the nominal one, in the coordinates of ``qvel``."""
    data = [mujoco.MjData(model) for _ in range(2)]
    for each, row in zip(data, (nominal, other), strict=True):
        mujoco.mj_setState(model, each, row, INTEGRATION)
    moved = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, moved, 1.0, data[0].qpos, data[1].qpos)
    return np.concatenate([moved, data[1].qvel - data[0].qvel])


def _refuse_memory(assembly: Assembly) -> None:
    """Refuse actuators that remember anything: it would be a state that no column has."""
    for kind in assembly.actuators.kinds:
        if remembered := ", ".join(kind.reset(1)):
            raise InputError(
                f"plant: {type(kind).__name__} has states of its own ({remembered}), which a "
                "linear model of the motion lacks: give a plant whose actuators have none"
            )


def _input_steps(assembly: Assembly, fields: Fields) -> Array:
    """Return the step of each input, (m,)."""
    limits: dict[str, Array] = {}
    for kind in assembly.actuators.kinds:
        for name, (least, largest) in kind.limits().items():
            limits[name] = np.minimum(-least, largest)
    steps = [
        np.where(np.isfinite(limit) & (limit > 0.0), _PART * limit, _PART).ravel()
        for limit in (np.broadcast_to(limits[name], f.shape) for name, f in fields.items())
    ]
    return np.concatenate([np.zeros(0), *steps])


def _refuse_bent(nominal: Array, moved: Array, names: list[str]) -> None:
    """Refuse an input that does not act linearly about zero."""
    for name, up, down in zip(names, moved[::2] - nominal, moved[1::2] - nominal, strict=True):
        if np.abs(up + down).max() > _LINEAR * np.abs(up - down).max() + 1e-12:
            raise InputError(
                f"command.{name}: does not act linearly about zero, as a thruster that is on or "
                "off: a linear model has no column for it"
            )


def _outputs(assembly: Assembly, measurement: Fields) -> Iterator[tuple[str, Field]]:
    """Yield what depends on the motion at the instant alone, of what is measured."""
    sensors = assembly.scenario.sensors
    for name, field in measurement.items():
        of_sensor = name in sensors and not sensors[name].integrates
        if prod(field.shape) and (of_sensor or name in _OF_HINGES):
            turns = field.measures == "attitude"
            yield name, field._replace(shape=(3,), unit="rad") if turns else field


def _reported(truth: Any, field: Field) -> Array:
    """Return what an ideal sensor reports, (N, k); of an attitude its error from the first."""
    values: Array = getattr(truth, field.measures)
    if field.measures != "attitude":
        return values.reshape(len(values), -1)
    error = attitude.multiply(attitude.conjugate(values[0]), values)
    return attitude.to_rotation_vector(error)


def _noise(sensor: Any) -> float:
    return 0.0 if sensor is None else float(sensor.noise_std)


def _names(fields: Fields) -> Iterator[str]:
    """Yield the name of each number of the fields, ``inertia[0,1]``."""
    for name, field in fields.items():
        for index in np.ndindex(field.shape):
            yield f"{name}[{','.join(map(str, index))}]" if index else name


def _units(fields: Fields) -> Iterator[str]:
    for field in fields.values():
        yield from [field.unit] * prod(field.shape)
