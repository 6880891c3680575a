"""Control by magnetic moments: B-dot detumbling, and unloading of reaction wheels."""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from mjspace.contract import Array, Gains, Measurement, Reference, Unit, gain
from mjspace.gufunc import gufunc

from ..attitude.linear_quadratic import Regulator, Signals


class DipoleCommand(NamedTuple):
    """Command to magnetorquers."""

    dipole: Annotated[Array, Unit("A m^2")]
    """Magnetic moment, body axes [A m^2], (..., 3)."""


class Command(NamedTuple):
    """Command to wheels and magnetorquers."""

    torque: Annotated[Array, Unit("N m")]
    """Torque of the wheels on the bus, body axes [N m], (..., 3)."""
    dipole: Annotated[Array, Unit("A m^2")]
    """Magnetic moment, body axes [A m^2], (..., 3)."""


class LastField(NamedTuple):
    """Memory of ``BDot``."""

    field: Array
    """Magnetic field measured in the last period, body axes [T], (..., 3)."""


class FieldRate(NamedTuple):
    """Signals of ``BDot``."""

    field_rate: Array
    """Mean derivative of the field's body components over the last period [T/s], (..., 3)."""


@dataclass(frozen=True)
class BDot(Gains):
    """m = -k dB/dt, from the magnetometer alone: damps the rotation relative to the field.

    Stickler and Alfriend, Elementary magnetic attitude control system, J. Spacecraft and Rockets
    13, 1976. The remaining rate is that of the field's direction: 1.8 n over the poles of a dipole.
    """

    rate_gain: float = gain("A m^2 s/T", above=0.0)
    """k."""
    control_period: float = gain("s", above=0.0)
    """Time from one reading to the next."""
    batched = True

    def reset(self, measurement: Measurement, reference: Reference) -> LastField:
        """Return the initial state: the field measured at the start."""
        return LastField(measurement.magnetic_field.copy())

    def step(
        self, state: LastField, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[LastField, DipoleCommand, FieldRate]:
        """Return the next state, the moment [A m^2] and the field's derivative."""
        field = measurement.magnetic_field
        change = (field - state.field) / self.control_period
        return LastField(field.copy()), DipoleCommand(-self.rate_gain * change), FieldRate(change)


@dataclass(frozen=True)
class MagneticUnloading(Regulator):
    """m = k (h x B)/B^2: its torque -k h_perp unloads the momentum perpendicular to the field.

    h is what the wheels have above the desired momentum, zero by default.

    R. Vazquez, Control activo de la actitud, Univ. Sevilla 2016, erratum 27: a moment gives the
    torque m x B, which has no component along B. The torque is fed forward to the wheels, so that
    it does not disturb the attitude.
    """

    unloading_gain: float = gain("1/s", default=1e-3, at_least=0.0)
    """k."""
    desired_momentum: Array = gain("N m s", (3,), default=(0.0, 0.0, 0.0))
    """To which the wheels are unloaded, body axes: a bias that keeps them away from zero speed."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, Signals]:
        """Return the regulator's state and signals, and the wheels' torque and coils' moment."""
        state, wheels, signals = super().step(state, time, measurement, reference)
        excess = signals.h - self.desired_momentum
        dipole, torque = unload.ufunc(excess, measurement.magnetic_field, self.unloading_gain)
        return state, Command(wheels.torque - torque, dipole), signals


@gufunc(["void(f8[:],f8[:],f8,f8[:],f8[:])"], "(k),(k),()->(k),(k)")
def unload(h: Any, B: Any, k: Any, m: Any, torque: Any) -> None:
    """Write m = k (h x B)/B^2 [A m^2] and its torque m x B [N m]."""
    share = k / (B[0] * B[0] + B[1] * B[1] + B[2] * B[2])
    m[0] = share * (h[1] * B[2] - h[2] * B[1])
    m[1] = share * (h[2] * B[0] - h[0] * B[2])
    m[2] = share * (h[0] * B[1] - h[1] * B[0])
    torque[0] = m[1] * B[2] - m[2] * B[1]
    torque[1] = m[2] * B[0] - m[0] * B[2]
    torque[2] = m[0] * B[1] - m[1] * B[0]
