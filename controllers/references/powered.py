"""A desired turn with a power profile, for wheels that store energy beside turning the vehicle."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Unit, gain

from .references import Regulation


class PoweredReference(NamedTuple):
    """A ``Reference`` with the power into the wheels."""

    attitude: Array
    """Quaternion, scalar first, desired body axes to inertial, shape (..., 4)."""
    rate: Annotated[Array, Unit("rad/s")]
    """Angular velocity of the desired axes, in the desired axes [rad/s], shape (..., 3)."""
    acceleration: Annotated[Array, Unit("rad/s^2")]
    """Time derivative of the components of ``rate`` [rad/s^2], shape (..., 3)."""
    power: Annotated[Array, Unit("W")]
    """Into the wheels; negative: out of them [W], shape (..., 1)."""
    energy: Annotated[Array, Unit("J")]
    """Integral of the power since time zero [J], shape (..., 1)."""


@dataclass(frozen=True)
class PoweredTurn(Gains):
    """The turn of ``references:Regulation`` while P = power sin(2 pi t / period) is stored."""

    power: float = gain("W")
    """Largest."""
    period: float = gain("s", above=0.0)
    """In its first half energy is stored, in its second it is taken back."""
    angle: float = gain("rad", default=2.0 * np.pi / 3.0)
    """Of the whole turn."""
    duration: float = gain("s", default=2.0, above=0.0)
    """Of the turn, from rest to rest."""
    axis: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), form="direction")
    """Of the turn; normalized."""

    def at(self, time: Array) -> PoweredReference:
        """Return the turn, power and energy at each ``time`` [s]."""
        turn = Regulation(angle=self.angle, duration=self.duration, axis=self.axis).at(time)
        frequency = 2.0 * np.pi / self.period
        phase = frequency * time[:, None]
        energy = self.power / frequency * (1.0 - np.cos(phase))
        return PoweredReference(*turn, self.power * np.sin(phase), energy)
