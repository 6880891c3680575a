"""Whether a sensor has reported a sample, and a new one."""

from typing import Any

import numpy as np

from mjspace.contract import Array, Measurement


def is_sample(quantity: str, measurement: Measurement) -> Any:
    """Return whether the sensor reports anything, (..., 1): not zeros, nor what is not valid.

    ``<quantity>_valid``, where the measurement has it, is 1.0 for a sample that is.
    """
    reported = np.any(getattr(measurement, quantity) != 0.0, axis=-1, keepdims=True)
    valid = getattr(measurement, f"{quantity}_valid", None)
    return reported if valid is None else reported & (valid > 0.5)


def is_new(quantity: str, measurement: Measurement, last: Array) -> Any:
    """Return whether the sensor reports another sample than the ``last``, (..., 1)."""
    changed = np.any(getattr(measurement, quantity) != last, axis=-1, keepdims=True)
    return changed & is_sample(quantity, measurement)
