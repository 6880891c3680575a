"""Sensors that the vehicle's own model has, with errors, delay and sampling."""

from typing import Annotated, ClassVar, Literal

from mjspace.contract import Array
from mjspace.errors import nearest
from mjspace.scenario.fields import AnyUnit, NonNegative
from mjspace.sensors.base import Sensor, Surroundings
from mjspace.sensors.star_tracker import turned
from mjspace.units import Quantity

_ERRORS = ("noise_std", "bias", "bias_std", "bias_walk", "bias_instability", "quantization")


class OfModel(Sensor[Annotated[NonNegative, AnyUnit]]):
    """A sensor of the model, or of relative motion, with errors in its unit.

    The errors of one that reports a quaternion are small rotations about its axes, in rad. It
    samples at control instants.
    """

    measures: Literal["model"] = "model"
    unit: ClassVar[str] = ""
    at_control: ClassVar[bool] = True

    of: str | None = None
    """Which: ``"target_position"``; that of the table's name when left out."""

    def quantity(self, name: str) -> str:
        """Return the field of the truth that it samples."""
        return name if self.of is None else self.of

    def alias(self, name: str) -> str:
        """Return the field of the truth that it samples."""
        return self.quantity(name)

    def axes_of(self, name: str, surroundings: Surroundings) -> int:
        """Return on how many axes the model's sensor errs.

        Raises:
            ValueError: the model has no such sensor, or an error has the unit of another quantity.
        """
        known, sampled = surroundings.own_sensors, self.quantity(name)
        if sampled not in known:
            near = nearest(sampled, known)
            raise ValueError(f"sensors.{name}: the model has no sensor {sampled!r}{near}")
        own = known[sampled]
        right = "rad" if own.is_attitude else own.unit
        rights = dict.fromkeys(_ERRORS, right) | {"noise_density": f"{right}/sqrt(Hz)"}
        for key, unit in rights.items():
            value = getattr(self, key)
            for each in value if isinstance(value, list) else [value]:
                if isinstance(each, Quantity) and each.unit != unit:
                    wanted = f"in {unit}" if right else "a plain number"
                    given = f"{each:.6g} {each.unit}"
                    raise ValueError(f"sensors.{name}.{key}: got {given}, should be {wanted}")
        return 3 if own.is_attitude else own.size

    def width_of(self, name: str, surroundings: Surroundings) -> int:
        """Return how many numbers the model's sensor reports."""
        return surroundings.own_sensors[self.quantity(name)].size

    def with_error(self, value: Array, error: Array) -> Array:
        """Return what is reported of the true ``value`` under the ``error``, (..., axes)."""
        if value.shape[-1] == error.shape[-1]:
            return super().with_error(value, error)
        return turned(value, error, self.quantization)
