"""The Earth's magnetic field along the orbit as a step effect: the piece that holds now."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Self

from mjspace.contract import Array
from mjspace.environment.magnetic_field import FIELD, of_piece
from mjspace.sensors.base import Surroundings
from mjspace.vehicle.step_effect import Instant, State, StepEffect, Write

if TYPE_CHECKING:
    from mjspace.environment.geomagnetism import FieldAlongOrbit


class MagneticField(StepEffect):
    """Hands the field's cubic of time to the environment, which turns moments in it."""

    name: ClassVar[str] = "the magnetic field"
    not_compiled = ""

    @classmethod
    def of(cls, field: "FieldAlongOrbit | None") -> Self | None:
        """Return the effect of the ``field``; None where there is none."""
        return None if field is None else cls(field)

    def __init__(self, field: "FieldAlongOrbit") -> None:
        """Keep the ``field`` along the orbit."""
        self._field = field
        self._acting: Any = None

    def bind(self, batch: Any) -> None:
        """Take the environment's parameters in ``userdata``."""
        self._acting = batch.bind("userdata")[:, FIELD]

    def at_control(self, memory: State, instant: Instant) -> State:
        """Set the cubic that holds from this control instant on."""
        self._acting[:] = self._field.piece(instant.time)
        return memory

    def known(self, times: Array) -> Array:
        """Return the cubic of each control instant."""
        return self._field.piece(times)

    def prepare(
        self, memory: State, physics: Array, time: Array, known: Array
    ) -> tuple[list[Write], Array | None]:
        """Return that the cubic is written."""
        return [Write("userdata", FIELD.start, known[None])], None

    def around(self, surroundings: Surroundings, known: Array) -> Surroundings:
        """Return surroundings with the field of that cubic."""
        return replace(surroundings, magnetic_field=partial(of_piece, known))
