"""The terms that there are: those of the scenario's environment, and those of the plant.

A term of the environment is registered by its key in ``scenario.environment.Environment``.
"""

from collections.abc import Iterator

from mjspace.environment.base import Term
from mjspace.environment.bearing_friction import BearingFriction
from mjspace.environment.compiled import compiled
from mjspace.environment.connection import Latch
from mjspace.environment.torque_ripple import TorqueRipple
from mjspace.environment.vibration import HingeVibration
from mjspace.scenario.declared import tables_in, type_of
from mjspace.scenario.environment import Environment
from mjspace.scenario.plant import PlantTable

OF_PLANT: tuple[
    type[BearingFriction] | type[TorqueRipple] | type[Latch] | type[HingeVibration], ...
] = (
    BearingFriction,
    TorqueRipple,
    Latch,
    HingeVibration,
)


def kernels() -> dict[int, compiled]:
    """Return the kernel for each kind of block in ``userdata``.

    Raises:
        ValueError: two terms have the same kind of block.
    """
    blocks = [(kind, term) for term in _kinds() for kind in term.kernels]
    found = dict(blocks)
    for kind, term in blocks:
        if found[kind] is not term:
            names = f"{term.__name__} and {found[kind].__name__}"
            raise ValueError(
                f"{names} both have blocks of kind {kind}: {max(found) + 1} is free for a new one"
            )
    return {kind: term.kernels[kind] for kind, term in blocks}


def _kinds() -> Iterator[type[Term]]:
    for field in Environment.model_fields.values():
        for table in tables_in(type_of(field)):
            if issubclass(table, Term):
                yield table
    yield from OF_PLANT


def terms_of(environment: Environment, plant: PlantTable | None) -> list[Term]:
    """Return what acts on a vehicle, in the order of the blocks in ``userdata``."""
    of_plant = [] if plant is None else [term for kind in OF_PLANT for term in kind.of(plant)]
    return [*environment.terms, *of_plant]
