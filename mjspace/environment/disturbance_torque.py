"""A torque on the bus that is a function of time alone: a bias and sinusoids."""

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from mjspace.contract import Array
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, in_bus_axes
from mjspace.environment.compiled import compiled
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Angles3, Positive, Si, Table, Torque3


@compiled
def torque_at(series: Any, time: float) -> tuple[float, float, float]:
    """Return a bias and a sum of sinusoids [N m] at ``time`` [s].

    ``series``: the bias (3), then for each sinusoid its frequency [rad/s], the factors of its sine
    (3) and of its cosine (3).
    """
    x, y, z = series[0], series[1], series[2]
    for i in range(3, series.size, 7):
        sine, cosine = math.sin(series[i] * time), math.cos(series[i] * time)
        x += series[i + 1] * sine + series[i + 4] * cosine
        y += series[i + 2] * sine + series[i + 5] * cosine
        z += series[i + 3] * sine + series[i + 6] * cosine
    return x, y, z


@compiled
def body_torque(series: Any, time: float, bodies: Bodies) -> None:
    """Add a torque on the bus whose components are in body axes."""
    torque = torque_at(series, time)
    for i in range(3):
        bodies.qfrc_passive[bodies.bus_dof + 3 + i] += torque[i]


@compiled
def inertial_torque(series: Any, time: float, bodies: Bodies) -> None:
    """Add a torque on the bus whose components are in inertial axes."""
    x, y, z = torque_at(series, time)
    torque = in_bus_axes(bodies, x, y, z)
    for i in range(3):
        bodies.qfrc_passive[bodies.bus_dof + 3 + i] += torque[i]


class Sine(Table):
    """One sinusoid of a disturbance torque, on each axis: amplitude sin(frequency t + phase)."""

    amplitude: Torque3
    """On each axis."""
    frequency: Annotated[Positive, Si("rad/s")]
    """The same on every axis."""
    phase: Angles3 = [0.0, 0.0, 0.0]
    """On each axis."""


class DisturbanceTorque(Term):
    """A torque on the bus from outside: a bias and a sum of sinusoids of time."""

    kernels: ClassVar = {2: body_torque, 3: inertial_torque}

    frame: Literal["body", "inertial"] = "body"
    """The axes in which the components are constant or periodic."""
    bias: Torque3 = [0.0, 0.0, 0.0]
    """Constant part."""
    sines: list[Sine] = []
    """Periodic part."""

    def block_kind(self) -> int:
        """Return which kernel turns the components into torques about the bus's axes."""
        return 2 if self.frame == "body" else 3

    def payload_size(self, environment: Environment) -> int:
        """Return the size of the series of ``torque_at``."""
        return 3 + 7 * len(self.sines)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the series of ``torque_at``."""
        series = [np.array(self.bias)]
        for sine in self.sines:
            amplitude, phase = np.array(sine.amplitude), np.array(sine.phase)
            frequency = np.array([sine.frequency])
            series += [frequency, amplitude * np.cos(phase), amplitude * np.sin(phase)]
        return np.concatenate(series)
