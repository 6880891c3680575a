"""Control by magnetic moments: B-dot against a tumble, and the unloading of wheels that point."""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numba

from mjspace.contract import Array, Gains, Measurement, Reference, Unit, gain

from ..attitude.linear_quadratic import Regulator, Signals


class DipoleCommand(NamedTuple):
    """What a law asks of magnetorquers."""

    dipole: Annotated[Array, Unit("A m^2")]
    """Magnetic moment, body axes [A m^2], (..., 3)."""


class Command(NamedTuple):
    """What wheels and magnetorquers are asked for."""

    torque: Annotated[Array, Unit("N m")]
    """Of the wheels on the bus, body axes [N m], (..., 3)."""
    dipole: Annotated[Array, Unit("A m^2")]
    """Magnetic moment, body axes [A m^2], (..., 3)."""


class LastField(NamedTuple):
    """What ``BDot`` remembers."""

    field: Array
    """Of the last period, body axes [T], (..., 3)."""


class FieldRate(NamedTuple):
    """What ``BDot`` knows."""

    field_rate: Array
    """In body axes [T/s], (..., 3): the mean over the last period."""


@dataclass(frozen=True)
class BDot(Gains):
    """m = -k dB/dt, by the magnetometer alone: whatever turns the body in the field is braked.

    Stickler and Alfriend, Elementary magnetic attitude control system, J. Spacecraft and Rockets
    13, 1976. What is left turns with the field: 1.8 n over the poles of a dipole.
    """

    rate_gain: float = gain("A m^2 s/T", above=0.0)
    """k."""
    control_period: float = gain("s", above=0.0)
    """From one reading to the next."""
    batched = True

    def reset(self, measurement: Measurement, reference: Reference) -> LastField:
        """Return the field at the start."""
        return LastField(measurement.magnetic_field.copy())

    def step(
        self, state: LastField, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[LastField, DipoleCommand, FieldRate]:
        """Return the moment [A m^2] against the field's change since the last period."""
        field = measurement.magnetic_field
        change = (field - state.field) / self.control_period
        return LastField(field.copy()), DipoleCommand(-self.rate_gain * change), FieldRate(change)


@dataclass(frozen=True)
class MagneticUnloading(Regulator):
    """m = k (h x B)/B^2, whose torque takes from h what is across the field: -k h_perp.

    R. Vazquez, Control activo de la actitud, Univ. Sevilla 2016, erratum 27: a moment gives m x B,
    and nothing along B. The wheels are told of the torque, so that the attitude does not feel it.
    """

    unloading_gain: float = gain("1/s", default=1e-3, at_least=0.0)
    """k."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, Signals]:
        """Return the torque of the wheels and the moment of the coils."""
        state, wheels, shown = super().step(state, time, measurement, reference)
        dipole, brought = _shed.ufunc(shown.h, measurement.magnetic_field, self.unloading_gain)
        return state, Command(wheels.torque - brought, dipole), shown


@numba.guvectorize(["void(f8[:],f8[:],f8,f8[:],f8[:])"], "(k),(k),()->(k),(k)", cache=True)
def _shed(h: Any, B: Any, k: Any, m: Any, torque: Any) -> None:
    """Give k (h x B)/B^2 and its torque m x B."""
    share = k / (B[0] * B[0] + B[1] * B[1] + B[2] * B[2])
    m[0] = share * (h[1] * B[2] - h[2] * B[1])
    m[1] = share * (h[2] * B[0] - h[0] * B[2])
    m[2] = share * (h[0] * B[1] - h[1] * B[0])
    torque[0] = m[1] * B[2] - m[2] * B[1]
    torque[1] = m[2] * B[0] - m[0] * B[2]
    torque[2] = m[0] * B[1] - m[1] * B[0]
