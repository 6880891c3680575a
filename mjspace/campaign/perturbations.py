"""What a law may have to survive: a scenario made worse in one way, by so much."""

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from mjspace.simulation.assembly import Assembly

Change = dict[str, Any]
"""A scenario's table, to be changed."""


@dataclass(frozen=True)
class Nominal:
    """A scenario before it is made worse."""

    table: Mapping[str, Any]
    """As it is written, with the overrides."""
    path: Path
    """Of its file."""
    trust: bool
    assembly: Assembly

    def copy(self) -> Change:
        """Return its table to change."""
        return copy.deepcopy(dict(self.table))


class Perturbation(ABC):
    """One way of making a scenario worse, by steps: the larger the step, the worse."""

    name: str
    unit: str = ""
    """Of ``value``: SI, or "" for a factor."""
    whole: ClassVar[bool] = False
    """Whether only whole steps are possible."""
    first: ClassVar[float] = 1.0
    """The first step that is tried."""
    most: ClassVar[float]
    """The largest."""

    def applies(self, nominal: Nominal) -> bool:
        """Return whether the scenario has anything that it changes."""
        return True

    @abstractmethod
    def value(self, nominal: Nominal, step: float) -> float:
        """Return what a person reads of the step, in ``unit``."""

    @abstractmethod
    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the scenario's table with the step in it."""


class Delay(Perturbation):
    """All actuators apply what they should have applied earlier."""

    name = "delay of all actuators"
    unit = "s"
    whole = True
    most = 1000  # each held value is remembered

    def applies(self, nominal: Nominal) -> bool:
        """Return whether there are any."""
        return bool(nominal.assembly.actuators.kinds)

    def value(self, nominal: Nominal, step: float) -> float:
        """Return the delay [s]."""
        return step * nominal.assembly.hold

    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the table with a fault of every kind of actuator."""
        return _with_faults(nominal, "delayed", self.value(nominal, step))


class Lag(Perturbation):
    """All actuators follow with a first-order lag, beside what their own models have."""

    name = "time constant of a lag of all actuators"
    unit = "s"
    most = 1e6

    def applies(self, nominal: Nominal) -> bool:
        """Return whether there are any."""
        return bool(nominal.assembly.actuators.kinds)

    def value(self, nominal: Nominal, step: float) -> float:
        """Return the time constant [s]."""
        return step * nominal.assembly.hold

    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the table with a fault of every kind of actuator."""
        return _with_faults(nominal, "lagged", self.value(nominal, step))


@dataclass(frozen=True)
class _Factor(Perturbation):
    """What is nominal is multiplied by 1 + step, or divided by it."""

    name: str
    divides: bool = False
    first: ClassVar[float] = 0.05
    most: ClassVar[float] = 31.0  # 30 dB

    def value(self, nominal: Nominal, step: float) -> float:
        """Return the factor."""
        return 1.0 / (1.0 + step) if self.divides else 1.0 + step


class Gain(_Factor):
    """All actuators apply more, or less, than they should."""

    def applies(self, nominal: Nominal) -> bool:
        """Return whether there are any actuators."""
        return bool(nominal.assembly.actuators.kinds)

    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the table with a fault of every kind of actuator."""
        return _with_faults(nominal, "scaled", self.value(nominal, step))


class Inertia(_Factor):
    """The law believes in a larger, or a smaller, inertia than the vehicle's."""

    def applies(self, nominal: Nominal) -> bool:
        """Return whether the law has an inertia among its gains."""
        return "inertia" in nominal.assembly.scenario.law.gains

    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the table with another inertia in the law."""
        table = nominal.copy()
        own = np.array(nominal.assembly.scenario.law.gains["inertia"])
        table["law"]["inertia"] = (self.value(nominal, step) * own).tolist()
        return table


class Sampling(Perturbation):
    """The law is called less often; the flight ends with its last whole period."""

    name = "control period"
    unit = "s"
    whole = True
    most = 1000.0

    def value(self, nominal: Nominal, step: float) -> float:
        """Return the control period [s]."""
        return (1.0 + step) * nominal.assembly.scenario.rates.control

    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the table with the longer period."""
        table, period = nominal.copy(), self.value(nominal, step)
        table.setdefault("rates", {})["control"] = period
        periods = math.floor(nominal.assembly.scenario.duration / period * (1.0 + 1e-9))
        table["duration"] = periods * period
        return table


@dataclass(frozen=True, kw_only=True)
class Noise(Perturbation):
    """A quantity is measured with white noise."""

    name: str
    unit: str
    quantity: str
    first: ClassVar[float] = 1e-6
    most: ClassVar[float] = 1.0

    def applies(self, nominal: Nominal) -> bool:
        """Return whether a sensor measures the quantity."""
        return bool(self._sensors(nominal))

    def value(self, nominal: Nominal, step: float) -> float:
        """Return the standard deviation of a sample on each axis."""
        return step

    def change(self, nominal: Nominal, step: float) -> Change:
        """Return the table with the noise added to that of every sensor of the quantity."""
        table = nominal.copy()
        for name in self._sensors(nominal):
            own = float(nominal.assembly.scenario.sensors[name].noise_std)
            sensor = table.setdefault("sensors", {}).setdefault(name, {})
            sensor["noise_std"] = math.hypot(own, step)
        return table

    def _sensors(self, nominal: Nominal) -> Sequence[str]:
        sensors = nominal.assembly.scenario.sensors
        return [name for name, one in sensors.items() if one.measures == self.quantity]


KINDS: dict[str, Perturbation] = {
    "delay": Delay(),
    "lag": Lag(),
    "gain-up": Gain("gain increased to"),
    "gain-down": Gain("gain reduced to", divides=True),
    "inertia-up": Inertia("the law's inertia increased to"),
    "inertia-down": Inertia("the law's inertia reduced to", divides=True),
    "sampling": Sampling(),
    "rate-noise": Noise(name="noise of the rate", unit="rad/s", quantity="rate"),
    "attitude-noise": Noise(name="noise of the attitude", unit="rad", quantity="attitude"),
}
"""By the name on the command line: a line registers each."""


def _with_faults(nominal: Nominal, kind: str, value: float) -> Change:
    """Return the table with a fault of every kind of actuator, from the beginning on."""
    table = nominal.copy()
    motors = [each.logged_as for each in nominal.assembly.actuators.kinds]
    faults = [{"motor": motor, "kind": kind, "value": value, "at": 0.0} for motor in motors]
    table["faults"] = [*table.get("faults", []), *faults]
    return table
