"""The signals that a learner observes and is rewarded for, by the names of the log."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array, DesiredMotion, Truth
from mjspace.errors import input_error_at
from mjspace.signals import find_signal
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.recording import position_errors
from mjspace.simulation.state_layout import StateLayout

Reader = Callable[["Signals"], Array]
"""Returns a signal or some of its components, (N, ...)."""


@dataclass
class Signals:
    """What is known of a control instant; arrays have a vehicle axis first.

    Its topics are those of the log, without what the log has of the period that begins, and
    ``error``: the measured attitude's rotation vector from the desired one [rad], and the measured
    less the desired rate [rad/s], both in body axes.
    """

    layout: StateLayout
    period: ControlPeriod
    """Sensed: without a command of its own."""
    desired: DesiredMotion
    """Of the instant, without a vehicle axis."""
    command: Any
    """That of the period before, a named tuple of arrays (N, ...); zeros at the start."""
    _rows: dict[tuple[str, str], Array] = field(default_factory=dict)

    def topics(self) -> dict[str, dict[str, tuple[int, ...]]]:
        """Return the shape of each field of each topic for one vehicle."""
        found: dict[str, Mapping[str, Array]] = {
            "/measurement": self.period.measurement._asdict(),
            "/reference": self.desired._asdict(),
            "/error": {name: self.of("/error", name) for name in _ERRORS if self._measures(name)},
            "/truth": self.period.truth._asdict() | self._motion | self._in_orbit,
            "/command": self.command._asdict(),
        }
        return {
            topic: {name: self.of(topic, name).shape[1:] for name, a in each.items() if np.size(a)}
            for topic, each in found.items()
        }

    def of(self, topic: str, name: str) -> Array:
        """Return a signal, (N, ...)."""
        key = topic, name
        if key not in self._rows:
            self._rows[key] = _READ[topic](self, name)
        return self._rows[key]

    def truth(self) -> Truth:
        """Return all of the truth, as a disturbance in Python receives it, (N, ...)."""
        return self.layout.with_surroundings(self.period.physics, self.period.truth)

    def _of_each(self, values: Array) -> Array:
        return np.broadcast_to(values, (len(self.period.physics), *values.shape))

    def _measures(self, name: str) -> bool:
        needed = _ERRORS[: _ERRORS.index(name) + 1]
        return all(hasattr(self.period.measurement, each) for each in needed)

    @cached_property
    def _motion(self) -> dict[str, Array]:
        """The truth that is no sensor's."""
        physics, layout = self.period.physics, self.layout
        position, quaternion = physics[:, layout.position], self.period.truth.attitude
        desired = {name: values[None] for name, values in self.desired._asdict().items()}
        error = attitude.rotation_angle(quaternion, desired["attitude"])
        return {
            "position": position,
            "velocity": physics[:, layout.velocity],
            "attitude_error": error[..., None],
            **position_errors(position, quaternion, desired),
        }

    @cached_property
    def _in_orbit(self) -> dict[str, Array]:
        return self.layout.in_orbit(self.period.physics)

    def _of_truth(self, name: str) -> Array:
        if name in self._motion:
            return self._motion[name]
        known = self.period.truth._asdict()
        return known[name] if np.size(known.get(name, ())) else self._in_orbit[name]

    def _error(self, name: str) -> Array:
        measurement, desired = self.period.measurement, self.desired
        rate = measurement.rate if hasattr(measurement, "rate") else np.zeros(3)
        errors = attitude.tracking_error(measurement.attitude, rate, desired.attitude, desired.rate)
        return errors[_ERRORS.index(name)]


_ERRORS = "attitude", "rate"  # the second needs the first as well
_READ: dict[str, Callable[[Signals, str], Array]] = {
    "/measurement": lambda signals, name: signals.period.measurement._asdict()[name],
    "/reference": lambda signals, name: signals._of_each(getattr(signals.desired, name)),
    "/error": Signals._error,
    "/truth": Signals._of_truth,
    "/command": lambda signals, name: getattr(signals.command, name),
}


def reader(signals: Signals, signal: str, key: str) -> Reader:
    """Return what reads the ``signal``, as "truth.rate[0]", of any instant alike.

    All of a signal has its own shape, components are (N, k).

    Raises:
        InputError: there is none, with the scenario's ``key`` and the near names.
    """
    with input_error_at(key):
        topic, name, part = find_signal(signals.topics(), signal)
    if "[" in signal:
        return lambda now: rows(now.of(topic, name))[:, part]
    return lambda now: now.of(topic, name)


def rows(values: Array) -> Array:
    """Return ``values`` (N, ...) with the numbers of each vehicle side by side, (N, k)."""
    return values.reshape(len(values), -1)
