"""Flights that begin on their reference."""

import numpy as np

from mjspace.contract import ReferenceSource
from mjspace.scenario.scenario import Scenario


def on_reference(scenario: Scenario, reference: ReferenceSource) -> Scenario:
    """Return the scenario with the initial state that its ``reference`` has, where it asks for it.

    That state is written out, so that the scenario as flown says it.
    """
    if not scenario.initial.on_reference:
        return scenario
    start = reference.at(np.zeros(1))
    names = {"attitude", "rate", "position", "velocity"} & set(start._fields)
    state = {name: getattr(start, name)[0].tolist() for name in names}
    initial = scenario.initial.model_copy(update={**state, "on_reference": False})
    return scenario.model_copy(update={"initial": initial})
