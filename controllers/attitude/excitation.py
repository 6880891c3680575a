"""How much a motion excites the parameters that an adaptive law estimates."""

from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.gufunc import gufunc


def least_eigenvalue(Z: Array) -> Array:
    """Return the least eigenvalue of symmetric matrices (..., n, n), shape (..., 1).

    Not a number where a matrix is not finite, as when a flight diverges.
    """
    least: Array = _least.ufunc(Z)
    return least[..., None]


@gufunc(["void(f8[:,:], f8[:])"], "(n,n)->()")
def _least(Z: Any, least: Any) -> None:
    if np.isfinite(Z).all():
        least[0] = np.linalg.eigvalsh(np.ascontiguousarray(Z))[0]
    else:
        least[0] = np.nan
