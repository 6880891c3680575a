"""What every sensor has: a quantity, timing and errors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import exp, sqrt
from typing import Annotated, Any, ClassVar, Generic, NamedTuple, get_args

import numpy as np
from pydantic import ValidationInfo, model_validator
from typing_extensions import TypeVar

from mjspace.contract import Array, Measurement
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import (
    AnyUnit,
    Finite,
    NonNegative,
    OneOrEach,
    Positive,
    Seconds,
    Si,
    Table,
    Time,
    Walk,
    of_each,
    refuse_other_count,
)

State = dict[str, Array]
"""What the sensors remember, vehicle axis first."""
Draw = Callable[[str, int], Array]
"""Returns the standard normal numbers, (N, k), that a vehicle's sensor draws once: of which
parameter, and how many."""
Deviation = TypeVar("Deviation")
Known = TypeVar("Known", default=Any)
WalkDeviation = TypeVar("WalkDeviation", default=Any)
Density = TypeVar("Density", default=Any)
Limit = TypeVar("Limit", default=Any)

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
    moon_position: Callable[[Array], Array] | None = None
    """Likewise of the Moon."""
    orbit_position: Callable[[Array], Array] | None = None
    """Of the frame's origin from the planet's centre, inertial axes [m], (..., 3), at each time."""
    orbit_velocity: Callable[[Array], Array] | None = None
    """Of the frame's origin, inertial axes [m/s], (..., 3), at each time."""
    sunlight: Callable[[Array, Array], Array] | None = None
    """Part of the Sun's disc that is visible, (..., 1), at a place, with the Sun at another, both
    from the planet's centre, inertial axes [m], (..., 3)."""
    planet_radius: float = 0.0
    """[m]"""


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
    dipole: Array | None = None
    """The magnetic moment that the coils apply, body axes [A m^2], shape (..., 3); None without."""


class Sensor(Table, Generic[Deviation, Known, WalkDeviation, Density, Limit]):
    """A sensor: its table in the scenario, what it measures, and how it errs. Ideal by default.

    A kind of sensor is a subclass with the type of its errors, ``Sensor[Annotated[NonNegative,
    Si("rad/s")]]``, the quantity as default of ``measures``, its ``unit``, and ``true_value`` where
    the quantity is no field of ``Motion``. The types of the other errors follow from that one.
    """

    measures: str
    """The quantity; the table's name when left out."""
    period: Seconds | None = None
    """Time between samples, a whole number of integration steps; else the control period."""
    delay: Time = 0.0
    """Age of a sample when it is reported, a whole number of integration steps."""
    noise_std: Deviation = _NONE
    """Standard deviation of the white noise of each sample, on each axis."""
    noise_density: Density = _NONE
    """Density of white noise, as a gyro's angular random walk: a sample has the variance
    density^2 / period from it, besides that of ``noise_std``."""
    bias: Known = _NONE
    """Constant bias that is known: of all axes, or of each."""
    bias_std: Deviation = _NONE
    """Standard deviation of the constant bias drawn at the start, on each axis."""
    bias_walk: WalkDeviation = _NONE
    """Standard deviation that the bias's random walk has after one second."""
    bias_instability: Deviation = _NONE
    """Standard deviation of a bias that is a Gauss-Markov process of ``correlation_time``."""
    correlation_time: Seconds | None = None
    """After which that bias's autocorrelation has fallen to 1/e."""
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
    holds: ClassVar[bool] = True
    """Whether it reports its last sample again where one is not valid."""

    def __class_getitem__(cls, deviation: Any) -> Any:
        """Return the class of sensors whose errors are such deviations; the rest follows."""
        kinds = deviation if isinstance(deviation, tuple) else _kinds_of(deviation)
        return super().__class_getitem__(kinds)

    @model_validator(mode="before")
    @classmethod
    def _deviations_are_called_so(cls, table: Any, info: ValidationInfo) -> Any:
        """Refuse the names that deviations had; in a log's own scenario they are understood."""
        if not isinstance(table, dict) or "noise" not in table:
            return table
        if (info.context or {}).get("flown"):  # its bias was a deviation as well
            return {_RENAMED.get(key, key): value for key, value in table.items()}
        raise ValueError("noise is now noise_std: the standard deviation")

    @model_validator(mode="after")
    def _correlated_for_a_time(self) -> "Sensor[Any]":
        if bool(self.bias_instability) != (self.correlation_time is not None):
            raise ValueError("bias_instability and correlation_time: give both")
        return self

    @property
    def errs(self) -> bool:
        """Whether a sample may differ from the quantity's true value."""
        return any(np.any(getattr(self, name)) for name in self.errors)

    @property
    def errors(self) -> tuple[str, ...]:
        """The keys of what makes a sample differ from the true value, where they are not zero."""
        return _ERRORS

    @property
    def always_valid(self) -> bool:
        """Whether every sample is valid; else there is a ``<name>_valid`` beside the report."""
        return True

    def noise(self, period: float) -> float:
        """Return the standard deviation of a sample's white noise at that sample ``period`` [s].

        Of a density N that is N / sqrt(period): the Allan variance of white noise over the sample
        period, N^2 / period (IEEE Std 952-1997, annex C.1.1; N is its angle random walk).
        """
        std: Any = self.noise_std
        density: Any = self.noise_density
        return sqrt(std**2 + density**2 / period) if density else std

    def markov(self, period: float) -> tuple[float, float]:
        """Return what is kept of the Gauss-Markov bias over a ``period`` [s], and what comes in.

        The second is the standard deviation of what is added. Exact: b' = k b + s sqrt(1 - k^2) w
        with k = exp(-period / correlation_time) (Maybeck 1979, Stochastic Models, Estimation, and
        Control, volume 1, section 4.11).
        """
        kept = exp(-period / (self.correlation_time or 1.0))
        std: Any = self.bias_instability
        return kept, std * sqrt(1.0 - kept**2)

    def fixed(self, draw: Draw, name: str, axes: int) -> dict[str, Array]:
        """Return what of a sensor's errors is constant in a flight, (N, ...): its "bias".

        Raises:
            ValueError: a known error has another number of axes.
        """
        refuse_other_count(f"sensors.{name}.bias", self.bias, axes, "axes")
        std: Any = self.bias_std
        known: Any = self.bias
        drawn = std * draw("bias", axes)
        return {"bias": drawn + of_each(known, axes) if np.any(known) else drawn}

    def deformed(self, value: Array, fixed: Mapping[str, Array]) -> Array:
        """Return the true ``value`` as the sensor's imperfect axes have it, before the errors."""
        return value

    def weighted(self, white: Array) -> Array:
        """Return standard normal numbers, (..., axes), as the noise's axes have them."""
        return white

    def validity(self, motion: Motion) -> Array:
        """Return 1.0 where a sample is valid and 0.0 where it is not, (..., 1)."""
        raise NotImplementedError

    def quantity(self, name: str) -> str:
        """Return the field of the truth that a sensor of that ``name`` samples."""
        return self.measures

    def alias(self, name: str) -> str:
        """Return the name under which a law also reads the first of the sensors that have it."""
        return self.measures

    def axes_of(self, name: str, surroundings: Surroundings) -> int:
        """Return on how many axes a sensor of that ``name`` errs.

        Raises:
            ValueError: the vehicle has nothing that it could measure.
        """
        width = surroundings.wheels if self.width is None else self.width
        return width if self.axes is None else self.axes

    def width_of(self, name: str, surroundings: Surroundings) -> int:
        """Return how many numbers a sensor of that ``name`` reports."""
        return self.axes_of(name, surroundings) if self.width is None else self.width

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
        return self.rounded(value + error)

    def rounded(self, value: Array) -> Array:
        """Return the ``value`` as a whole number of digits."""
        digit: Any = self.quantization
        return np.rint(value / digit) * digit if digit else value


_ERRORS = (
    *("noise_std", "noise_density", "bias", "bias_std"),
    *("bias_walk", "bias_instability", "quantization"),
)


def _kinds_of(deviation: Any) -> tuple[Any, ...]:
    """Return the types of all errors from that of a standard deviation."""
    marks = get_args(deviation)
    if AnyUnit in marks:
        of_axes = Annotated[float | list[Any], OneOrEach(Annotated[Finite, AnyUnit])]
        return deviation, of_axes, deviation, deviation, Annotated[Positive, AnyUnit]
    unit = next((mark.si for mark in marks if isinstance(mark, Si)), None)
    if unit is None:  # a variable of a class between
        return deviation, Known, WalkDeviation, Density, Limit
    return (
        deviation,
        Annotated[float | list[Finite], OneOrEach(Finite), Si(unit)],
        Annotated[NonNegative, Walk(unit)],
        Annotated[NonNegative, Si(f"{unit}/sqrt(Hz)" if unit else "")],
        Annotated[Positive, Si(unit)],
    )


def in_unit(sensor: Any) -> str | None:
    """Return the unit of a sensor's errors, "" for a number; None where the model knows it."""
    marks = type(sensor).model_fields["noise_std"].metadata
    return next((mark.si for mark in marks if isinstance(mark, Si)), None)
