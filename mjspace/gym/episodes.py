"""Episodes: members of a scenario's campaign without its law, flown side by side where alike."""

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjspace.campaign.alike import alike, start_of
from mjspace.campaign.members import Campaign, populated
from mjspace.contract import Array, Event
from mjspace.learning.action import Action
from mjspace.learning.no_law import refuse_what_needs_a_law
from mjspace.learning.signals import Signals, rows
from mjspace.learning.task import Task
from mjspace.scenario.loading import read, validated
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.desired import Desired
from mjspace.simulation.initial_state import Start, last_period
from mjspace.simulation.stepper import Stepper

MEMBERS = 2**31
"""From how many members of the campaign episodes are drawn."""


class Episodes:
    """What the episodes of an environment have in common.

    Attributes:
        nominal: the scenario without draws, assembled.
        action: how actions are commands.
        labels: of each number that is observed: "rate[0]".
        last: number of the last control period.
    """

    def __init__(
        self, scenario: str | Path, overrides: Iterable[str], *, trust: bool, threads: int = 1
    ) -> None:
        """Load the scenario; ``threads`` share the vehicles of a batch.

        Raises:
            InputError: bad input, in one line.
        """
        # What an episode draws does not depend on how many there are.
        campaign = Campaign(str(scenario), (*overrides, "sampling=random"), MEMBERS, trust=trust)
        table, path, origins = read(campaign.scenario, campaign.all_overrides)
        with_law = validated(table, str(path), origins)
        refuse_what_needs_a_law(with_law)
        still = {key: value for key, value in table.items() if key != "estimator"}
        still["law"] = {"kind": "coast:Coast"}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they have been shown
            self._members = populated(campaign, still, path, path.parent, origins)
        self.nominal = self._members.nominal
        self.action, self.last = Action(self.nominal), last_period(self.nominal.scenario)
        self._threads = threads
        self.desired = Desired(self.nominal)
        signals = self._side_by_side([(0, self.nominal)]).signals()
        self.task = Task(self.nominal.scenario, path.parent, signals, trust=trust)
        observed = self.task.observation(signals).items()
        self.labels = [f"{name}[{i}]" for name, a in observed for i in range(rows(a).shape[1])]

    def observation(self, signals: Signals) -> Array:
        """Return what is observed, side by side, (N, n)."""
        return np.concatenate([rows(a) for a in self.task.observation(signals).values()], axis=1)

    def begin(self, members: Sequence[int]) -> "list[Flight]":
        """Return these members' flights at their start, in order: one for each that are alike.

        Raises:
            InputError: the scenario does not admit what a member drew.
        """
        groups: list[list[tuple[int, Assembly]]] = []
        for number in members:
            assembly = self._assembly(number)
            if not (groups and alike(groups[-1][0][1], assembly)):
                groups.append([])
            groups[-1].append((number, assembly))
        return [self._side_by_side(group) for group in groups]

    def _assembly(self, member: int) -> Assembly:
        return self._members.member(member)[0] if self._members.dispersions else self.nominal

    def _side_by_side(self, group: Sequence[tuple[int, Assembly]]) -> "Flight":
        numbers, assemblies = [number for number, _ in group], [each for _, each in group]
        start = start_of(assemblies, numbers)
        return Flight(self, assemblies[0], start, numbers, self._threads)


class Step(NamedTuple):
    """What a control period has led to, of each vehicle."""

    observation: Array
    """(N, n)"""
    reward: Array
    """(N,)"""
    terminated: NDArray[np.bool_]
    """Whether the task ends the episode here, (N,)."""
    truncated: NDArray[np.bool_]
    """Whether the scenario's duration is over, (N,)."""
    events: list[Event]
    """What happened in the period, such as a fault that began."""


class Flight:
    """Vehicles that began together, from one control instant to the next.

    Attributes:
        members: the numbers of the vehicles in the campaign.
        period: the control period that begins, sensed, without a command.
        applied: what each kind of actuator applied in the last one; None at the start.
    """

    def __init__(
        self,
        episodes: Episodes,
        assembly: Assembly,
        start: Start,
        members: Sequence[int],
        threads: int,
    ) -> None:
        self._episodes, self._assembly, self._threads = episodes, assembly, threads
        self.members, self._start = list(members), start
        self._observation: Array | None = None
        self.applied: tuple[Array, ...] | None = None
        action = episodes.action
        self._command = action.command(np.zeros((len(members), len(action.labels))))
        with np.errstate(all="ignore"):
            self._stepper = Stepper(assembly, start, members, threads=threads)
            self.period: ControlPeriod = self._stepper.sense(start.period)

    def step(self, actions: Array) -> "Step":
        """Fly one control period under ``actions`` (N, n).

        Raises:
            ValueError: the actions have another length.
            FlightError: a part of the flight, such as the user's disturbance, raised an error.
        """
        period, before = self.period, self.observation()
        period.command, period.signals = self._episodes.action.command(actions), ()
        with np.errstate(all="ignore"):
            self._stepper.begin(period)
            self._stepper.finish(period)
            self.period = self._stepper.sense(period.number + 1)
            self._command, self.applied = period.command, period.applied
            signals, diverged = self.signals(), self._diverged()
            observation = self._episodes.observation(signals)
            reward, ends = self._episodes.task.judged(signals, diverged)
        self._observation = np.where(diverged[:, None], before, observation)
        over = np.full(len(ends), self.period.number >= self._episodes.last)
        return Step(self.observation(), reward, ends, over, period.events)

    def observation(self) -> Array:
        """Return what is observed now, (N, n), an array of the caller's own.

        Where the state is not finite it is the last one before.
        """
        if self._observation is None:
            self._observation = self._episodes.observation(self.signals())
        return self._observation.copy()

    def signals(self) -> Signals:
        """Return what is known of the control instant."""
        desired = self._episodes.desired.at(self.period.number)
        return Signals(self._stepper.layout, self.period, desired, self._command)

    def state(self, row: int) -> dict[str, Array]:
        """Return what ``/state`` logs of a vehicle at the control instant, but for the law's."""
        period = self.period
        kept = {"physics": period.physics}
        kept |= {f"actuator_{name}": values for name, values in period.memory.items()}
        kept |= {f"sensor_{name}": values for name, values in period.sensors.items()}
        return {name: values[row].copy() for name, values in kept.items()}

    def _diverged(self) -> NDArray[np.bool_]:
        """Return where MuJoCo warned, or the motion is not finite or beyond 1e10, (N,)."""
        warned = self._stepper.batch.warning[:, :, 1].any(axis=-1)
        moving = self.period.physics[:, self._stepper.layout.moving]
        within = (np.abs(moving) <= mujoco.mjMAXVAL).all(axis=1)
        bad: NDArray[np.bool_] = warned | ~within
        return bad

    def only(self, rows: NDArray[np.bool_]) -> "Flight":
        """Return the flight of those of the vehicles, which goes on where it is."""
        places, period, models = np.flatnonzero(rows).tolist(), self.period, self._start.models
        start = Start(
            period.number,
            period.physics[rows],
            _of(period.sensors, rows),
            None,
            _of(period.memory, rows),
            models=[models[row] for row in places] if models else (),
        )
        members = [self.members[row] for row in places]
        flight = Flight(self._episodes, self._assembly, start, members, self._threads)
        flight._observation = self.observation()[rows]
        flight._command = type(self._command)(*(values[rows] for values in self._command))
        if self.applied is not None:
            flight.applied = tuple(values[rows] for values in self.applied)
        return flight


def _of(state: dict[str, Array], rows: NDArray[np.bool_]) -> dict[str, Array]:
    """Return what those of the vehicles remember."""
    return {name: values[rows] for name, values in state.items()}
