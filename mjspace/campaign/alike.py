"""Which members of a campaign fly side by side, in rows of one batch: those that are alike.

They share law, sensors and actuators, and differ in where they start and in masses.
"""

import pickle
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mjspace.campaign.members import Population
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.effects import effects_of
from mjspace.simulation.initial_state import Start, initial_physics, start_at
from mjspace.simulation.state_layout import StateLayout

_STARTS = ("attitude", "euler", "rate", "position", "velocity", "wheel_speed", "momentum")
_MASSES = ("mass", "bus_inertia", "gyrostat_inertia", "vehicle_mass", "vehicle_inertia")
_MAY_DIFFER = {"initial": _STARTS, "plant": _MASSES}
"""The numbers of each table that are in a row of the state, or in a vehicle's compiled model."""


def may_be_alike(members: Population) -> bool:
    """Return whether the members are alike, as far as the keys of their dispersions tell."""
    may_differ = {f"{table}.{key}" for table, keys in _MAY_DIFFER.items() for key in keys}
    keys = {key.partition("[")[0] for each in members.dispersions for key in each.all_keys}
    of_plant = any(key.startswith("plant.") for key in keys)
    return keys <= may_differ and not (of_plant and _has_effects(members.nominal))


def alike(one: Assembly, other: Assembly) -> bool:
    """Return whether law, sensors, actuators and environment of the one do for the other as well.

    An engine's first thrust may depend on where the vehicle starts, and the torque of a wheel near
    its speed limit on the inertia: what actuators keep is compared itself. Step effects may keep
    numbers of one model, or change them.
    """
    if one.vehicle is not other.vehicle and _has_effects(one):
        return False
    moved = {}
    for table, keys in _MAY_DIFFER.items():
        numbers = getattr(one.scenario, table)
        moved[table] = getattr(other.scenario, table).model_copy(
            update={key: getattr(numbers, key) for key in keys}
        )
    if one.scenario != other.scenario.model_copy(update=moved):
        return False
    return pickle.dumps(one.actuators) == pickle.dumps(other.actuators)


def start_of(assemblies: Sequence[Assembly], members: Sequence[int]) -> Start:
    """Return where members that are ``alike`` start, of these numbers, in rows of one batch."""
    physics = np.concatenate([initial_physics(each, 1) for each in assemblies])
    start = start_at(first := assemblies[0], physics, members)
    if all(each.vehicle is first.vehicle for each in assemblies):
        return start
    return replace(start, models=[each.vehicle.model for each in assemblies])


def _has_effects(assembly: Assembly) -> bool:
    return bool(effects_of(assembly, StateLayout(assembly), [0]))
