"""One episode after another of a scenario, as a ``gymnasium.Env``."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from mjspace.contract import Array
from mjspace.gym import spaces
from mjspace.gym.episodes import Episodes, Flight
from mjspace.gym.pictures import Pictures


def load(
    scenario: str | Path,
    overrides: Iterable[str] = (),
    *,
    trust: bool = False,
    render_mode: str | None = None,
) -> "Environment":
    """Return the ``gymnasium.Env`` of a scenario, by name or path.

    ``overrides`` are ``"key=value"``, as ``--set`` takes them. An episode flies on the stepper of a
    flight: the commands that a flight logged, as actions, leave bit for bit the ``/state`` of that
    flight. An action takes the place of the estimator, the law and its inner loop, and is held for
    one control period. The scenario's ``[task]`` says what is observed and rewarded, and where an
    episode terminates; it is truncated at the scenario's duration.
    With ``trust`` the scenario may name files outside its folder and any installed module.

    Raises:
        InputError: bad input, in one line.
        UnsupportedMode: a ``render_mode`` that is neither None nor "rgb_array".
    """
    spaces.refuse_render_mode(render_mode)
    return Environment(Episodes(scenario, overrides, trust=trust), render_mode)


class Environment(gymnasium.Env[Any, Any]):
    """A scenario without its law: an action is a command, a step a control period.

    Each episode is another member of the scenario's campaign, with its own noise and its own draws
    of the ``[[dispersions]]``: a random one, or that of ``reset(options={"member": 3})``.

    Attributes:
        action_labels: of each number of an action, with its unit: "torque[0] [N m]".
        observation_labels: of each number of an observation: "rate[0]".
    """

    def __init__(self, episodes: Episodes, render_mode: str | None) -> None:
        self.metadata = spaces.metadata(episodes)
        self.render_mode = render_mode
        self.action_space = spaces.action_space(episodes)
        self.observation_space = spaces.observation_space(episodes)
        self.action_labels, self.observation_labels = episodes.action.labels, episodes.labels
        self._episodes = episodes
        self._flight: Flight | None = None
        self._over = True
        self._pictures: Pictures | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; return the first observation, and which ``member`` flies.

        Raises:
            InputError: the scenario does not admit what the member drew.
            ValueError: an option that there is not.
        """
        super().reset(seed=seed)
        member = spaces.member_of(options, self.np_random)
        (self._flight,) = self._episodes.begin([member])
        self._over = False
        return self._flight.observation()[0], {"member": member}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Fly one control period; ``info`` has its ``events``.

        Raises:
            ResetNeeded: the episode is over, or none has begun.
            ValueError: the action has another length.
            FlightError: a part of the flight, such as the user's disturbance, raised an error.
        """
        if self._flight is None or self._over:
            raise ResetNeeded("the episode is over, or none has begun: reset the environment")
        observation, reward, ends, over, events = self._flight.step(np.asarray(action)[None])
        self._over = bool(ends[0] or over[0])
        info = {"events": events}
        return observation[0], float(reward[0]), bool(ends[0]), bool(over[0]), info

    def render(self) -> Any:
        """Return a picture of the vehicle, (height, width, 3), under ``render_mode="rgb_array"``.

        Raises:
            ResetNeeded: no episode has begun.
            NoRendererError: this machine cannot render; the message says what to install.
        """
        if self.render_mode is None:
            return None
        if self._flight is None:
            raise ResetNeeded("no episode has begun: reset the environment first")
        self._pictures = self._pictures or Pictures(self._episodes.nominal)
        return self._pictures.of(self._flight, 0)

    def close(self) -> None:
        """Free what rendering needs."""
        if self._pictures is not None:
            self._pictures.close()
        self._pictures = None
        super().close()

    def state(self) -> dict[str, Array]:
        """Return what ``/state`` logs of the control instant, but for the law's.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._flight is None:
            raise ResetNeeded("no episode has begun: reset the environment first")
        return self._flight.state(0)
