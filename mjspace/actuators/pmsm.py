"""Permanent-magnet synchronous motors with their currents, as actuators of a vehicle's hinges.

Servín 2022 (paper 001), (2.73), (2.74), in axes (d, q) that turn with the rotor; as one complex
number i = I_d + j I_q,

    L i' = -(R + j p W) i + u_d + j (u_q - k_m W),    torque = k_m I_q.

With the speed W held, and the voltage too, in these axes or in the stator's, a step has a closed
form, used here: it is exact however fast the currents are beside the step. A speed that changes is
what a step misses: held at its value at the step's start it leaves the flight first order in the
step, in the step's middle second order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from mjspace.contract import Array
from mjspace.environment.compiled import compiled
from mjspace.gufunc import gufunc
from mjspace.scenario.fields import Positive, Si, Table


class Pmsm(Table):
    """A permanent-magnet synchronous motor, as two windings at right angles."""

    pole_pairs: Annotated[int, Field(ge=1, strict=True)]
    """Electrical turns in one of the rotor."""
    resistance: Annotated[Positive, Si("ohm")]
    """Of each winding."""
    inductance: Annotated[Positive, Si("H")]
    """Of each winding."""
    torque_constant: Annotated[Positive, Si("N m/A")]
    """Torque for each ampere across the rotor's field; the same number is the back-EMF in V s."""
    axes: Literal["rotor", "stator"] = "rotor"
    """In which its voltages are commanded, held from step to step, and its currents measured: those
    of the rotor take a sensor of its angle; the stator's are of the two windings themselves."""
    voltage_limit: Annotated[Positive, Si("V")] | None = None
    """Longest voltage vector that the supply gives; none when left out."""


@dataclass(frozen=True)
class Drives:
    """The motors of a vehicle, m of them: what is between a voltage and a torque."""

    pole_pairs: Array
    """p, shape (m,)."""
    resistance: Array
    """R of each of the two windings [ohm], shape (m,)."""
    inductance: Array
    """L of each of the two windings [H], shape (m,)."""
    torque_constant: Array
    """k_m [N m/A], which is also the back-EMF [V s/rad], shape (m,)."""
    voltage_limit: Array
    """Longest voltage vector of the supply [V], shape (m,)."""
    windings: Array
    """Whose voltages and currents are those of the windings, in the stator's axes: 1.0, else 0.0;
    shape (m,)."""

    @classmethod
    def of(cls, tables: Sequence[Pmsm]) -> "Drives":
        """Return the motors of a scenario's tables, in their order."""
        columns = [
            (
                *(t.pole_pairs, t.resistance, t.inductance, t.torque_constant),
                inf if t.voltage_limit is None else t.voltage_limit,
                float(t.axes == "stator"),
            )
            for t in tables
        ]
        return cls(*np.array(columns).T.copy())

    def reset(self, batch: tuple[int, ...] = ()) -> Array:
        """Return no current in any motor [A], shape (*batch, m, 2)."""
        return np.zeros((*batch, len(self.pole_pairs), 2))

    def advance(
        self, current: Array, voltage: Array, speed: Array, step: float, angle: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Return (current, torque, voltage applied) over a ``step`` [s] of integration.

        ``current`` (..., m, 2) is (I_d, I_q) [A], of the step's start and, returned, of its end;
        ``voltage`` (..., m, 2) is (u_d, u_q) [V]; both are the windings' where ``windings`` says
        so. ``speed`` (..., m) is the rotor's relative to its stator [rad/s], ``angle``
        (..., m) that of its start [rad], which matters to windings alone. ``torque`` (..., m) is
        the mean over the step [N m], on the rotor, whose reaction is on the stator's body.
        ``voltage applied`` (..., m, 2) is the voltage cut to the supply's limit in length, not in
        direction: equal to ``voltage`` within the limit.
        """
        if angle is None:
            angle = np.full(np.shape(speed), np.nan)
        result: tuple[Array, Array, Array] = _advance.ufunc(
            current, voltage, speed, angle, self._constants, step
        )
        return result

    def to_stator(self, vector: Array, angle: Array) -> Array:
        """Return the two windings' currents or voltages (..., m, 2): Park's transform undone.

        ``vector`` (..., m, 2) is in axes (d, q), ``angle`` (..., m) the rotor's [rad]; (2.70).
        """
        cos, sin = np.cos(self.pole_pairs * angle), np.sin(self.pole_pairs * angle)
        d, q = vector[..., 0], vector[..., 1]
        return np.stack([cos * d - sin * q, sin * d + cos * q], axis=-1)

    @cached_property
    def _constants(self) -> Array:
        return np.array([
            self.pole_pairs, self.resistance, self.inductance, self.torque_constant,
            self.voltage_limit, self.windings,
        ])  # fmt: skip


# With f(x) = (e^x - 1 - x)/x^2, the answers of i' = a i + b after h are, x = a h,
# mean i = i0 + h (a i0 + b) f(x) and i(h) = i0 + h (a (mean i) + b).
@compiled
def _held_ramp(x: Any) -> Any:
    """Return (e^x - 1 - x)/x^2, by its series where the difference would lose digits."""
    if abs(x) > 1.0:
        return (np.exp(x) - 1.0 - x) / (x * x)
    total = 1.0 + 0.0j
    for n in range(18, 2, -1):  # the first term left out is 1/(3...19) = 1.6e-17
        total = 1.0 + x * total * (1.0 / n)  # a complex quotient would cost as much again
    return 0.5 * total


@compiled
def _from_rest(a: Any, v: Any, w: Any, step: Any) -> tuple[Any, Any]:
    """Return (mean, end) of i' = a i + v e^(-j w t), i(0) = 0: ``v`` turns back at ``w`` [rad/s].

    Where a = -r - j w, r > 0, as windings have: i = v e^(-j w t) (1 - e^(-r t)) / r.
    """
    half = 0.5 * w * step
    middle = complex(np.cos(half), -np.sin(half))
    end = v * middle * middle * (np.expm1(a.real * step) / a.real)
    share = np.sin(half) / half if half != 0.0 else 1.0
    return (end / step - v * middle * share) / a, end


@gufunc(
    ["void(f8[:, :], f8[:, :], f8[:], f8[:], f8[:, :], f8, f8[:, :], f8[:], f8[:, :])"],
    "(m,k),(m,k),(m),(m),(c,m),()->(m,k),(m),(m,k)",
)
def _advance(
    current: Any, voltage: Any, speed: Any, angle: Any, constants: Any, step: Any,
    after: Any, torque: Any, applied: Any,
) -> None:  # fmt: skip
    for n in range(speed.size):
        p, R, L, km, limit = (
            constants[0, n], constants[1, n], constants[2, n], constants[3, n], constants[4, n]
        )  # fmt: skip
        windings = constants[5, n] != 0.0
        length = np.hypot(voltage[n, 0], voltage[n, 1])
        beyond = length > limit
        share = (limit if beyond else 1.0) / (length if beyond else 1.0)  # never by zero
        applied[n, 0], applied[n, 1] = share * voltage[n, 0], share * voltage[n, 1]

        a = complex(-R / L, -p * speed[n])
        b = complex(0.0, -km * speed[n] / L)
        driven = complex(applied[n, 0] / L, applied[n, 1] / L)
        start = complex(current[n, 0], current[n, 1])
        if windings:
            to_rotor = complex(np.cos(p * angle[n]), -np.sin(p * angle[n]))
            start *= to_rotor
        else:
            b += driven
        mean = start + step * (a * start + b) * _held_ramp(a * step)
        end = start + step * (a * mean + b)
        if windings:
            more_mean, more = _from_rest(a, driven * to_rotor, p * speed[n], step)
            mean += more_mean
            there = p * (angle[n] + speed[n] * step)
            end = (end + more) * complex(np.cos(there), np.sin(there))
        after[n, 0], after[n, 1] = end.real, end.imag
        torque[n] = km * mean.imag
