"""The hinges of a vehicle's parts that motors turn, as gimbals and wheels."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjspace.scenario.equipment import Driven


def gimbals_and_wheels(hinges: Sequence[str]) -> Driven:
    """Return motors in the order of ``ctrl``, and the ``hinges`` of the same names that they turn.

    A hinge whose name ends in ``wheel`` is a wheel, any other a gimbal.
    """
    wheels = tuple(name for name in hinges if name.endswith("wheel"))
    gimbals = tuple(name for name in hinges if name not in wheels)
    return Driven(motors=tuple(hinges), gimbals=gimbals, wheels=wheels, encoded_wheels=wheels)


def motor_order(driven: Driven) -> Any:
    """Return where each motor's hinge is among gimbals and then wheels, shape (m,)."""
    measured = [*driven.gimbals, *driven.wheels]
    return np.array([measured.index(name) for name in driven.motors])
