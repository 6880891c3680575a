"""What the tests of the double-gimbal CMG's laws share: a bus, its rates, measurements."""

import numpy as np

from mjspace.contract import Measurement, Reference

BUS = np.array([[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]])
RATES = {"inertia": BUS, "control_period": 1e-3, "inner_period": 1e-4}
AT_REST = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))


def measured(
    vehicles: int, *, wheel_speed: float = 80.0, spread: float = 1.0, seed: int = 0
) -> Measurement:
    """Return a random measurement; ``wheel_speed`` is the mean, ``spread`` its deviation."""
    random = np.random.default_rng(seed)
    q = random.normal(size=(vehicles, 4))
    return Measurement(
        attitude=q / np.linalg.norm(q, axis=1, keepdims=True),
        rate=0.1 * random.normal(size=(vehicles, 3)),
        wheel_speed=wheel_speed + spread * random.normal(size=(vehicles, 1)),
        gimbal_angle=0.3 * random.normal(size=(vehicles, 2)),
        gimbal_rate=random.normal(size=(vehicles, 2)),
        current=random.normal(size=(vehicles, 3, 2)),
    )
