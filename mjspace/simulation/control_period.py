"""What a control period holds, filled in while it is flown."""

from dataclasses import dataclass
from typing import Any

from mjspace.contract import Array, Event, Measurement
from mjspace.vehicle.step_effect import State


@dataclass(slots=True, init=False)
class ControlPeriod:
    """One control period of a batch of vehicles; arrays have a vehicle axis first.

    ``Stepper.sense`` fills in what is known at the control instant, the flight or the environment
    the command, and ``Stepper.begin`` what acts on the vehicles from then on.
    """

    number: int
    """Control periods since time zero."""
    time: float
    """Simulation time of the control instant [s]."""
    physics: Array
    """MuJoCo's integration state, (N, nstate)."""
    memory: State
    """What actuators and step effects remember."""
    sensors: State
    """What the sensors remembered before they sampled."""
    truth: Measurement
    measurement: Measurement
    events: list[Event]
    """What happens in the period, in order of time; complete when it is over."""

    law: Any
    """The law's state before its step, a named tuple or empty."""
    command: Any
    """The law's command, a named tuple of arrays (N, ...)."""
    signals: Any
    """The law's signals, a named tuple or empty."""

    applied: tuple[Array, ...]
    """What each kind of actuator applies in the first integration step."""
    saturated: Array
    """1.0 for each motor that saturates in the period, (N, m); complete when it is over."""
    wrench: Array | None
    """Force [N], inertial axes, and torque [N m], body axes, of the step effects, (N, 6)."""
    sensordata: Array
    """MuJoCo's sensors at the control instant, (N, nsensordata)."""
