"""A law without control: the wheels' motors are off, other joints move freely."""

from dataclasses import dataclass

import numpy as np

from mjspace.contract import Measurement, Reference, TorqueCommand


@dataclass(frozen=True)
class Coast:
    """Commands zero torque: for a vehicle with passive damping, or for a free tumble."""

    batched = True

    def reset(self, measurement: Measurement, reference: Reference) -> None:
        """Return no state."""

    def step(
        self, state: None, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[None, TorqueCommand, None]:
        """Return zero torque [N m], shape (..., 3); there is no state and no signal."""
        return state, TorqueCommand(np.zeros_like(measurement.rate)), None
