"""A control period as a program: step effects, law, inner loop and actuators, or without a law."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjspace.tracing.program import Calls, Program
from mjspace.vehicle.step_effect import Write

Copies = list[tuple[np.ndarray, np.ndarray]]
"""Pairs (to, from) of arrays of a program's memory."""


class Recorded(NamedTuple):
    """A field that is recorded each period: its group, its name, and the array that holds it."""

    group: str
    name: str
    array: np.ndarray


def recorded_of(group: str, arrays: Any) -> list[Recorded]:
    """Return the fields of a named tuple, which may be empty."""
    names = getattr(arrays, "_fields", ())
    return [Recorded(group, name, array) for name, array in zip(names, arrays, strict=True)]


class Section(NamedTuple):
    """A part of the program that is called by itself."""

    calls: Calls
    after: Copies
    """Made within the memory after it."""
    report: np.ndarray
    """Other than 0.0 where a step effect has an event to tell, (reports,)."""


@dataclass(frozen=True)
class PeriodProgram:
    """The program of one vehicle's control period; all arrays are views of its memory."""

    program: Program
    weighing: Section
    """Of a control instant: the masses that bodies have then, for what step effects see."""
    looking: Section
    """Of a control instant and of the end of each later step: what step effects see."""
    sensing: Section
    """Of a control instant: sensors and law."""
    driving: Section
    """Of an integration step: inner loop and actuators."""
    preparing: Section
    """Of an integration step: what step effects change for it."""
    time: np.ndarray
    """[s], shape ()."""
    physics: np.ndarray
    """MuJoCo's integration state, (1, nstate)."""
    sensordata: np.ndarray
    """MuJoCo's sensors, (1, nsensordata)."""
    reference: Any
    """The desired motion, a named tuple of arrays without a vehicle axis."""
    memory: dict[str, np.ndarray]
    """What actuators and step effects remember, (1, ...)."""
    law: Any
    """The law's state, a named tuple of arrays (1, ...), or empty."""
    sensors: dict[str, np.ndarray]
    """What the sensors remember, (1, ...)."""
    constants: dict[str, np.ndarray]
    """What is constant of the errors of each sensor that is not ideal, (1, ...)."""
    draws: dict[str, np.ndarray]
    """Random numbers of a sample, (1, axes), as ``SensorSuite.draws`` names them."""
    known: tuple[np.ndarray, ...]
    """What each step effect knows of a control instant beforehand, (k,)."""
    command: Any
    """The law's command, a named tuple of arrays (1, ...)."""
    has_law: bool
    """Whether the program makes the command; else it is made elsewhere, as its input."""
    applied: tuple[np.ndarray, ...]
    """What each kind of actuator applies, (1, width)."""
    saturated: np.ndarray
    """1.0 for each motor that saturates, (1, motors)."""
    written: list[Write]
    """By step effects, into mjData."""
    weighed: list[Write]
    """At a control instant, into mjModel; none where no step effect looks."""
    masses: list[Write]
    """For a step, into mjModel."""
    before: list[Recorded]
    """Recorded at the control instant."""
    after: list[Recorded]
    """Recorded after the first integration step."""
    kinds: dict[str, type]
    """The named tuples of "law", "command" and "signals"."""
