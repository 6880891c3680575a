"""Pictures of a flight: the vehicle as a log of it would be rendered."""

import copy
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.gym.episodes import Flight
from mjspace.rendering.offscreen import Canvas
from mjspace.rendering.scene import Stage
from mjspace.simulation.assembly import Assembly

CAMERA, SIZE = "chase", (480, 270)


class Pictures:
    """A canvas on which instants of flights are drawn; it is to be closed."""

    def __init__(self, assembly: Assembly) -> None:
        """Prepare to draw the vehicle of the ``assembly``.

        Raises:
            NoRendererError: this machine cannot render; the message says what to install.
        """
        self._assembly = assembly
        scenario = assembly.scenario
        self._stage = Stage(copy.copy(assembly.vehicle.model), CAMERA, scenario.environment.orbit)
        self._canvas = Canvas(self._stage.model, SIZE)

    def of(self, flight: Flight, row: int) -> Any:
        """Return a picture of a vehicle of the ``flight``, (height, width, 3)."""
        now, engine = flight.signals(), self._assembly.scenario.plant.engine
        thrust = 0.0
        if engine is not None:
            thrust = float(now.of("/truth", "thrust")[row, 0]) / engine.thrust_max
        period = now.period
        pulses = self._pulses(flight, row)
        self._stage.set(period.time, period.physics[row], now.desired.attitude, pulses, thrust)
        return self._canvas.draw(self._stage.scene)

    def close(self) -> None:
        """Free the canvas."""
        self._canvas.__exit__(None, None, None)

    def _pulses(self, flight: Flight, row: int) -> Array | None:
        """Return what is above zero for each thruster that was on in the last control period."""
        if flight.applied is None:
            return None
        applied = self._assembly.actuators.logged(flight.applied)
        fields = flight.signals().command._asdict() | applied
        each = [fields[name][row] for name in ("on_time", "thruster_thrust") if name in fields]
        return np.maximum.reduce(each) if each else None
