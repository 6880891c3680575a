"""The hinges of a vehicle's parts that motors turn, as gimbals and wheels."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from mjspace.actuators.base import Actuator, Input, motors
from mjspace.scenario.equipment import Driven


def gimbals_and_wheels(hinges: Sequence[str]) -> Driven:
    """Return motors in the order of ``ctrl``, and the ``hinges`` of the same names that they turn.

    A hinge whose name ends in ``wheel`` is a wheel, any other a gimbal.
    """
    wheels = tuple(name for name in hinges if name.endswith("wheel"))
    gimbals = tuple(name for name in hinges if name not in wheels)
    return Driven(motors=tuple(hinges), gimbals=gimbals, wheels=wheels, encoded_wheels=wheels)


@dataclass(frozen=True, kw_only=True)
class HingeMotors(Actuator):
    """Base of motors on the hinges of parts; each pushes against what carries its hinge."""

    driven: Driven
    order: Any = field(init=False, repr=False)
    """Where each motor's hinge is among gimbals and then wheels, shape (m,)."""

    logged_as: ClassVar[str] = "motor_torque"
    unit: ClassVar[str] = "N m"
    stateful: ClassVar[bool] = True

    def __post_init__(self) -> None:
        measured = [*self.driven.gimbals, *self.driven.wheels]
        order = np.array([measured.index(name) for name in self.driven.motors])
        object.__setattr__(self, "order", order)

    @property
    def drives(self) -> Input:
        """The hinges' motors."""
        return motors(self.driven.motors)
