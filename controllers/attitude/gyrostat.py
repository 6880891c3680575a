"""A satellite with reaction wheels as its laws know it: H w' = p x w + tau."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjspace.algebra import cross, times, transpose
from mjspace.contract import Array, Gains, Measurement, gain

from .wheel_momentum import wheel_momentum


@dataclass(frozen=True)
class Gyrostat(Gains):
    """Gains that the vehicle determines, and its equation of motion.

    p is the total momentum in body axes and tau the wheels' torque on the bus: paper 000, (2).
    """

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """H: of the vehicle less its wheels' axial inertia, about its centre of mass, body axes."""
    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""

    def total_momentum(self, measurement: Measurement) -> Array:
        """Return p = H w + sum a Jw (a.w + Omega) [N m s], (..., 3), from the tachometers."""
        return times(self.inertia, measurement.rate) + wheel_momentum(self, measurement)

    def torque_for(self, acceleration: Array, momentum: Array, rate: Array) -> Array:
        """Return tau = H w' - p x w [N m], (..., 3), that makes w' the ``acceleration``."""
        return times(self.inertia, acceleration) - cross(momentum, rate)

    def relative_momentum(self, measurement: Measurement) -> Array:
        """Return h = sum a Jw Omega [N m s], (..., 3): of the wheels' speeds alone."""
        return times(transpose(self.wheel_axes), self.wheel_inertia * measurement.wheel_speed)

    @cached_property
    def locked(self) -> Array:
        """H0 = H + sum a Jw a^T: with the wheels locked [kg m^2], (3, 3)."""
        axial = self.wheel_axes.T @ np.diag(self.wheel_inertia) @ self.wheel_axes
        locked: Array = self.inertia + axial
        return locked

    @cached_property
    def locked_inverse(self) -> Array:
        """The inverse of H0 [1/(kg m^2)], (3, 3)."""
        return np.asarray(np.linalg.inv(self.locked), float)
