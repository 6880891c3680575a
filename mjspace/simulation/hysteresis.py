"""What hysteresis rods remember, as a step effect: their field and its lag, from step to step."""

from typing import Any, ClassVar, Self

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.cubics import value_of
from mjspace.environment.hysteresis_rod import MAGNETIC_CONSTANT, STATE, HysteresisRod, lags_after
from mjspace.environment.install import places_of
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.state_layout import StateLayout
from mjspace.vehicle.step_effect import Instant, State, StepEffect, Write


class Hysteresis(StepEffect):
    """Takes each rod's state along with the field, and hands it to the rod's term for a step.

    The field is taken to change one way in a step: where it turns within one, the lag is off by
    what it changes back in it, of second order in the step.
    """

    name: ClassVar[str] = "the hysteresis rods"
    every_step: ClassVar[bool] = True
    not_compiled = ""

    @classmethod
    def of(cls, assembly: Assembly, layout: StateLayout) -> Self | None:
        """Return the effect of the scenario's rods; None where there are none."""
        return cls(assembly, layout) if assembly.scenario.environment.hysteresis_rods else None

    def __init__(self, assembly: Assembly, layout: StateLayout) -> None:
        """Keep the rods, where their states stand in ``userdata``, and the Earth's field."""
        scenario = assembly.scenario
        self._rods = scenario.environment.hysteresis_rods
        self._places = places_of(HysteresisRod, scenario.environment, scenario.plant)
        self._axes = np.array([rod.direction for rod in self._rods])
        self._loops = np.array([[rod.coercivity, rod.rate] for rod in self._rods])
        self._field = assembly.known["magnetic_field"]
        self._attitude = layout.attitude
        self._parameters: Any = None

    def bind(self, batch: Any) -> None:
        """Take the environment's parameters in ``userdata``."""
        self._parameters = batch.bind("userdata")

    def reset(self, physics: Array) -> State:
        """Return the rods as they are without magnetization, on the middle of their loops."""
        field = self._along_rods(physics, self.known(physics[:, 0]))
        return {"rod_field": field, "rod_lag": field.copy()}

    def known(self, times: Array) -> Array:
        """Return the cubic of the Earth's field that holds from each control instant on."""
        return self._field.rows(times)

    def before_step(self, memory: State, instant: Instant) -> State:
        """Follow the field to the beginning of the step."""
        memory = self.follow(memory, instant.physics, self.known(instant.physics[:, 0]))
        for i, place in enumerate(self._places):
            self._parameters[:, place + STATE] = memory["rod_field"][:, i]
            self._parameters[:, place + STATE + 1] = memory["rod_lag"][:, i]
        return memory

    def follow(self, memory: State, physics: Array, known: Array) -> State:
        """Return the memory with the field at the beginning of a step, and the lag there."""
        field = self._along_rods(physics, known)
        lag = lags_after.ufunc(memory["rod_lag"], field - memory["rod_field"], self._loops)
        return memory | {"rod_field": field, "rod_lag": lag}

    def prepare(
        self, memory: State, physics: Array, time: Array, known: Array
    ) -> tuple[list[Write], Array | None]:
        """Return that field and lag are written."""
        states = memory["rod_field"], memory["rod_lag"]
        return [
            Write("userdata", place + STATE + k, state[:, i : i + 1])
            for i, place in enumerate(self._places)
            for k, state in enumerate(states)
        ], None

    def logged(self, memory: State, sensordata: Array) -> dict[str, Array]:
        """Return the field [A/m] and the flux density [T] along each rod."""
        field, lag = memory["rod_field"], memory["rod_lag"]
        columns = [rod.flux_density(field[..., i], lag[..., i]) for i, rod in enumerate(self._rods)]
        return {"rod_field": field, "rod_flux_density": np.stack(columns, axis=-1)}

    def _along_rods(self, physics: Array, known: Array) -> Array:
        """Return the Earth's field along each rod [A/m], (N, rods)."""
        inertial = value_of(known, physics[:, 0])
        body = attitude.rotate(attitude.conjugate(physics[:, self._attitude]), inertial)
        x, y, z = (body[:, i, None] * self._axes[:, i] for i in range(3))
        along: Array = (x + y + z) / MAGNETIC_CONSTANT
        return along
