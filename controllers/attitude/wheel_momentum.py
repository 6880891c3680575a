"""Angular momentum of reaction wheels in body axes."""

from typing import Any

from mjspace.algebra import times, transpose
from mjspace.contract import Array, Measurement


def wheel_momentum(law: Any, measurement: Measurement) -> Array:
    """Return h = sum a Jw (a.w + Omega) [N m s], (..., 3), absolute, from the tachometers.

    ``law`` has ``wheel_axes`` a (n, 3) and ``wheel_inertia`` Jw (n,) [kg m^2]. Wheels in gimbals,
    which come after them, are not among them.
    """
    speed = measurement.wheel_speed[..., : law.wheel_axes.shape[-2]]
    spin = times(law.wheel_axes, measurement.rate) + speed
    return times(transpose(law.wheel_axes), law.wheel_inertia * spin)
