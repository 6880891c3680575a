"""The matrices of a linear plant, with the names of its states, inputs and outputs."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from mjspace.contract import Array
from mjspace.errors import whole_or_none


@dataclass(frozen=True)
class LinearPlant:
    """x' = A x + B u, y = C x + D u; and x(t + T) = Ad x + Bd u under a command held for T."""

    A: Array
    """Shape (n, n)."""
    B: Array
    """Shape (n, m)."""
    C: Array
    """Shape (p, n)."""
    D: Array
    """Shape (p, m): zero, as a measurement comes before the command of its instant."""
    Ad: Array
    """Of one control period, by the flight's own integration, shape (n, n)."""
    Bd: Array
    """Shape (n, m)."""
    control_period: float
    """T [s]."""
    states: Array
    """Names of the states, ``rate[0]``, shape (n,)."""
    inputs: Array
    """Names of the fields of the command, ``torque[0]``, shape (m,)."""
    outputs: Array
    """Names of what sensors measure, shape (p,); of an attitude, a rotation vector, body axes."""
    state_units: Array
    """SI units, texts, shape (n,)."""
    input_units: Array
    """Shape (m,)."""
    input_least: Array
    """Of each input, shape (m,); -inf without a limit. Where it is 0, as a thruster's, the columns
    of B and Bd hold for what is above."""
    input_largest: Array
    """Of each input, shape (m,); inf without a limit."""
    output_units: Array
    """Shape (p,)."""
    noise_std: Array
    """Standard deviation of the white noise of each sample of the outputs, shape (p,)."""

    def save(self, path: str | Path) -> None:
        """Write the fields to an .npz file of NumPy's.

        Raises:
            OSError: it cannot be written.
        """
        path = Path(path)
        with whole_or_none(path), path.open("wb") as file:
            np.savez(file, **{f.name: getattr(self, f.name) for f in fields(self)})
