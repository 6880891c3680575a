"""What every sensor has: a quantity, timing and errors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
from pydantic import ValidationInfo, model_validator

from mjspace.contract import Array, Measurement
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Seconds, Table, Time

State = dict[str, Array]
"""What the sensors remember, vehicle axis first."""
Deviation = TypeVar("Deviation")

_NONE: Any = 0.0
_RENAMED = {"noise": "noise_std", "bias": "bias_std"}


class OwnSensor(NamedTuple):
    """What is known of a sensor that the vehicle's own model has."""

    size: int
    """How many numbers it reports."""
    unit: str
    """Of them; "" where there is none."""
    is_attitude: bool
    """Whether it reports a quaternion."""


@dataclass(frozen=True)
class Surroundings:
    """What a vehicle's sensors need to know of the vehicle and of where it flies."""

    wheels: int = 0
    own_sensors: Mapping[str, OwnSensor] = field(default_factory=dict)
    """The sensors of the vehicle's own model, by the field of the truth that they have read."""
    gravity: Callable[[Array], Array] = np.zeros_like
    """What accelerometers do not measure [m/s^2], (..., 3), at each position [m], (..., 3)."""
    height: Callable[[Array], Array] = lambda position: position[..., 2:]
    """What altimeters measure [m], (..., 1), at each position [m], (..., 3)."""
    magnetic_field: Callable[[Array], Array] | None = None
    """Of the Earth, inertial axes [T], (..., 3), at each time [s], (...)."""
    sun_position: Callable[[Array], Array] | None = None
    """Of the Sun from the Earth's centre, inertial axes [m], (..., 3), at each time [s], (...)."""
    orbit_position: Callable[[Array], Array] | None = None
    """Of the frame's origin from the planet's centre, inertial axes [m], (..., 3), at each time."""


class Motion(NamedTuple):
    """The bus's true motion; leading axes are those of all arrays."""

    time: Array
    """Simulation time [s], shape (...)."""
    attitude: Array
    """Quaternion, scalar first, body to inertial, shape (..., 4)."""
    rate: Array
    """Body axes [rad/s], shape (..., 3)."""
    wheel_speed: Array
    """[rad/s], shape (..., n)."""
    position: Array
    """Inertial axes, from the frame's origin [m], shape (..., 3)."""
    velocity: Array
    """Inertial axes [m/s], shape (..., 3)."""
    surroundings: Surroundings


class Sensor(Table, Generic[Deviation]):
    """A sensor: its table in the scenario, what it measures, and how it errs. Ideal by default.

    A kind of sensor is a subclass with the type of its errors, ``Sensor[Annotated[NonNegative,
    Si("rad/s")]]``, the quantity as default of ``measures``, its ``unit``, and ``true_value`` where
    the quantity is no field of ``Motion``.
    """

    measures: str
    """The quantity; the table's name when left out."""
    period: Seconds | None = None
    """Time between samples, a whole number of integration steps; else the control period."""
    delay: Time = 0.0
    """Age of a sample when it is reported, a whole number of sample periods."""
    noise_std: Deviation = _NONE
    """Standard deviation of the white noise of each sample, on each axis."""
    bias_std: Deviation = _NONE
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: Deviation = _NONE
    """Standard deviation that the bias's random walk has after one second."""
    quantization: Deviation = _NONE
    """Size of the least significant digit."""

    unit: ClassVar[str]
    """Of what it reports, "" for a number."""
    width: ClassVar[int | None] = 3
    """Numbers that it reports; None: one for each wheel."""
    axes: ClassVar[int | None] = None
    """Axes on which it errs; None: as many as it reports numbers."""
    of_translation: ClassVar[bool] = False
    """Whether it measures the bus's translation: /truth then has ``altitude``, too."""
    integrates: ClassVar[bool] = False
    """Whether a sample depends on the one before: it then has ``begin`` and ``mean``, and no
    ``true_value``."""
    at_control: ClassVar[bool] = False
    """Whether it can sample at control instants only."""

    @model_validator(mode="before")
    @classmethod
    def _deviations_are_called_so(cls, table: Any, info: ValidationInfo) -> Any:
        """Refuse the names that deviations had; in a log's own scenario they are understood."""
        old = [name for name in _RENAMED if isinstance(table, dict) and name in table]
        if not old:
            return table
        if (info.context or {}).get("flown"):
            return {_RENAMED.get(key, key): value for key, value in table.items()}
        names = " and ".join(f"{name} is now {_RENAMED[name]}" for name in old)
        raise ValueError(f"{names}: the standard deviation")

    @property
    def errs(self) -> bool:
        """Whether a sample may differ from the quantity's true value."""
        return any((self.noise_std, self.bias_std, self.bias_walk, self.quantization))

    def quantity(self, name: str) -> str:
        """Return the field of the truth that a sensor of that ``name`` samples."""
        return self.measures

    def axes_of(self, name: str, surroundings: Surroundings) -> int:
        """Return on how many axes a sensor of that ``name`` errs.

        Raises:
            ValueError: the vehicle has nothing that it could measure.
        """
        width = surroundings.wheels if self.width is None else self.width
        return width if self.axes is None else self.axes

    def check_environment(self, environment: Environment) -> None:
        """Raise a ValueError where there is nothing that the sensor could measure."""

    def true_value(self, motion: Motion) -> Array:
        """Return the quantity's true value, (..., width): by default, the motion's of its name."""
        value: Array = getattr(motion, self.measures)
        return value

    def begin(self, memory: State, name: str, truth: Measurement) -> Array:
        """Put the start into ``memory``, under names that begin with ``name``; return sample 0."""
        raise NotImplementedError

    def mean(
        self, memory: State, name: str, truth: Measurement, span: float, surroundings: Surroundings
    ) -> Array:
        """Return the mean over the ``span`` [s] since the last sample, and remember this one."""
        raise NotImplementedError

    def with_error(self, value: Array, error: Array) -> Array:
        """Return what is reported of the true ``value`` under the ``error``, (..., axes)."""
        result = value + error
        digit: Any = self.quantization
        return np.rint(result / digit) * digit if digit else result
