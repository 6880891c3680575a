"""A scenario, whole: what flies, where, under which law, how long, and what it must show."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from mjspace.environment_tables import Environment
from mjspace.fields import Seconds, Table, Time
from mjspace.quantity import any_to_si, whole_number
from mjspace.sensor_tables import Sensors
from mjspace.tables import Initial, PlantTable, Rates


class Component(BaseModel):
    """A law or a reference: ``kind`` names a class, every other key is one of its gains."""

    model_config = ConfigDict(extra="allow", frozen=True, use_attribute_docstrings=True)

    kind: str
    """``"module:Class"`` in controllers/, or ``"path/to/file.py:Class"`` beside the scenario."""

    @property
    def gains(self) -> dict[str, Any]:
        """The table without ``kind``."""
        return dict(self.model_extra or {})


class Check(Table):
    """One thing that the flight must show, judged from the log alone."""

    name: str
    """What it says in the table of checks."""
    signal: str
    """``topic.field`` or ``topic.field[i]`` of the log: ``truth.attitude_error``."""
    statistic: Literal["max", "min", "peak", "mean", "rms", "final", "drift"] = "max"
    """Over the window: of the value, or of the norm of a vector; ``peak`` is the largest magnitude,
    ``drift`` the largest change from the window's first value."""
    below: float | None = None
    """The statistic must be less; a number in SI or a quantity."""
    above: float | None = None
    """The statistic must be greater; a number in SI or a quantity."""
    start: Time = 0.0
    """The window's first instant."""
    end: Time | None = None
    """The window's last instant; the flight's when left out."""
    target: float | list[float] | None = None
    """Taken from the signal first, so that the statistic is of an error."""
    relative: bool = False
    """The error is divided by the norm of ``target``."""

    @field_validator("below", "above", mode="before")
    @classmethod
    def _quantity(cls, value: Any) -> Any:
        return any_to_si(value) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _bounded(self) -> "Check":
        if self.below is None and self.above is None:
            raise ValueError("neither below nor above is given: a check must be able to fail")
        if self.relative and self.target is None:
            raise ValueError("relative needs a target")
        return self


class Scenario(Table):
    """One flight, whole: what flies, where, under which law, how long, and what it must show."""

    name: str = ""
    """The file's name when left out."""
    description: str
    """One line: what the flight shows."""
    source: str = ""
    """Where its numbers come from."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Of every random stream."""
    duration: Seconds
    """Simulated time."""
    rates: Rates = Rates()
    plant: PlantTable = PlantTable()
    initial: Initial = Initial()
    environment: Environment = Environment()
    sensors: Sensors = Sensors()
    reference: Component
    law: Component
    checks: list[Check] = []

    @model_validator(mode="after")
    def _whole_periods(self) -> "Scenario":
        step = self.rates.physics
        spans: dict[str, float | None] = {"rates.control": self.rates.control}
        for name, sensor in self.sensors:
            spans[f"sensors.{name}.period"] = None if sensor is None else sensor.period
        for key, span in spans.items():
            if span is not None:
                whole_number(span, step, key, "rates.physics")
        if self.duration < self.rates.control:
            raise ValueError(f"duration {self.duration:g} s is less than one control period")
        return self
