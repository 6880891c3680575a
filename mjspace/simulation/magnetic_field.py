"""The Earth's magnetic field along the orbit as a step effect: the piece that holds now."""

from typing import TYPE_CHECKING, Any, ClassVar, Self

from mjspace.environment.magnetic_field import FIELD
from mjspace.vehicle.step_effect import Instant, State, StepEffect

if TYPE_CHECKING:
    from mjspace.environment.geomagnetism import FieldAlongOrbit


class MagneticField(StepEffect):
    """Hands the field's cubic of time to the environment, which turns moments in it."""

    name: ClassVar[str] = "the magnetic field"

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
