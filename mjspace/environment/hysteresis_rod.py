"""Rods of soft magnetic material, whose hysteresis in the Earth's field damps a rotation.

The model is that of Flatley and Henretty, A magnetic hysteresis model, Flight Mechanics and
Estimation Theory Symposium, NASA Goddard 1995 (N95-27801), with their exponent 2. Between the two
curves of the saturated loop, B = (2 Bs / pi) atan(k (H -+ Hc)), k Hc = tan(pi Br / 2 Bs), the flux
density changes with the slope of these curves at that B times

    Q = q + (1 - q) f^2,        f = 0 on the curve that is left, 1 on the one that is approached.

Written with the lag w of the field, B = (2 Bs / pi) atan(k (H - w)), it is f' = (1 - q)(1 - f^2) /
(2 Hc) with f = (Hc +- w) / (2 Hc), whose solution is a hyperbolic tangent of H. The flux density is
thus an exact function of the field that a stage of the integrator finds, and of field and lag at
the beginning of the step.
"""

import math
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mjspace.contract import Array
from mjspace.environment import cubics
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, in_bus_axes
from mjspace.environment.compiled import compiled
from mjspace.environment.cubics import component
from mjspace.gufunc import gufunc
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Positive, Si, Unit3

MAGNETIC_CONSTANT = 1.25663706127e-6  # N/A^2; CODATA 2022
STATE = cubics.SIZE
"""Where in a rod's parameters its state begins: field [A/m] and lag [A/m]."""
_ROD = STATE + 2
"""Where its constants begin: axis (3), Hc, (1 - q) / (2 Hc), k, 2 Bs / pi, volume over the magnetic
constant."""
_WIDTH = _ROD + 8


@compiled
def lag_after(lag: float, change: float, coercivity: float, rate: float) -> float:
    """Return the lag [A/m] after a monotonic ``change`` of the field [A/m].

    ``rate`` is (1 - q) / (2 Hc).
    """
    side = 1.0 if change > 0.0 else -1.0
    before = 0.5 + 0.5 * side * lag / coercivity
    grown = math.tanh(rate * abs(change))
    after = (before + grown) / (1.0 + before * grown)
    return side * coercivity * (2.0 * after - 1.0)


@gufunc(["void(f8[:], f8[:], f8[:, :], f8[:])"], "(n),(n),(n,k)->(n)")
def lags_after(lags: Any, changes: Any, loops: Any, after: Any) -> None:
    """Write the lag of each rod; ``loops`` (n, 2) has the coercivity and rate of each."""
    for i in range(lags.size):
        after[i] = lag_after(lags[i], changes[i], loops[i, 0], loops[i, 1])


@compiled
def magnetize(payload: Any, time: float, bodies: Bodies) -> None:
    """Add moment x field [N m] on the bus.

    The moment is the flux density along the rod times its volume over the magnetic constant.
    """
    since = time - payload[0]
    x, y, z = (
        component(payload, 0, since),
        component(payload, 1, since),
        component(payload, 2, since),
    )
    bx, by, bz = in_bus_axes(bodies, x, y, z)
    ax, ay, az = payload[_ROD], payload[_ROD + 1], payload[_ROD + 2]
    field = (ax * bx + ay * by + az * bz) / MAGNETIC_CONSTANT
    change = field - payload[STATE]
    lag = lag_after(payload[STATE + 1], change, payload[_ROD + 3], payload[_ROD + 4])
    moment = payload[_ROD + 6] * math.atan(payload[_ROD + 5] * (field - lag)) * payload[_ROD + 7]
    dof = bodies.bus_dof + 3
    bodies.qfrc_passive[dof] += moment * (ay * bz - az * by)
    bodies.qfrc_passive[dof + 1] += moment * (az * bx - ax * bz)
    bodies.qfrc_passive[dof + 2] += moment * (ax * by - ay * bx)


class HysteresisRod(Term):
    """A rod of soft magnetic material: what its loop encloses, times its volume, is lost a turn.

    The loop is that of the rod, which its own field makes flatter than that of the material.
    """

    kernels: ClassVar = {15: magnetize}
    reads: ClassVar = {"magnetic_field": 0}

    axis: Unit3
    """Body axes; normalized."""
    volume: Annotated[Positive, Si("m^3")]
    coercivity: Annotated[Positive, Si("A/m")]
    """Hc: field that takes the saturated rod's flux density to zero."""
    remanence: Annotated[Positive, Si("T")]
    """Br: flux density that the saturated rod keeps without a field."""
    saturation: Annotated[Positive, Si("T")]
    """Bs: largest flux density; above the remanence."""
    reversible: Annotated[NonNegative, Field(lt=1)] = 0.0
    """q: part of the loop's slope with which the flux density begins to turn back."""

    @model_validator(mode="after")
    def _saturates(self) -> Self:
        if self.remanence >= self.saturation:
            raise ValueError(
                f"remanence: got {self.remanence:g} T, should be below the saturation, "
                f"{self.saturation:g} T"
            )
        return self

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment without a magnetic field."""
        if environment.magnetic_field is None:
            raise ValueError("hysteresis_rods: needs an [environment.magnetic_field]")

    def payload_size(self, environment: Environment) -> int:
        """Return the size of the parameters of ``magnetize``."""
        return _WIDTH

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the parameters of ``magnetize``; field and state are written in flight."""
        loop = [self.steepness, 2.0 * self.saturation / math.pi, self.volume / MAGNETIC_CONSTANT]
        rod = [*self.direction, self.coercivity, self.rate, *loop]
        return np.concatenate([np.zeros(_ROD), rod])

    @property
    def direction(self) -> Array:
        """The unit vector along the rod, body axes, (3,)."""
        axis = np.array(self.axis, dtype=float)
        unit: Array = axis / np.sqrt(np.sum(axis**2))
        return unit

    @property
    def rate(self) -> float:
        """How fast the lag grows with the field, (1 - q) / (2 Hc) [m/A]."""
        return (1.0 - self.reversible) / (2.0 * self.coercivity)

    @property
    def steepness(self) -> float:
        """k [m/A] of the loop's curves."""
        return math.tan(0.5 * math.pi * self.remanence / self.saturation) / self.coercivity

    def flux_density(self, field: Array, lag: Array) -> Array:
        """Return the flux density [T] at a ``field`` and ``lag`` [A/m]."""
        found: Array = 2.0 / math.pi * self.saturation * np.arctan(self.steepness * (field - lag))
        return found
