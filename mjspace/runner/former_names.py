"""Fields that the laws of earlier versions logged under other names: their logs still fly again."""

from collections.abc import Container, Mapping
from typing import TypeVar

Value = TypeVar("Value")

FORMER = {
    "applied_torque": "given",
    "desired_angles": "wanted_angles",
    "desired_current": "wanted_current",
    "desired_gimbal": "wanted_gimbal",
    "desired_speed": "wanted",
    "desired_thrust": "wanted_thrust",
    "desired_wheel_speed": "wheel_wanted",
    "estimated_attitude": "believed_attitude",
    "estimated_bias": "believed_bias",
    "estimated_position": "believed_position",
    "estimated_velocity": "believed_velocity",
}
"""Of a law's state or signals, by the present name."""
_STATE = "law_"  # begins the names of the law's state in /state


def logged_name(field: str, logged: Container[str]) -> str:
    """Return the name that ``field`` has in a log with the fields ``logged`` on its topic."""
    prefix = _STATE if field.startswith(_STATE) else ""
    former = prefix + FORMER.get(field.removeprefix(prefix), "")
    return former if field not in logged and former in logged else field


def as_logged(
    flown: Mapping[str, Mapping[str, Value]], topics: Mapping[str, Container[str]]
) -> dict[str, dict[str, Value]]:
    """Return what was ``flown``, by topic and field, under the names of a log with ``topics``."""
    return {
        topic: {logged_name(name, topics.get(topic, ())): value for name, value in fields.items()}
        for topic, fields in flown.items()
    }
