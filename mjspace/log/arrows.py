"""What of a log viewers draw as arrows at the bus, and in which colors; pictures have the same."""

from typing import NamedTuple


class Arrow(NamedTuple):
    """A vector that is drawn at the bus."""

    name: str
    topic: str
    field: str
    """Of three numbers."""
    color: tuple[int, int, int]
    """Red, green and blue, 0 to 255."""
    in_body: bool
    """Whether it is in body axes; else in inertial ones."""


ARROWS = (
    Arrow("angular velocity", "/truth", "rate", (179, 128, 255), True),
    Arrow("commanded torque", "/command", "torque", (242, 140, 26), True),
    Arrow("disturbance torque", "/disturbance", "torque", (220, 60, 220), True),
    Arrow("total momentum", "/truth", "momentum", (31, 179, 194), False),
)


THRUST = (255, 115, 25)
"""Of the arrows of thrusts, which act elsewhere: red, green and blue, 0 to 255."""
TRAIL = (255, 200, 60)
"""Of the trail of where the vehicle was."""


def color_of(name: str) -> tuple[int, int, int]:
    """Return red, green and blue of the arrow of that name, 0 to 255."""
    return next(arrow.color for arrow in ARROWS if arrow.name == name)


def to_one(color: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return red, green and blue from 0 to 1."""
    red, green, blue = color
    return red / 255.0, green / 255.0, blue / 255.0
