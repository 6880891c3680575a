"""Where a flight begins and ends: time zero of a scenario, or any logged period."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.scenario.scenario import Scenario
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.state_layout import StateLayout

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
    """The actuators' state at the period's start."""
    model: dict[str, Array] = field(default_factory=dict)
    """Fields of MuJoCo's model in which the vehicles differ, (N, ...)."""


def last_period(scenario: Scenario) -> int:
    """Return the number of the scenario's last control period."""
    return math.floor(scenario.duration / scenario.rates.control + 1e-6)


def first_start(assembly: Assembly, members: Sequence[int]) -> Start:
    """Return time zero of the scenario for these members."""
    model = assembly.vehicle.model
    data = mujoco.MjData(model)
    data.qpos, data.qvel = assembly.qpos, assembly.qvel
    data.userdata = assembly.userdata
    row = np.empty(mujoco.mj_stateSize(model, INTEGRATION))
    mujoco.mj_getState(model, data, row, INTEGRATION)
    physics = np.repeat(row[None], len(members), axis=0)
    actuators = assembly.actuators.reset(len(members))
    if (faults := assembly.faults(members)) is not None:
        actuators |= faults.reset()
    columns = StateLayout(assembly)
    truth = assembly.actuators.seen(actuators, columns.truth(physics))
    if columns.ground is not None:
        actuators |= columns.ground.reset(physics)
        truth = columns.ground.seen(actuators, truth)
    return Start(0, physics, assembly.sensors(members).reset(truth), None, actuators)
