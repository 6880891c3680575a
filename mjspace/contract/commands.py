"""Commands of laws that come with mjspace; any named tuple with these fields is obeyed as well."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjspace.units import Unit

Array = NDArray[np.float64]


class TorqueCommand(NamedTuple):
    """A law's command to the reaction wheels."""

    torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes [N m], shape (..., 3)."""


class VoltageCommand(NamedTuple):
    """An inner loop's command to the motors' inverters."""

    voltage: Annotated[Array, Unit("V")]
    """(u_d, u_q) of each motor, in the rotor's axes [V], shape (..., m, 2); in the stator's, the
    two windings', where the drive works in those."""


class GimbalRateCommand(NamedTuple):
    """A law's command to gimbals that have speed loops of their own."""

    gimbal_rate: Annotated[Array, Unit("rad/s")]
    """Relative to what carries each [rad/s], shape (..., g)."""


class ThrustCommand(NamedTuple):
    """A law's command to an engine on two gimbals."""

    thrust: Annotated[Array, Unit("N")]
    """[N], shape (..., 1)."""
    gimbal: Annotated[Array, Unit("rad")]
    """Angles of the hinges, the outer before the inner [rad], shape (..., 2)."""


class PulseCommand(NamedTuple):
    """A law's command to on/off thrusters."""

    on_time: Annotated[Array, Unit("s")]
    """For how long each is on, from the beginning of the control period or, of an inner loop, the
    integration step [s], shape (..., n). A negative one shuts a valve."""
