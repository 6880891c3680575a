"""Refuses or warns of models that would fly wrongly without a word from MuJoCo."""

from typing import Any


def check(model: Any, fastest: float = 0.0) -> None:
    """Check ``model``."""
