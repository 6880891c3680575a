"""A scenario's vehicle, linearized about its initial state by central differences in MuJoCo.

The states are errors from the nominal motion: ``position`` of the bus, inertial axes; ``attitude``,
the rotation vector from the nominal to the true body axes, in body axes; angles of hinges; the same
of other spacecraft, ``target.position``; and their rates: ``velocity``, inertial axes, ``rate``,
body axes, speeds of hinges; and activations of a model's own motors. The rows of A that are
kinematics are exact.
"""

from collections.abc import Iterable, Iterator
from math import prod
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, without_law
from mjspace.simulation.flight_software.interface import Field, Fields, interface_of, named_tuple
from mjspace.simulation.initial_state import INTEGRATION, initial_physics, start_at
from mjspace.simulation.linear_inputs import inputs_of, names_of, refuse_bent
from mjspace.simulation.linear_plant import LinearPlant
from mjspace.simulation.linear_states import kinematics, states_of
from mjspace.simulation.stepper import Stepper

_OF_HINGES = ("wheel_speed", "gimbal_angle", "gimbal_rate", "wheel_angle")
_STEP = 1e-5
"""Of a state, in SI, or as a part of it where it is larger than 1."""


def linearize(
    scenario: str | Path, overrides: Iterable[str] = (), *, trust: bool = False
) -> LinearPlant:
    """Return the vehicle of a scenario, by name or path, linearized about its initial state.

    The command about which it is linearized is zero; an input whose range begins there, as a
    thruster's, has its slope to that side. The law does not matter; ``overrides`` and ``trust`` are
    as in ``mjspace.run``.

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
    inputs = inputs_of(assembly, interface.command)
    model, vehicle = assembly.vehicle.model, assembly.vehicle
    names, units = zip(*states_of(vehicle), strict=True)
    kept = [i for i, name in enumerate(names) if name]
    nominal = initial_physics(assembly, 1)[0]
    _refuse_dry_friction(model, assembly.qvel)
    moved, step = _perturbed(model, nominal)
    nx, nu = len(step), len(inputs.step)
    # The nominal vehicle; each state moved up and down; each input moved up and down from its
    # centre, which comes last.
    physics = np.concatenate([nominal[None], moved, np.repeat(nominal[None], 3 * nu, axis=0)])
    moves_of_inputs = 1 + 2 * nx + np.arange(2 * nu)
    commands = np.zeros((len(physics), nu))
    commands[moves_of_inputs[::2]] = np.diag(inputs.centre + inputs.step)
    commands[moves_of_inputs[1::2]] = np.diag(inputs.centre - inputs.step)
    commands[len(commands) - nu :] = np.diag(inputs.centre)
    h = np.concatenate([step, inputs.step])

    def slopes(values: Array) -> Array:
        moved = values[1 : 1 + 2 * len(h)]
        return ((moved[::2] - moved[1::2]) / (2.0 * h[:, None])).T

    derivatives, truth = _at_once(assembly, physics, commands, interface.command)
    of_inputs = derivatives[len(commands) - nu :], derivatives[moves_of_inputs]
    refuse_bent(*of_inputs, [f"command.{name}" for name in names_of(interface.command)])
    of_activations = derivatives[1 + 4 * model.nv : 1 + 2 * nx]
    refuse_bent(derivatives[:1], of_activations, names[2 * model.nv :])
    dynamics = slopes(derivatives)
    after = _after_a_period(assembly, physics, commands, interface.command)
    moves = slopes(np.array([_difference(model, after[0], row) for row in after]))
    measured = dict(_outputs(assembly, interface.measurement))
    outputs = np.concatenate([_reported(truth, field) for field in measured.values()], axis=1)
    of_states = np.ix_(kept, kept)
    sensors = assembly.scenario.sensors
    control = assembly.scenario.rates.control
    noise = [
        np.full(prod(f.shape), _noise(sensors.get(name), control)) for name, f in measured.items()
    ]
    return LinearPlant(
        A=np.vstack([kinematics(model, assembly.qvel, nx), dynamics[:, :nx]])[of_states],
        B=np.vstack([np.zeros((model.nv, nu)), dynamics[:, nx:]])[kept],
        C=slopes(outputs)[:, kept],
        D=np.zeros((outputs.shape[1], nu)),
        Ad=moves[:, :nx][of_states],
        Bd=moves[:, nx:][kept],
        control_period=assembly.scenario.rates.control,
        states=np.array([names[i] for i in kept]),
        inputs=np.array(list(names_of(interface.command))),
        outputs=np.array(list(names_of(measured))),
        state_units=np.array([units[i] for i in kept]),
        input_units=np.array(list(_units(interface.command))),
        input_least=inputs.least,
        input_largest=inputs.largest,
        output_units=np.array(list(_units(measured))),
        noise_std=np.concatenate(noise),
    )


def _perturbed(model: Any, nominal: Array) -> tuple[Array, Array]:
    """Return states with each coordinate moved up and down, (2 n, nstate), and the steps (n,).

    The coordinates are those of ``qvel``, a rotation about body axes, then ``qvel`` and ``act``.
    """
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, nominal, INTEGRATION)
    qpos, qvel, act = data.qpos.copy(), data.qvel.copy(), data.act.copy()
    tangent = np.zeros(model.nv)
    at_zero = mujoco.MjData(model).qpos
    mujoco.mj_differentiatePos(model, tangent, 1.0, at_zero, qpos)
    steps = _STEP * np.maximum(1.0, np.abs(np.concatenate([tangent, qvel, act])))
    rows = []
    for i, step in enumerate(steps):
        for sign in (1.0, -1.0):
            data.qpos, data.qvel, data.act = qpos, qvel, act
            if i < model.nv:
                move = np.zeros(model.nv)
                move[i] = sign * step
                mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            elif i < 2 * model.nv:
                data.qvel[i - model.nv] += sign * step
            else:
                data.act[i - 2 * model.nv] += sign * step
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
    ends = np.cumsum([prod(field.shape) for field in fields.values()], dtype=int)
    parts = np.split(commands, ends, axis=1)[:-1]
    shapes = [(len(physics), *field.shape) for field in fields.values()]
    arrays = [part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)]
    period.law, period.signals = (), ()
    period.command = named_tuple("Command", fields)(*arrays)
    return stepper, period


def _at_once(
    assembly: Assembly, physics: Array, commands: Array, fields: Fields
) -> tuple[Array, Any]:
    """Return accelerations and the activations' derivatives, (N, nv + na), and the truth."""
    stepper, period = _stepper(assembly, physics, commands, fields)
    derivatives = [stepper.batch.bind(name) for name in ("qacc", "act_dot")]
    stepper.begin(period, flown=False)
    return np.concatenate(derivatives, axis=1), period.truth


def _after_a_period(assembly: Assembly, physics: Array, commands: Array, fields: Fields) -> Array:
    """Return the states after a control period, (N, nstate)."""
    stepper, period = _stepper(assembly, physics, commands, fields)
    stepper.begin(period)
    stepper.finish(period)
    after: Array = stepper.batch.state.copy()
    return after


def _difference(model: Any, nominal: Array, other: Array) -> Array:
    """Return the other state's error from the nominal one, in the coordinates of the states."""
    data = [mujoco.MjData(model) for _ in range(2)]
    for each, row in zip(data, (nominal, other), strict=True):
        mujoco.mj_setState(model, each, row, INTEGRATION)
    moved = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, moved, 1.0, data[0].qpos, data[1].qpos)
    return np.concatenate([moved, data[1].qvel - data[0].qvel, data[1].act - data[0].act])


def _refuse_memory(assembly: Assembly) -> None:
    """Refuse actuators that remember anything: it would be a state that no column has."""
    for kind in assembly.actuators.kinds:
        if remembered := ", ".join(kind.reset(1)):
            raise InputError(
                f"plant: {type(kind).__name__} has states of its own ({remembered}), which a "
                "linear model of the motion lacks: give a plant whose actuators have none"
            )
    if assembly.vehicle.model.nhistory:
        raise InputError(
            "plant.model: its motors act late (nsample, delay), which a linear model of the motion "
            "lacks: linearize it without"
        )


def _refuse_dry_friction(model: Any, qvel: Array) -> None:
    """Refuse a model's own dry friction where it is at rest: its slope there is the solver's."""
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONSTRAINT:
        return
    for dof in np.flatnonzero((model.dof_frictionloss > 0.0) & (np.abs(qvel) <= _STEP)):
        name = model.joint(int(model.dof_jntid[dof])).name
        raise InputError(
            f"plant.model: joint {name!r} has dry friction and is at rest, where it has no slope: "
            "linearize it in motion (initial.joint_speed), or without its frictionloss"
        )


def _outputs(assembly: Assembly, measurement: Fields) -> Iterator[tuple[str, Field]]:
    """Yield what depends on the motion at the instant alone, of what is measured."""
    sensors, own = assembly.scenario.sensors, {s.field: s for s in assembly.vehicle.sensors}
    for name, field in measurement.items():
        if field.measures in own:
            sensor = own[field.measures]
            of_motion, turns = not sensor.of_forces, sensor.is_attitude
        else:
            of_sensor = name in sensors and not sensors[name].integrates
            of_motion, turns = of_sensor or name in _OF_HINGES, field.measures == "attitude"
        if prod(field.shape) and of_motion:
            yield name, field._replace(shape=(3,), unit="rad") if turns else field


def _reported(truth: Any, field: Field) -> Array:
    """Return what an ideal sensor reports, (N, k); of an attitude its error from the first."""
    values: Array = getattr(truth, field.measures).reshape(len(truth.attitude), -1)
    if prod(field.shape) == values.shape[1]:
        return values
    error = attitude.multiply(attitude.conjugate(values[0]), values)
    return attitude.to_rotation_vector(error)


def _noise(sensor: Any, control: float) -> float:
    return 0.0 if sensor is None else float(sensor.noise(sensor.period or control))


def _units(fields: Fields) -> Iterator[str]:
    for field in fields.values():
        yield from [field.unit] * prod(field.shape)
