"""The unit of each logged field, by topic, read from where the field is declared."""

from collections.abc import Mapping
from typing import Annotated

from mjspace.contract import (
    Array,
    GimbalRateCommand,
    Measurement,
    PulseCommand,
    Reference,
    ThrustCommand,
    TorqueCommand,
    Trajectory,
    Truth,
    VoltageCommand,
)
from mjspace.units import Unit, units_of


class DerivedTruth:
    """The fields of ``/truth`` that are computed from the state for the log alone."""

    attitude_error: Annotated[Array, Unit("rad")]
    """Angle of the rotation from the desired to the true attitude, shape (1,)."""
    estimation_error: Annotated[Array, Unit("rad")]
    """Rotation vector from the estimated to the true attitude, body axes, shape (3,); where an
    attitude is estimated."""
    position_error: Annotated[Array, Unit("m")]
    """True less desired position, inertial axes, shape (3,); where a position is desired."""
    tilt: Annotated[Array, Unit("rad")]
    """Angle between the z axes of the body and of the world, shape (1,)."""
    momentum: Annotated[Array, Unit("N m s")]
    """Total angular momentum about the centre of mass, inertial axes, shape (3,)."""
    energy: Annotated[Array, Unit("J")]
    """Kinetic energy, shape (1,)."""
    wheel_power: Annotated[Array, Unit("W")]
    """Electrical power of each reaction wheel, at the end of the integration step that ends then,
    shape (n,); where ``plant.wheels.efficiency`` is given."""
    wheel_energy: Annotated[Array, Unit("J")]
    """Electrical energy of each reaction wheel since the start, shape (n,); likewise."""
    wheel_momentum_margin: Annotated[Array, Unit("N m s")]
    """What each reaction wheel can still take up of momentum before its speed limit, shape (n,);
    where ``plant.wheels.momentum_margin`` is set."""
    rod_field: Annotated[Array, Unit("A/m")]
    """Of the Earth along each hysteresis rod, shape (n,)."""
    rod_flux_density: Annotated[Array, Unit("T")]
    """Of each hysteresis rod along itself, shape (n,)."""
    foot_force: Annotated[Array, Unit("N")]
    """Magnitude of the ground's force on each foot, shape (f,)."""
    hull_force: Annotated[Array, Unit("N")]
    """Sum of the magnitudes of the ground's forces on all other parts, shape (1,)."""
    touchdown_velocity: Annotated[Array, Unit("m/s")]
    """Velocity of the bus at the first contact with the ground, shape (3,)."""
    crash_velocity: Annotated[Array, Unit("m/s")]
    """Velocity of the bus at the crash, shape (3,)."""


class Disturbance:
    """The fields of ``/disturbance``: the environment's total on the vehicle."""

    force: Annotated[Array, Unit("N")]
    torque: Annotated[Array, Unit("N m")]


DECLARED: Mapping[str, tuple[type, ...]] = {
    "/truth": (Truth, DerivedTruth),
    "/measurement": (Measurement,),
    "/estimate": (Measurement,),
    "/reference": (Reference, Trajectory),
    "/command": (TorqueCommand, VoltageCommand, GimbalRateCommand, ThrustCommand, PulseCommand),
    "/disturbance": (Disturbance,),
}
"""Classes that declare the fields of each topic; a law's own may declare more, and so do the
actuators for what they apply and measure."""


def units(kinds: Mapping[str, Mapping[str, type]] = {}) -> dict[str, dict[str, Unit]]:
    """Return the unit of each field that has one, by topic.

    ``kinds`` are the named tuples that a flight recorded on a topic, by what their fields' names
    begin with there: of ``/state`` the law's state under ``law_``. What their fields declare comes
    before what the contract says of that name.
    """
    found: dict[str, dict[str, Unit]] = {}
    for topic, declared in DECLARED.items():
        found[topic] = {name: unit for kind in declared for name, unit in units_of(kind).items()}
    for topic, by_prefix in kinds.items():
        for prefix, each in by_prefix.items():
            own = {prefix + name: unit for name, unit in units_of(each).items()}
            found[topic] = found.get(topic, {}) | own
    return found
