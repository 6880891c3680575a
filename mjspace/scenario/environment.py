"""The tables of what acts on a vehicle from outside."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from mjspace.constants import RADIUS
from mjspace.scenario.fields import Angles3, Finite, Positive, Si, Table, Torque3, WithinTurn
from mjspace.scenario.landing import CentralGravity
from mjspace.scenario.magnetics import MagneticField


class Orbit(Table):
    """A Kepler orbit: its gravity gradient acts on every body, in the free-fall frame."""

    body: Literal["earth", "moon"] = "earth"
    """What is orbited."""
    semi_major_axis: Annotated[Positive, Si("m")]
    """From the body's centre."""
    eccentricity: Annotated[Finite, Field(ge=0, lt=1)] = 0.0
    """0 is a circle."""
    inclination: Annotated[Finite, Field(ge=0, le=math.pi), Si("rad")] = 0.0
    """To the inertial x-y plane; above 90 deg the orbit is retrograde."""
    ascending_node: WithinTurn = 0.0
    """Right ascension of the ascending node."""
    periapsis: WithinTurn = 0.0
    """Argument of periapsis."""
    true_anomaly: WithinTurn = 0.0
    """At time zero."""

    @model_validator(mode="after")
    def _above_the_planet(self) -> "Orbit":
        lowest, radius = self.semi_major_axis * (1.0 - self.eccentricity), RADIUS[self.body]
        if lowest <= radius:
            meant = f": did you mean '{self.semi_major_axis:.10g} km'?"
            raise ValueError(
                f"semi_major_axis: got {self.semi_major_axis:.10g} m, with which the periapsis, "
                f"{lowest:.6g} m from the centre, is inside the {self.body}, whose radius is "
                f"{radius:.6g} m{meant if radius < 1e3 * lowest < 100.0 * radius else ''}"
            )
        return self


class Sine(Table):
    """One sinusoid of a disturbance torque, on each axis: amplitude sin(frequency t + phase)."""

    amplitude: Torque3
    """On each axis."""
    frequency: Annotated[Positive, Si("rad/s")]
    """The same on every axis."""
    phase: Angles3 = [0.0, 0.0, 0.0]
    """On each axis."""


class DisturbanceTorque(Table):
    """A torque on the bus from outside: a bias and a sum of sinusoids of time."""

    frame: Literal["body", "inertial"] = "body"
    """The axes in which the components are constant or periodic."""
    bias: Torque3 = [0.0, 0.0, 0.0]
    """Constant part."""
    sines: list[Sine] = []
    """Periodic part."""


class Environment(Table):
    """What acts on the vehicle from outside; nothing when left out."""

    orbit: Orbit | None = None
    gravity: CentralGravity | None = None
    magnetic_field: MagneticField | None = None
    torques: list[DisturbanceTorque] = []
    """Evaluated at every stage of the integrator."""
    python: str | None = None
    """A function of one's own, ``"file.py:name"``: name(time, truth) -> (force [N] on the bus in
    inertial axes, torque [N m] in body axes), held over each integration step: first order only."""

    @model_validator(mode="after")
    def _one_planet(self) -> "Environment":
        if self.orbit is not None and self.gravity is not None:
            raise ValueError("orbit and gravity are both given: fly round the planet or land on it")
        return self

    @model_validator(mode="after")
    def _around_the_earth(self) -> "Environment":
        if self.magnetic_field is not None and (self.orbit is None or self.orbit.body != "earth"):
            raise ValueError('magnetic_field: needs an orbit with body = "earth"')
        return self
