"""Many episodes of a scenario at once, on MuJoCo's batch, as a ``gymnasium.vector.VectorEnv``."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from mjspace.contract import Array, Event
from mjspace.errors import InputError
from mjspace.gym import spaces
from mjspace.gym.episodes import Episodes, Flight
from mjspace.gym.pictures import Pictures

Rows = NDArray[np.bool_]
"""True for some of the environments, (num_envs,)."""


def load_vector(
    scenario: str | Path,
    num_envs: int,
    overrides: Iterable[str] = (),
    *,
    trust: bool = False,
    threads: int = 1,
    render_mode: str | None = None,
    autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
) -> "VectorEnvironment":
    """Return a ``gymnasium.vector.VectorEnv`` of ``num_envs`` episodes of a scenario.

    Each is bit for bit what ``load`` makes of its seed. ``threads`` share the vehicles that fly
    side by side; the rest is as of ``load``.

    Raises:
        InputError: bad input, in one line.
        UnsupportedMode: a ``render_mode`` that is neither None nor "rgb_array".
    """
    spaces.refuse_render_mode(render_mode)
    for name, number in (("num_envs", num_envs), ("threads", threads)):
        if number < 1:
            raise InputError(f"{name}: got {number}, should be at least 1")
    episodes = Episodes(scenario, overrides, trust=trust, threads=threads)
    return VectorEnvironment(episodes, num_envs, render_mode, AutoresetMode(autoreset_mode))


class VectorEnvironment(VectorEnv[Any, Any, Any]):
    """Environments that step together, each in an episode, and at a time, of its own.

    Those that began in one step fly side by side in one batch, until all have ended. With episodes
    that end with the scenario's duration alone, all do; where some terminate, their next episodes
    are batches of their own.

    Attributes:
        action_labels: of each number of an action, with its unit: "torque[0] [N m]".
        observation_labels: of each number of an observation: "rate[0]".
    """

    def __init__(
        self,
        episodes: Episodes,
        num_envs: int,
        render_mode: str | None,
        autoreset_mode: AutoresetMode,
    ) -> None:
        self.num_envs, self.render_mode = num_envs, render_mode
        self.metadata = spaces.metadata(episodes) | {"autoreset_mode": autoreset_mode}
        self.single_action_space = spaces.action_space(episodes)
        self.single_observation_space = spaces.observation_space(episodes)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_labels, self.observation_labels = episodes.action.labels, episodes.labels
        self._episodes, self._mode = episodes, autoreset_mode
        self._random = [np_random(None)[0] for _ in range(num_envs)]
        self._flights: list[tuple[NDArray[np.int_], Flight]] = []
        """Which environments fly in each."""
        self._over = np.ones(num_envs, dtype=bool)
        self._observation = np.zeros(self.observation_space.shape or ())
        self._pictures: Pictures | None = None

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode in each environment, or in those of ``options["reset_mask"]``.

        A ``seed`` s seeds environment i with s + i; a list has one for each. ``info`` has the
        ``member`` that each flies; ``options["member"]`` has one for each environment.

        Raises:
            InputError: the scenario does not admit what a member drew.
            ValueError: an option or a number of seeds that does not fit.
        """
        options = dict(options or {})
        chosen = self._chosen(options.pop("reset_mask", None))
        for row, one in enumerate(self._seeds(seed)):
            if one is not None and chosen[row]:
                self._random[row] = np_random(one)[0]
        given = self._of_each("member", options.pop("member", None))
        each = [options if one is None else {**options, "member": one} for one in given]
        members = self._begin(chosen, each)
        return self._observation.copy(), members

    def step(self, actions: Array) -> tuple[Array, Array, Rows, Rows, dict[str, Any]]:
        """Fly one control period of each environment; where an episode is over, the next begins.

        Under ``AutoresetMode.NEXT_STEP`` that is all that a step does in such an environment.
        ``info`` has the ``events`` of those in which there were any.

        Raises:
            ResetNeeded: an episode is over that nothing resets.
            ValueError: the actions have another shape.
            FlightError: a part of a flight, such as the user's disturbance, raised an error.
        """
        numbers = np.asarray(actions, dtype=float)
        if numbers.shape != self.action_space.shape:
            raise ValueError(
                f"the actions have shape {numbers.shape}: it must be {self.action_space.shape}, of "
                f"{', '.join(self.action_labels)}"
            )
        before = self._over
        if before.any() and (self._mode is AutoresetMode.DISABLED or not self._flights):
            raise ResetNeeded("episodes are over, or none has begun: reset the environments")
        reward = np.zeros(self.num_envs)
        ends, late = (np.zeros(self.num_envs, dtype=bool) for _ in range(2))
        events: dict[int, list[Event]] = {}
        self._keep(~before)
        for rows, flight in self._flights:
            step = flight.step(numbers[rows])
            self._observation[rows], reward[rows] = step.observation, step.reward
            ends[rows], late[rows] = step.terminated, step.truncated
            for event in step.events:
                row = int(rows[event.vehicle])
                events.setdefault(row, []).append(event._replace(vehicle=row))
        self._over = ends | late
        again = self._over if self._mode is AutoresetMode.SAME_STEP else before
        info = self._told(events, final=self._over & again)
        for name, value in self._begin(again, [{}] * self.num_envs).items():
            info[name] = value
        return self._observation.copy(), reward, ends, late, info

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of each vehicle, (height, width, 3), under ``render_mode="rgb_array"``.

        Raises:
            ResetNeeded: no episode has begun.
            NoRendererError: this machine cannot render; the message says what to install.
        """
        if self.render_mode is None:
            return None
        if not self._flights:
            raise ResetNeeded("no episode has begun: reset the environments first")
        self._pictures = self._pictures or Pictures(self._episodes.nominal)
        frames = {
            int(row): self._pictures.of(flight, place)
            for rows, flight in self._flights
            for place, row in enumerate(rows)
        }
        return tuple(frames[row] for row in range(self.num_envs))

    def close_extras(self, **_: Any) -> None:
        """Free what rendering needs."""
        if self._pictures is not None:
            self._pictures.close()
        self._pictures = None

    def state(self, row: int) -> dict[str, Array]:
        """Return what ``/state`` logs of an environment's control instant, but for the law's.

        Raises:
            ResetNeeded: no episode has begun.
        """
        for rows, flight in self._flights:
            if row in rows:
                return flight.state(int(np.flatnonzero(rows == row)[0]))
        raise ResetNeeded("no episode has begun: reset the environments first")

    def _begin(self, chosen: Rows, options: Sequence[dict[str, Any]]) -> dict[str, Any]:
        """Begin episodes in the ``chosen`` environments; return the information of that."""
        self._keep(~chosen)
        info: dict[str, Any] = {}
        rows = np.flatnonzero(chosen)
        members = [spaces.member_of(options[row], self._random[row]) for row in rows.tolist()]
        for row, member in zip(rows, members, strict=True):
            info = self._add_info(info, {"member": member}, int(row))
        first = 0
        for flight in self._episodes.begin(members):
            own = rows[first : first + len(flight.members)]
            self._flights.append((own, flight))
            self._observation[own] = flight.observation()
            first += len(own)
        self._over[chosen] = False
        return info

    def _keep(self, kept: Rows) -> None:
        """Fly on with the ``kept`` environments alone."""
        self._flights = [
            (rows[kept[rows]], flight if kept[rows].all() else flight.only(kept[rows]))
            for rows, flight in self._flights
            if kept[rows].any()
        ]

    def _told(self, events: dict[int, list[Event]], final: Rows) -> dict[str, Any]:
        """Return the information of a step; of episodes that are reset in it as the final one."""
        info: dict[str, Any] = {}
        for row in range(self.num_envs):
            if final[row]:
                own = {"events": events.get(row, [])}
                last = {"final_obs": self._observation[row].copy(), "final_info": own}
                info = self._add_info(info, last, row)
            elif row in events:
                info = self._add_info(info, {"events": events[row]}, row)
        return info

    def _chosen(self, mask: Any) -> Rows:
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        chosen = np.asarray(mask)
        if chosen.dtype != bool or chosen.shape != (self.num_envs,) or not chosen.any():
            raise ValueError(
                f"options: reset_mask {mask!r}: should be an array of {self.num_envs} truth "
                "values, one of them true"
            )
        return chosen

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if isinstance(seed, int | np.integer):
            return [int(seed) + row for row in range(self.num_envs)]
        return self._of_each("seed", seed)

    def _of_each(self, name: str, values: Sequence[Any] | None) -> Sequence[Any]:
        """Return a value for each environment; None for all where there are none.

        Raises:
            ValueError: another number of them.
        """
        if values is None:
            return [None] * self.num_envs
        if np.ndim(values) != 1 or len(values) != self.num_envs:
            raise ValueError(f"{name}: got {values!r}, should be one for each of {self.num_envs}")
        return values
