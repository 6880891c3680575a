"""What is known of the environment as a function of time, as a step effect: what holds now.

The magnetic field, where the Sun and the Moon are, and the air's density, each a cubic of time, and
the elements of an orbit that drifts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from mjspace.contract import Array
from mjspace.environment.cubics import value_of
from mjspace.environment.install import places_read
from mjspace.scenario.scenario import Scenario
from mjspace.sensors.base import Surroundings
from mjspace.vehicle.step_effect import Instant, State, StepEffect, Write

_SEEN = ("magnetic_field", "sun_position", "moon_position")
"""What of it sensors and logs may read."""


class Known(Protocol):
    """Numbers that are known beforehand."""

    def rows(self, time: Array) -> Array:
        """Return those that hold from each ``time`` (n,) [s] on, (n, k)."""


def known_of(scenario: Scenario) -> dict[str, Known]:
    """Return what is known of the scenario's environment, by the names that terms read it under."""
    environment, control, duration = (
        scenario.environment,
        scenario.rates.control,
        scenario.duration,
    )
    found: dict[str, Known] = {}
    if environment.magnetic_field is not None:
        from mjspace.environment import geomagnetism

        found["magnetic_field"] = geomagnetism.along(environment, control, duration)
    if environment.time_zero is not None and environment.has_sun:
        from mjspace.environment import moon, sun

        found["sun_position"] = sun.along(environment.time_zero, control, duration)
        found["moon_position"] = moon.along(environment.time_zero, control, duration)
    if environment.facet_drag is not None and environment.facet_drag.nrlmsis is not None:
        from mjspace.environment import nrlmsis

        found["air_density"] = nrlmsis.along(environment, control, duration)
    if environment.orbit is not None and environment.orbit.drifts_on:
        environment.orbit.rows(np.array([0.0, duration]))  # a satellite may decay before
        found["orbit"] = environment.orbit
    return found


def seen_of(known: Mapping[str, Known]) -> dict[str, Any]:
    """Return the cubics that are fields of ``Surroundings``."""
    return {name: known[name] for name in _SEEN if name in known}


def changing(known: Mapping[str, Known], scenario: Scenario) -> list[slice]:
    """Return which parts of ``userdata`` it is written to."""
    zero = np.zeros(1)
    return [
        slice(place, place + one.rows(zero).shape[1])
        for name, one in known.items()
        for place in places_read(name, scenario.environment, scenario.plant)
    ]


class KnownBeforehand(StepEffect):
    """Hands the terms of the environment what holds from each control instant on."""

    name: ClassVar[str] = "the environment"
    not_compiled = ""

    @classmethod
    def of(cls, known: Mapping[str, Known], scenario: Scenario) -> Self | None:
        """Return the effect of what is ``known``; None where that is nothing."""
        return cls(known, scenario) if known else None

    def __init__(self, known: Mapping[str, Known], scenario: Scenario) -> None:
        """Keep what is ``known``, and where terms read it."""
        self._known = known
        zero, column = np.zeros(1), 0
        self._columns: dict[str, slice] = {}
        self._places: list[tuple[slice, int]] = []
        for name, one in known.items():
            width = one.rows(zero).shape[1]
            columns = self._columns[name] = slice(column, column + width)
            places = places_read(name, scenario.environment, scenario.plant)
            self._places += [(columns, place) for place in places]
            column += width
        self._acting: Sequence[tuple[slice, Any]] = ()

    def bind(self, batch: Any) -> None:
        """Take the environment's parameters in ``userdata``."""
        parameters = batch.bind("userdata")
        self._acting = [
            (columns, parameters[:, place : place + columns.stop - columns.start])
            for columns, place in self._places
        ]

    def at_control(self, memory: State, instant: Instant) -> State:
        """Set what holds from this control instant on."""
        (row,) = self.known(np.array([instant.time]))
        for columns, parameters in self._acting:
            parameters[:] = row[columns]
        return memory

    def known(self, times: Array) -> Array:
        """Return what holds from each control instant on."""
        return np.concatenate([one.rows(times) for one in self._known.values()], axis=-1)

    def prepare(
        self, memory: State, physics: Array, time: Array, known: Array
    ) -> tuple[list[Write], Array | None]:
        """Return that it is written."""
        writes = [Write("userdata", place, known[None, cols]) for cols, place in self._places]
        return writes, None

    def around(self, surroundings: Surroundings, known: Array) -> Surroundings:
        """Return surroundings with the vectors of those cubics."""
        vectors: dict[str, Any] = {
            name: partial(value_of, known[self._columns[name]]) for name in seen_of(self._known)
        }
        return replace(surroundings, **vectors)
