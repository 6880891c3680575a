"""Sloshing propellant as its mechanical analogue: a pendulum, or a mass between springs.

H. N. Abramson (ed.), "The dynamic behavior of liquids in moving containers", NASA SP-106, 1966, and
F. T. Dodge, "The new 'Dynamic behavior of liquids in moving containers'", Southwest Research
Institute, 2000, derive both, and give mass and frequency for tanks of many shapes. Under the
acceleration a of its tank a pendulum of length L swings at sqrt(a/L), whatever a is; a mass between
springs keeps its frequency, and represents one acceleration. Both are linear in small motions.
"""

import math
from typing import Annotated, Any, Literal, Self

import mujoco
import numpy as np
from pydantic import Field, model_validator

from mjspace.scenario.fields import Positive, Si
from mjspace.scenario.mounted import MovingPart, Report
from mjspace.vehicle.moving_parts import measure_place, new_part, set_inertia

_DENSITY = 1000.0  # kg/m^3, of the ball that is drawn
_RADIUS_OF_GYRATION = 1e-3
"""Of the point mass, as a share of the pendulum's arm or in m: MuJoCo moves no body without
inertia. It makes a pendulum slower by 5e-7."""
_HINGE, _SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
_ACROSS = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0]}


class Slosh(MovingPart):
    """The sloshing part of a tank's propellant; the other part of it belongs to the bus.

    The acceleration of the tank is along z. A pendulum hangs from the origin, along -z, on two
    hinges; a mass between springs rests in the origin, and slides along x and y.
    """

    model: Literal["pendulum", "spring"]
    """``pendulum`` has the frequency that follows from the present acceleration, ``spring`` one
    frequency."""
    mass: Annotated[Positive, Si("kg")]
    """Of what sloshes. It does not burn."""
    frequency: Annotated[Positive, Si("Hz")] | None = None
    """With the tank held, undamped; of a pendulum under ``acceleration``."""
    arm: Annotated[Positive, Si("m")] | None = None
    """Length of a pendulum, in place of ``frequency``."""
    acceleration: Annotated[Positive, Si("m/s^2")] | None = None
    """Of a pendulum's tank: that for which its ``frequency`` and ``damping_ratio`` hold."""
    damping_ratio: Annotated[float, Field(ge=0, lt=1, strict=True)] = 0.0
    """With the tank held; of a pendulum under ``acceleration``."""

    @model_validator(mode="after")
    def _enough(self) -> Self:
        if self.model == "spring":
            if self.frequency is None:
                raise ValueError("frequency: missing, a spring needs it")
            for key in ("arm", "acceleration"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key}: a spring has none, a pendulum has")
            return self
        if (self.arm is None) == (self.frequency is None):
            raise ValueError("a pendulum has either an arm or a frequency: give one")
        needs = "frequency" if self.frequency else "damping_ratio"
        if getattr(self, needs) and self.acceleration is None:
            raise ValueError(f"acceleration: missing, a pendulum's {needs} needs it")
        return self

    def build(self) -> Any:
        """Return the mass ``liquid`` on the joints ``swing_x``, ``swing_y`` or ``slide_x``, ...."""
        part = new_part()
        body = part.worldbody.add_body(name="liquid")
        liquid = part.add_material(name="liquid", rgba=[0.25, 0.55, 0.95, 1.0], specular=0.8)
        swings = self.model == "pendulum"
        place = np.array([0.0, 0.0, -self._length if swings else 0.0])
        distance = self._length if swings else 1.0
        moment = self.mass * (_RADIUS_OF_GYRATION * distance) ** 2
        set_inertia(body, self.mass, place, np.full(3, moment))
        for letter, axis in _ACROSS.items():
            if swings:
                joint = body.add_joint(name=f"swing_{letter}", type=_HINGE, axis=axis)
            else:
                joint = body.add_joint(name=f"slide_{letter}", type=_SLIDE, axis=axis)
                joint.stiffness[0] = self.mass * self._rate**2
            joint.damping[0] = 2.0 * self.damping_ratio * self._rate * self._inertia
        radius = (0.75 * self.mass / (math.pi * _DENSITY)) ** (1.0 / 3.0)
        body.add_geom(size=[radius, 0.0, 0.0], pos=place, material=liquid.name)
        if swings:
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                size=[0.1 * radius, 0.0, 0.0],
                fromto=[0.0, 0.0, 0.0, *place],
                material=liquid.name,
            )
        measure_place(part, "place", body, place)
        return part

    def reports(self) -> tuple[Report, ...]:
        """Return the displacement of the mass along x and y."""
        return (Report("displacement", "m", "place", slice(0, 2)),)

    @property
    def _length(self) -> float:
        """The pendulum's arm [m]."""
        if self.arm is not None:
            return self.arm
        return (self.acceleration or 0.0) / (2.0 * math.pi * (self.frequency or math.inf)) ** 2

    @property
    def _rate(self) -> float:
        """The frequency with the tank held [rad/s]; 0 of a pendulum where nobody needs it."""
        if self.frequency is not None:
            return 2.0 * math.pi * self.frequency
        return math.sqrt((self.acceleration or 0.0) / self._length)

    @property
    def _inertia(self) -> float:
        """What a joint moves: mass [kg], or mass times the square of the arm [kg m^2]."""
        return self.mass * (self._length**2 if self.model == "pendulum" else 1.0)
