"""The Earth's magnetic field, and the torque that it exerts on the bus's magnetic moment."""

import math
from datetime import datetime
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from mjspace.contract import Array
from mjspace.environment.base import HEADER, Term
from mjspace.environment.bodies import Bodies, in_bus_axes
from mjspace.environment.compiled import compiled
from mjspace.environment.cubics import component
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Epoch, NonNegative, Si

DEFAULT_EPOCH = datetime(2025, 1, 1)
"""Time zero where a scenario has none."""
FIELD = slice(HEADER + 2, HEADER + 15)
"""In ``userdata``: the field's cubic of time, to be written in flight. This term's block is the
first where there is one."""
MOMENT = slice(HEADER + 15, HEADER + 18)
"""In ``userdata``: the bus's magnetic moment [A m^2], body axes, to be written in flight."""


@compiled
def magnetic(payload: Any, time: float, bodies: Bodies) -> None:
    """Add moment x field [N m] on the bus, the moment being constant in body axes.

    ``payload``: a cubic of time that is the field [T] in inertial axes, as ``cubics`` has it, and
    the moment (3) [A m^2].
    """
    since = time - payload[0]
    x = component(payload, 0, since)
    y = component(payload, 1, since)
    z = component(payload, 2, since)
    dof, moment = bodies.bus_dof + 3, payload[13:16]
    bx, by, bz = in_bus_axes(bodies, x, y, z)
    bodies.qfrc_passive[dof] += moment[1] * bz - moment[2] * by
    bodies.qfrc_passive[dof + 1] += moment[2] * bx - moment[0] * bz
    bodies.qfrc_passive[dof + 2] += moment[0] * by - moment[1] * bx


class MagneticField(Term):
    """The Earth's magnetic field along the orbit; inertial x is at the equinox, z at the pole."""

    kernels: ClassVar = {7: magnetic}
    reads: ClassVar = {"magnetic_field": 0}

    model: Literal["dipole", "igrf"] = "dipole"
    """A tilted dipole at the centre, or the International Geomagnetic Reference Field (IGRF-14)."""
    epoch: Epoch | None = None
    """Time zero, UTC, where ``environment.epoch`` is left out; 2025-01-01 without either. It says
    which way the Earth has turned by then, and of which day the field is, of the dipole too:
    IGRF-14 is valid from 1900 to 2030, and other dates are refused."""
    tilt: Annotated[NonNegative, Field(le=math.pi), Si("rad")] | None = None
    """Of the dipole to the Earth's axis; the Earth's own when left out."""

    @field_validator("epoch")
    @classmethod
    def _known(cls, epoch: datetime | None) -> datetime | None:
        if epoch is not None and not 1900 <= epoch.year < 2030:
            raise ValueError(f"{epoch:%Y-%m-%d}: the field (IGRF-14) is known from 1900 to 2030")
        return epoch

    def time_zero(self, environment: Environment) -> datetime:
        """Return time zero, UTC."""
        return environment.time_zero or self.epoch or DEFAULT_EPOCH

    def payload_size(self, environment: Environment) -> int:
        """Return the size of ``FIELD`` and ``MOMENT``."""
        return 16

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return zeros: field and moment are written as the vehicle flies."""
        return np.zeros(16)

    def check_environment(self, environment: Environment) -> None:
        """Refuse all but an orbit around the Earth."""
        if environment.orbit is None or environment.orbit.body != "earth":
            raise ValueError('magnetic_field: needs an orbit with body = "earth"')
        if self.epoch is not None and environment.time_zero not in (None, self.epoch):
            raise ValueError(
                f"magnetic_field.epoch: {self.epoch} differs from environment.epoch, "
                f"{environment.time_zero}: leave it out"
            )
        self._known(self.time_zero(environment))
