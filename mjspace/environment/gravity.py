"""A planet's gravity in the frame of a landing site: origin on its sphere, z up."""

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from mjspace.contract import Array
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, add_wrench
from mjspace.environment.compiled import compiled
from mjspace.environment.constants import GM, RADIUS
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Positive, Si


@compiled
def central(gravity: Any, time: float, bodies: Bodies) -> None:
    """Add a planet's gravity on every body at its own place, with its gradient's torque.

    ``gravity``: the gravitational parameter [m^3/s^2], the origin's distance from the centre [m],
    from which it is along z.
    """
    for body in range(1, bodies.body_mass.size):
        mass = bodies.body_mass[body]
        if mass == 0.0:
            continue
        x, y, z = bodies.xipos[body]
        z += gravity[1]
        radius2 = x * x + y * y + z * z
        rate2 = gravity[0] / (radius2 * math.sqrt(radius2))
        scale = -mass * rate2
        force = (scale * x, scale * y, scale * z)
        torque = gradient_torque(bodies, body, x, y, z, 3.0 * rate2 / radius2)
        add_wrench(bodies, body, force, torque)


@compiled
def gradient_torque(
    bodies: Bodies, body: int, x: float, y: float, z: float, factor: float
) -> tuple[float, float, float]:
    """Return ``factor`` r x I r [N m], world axes, of ``body`` at r = (x, y, z) from the planet."""
    # the columns of ximat are the principal axes
    m, inertia = bodies.ximat[body], bodies.body_inertia[body]
    a = m[0] * x + m[3] * y + m[6] * z
    b = m[1] * x + m[4] * y + m[7] * z
    c = m[2] * x + m[5] * y + m[8] * z
    ta = factor * (inertia[2] - inertia[1]) * b * c
    tb = factor * (inertia[0] - inertia[2]) * c * a
    tc = factor * (inertia[1] - inertia[0]) * a * b
    return (
        m[0] * ta + m[1] * tb + m[2] * tc,
        m[3] * ta + m[4] * tb + m[5] * tc,
        m[6] * ta + m[7] * tb + m[8] * tc,
    )


class CentralGravity(Term):
    """A planet's gravity on every body, in the frame of a landing site.

    The frame's origin is on the sphere of the planet's radius, z up; it does not turn.
    """

    kernels: ClassVar = {6: central}

    body: Literal["earth", "moon"] = "moon"
    """What is landed on."""
    gm: Annotated[Positive, Si("m^3/s^2")] | None = None
    """Gravitational parameter; the body's when left out."""
    radius: Annotated[Positive, Si("m")] | None = None
    """From the planet's centre to the origin; the body's when left out."""

    def payload_size(self, environment: Environment) -> int:
        """Return the size of ``parameters``."""
        return 2

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return ``parameters``."""
        return self.parameters()

    def parameters(self) -> Array:
        """Return the gravitational parameter [m^3/s^2] and the distance to the centre [m], (2,)."""
        gm = GM[self.body] if self.gm is None else self.gm
        radius = RADIUS[self.body] if self.radius is None else self.radius
        return np.array([gm, radius])

    def acceleration(self, position: Array) -> Array:
        """Return the acceleration [m/s^2] at ``position`` [m], both (..., 3), site's frame."""
        gm, radius = self.parameters()
        from_centre = position + radius * np.array([0.0, 0.0, 1.0])
        distance = np.sqrt(np.sum(from_centre**2, axis=-1, keepdims=True))
        result: Array = -gm / distance**3 * from_centre
        return result

    def height(self, position: Array) -> Array:
        """Return the height above the sphere [m], (..., 1), at ``position`` [m], (..., 3)."""
        _, radius = self.parameters()
        up = position[..., 2:]
        square = np.sum(position**2, axis=-1, keepdims=True) + 2.0 * radius * up
        # Not the difference of two distances of 1e6 m, which would leave 1e-10 m of it.
        result: Array = square / (radius + np.sqrt(square + radius**2))
        return result

    def check_environment(self, environment: Environment) -> None:
        """Refuse a free-fall frame."""
        if environment.orbit is not None:
            raise ValueError("orbit and gravity are both given: fly round the planet or land on it")
