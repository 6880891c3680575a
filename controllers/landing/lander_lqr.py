"""Linear-quadratic gain of the lander's virtual controls, paper 003, (31)."""

import numpy as np
from scipy.linalg import solve_continuous_are

from mjspace.contract import Array

PRINTED = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.316],
        [0.0, -14.14, 1062.5, 0.0, 0.0, -1.31, 0.0],
        [-0.001, 0.0, 0.0, 0.0218, -0.374, 0.0, 0.0],
    ]
)
"""K of table 4 (3, 7): rows for (x', w2L, w3L), columns for z3 to z9, SI and radians.

The third row has the wrong sign (erratum 10), which a negative k3 compensates. 1062.5 should read
1062.9, and other entries are truncated, not rounded (erratum 11).
"""
STATE_WEIGHTS = np.diag([1e2, 1e9, 4e12, 1e3, 7e6, 7e6, 1e2])
"""Q of section 4, over z3 to z9."""
CONTROL_WEIGHTS = np.diag([1e3, 5e6, 1e8])
"""R of section 4."""


def controllable_part(thrust_acceleration: float = 1.6, radius: float = 1e4) -> tuple[Array, Array]:
    """Return A (7, 7) and B (7, 3) of z3 to z9 under the virtual controls (x', w2L, w3L).

    z = (r, (theta - alpha)/sqrt 2, -theta', -r', gammaL, -phiL, x): these signs follow from the
    paper's T; its list of z has others (erratum 12). ``thrust_acceleration`` is Fe/m [m/s^2],
    ``radius`` is re [m].
    """
    a, b = np.zeros((7, 7)), np.zeros((7, 3))
    a[0, 3], a[1, 2] = -1.0, -np.sqrt(2.0)
    a[2, 5], a[3, 4] = -thrust_acceleration / radius, -thrust_acceleration
    b[4, 2], b[5, 1], b[6, 0] = 1.0, -1.0, 1.0
    return a, b


def lqr_gain(
    state_weights: Array = STATE_WEIGHTS, control_weights: Array = CONTROL_WEIGHTS
) -> Array:
    """Return K (3, 7) of X2L = -K z, (30), from the algebraic Riccati equation.

    ``state_weights`` (7, 7) and ``control_weights`` (3, 3) are Q and R.
    """
    a, b = controllable_part()
    cost = solve_continuous_are(a, b, state_weights, control_weights)
    gain: Array = np.linalg.solve(control_weights, b.T @ cost)
    return gain
