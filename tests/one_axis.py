"""A sampled integrator, whose stability is known in closed form: rate damping about one axis."""

from pathlib import Path

ONE_AXIS = """
base = "detumble-wheels"
description = "Rate damping about one axis, called every half second"
duration = "10 s"
checks = []

[rates]
physics = "0.5 s"
control = "0.5 s"

[initial]
rate = [0.01, 0, 0]
wheel_speed = [0, 0, 0]
"""
"""w[k + 1] = (1 - T gain / inertia) w[k], T = 0.5 s, with the bus' inertia less the wheel's."""


def written(folder: Path, text: str = ONE_AXIS) -> str:
    """Write the scenario ``text`` into the ``folder``; return its path."""
    path = folder / "one_axis.toml"
    path.write_text(text)
    return str(path)
