"""The task of a learner: what it observes, what it is rewarded for, and where an episode ends."""

from typing import Annotated

from mjspace.scenario.fields import AnyUnit, Finite, KindName, Switch, Table
from mjspace.scenario.region import Region


class RewardTerm(Table):
    """A part of the reward of each control period: weight times signal, or its square."""

    signal: str
    """As an observation; of a vector its norm."""
    weight: Finite
    """Per unit of the signal in SI; negative where the signal is to be small."""
    squared: Switch = False
    """The signal's square counts."""


class Ending(Region):
    """Where an episode ends before the scenario's duration: a signal is inside."""

    reward: Annotated[Finite, AnyUnit] = 0.0
    """Added to that of the last control period."""


class Task(Table):
    """What an environment for reinforcement learning observes and rewards."""

    observation: list[str] = []
    """Signals side by side, of ``measurement``, ``reference``, ``error``, ``truth`` and
    ``command``: ``"measurement.rate"``, ``"error.attitude[0]"``. Measurement and reference, all of
    them, when left out."""
    reward: list[RewardTerm] = []
    """Its terms, of which the sum counts. Without terms and function: bound / attitude error, at
    most 1, with the tightest bound on ``truth.attitude_error`` that a check sets then, or 1 deg."""
    reward_function: KindName | None = None
    """``"file.py:function"`` in the scenario's folder, which adds to the terms:
    ``function(time, truth, measurement, reference, command)`` returns a number."""
    terminate: list[Ending] = []
    """Where an episode ends before the scenario's duration. Where the state is not finite it always
    does."""
