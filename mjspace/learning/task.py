"""The task of a learner: observation, reward and end of each control period, from the scenario."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjspace.contract import Array
from mjspace.errors import FlightError, failure, input_error_at
from mjspace.learning.signals import Signals, reader, rows
from mjspace.scenario.scenario import Scenario
from mjspace.scenario.task import Task as TaskTable
from mjspace.scenario.trust import Trust
from mjspace.signals import magnitude

TOLERATED_ERROR = np.radians(1.0)
"""Attitude error [rad] that earns the full reward where no check of the scenario bounds it."""

Reward = Callable[[Signals], Array]
"""Returns the reward of a control period that has led to these signals, (N,)."""


class Task:
    """What is observed, what is rewarded, and where an episode ends early."""

    def __init__(
        self, scenario: Scenario, folder: Path, signals: Signals, *, trust: bool = False
    ) -> None:
        """Find what the scenario's ``[task]`` names among the ``signals`` of its first instant.

        ``folder`` and ``trust`` are as of ``assemble``.

        Raises:
            InputError: no such signal or function, with the key and what would be right.
        """
        table = scenario.task or TaskTable()
        names = table.observation or _all_of(signals, "/measurement", "/reference")
        self._observed = {
            label(name): reader(signals, name, f"task.observation.{number}")
            for number, name in enumerate(names)
        }
        self._rewards: list[Reward] = []
        for number, term in enumerate(table.reward):
            read = reader(signals, term.signal, f"task.reward.{number}.signal")
            power = 2 if term.squared else 1
            self._rewards.append(
                lambda now, read=read, power=power, weight=term.weight: (  # type: ignore[misc]
                    weight * magnitude(rows(read(now))) ** power
                )
            )
        if table.reward_function is not None:
            with input_error_at("task.reward_function"):
                function = Trust(folder, everything=trust).load(table.reward_function)
            self._rewards.append(lambda now: _returned(function, now))
        if not self._rewards:
            self._rewards.append(_tracking(scenario))
        self._ends = [
            (each, reader(signals, each.signal, f"task.terminate.{number}.signal"))
            for number, each in enumerate(table.terminate)
        ]

    def observation(self, signals: Signals) -> dict[str, Array]:
        """Return what is observed, (N, ...) each, by name."""
        return {name: read(signals) for name, read in self._observed.items()}

    def judged(
        self, signals: Signals, diverged: NDArray[np.bool_]
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return (reward, whether the episode ends early) of the period that led here, (N,) each.

        It ends, with reward 0, where the state has ``diverged`` (N,).

        Raises:
            FlightError: the scenario's function raised, or returned no number for a vehicle.
        """
        reward = np.sum([each(signals) for each in self._rewards], axis=0)
        ends = diverged.copy()
        for ending, read in self._ends:
            inside = ending.admits(magnitude(rows(read(signals))))
            reward = reward + np.where(inside & ~ends, float(ending.reward), 0.0)
            ends |= inside
        return np.where(diverged, 0.0, reward), ends


def label(signal: str) -> str:
    """Return the name of a signal in an observation: "rate" and "reference_rate"."""
    topic, _, name = signal.removeprefix("/").partition(".")
    return name if topic == "measurement" else f"{topic}_{name}"


def _all_of(signals: Signals, *topics: str) -> list[str]:
    found = signals.topics()
    return [f"{topic[1:]}.{name}" for topic in topics for name in found[topic]]


def _returned(function: Callable[..., Any], signals: Signals) -> Array:
    """Return what the scenario's function makes of each vehicle, (N,)."""
    time, measurement = signals.period.time, signals.period.measurement
    rewards = np.empty(len(signals.period.physics))
    truth, desired = signals.truth(), signals.desired
    for vehicle in range(len(rewards)):
        own = [type(each)(*(a[vehicle] for a in each)) for each in (truth, signals.command)]
        one = measurement._map(lambda values, vehicle=vehicle: values[vehicle])  # type: ignore[misc]
        try:
            returned = function(time, own[0], one, desired, own[1])
        except BaseException as error:
            raise failure("the reward", error) from error
        if np.size(returned) != 1 or not isinstance(returned, float | int | np.ndarray | np.number):
            raise FlightError(f"the reward returned {returned!r}: it must return a number")
        rewards[vehicle] = float(np.reshape(returned, ()))
    return rewards


def _tracking(scenario: Scenario) -> Reward:
    """Return the reward bound / (true attitude error), at most 1.

    The bound is the tightest ``below`` of the checks that bound the error at the instant
    (statistic max or peak of truth.attitude_error), or ``TOLERATED_ERROR`` where none does.
    """
    bounds = [
        (check.start, math.inf if check.end is None else check.end, check.below)
        for check in scenario.checks
        if check.signal.removeprefix("/").removesuffix("[0]") == "truth.attitude_error"
        and check.statistic in ("max", "peak")
        and check.target is None
        and check.below
    ]

    def reward(signals: Signals) -> Array:
        now = signals.period.time
        active = [below for start, end, below in bounds if start <= now <= end]
        bound = min(active, default=TOLERATED_ERROR)
        error = signals.of("/truth", "attitude_error")[:, 0]
        earned: Array = bound / np.maximum(error, bound)
        return earned

    return reward
