"""A scenario, whole: what flies, where, under which law, how long, and what it must show."""

import operator
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from mjspace.scenario.declared import DeclaredIn
from mjspace.scenario.dispersions import Dispersion, refuse_overlaps
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Count, FileName, KindName, Positive, Si, Table
from mjspace.scenario.log_rates import LogRates
from mjspace.scenario.measurement import Measurement
from mjspace.scenario.metrics import Metric
from mjspace.scenario.plant import Initial, PlantTable, Rates
from mjspace.scenario.region import Region
from mjspace.scenario.sensors import Sensors, check_sensors
from mjspace.scenario.task import Task
from mjspace.units import whole_number

_MOST_STEPS = 100_000  # in a control period: seconds of wall time


class Component(BaseModel):
    """A law, reference or estimator: ``kind`` names a class, all other keys are its gains."""

    model_config = ConfigDict(extra="allow", frozen=True)

    kind: KindName
    """``"module:Class"`` in controllers/, or ``"file.py:Class"`` in the scenario's folder; of a law
    also ``"library.so:function"`` there, or ``"tcp://host:port"``."""

    @property
    def gains(self) -> dict[str, Any]:
        """The table without ``kind``."""
        return dict(self.model_extra or {})


class SignalRegion(Region):
    """A region of a logged signal, with a name."""

    name: str
    """What it says in the table of checks, or in the log."""


class EventTable(SignalRegion):
    """What the log is to mention: each time the signal comes into the region, with its value."""

    level: Literal["INFO", "WARNING"] = "INFO"
    """Of the line on /events."""
    shows: list[str] = []
    """Other signals whose values the line gives as well."""


class Check(Measurement, SignalRegion):
    """One thing that the flight must show, judged on every control period."""

    statistic: Literal["max", "min", "peak", "mean", "rms", "final", "drift"] = "max"
    """Over the window: of the value, or of the norm of a vector; ``peak`` is the largest magnitude,
    ``drift`` the largest change from the window's first value. It is what has to be in bounds."""
    formula: str | None = None
    """In place of a signal and its bounds, of temporal logic:
    ``"always(dark -> eventually[0:60 s](error < 1 deg))"``. What is measured is its robustness,
    over the sizes of the bounds in it, which has to be above 0."""
    signals: dict[str, str] | None = None
    """Of the formula: the signal of each name in it; one that is named alone is a flag, 0 or 1."""
    expected: Literal["PASS", "FAIL"] = "PASS"
    """How the check comes out when all is well: FAIL of what the flight shows not to hold. The
    scenario passes if it reaches its end and every check comes out as expected; a check without a
    sample in its window comes out neither way."""
    requirement: str = ""
    """Identifier of the requirement that it verifies, as ``"ADCS-012"``: of a specification, shown
    with the verdict."""
    because: str = ""
    """Why it fails, in one line: required with ``expected = "FAIL"``."""
    fails_with: list[str] = []
    """``"key=value"``, or a list of them that go together, as ``--set`` takes them: a change of the
    scenario with which the check comes out the other way, because what it claims is gone."""

    @model_validator(mode="before")
    @classmethod
    def _of_a_formula(cls, table: Any) -> Any:
        if not isinstance(table, dict) or table.get("formula") is None:
            if isinstance(table, dict) and table.get("signals") is not None:
                raise ValueError("signals: go with a formula")
            return table
        if not table.get("signals"):
            raise ValueError("signals: missing, what each name in the formula stands for")
        fixed = {"signal": "", "above": 0.0, "statistic": "min", "relative": False}
        for key in (*fixed, "below", "target"):
            if table.get(key, fixed.get(key)) != fixed.get(key):
                raise ValueError(f"{key}: goes with a signal, not with a formula")
        return table | fixed

    @field_validator("fails_with", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return [value] if isinstance(value, str) else value

    @field_validator("fails_with")
    @classmethod
    def _of_the_flight(cls, value: list[str]) -> list[str]:
        for override in value:
            key, equals, _ = override.partition("=")
            if not equals or not key.strip():
                raise ValueError(f"got {override!r}, should be 'key=value'")
            if key.strip().split(".")[0] == "checks":
                raise ValueError(f"{override!r} changes a check, should change the flight")
        return value

    @model_validator(mode="after")
    def _reason_for_a_failure(self) -> Self:
        if self.expected == "FAIL" and not self.because.strip():
            raise ValueError('expected = "FAIL" needs because = "why it fails, in one line"')
        if self.expected == "PASS" and self.because:
            raise ValueError('because goes with expected = "FAIL"')
        return self


class Scenario(Table):
    """One flight, whole: what flies, where, under which law, how long, and what it must show."""

    name: FileName = ""
    """Of the folder of its logs; the file's name when left out."""
    description: str
    """One line: what the flight shows."""
    source: str = ""
    """Where its numbers come from."""
    seed: Count = 0
    """Of every random stream."""
    duration: Annotated[Positive, Field(le=9e9), Si("s")]
    """Simulated time."""
    rates: Rates = Rates()
    plant: PlantTable = Field(default_factory=PlantTable)
    initial: Initial = Initial()
    environment: Environment = Field(default_factory=Environment)
    sensors: Sensors = Field({}, validate_default=True)
    """By name. Attitude, rate and wheel speed are measured ideally where no sensor is declared."""
    reference: Component
    estimator: Component | None = None
    """What the law sees in place of the measurement; none when left out: it sees the sensors."""
    law: Component
    faults: list[Annotated[Any, DeclaredIn("mjspace.actuators.faults:Fault", optional=False)]] = []
    checks: list[Check] = []
    # Left out where there are none: such a scenario is written as before there were metrics.
    metrics: Annotated[list[Metric], Field(exclude_if=operator.not_)] = []
    events: list[EventTable] = []
    log: LogRates = LogRates()
    task: Task | None = None
    """Of an environment for reinforcement learning; every other command leaves it aside."""
    dispersions: list[Dispersion] = []
    """What differs from member to member of ``mjspace campaign``; every other command flies the
    scenario as it stands."""
    sampling: Literal["random", "latin_hypercube", "sobol", "saltelli"] = "random"
    """How a campaign covers what its dispersions span. With ``latin_hypercube`` the draws depend on
    the number of members too; ``saltelli`` is for Sobol indices."""

    @property
    def kinds(self) -> dict[str, str]:
        """What it names of code, by role: law, reference, and estimator, disturbance, metrics."""
        found = {"law": self.law.kind, "reference": self.reference.kind}
        if self.estimator is not None:
            found["estimator"] = self.estimator.kind
        if self.environment.python is not None:
            found["disturbance"] = self.environment.python
        functions = [metric.function for metric in self.metrics if metric.function]
        return found | {f"metrics.{n}": function for n, function in enumerate(functions)}

    @property
    def _measured(self) -> dict[str, Measurement]:
        """Its checks and metrics, by their places."""
        found: dict[str, Measurement] = {f"checks.{n}": c for n, c in enumerate(self.checks)}
        return found | {f"metrics.{n}": metric for n, metric in enumerate(self.metrics)}

    @model_validator(mode="before")
    @classmethod
    def _failures_are_named(cls, table: Any) -> Any:
        if isinstance(table, dict) and "verdict" in table:
            raise ValueError(
                "verdict: a scenario names the checks that fail: in each of these [[checks]] write "
                'expected = "FAIL" and because = "why it fails"'
            )
        return table

    @model_validator(mode="after")
    def _checks_of_events(self) -> "Scenario":
        names = [event.name for event in self.events]
        for place, measured in self._measured.items():
            for key in ("since", "until"):
                name = getattr(measured, key)
                if name is not None and name not in names:
                    raise ValueError(f"{place}.{key}: no event {name!r} in events: {names}")
        return self

    @model_validator(mode="after")
    def _each_metric_once(self) -> "Scenario":
        names = [metric.name for metric in self.metrics]
        for number, name in enumerate(names):
            if name in names[:number]:
                raise ValueError(f"metrics.{number}.name: {name!r} is there already")
        return self

    @model_validator(mode="after")
    def _each_dispersed_once(self) -> "Scenario":
        refuse_overlaps(self.dispersions)
        return self

    @model_validator(mode="after")
    def _magnetorquers_in_a_field(self) -> "Scenario":
        if self.plant.magnetorquers is not None and self.environment.magnetic_field is None:
            raise ValueError("plant.magnetorquers: needs an [environment.magnetic_field]")
        return self

    @model_validator(mode="after")
    def _boresights_in_an_orbit(self) -> "Scenario":
        if self.plant.boresights and self.environment.orbit is None:
            raise ValueError("plant.boresights: needs an [environment.orbit]")
        return self

    @model_validator(mode="after")
    def _something_to_measure(self) -> "Scenario":
        check_sensors(self.sensors, self.environment)
        return self

    @model_validator(mode="after")
    def _whole_periods(self, info: ValidationInfo) -> "Scenario":
        step, steps = self.rates.physics, self.rates.steps
        if steps > _MOST_STEPS:
            raise ValueError(
                f"rates.control: {self.rates.control:.10g} s has {steps} steps of rates.physics, "
                f"{step:.10g} s: should be at most {_MOST_STEPS}"
            )
        for name, sensor in self.sensors.items():
            if sensor.period is not None:
                whole_number(sensor.period, step, f"sensors.{name}.period", "rates.physics")
        if not _is_flown(info):
            whole_number(self.duration, self.rates.control, "duration", "rates.control")
        self.log.every(self.rates.control)
        return self

    @model_validator(mode="after")
    def _windows_with_samples(self, info: ValidationInfo) -> "Scenario":
        if _is_flown(info):
            return self
        period = self.rates.control
        for place, measured in self._measured.items():
            if measured.begins_too_late(self.duration) and not _is_cut_short(info):
                raise ValueError(
                    f"{place}.start: {measured.start:g} s is after the flight's end, duration "
                    f"{self.duration:g} s"
                )
            if measured.is_between_samples(period):
                raise ValueError(
                    f"{place}: nothing is logged from {measured.start:g} to {measured.end:g} s, "
                    f"but every {period:g} s (rates.control)"
                )
        return self


def _is_flown(info: ValidationInfo) -> bool:
    """Return whether the scenario is a log's, whose flight is judged again as it was."""
    return bool((info.context or {}).get("flown"))


def _is_cut_short(info: ValidationInfo) -> bool:
    """Return whether a duration on the command line may leave checks without a window."""
    return bool((info.context or {}).get("cut_short"))
