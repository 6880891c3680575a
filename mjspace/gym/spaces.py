"""The spaces of actions and observations, and what an environment may be told at a reset."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.error import UnsupportedMode
from gymnasium.spaces import Box

from mjspace.gym.episodes import MEMBERS, Episodes

RENDER_MODES = ["rgb_array"]


def action_space(episodes: Episodes) -> Box:
    """Return the space of actions: what the actuators can apply."""
    action = episodes.action
    return Box(action.least, action.largest, dtype=np.float64)


def observation_space(episodes: Episodes) -> Box:
    """Return the space of observations, unbounded."""
    return Box(-np.inf, np.inf, (len(episodes.labels),), np.float64)


def metadata(episodes: Episodes) -> dict[str, Any]:
    """Return what Gymnasium wants to know of pictures."""
    fps = 1.0 / episodes.nominal.scenario.rates.control
    return {"render_modes": RENDER_MODES, "render_fps": fps}


def refuse_render_mode(mode: str | None) -> None:
    """Refuse a way to render that there is not.

    Raises:
        UnsupportedMode: with those that there are.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise UnsupportedMode(f"render_mode {mode!r}: should be 'rgb_array' or None")


def member_of(options: Mapping[str, Any] | None, random: np.random.Generator) -> int:
    """Return the member of the campaign that flies next: that of the ``options``, or a random one.

    Raises:
        ValueError: an option that there is not, or no number of a member.
    """
    options = options or {}
    for name in options:
        if name != "member":
            raise ValueError(f"options: no {name!r}: have 'member'")
    member = options.get("member")
    if member is None:
        return int(random.integers(MEMBERS))
    if isinstance(member, bool) or not isinstance(member, int | np.integer) or member < 0:
        raise ValueError(f"options: member {member!r}: should be a whole number from 0")
    return int(member)
