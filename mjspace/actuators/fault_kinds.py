"""Kinds of fault: what each makes of what an actuator should apply."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

from mjspace.contract import Array
from mjspace.units import whole_number

Noise = Callable[[], Array]


class FaultKind(ABC):
    """One kind of fault, of one or several motors. Arrays are (N, motors)."""

    applies: ClassVar[str]
    """What the motors apply under it, for the scenario reference."""
    has_value: ClassVar[bool] = True
    """Whether it has a ``value``."""
    is_positive: ClassVar[bool] = False
    """Whether that must be above zero."""
    random: ClassVar[bool] = False
    """Whether it draws random numbers."""
    remembers_begin: ClassVar[bool] = False
    """Whether what it remembers stays, while it is in force, what it was when it began."""
    remembers_faulty: ClassVar[bool] = False
    """Whether it remembers, while it is in force, what the motors applied, not what they should."""

    def memory(self, value: float, hold: float, key: str) -> int:
        """Return how many applied values, of ``hold`` [s] each, are remembered.

        Raises:
            ValueError: the value does not fit ``hold``; ``key`` is the value's in the scenario.
        """
        return 0

    def per_hold(self, value: float, hold: float) -> float:
        """Return what ``faulty`` is given as the value, where values are held for ``hold`` [s]."""
        return value

    @abstractmethod
    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return what is applied instead of ``right``.

        ``oldest`` is the oldest that is remembered, empty where nothing is; ``noise()`` is standard
        normal, white and of this fault alone.
        """


class Dead(FaultKind):
    """A motor without any output."""

    applies = "nothing"
    has_value = False

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return zero."""
        return right * 0.0


class Stuck(FaultKind):
    """A motor whose output does not change."""

    applies = "what it applied when the fault began"
    has_value = False
    remembers_begin = True

    def memory(self, value: float, hold: float, key: str) -> int:
        """Remember the last value."""
        return 1

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return the value of the begin."""
        return oldest


class Biased(FaultKind):
    """A motor with an offset."""

    applies = "``value`` more"

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return the sum."""
        return right + value


class Scaled(FaultKind):
    """A motor with a wrong gain."""

    applies = "``value`` times as much"

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return the product."""
        return right * value


class Delayed(FaultKind):
    """A motor that follows late."""

    applies = "what it should have applied ``value`` seconds before"
    is_positive = True

    def memory(self, value: float, hold: float, key: str) -> int:
        """Remember the values of the delay."""
        return whole_number(value, hold, key, "what is held by actuators")

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return the oldest."""
        return oldest


class Lagged(FaultKind):
    """A motor that follows slowly: y' = (u - y) / T with u held, applied as y is at the end."""

    applies = "what it should, behind a first-order lag with a time constant of ``value`` seconds"
    is_positive = True
    remembers_faulty = True

    def memory(self, value: float, hold: float, key: str) -> int:
        """Remember the last value."""
        return 1

    def per_hold(self, value: float, hold: float) -> float:
        """Return the part of a difference that is left after a hold."""
        return math.exp(-hold / value)

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return the last value, nearer to the right one."""
        return right + value * (oldest - right)


class Noisy(FaultKind):
    """A motor with white noise."""

    applies = "noise of standard deviation ``value`` more"
    is_positive = True
    random = True

    def faulty(self, right: Array, value: float, oldest: Array, noise: Noise) -> Array:
        """Return the sum."""
        return right + value * noise()


KINDS: dict[str, FaultKind] = {
    "dead": Dead(),
    "stuck": Stuck(),
    "biased": Biased(),
    "scaled": Scaled(),
    "delayed": Delayed(),
    "lagged": Lagged(),
    "noisy": Noisy(),
}
"""By the name in a scenario: a line registers each."""
