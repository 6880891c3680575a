"""No control at all: the wheels' motors are off, and what else moves, moves."""

from dataclasses import dataclass

import numpy as np

from mjspace.contract import Measurement, Reference, TorqueCommand


@dataclass(frozen=True)
class Coast:
    """A law that asks for nothing: for a vehicle with passive damping, or to see it tumble."""

    batched = True

    def reset(self, measurement: Measurement, reference: Reference) -> None:
        """Return no state."""

    def step(
        self, state: None, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[None, TorqueCommand, None]:
        """Return zero torque [N m] of shape (..., 3), and nothing else."""
        return state, TorqueCommand(np.zeros_like(measurement.rate)), None
