"""What a plot shows of a log: one panel for each signal that has something to show."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.plotting.decimate import outline
from mjspace.signals import find_signal

DEGREES = float(np.degrees(1.0))
RPM = 30.0 / np.pi
WANTED_RATE = "/reference", "rate"
LAW_PANELS = 4


@dataclass(frozen=True)
class Panel:
    """A signal and how a person reads it."""

    title: str
    topic: str
    field: str
    unit: str = ""
    scale: float = 1.0
    """From SI to ``unit``."""
    part: slice | None = None
    """The one component that is drawn; all when left out."""
    names: str = ""
    """Of the components, a letter each; their numbers when left out."""
    log_scale: bool = False
    drift: bool = False
    """Drawn is the norm of the change since the first row."""
    wanted: tuple[str, str] | None = None
    """Topic and field of what it should be."""


@dataclass(frozen=True)
class Curves:
    """A panel and its points: times [s] and values in the panel's unit, each (m, c)."""

    panel: Panel
    time: Array
    value: Array
    wanted_time: Array | None = None
    wanted: Array | None = None


STANDARD = (
    Panel("Attitude error", "/truth", "attitude_error", "deg", DEGREES, log_scale=True),
    Panel("Body rate", "/truth", "rate", "deg/s", DEGREES, names="xyz", wanted=WANTED_RATE),
    Panel("Commanded torque on the bus", "/command", "torque", "N m", names="xyz"),
    Panel("Wheel motor torque", "/command", "wheel_torque", "N m"),
    Panel("Motor torque", "/command", "motor_torque", "N m"),
    Panel("Gimbal angle", "/truth", "gimbal_angle", "deg", DEGREES),
    Panel("Gimbal rate", "/truth", "gimbal_rate", "rad/s", wanted=("/command", "gimbal_rate")),
    Panel("Wheel speed", "/truth", "wheel_speed", "rpm", RPM),
    Panel("Change of total momentum", "/truth", "momentum", "N m s", log_scale=True, drift=True),
    Panel(
        "Disturbance torque about the centre of mass", "/disturbance", "torque", "N m", names="xyz"
    ),
)


def curves(log: Log) -> Iterator[Curves]:
    """Yield what the page shows: the standard signals, and the first of the law's own that move.

    A signal that is zero throughout is left out, and so is a law's that never changes.
    """
    for panel in STANDARD:
        if log.topics.get(panel.topic, {}).get(panel.field, (0,)) != (0,):
            found = read(log, panel)
            if found.value.any():
                yield found
    shown = 0
    for field in log.topics.get("/law", {}):
        found = read(log, _of_signal(log, f"law.{field}"))
        if shown < LAW_PANELS and np.ptp(found.value, axis=0).any():
            shown += 1
            yield found


def chosen(log: Log, signals: Sequence[str]) -> Iterator[Curves]:
    """Yield the curves of ``signals``, named as in a check: ``law.theta_hat``, ``truth.rate[0]``.

    Raises:
        ValueError: the log has no such signal, with the near names.
    """
    for signal in signals:
        yield read(log, _of_signal(log, signal))


def read(log: Log, panel: Panel) -> Curves:
    """Return the panel's curves from the log."""
    first: list[Array] = []

    def change(rows: Array) -> Array:
        if panel.part is not None:
            rows = rows[:, panel.part]
        if panel.drift:
            first.append(rows[0])
            rows = np.linalg.norm(rows - first[0], axis=1, keepdims=True)
        return panel.scale * rows

    time, value = outline(log, panel.topic, panel.field, change)
    if panel.wanted is None or panel.wanted[1] not in log.topics.get(panel.wanted[0], {}):
        return Curves(panel, time, value)
    return Curves(panel, time, value, *outline(log, *panel.wanted, change))


def _of_signal(log: Log, signal: str) -> Panel:
    topic, field, part = find_signal(log.topics, signal)
    unit = log.units.get(topic, {}).get(field, "")
    title = signal.removeprefix("law.") if topic == "/law" else signal
    return Panel(f"Law: {title}" if topic == "/law" else title, topic, field, unit, part=part)
