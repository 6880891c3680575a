"""A law of one's own: feedback of the attitude in modified Rodrigues parameters, 20 lines of NumPy.

It is what Basilisk's ``mrpFeedback`` computes without an integral term, for a desired attitude at
rest: Schaub and Junkins 2018, Analytical Mechanics of Space Systems, section 8.4.1. Once as it
can be compiled, and once as it cannot, with a branch on what is measured.
"""

from typing import Any, NamedTuple

import numpy as np

from mjspace import attitude
from mjspace.contract import Array, Measurement, Reference, TorqueCommand


class Signals(NamedTuple):
    """What is logged."""

    sigma: Array
    """Attitude error, modified Rodrigues parameters, (3,)."""


class Feedback:
    """u = -K sigma - P omega."""

    def __init__(self, stiffness: float = 60.0, damping: float = 60.0) -> None:
        self.stiffness, self.damping = stiffness, damping  # N m, N m s

    def reset(self, measurement: Measurement, reference: Reference) -> None:
        """It has no state."""

    def step(
        self, state: None, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[None, TorqueCommand, Signals]:
        """Return the torque on the bus."""
        error = attitude.multiply(attitude.conjugate(reference.attitude), measurement.attitude)
        sigma = self.parameters(error)
        torque = -self.stiffness * sigma - self.damping * measurement.rate
        return None, TorqueCommand(torque), Signals(sigma)

    def parameters(self, error: Any) -> Any:
        """Return the parameters of the shorter rotation, of q and -q."""
        error = np.where(error[0] < 0.0, -error, error)
        return error[1:] / (1.0 + error[0])


class Branching(Feedback):
    """The same, with ``if`` in place of ``np.where``."""

    def parameters(self, error: Any) -> Any:
        """Return the parameters of the shorter rotation, of q and -q."""
        if error[0] < 0.0:
            error = -error
        return error[1:] / (1.0 + error[0])
