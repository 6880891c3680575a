"""Where a flight begins and ends: time zero of a scenario, or any logged period."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.environment.connection import Latch
from mjspace.environment.install import install_callbacks, places_of
from mjspace.environment.magnetic_field import MOMENT
from mjspace.errors import InputError
from mjspace.scenario.scenario import Scenario
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.effects import effects_of
from mjspace.simulation.known_beforehand import changing
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


@dataclass(frozen=True)
class Start:
    """Where a flight begins: any period of any flight, with everything that is remembered there."""

    period: int
    physics: Array
    """MuJoCo's integration state, (N, nstate)."""
    sensors: dict[str, Array]
    """The sensors' state before they sample in this period."""
    law: Any
    """The law's state before it steps in this period; None: the law is reset here."""
    actuators: dict[str, Array] = field(default_factory=dict)
    """What actuators and step effects remember at the period's start."""
    model: dict[str, Array] = field(default_factory=dict)
    """Fields of MuJoCo's model in which the vehicles differ, (N, ...)."""
    models: Sequence[Any] = ()
    """Or a compiled model of each vehicle, of the sizes of the assembly's; step effects that change
    a model's fields cannot fly with them."""


def last_period(scenario: Scenario) -> int:
    """Return the number of the scenario's last control period."""
    return math.floor(scenario.duration / scenario.rates.control + 1e-6)


def first_start(assembly: Assembly, members: Sequence[int]) -> Start:
    """Return time zero of the scenario for these members."""
    return start_at(assembly, initial_physics(assembly, len(members)), members)


def initial_physics(assembly: Assembly, vehicles: int) -> Array:
    """Return MuJoCo's integration state at time zero of the scenario, (N, nstate)."""
    model = assembly.vehicle.model
    data = mujoco.MjData(model)
    data.qpos, data.qvel = assembly.qpos, assembly.qvel
    data.userdata = assembly.userdata
    row = np.empty(mujoco.mj_stateSize(model, INTEGRATION))
    mujoco.mj_getState(model, data, row, INTEGRATION)
    return np.repeat(row[None], vehicles, axis=0)


def state_of_log(assembly: Assembly, physics: Array) -> Array:
    """Return a logged integration state, (1, nstate), with the constants of the ``assembly`` in it.

    ``userdata`` tells the native callbacks which memory to read and write. Of a log, which may be a
    stranger's, only what changes in flight is taken: the magnetic field, the Sun's position, the
    air's density, the elements of a drifting orbit, the moment, and the states of connections.

    Raises:
        InputError: a number of it is not finite.
    """
    bad = np.flatnonzero(~np.isfinite(physics[0]))
    if len(bad):
        raise InputError(f"log: /state.physics[{bad[0]}] is {physics[0, bad[0]]}, not finite")
    model = assembly.vehicle.model
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, physics[0], INTEGRATION)
    constants = assembly.userdata.copy()
    changes = changing(assembly.known, assembly.scenario)
    if assembly.scenario.environment.magnetic_field is not None:
        changes.append(MOMENT)
    for part in changes:
        constants[part] = data.userdata[part]
    states = places_of(Latch, assembly.scenario.environment, assembly.scenario.plant)
    constants[states] = data.userdata[states]
    data.userdata = constants
    row = np.empty_like(physics)
    mujoco.mj_getState(model, data, row[0], INTEGRATION)
    return row


def start_at(assembly: Assembly, physics: Array, members: Sequence[int]) -> Start:
    """Return time zero with the vehicles at ``physics`` (N, nstate) and nothing remembered."""
    install_callbacks()
    layout = StateLayout(assembly)
    effects = effects_of(assembly, layout, members)
    memory = assembly.actuators.reset(len(members))
    for effect in effects:
        memory |= effect.reset(physics)
    truth = truth_of(physics, memory, layout, assembly.actuators, effects)
    return Start(0, physics, assembly.sensors(members).reset(truth), None, memory)
