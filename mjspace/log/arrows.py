"""What of a log viewers draw as arrows at the bus, and in which colors."""

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
    Arrow("angular velocity", "/truth", "rate", (255, 140, 0), True),
    Arrow("commanded torque", "/command", "torque", (220, 60, 220), True),
    Arrow("disturbance torque", "/disturbance", "torque", (0, 200, 200), True),
    Arrow("total momentum", "/truth", "momentum", (150, 150, 150), False),
)
