"""The truth of an instant: motion, actuators and step effects together."""

from collections.abc import Sequence

from mjspace.actuators.actuator_set import ActuatorSet
from mjspace.contract import Array, Measurement
from mjspace.simulation.state_layout import StateLayout
from mjspace.vehicle.step_effect import State, StepEffect


def truth_of(
    physics: Array,
    memory: State,
    layout: StateLayout,
    actuators: ActuatorSet,
    effects: Sequence[StepEffect],
) -> Measurement:
    """Return the truth at ``physics`` (..., N, nstate), views of it where that is possible.

    ``memory`` is what actuators and effects remember then, (..., N, k).
    """
    truth = actuators.measured(memory, layout.truth(physics))
    for effect in effects:
        truth = effect.add_to_truth(memory, truth)
    return truth
