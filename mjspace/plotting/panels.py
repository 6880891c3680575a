"""The panels of a page: one for each signal that has something to show."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mjspace.contract import Array
from mjspace.log import topics
from mjspace.log.reader import Log
from mjspace.plotting.decimate import POINTS, Line, outlines
from mjspace.scenario.boresight import ANGLES
from mjspace.signals import find_signal
from mjspace.units import Unit

DECLARED = topics.units()
NO_UNIT = Unit("")
DESIRED_RATE = "/reference", "rate"
LAW_PANELS = 4
MOST = 12
"""Panels on the standard page."""
PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
_PREFIXED = {"m", "m/s", "N", "N m", "N m s", "W", "J", "T", "A", "A m^2", "V"}
"""Units that take them."""
_CLOSED = "_closed"
"""Ending of the field that tells whether a connection is closed."""


@dataclass(frozen=True)
class Panel:
    """A signal and how it is drawn."""

    title: str
    topic: str
    field: str
    quantity: Unit = NO_UNIT
    """Of the field, as the log has it; ``read`` fills it in."""
    part: slice | None = None
    """The one component that is drawn; all when left out."""
    names: str = ""
    """Of the components, a letter each; their numbers when left out."""
    log_scale: bool = False
    drift: bool = False
    """Drawn is the norm of the change since the first row."""
    desired: tuple[str, str] | None = None
    """Topic and field of its desired value."""
    needs: tuple[str, str] | None = None
    """Topic and field of another signal without which it shows nothing of interest."""
    lanes: bool = False
    """Each component is drawn in a lane of its own, of the height of the largest value of all."""
    prefix: str = ""
    """Before the unit; ``read`` chooses it by the largest value."""

    @property
    def unit(self) -> str:
        """Of the drawn values."""
        return self.prefix + self.quantity.displayed[0]

    @property
    def scale(self) -> float:
        """Factor from SI to ``unit``."""
        return self.quantity.displayed[1] / PREFIXES[self.prefix]


@dataclass(frozen=True)
class Curves:
    """A panel and its points: times [s] and values in the panel's unit, each (m, c)."""

    panel: Panel
    time: Array
    value: Array
    desired_time: Array | None = None
    desired: Array | None = None


_GROUND = "/truth", "altitude"
TRANSLATION = (
    Panel("Height above the ground", *_GROUND),
    Panel("Velocity", "/truth", "velocity", names="xyz", needs=_GROUND),
    Panel("Position", "/truth", "position", names="xyz", desired=("/reference", "position")),
)
ROTATION = (
    Panel("Attitude error", "/truth", "attitude_error", log_scale=True),
    Panel("Estimation error", "/truth", "estimation_error", names="xyz"),
    Panel("Body rate", "/truth", "rate", names="xyz", desired=DESIRED_RATE),
)
STANDARD = (
    Panel("Propellant", "/truth", "propellant"),
    Panel("Commanded torque on the bus", "/command", "torque", names="xyz"),
    Panel("Wheel motor torque", "/command", "wheel_torque"),
    Panel("Motor torque", "/command", "motor_torque"),
    Panel("Joint torque", "/command", "applied_joint_torque"),
    Panel("Gimbal angle", "/truth", "gimbal_angle"),
    Panel("Gimbal rate", "/truth", "gimbal_rate", desired=("/command", "gimbal_rate")),
    Panel("Wheel speed", "/truth", "wheel_speed"),
    Panel("Momentum margin of wheels", "/truth", "wheel_momentum_margin"),
    Panel("Electrical power of wheels", "/truth", "wheel_power"),
    Panel("Electrical energy of wheels", "/truth", "wheel_energy"),
    Panel("Visible part of the Sun", "/truth", "sunlight"),
    Panel("Change of total momentum", "/truth", "momentum", log_scale=True, drift=True),
    Panel("Disturbance torque about the centre of mass", "/disturbance", "torque", names="xyz"),
)
OF_PARTS = {"deflection": "Tip deflection of", "displacement": "Displacement of what sloshes in"}
"""Titles, before the part's name, of the fields of /truth that end so."""


def curves(log: Log, *, coasting: bool = False, points: int = POINTS) -> list[Curves]:
    """Return the curves of the standard page: its signals, how parts move, and the law's signals.

    They are at most ``MOST``, the law's last: of those the first that change. A signal that is zero
    throughout is left out, and so is one of the law's that never changes. Of a ``coasting`` vehicle
    the attitude error says nothing. A line has at most so many ``points``, and two.
    """
    first = (*TRANSLATION, *_of_thrust(log), *ROTATION, *_of_connections(log), *_of_parts(log))
    standard = [
        panel
        for panel in (*first, *STANDARD)
        if _has(log, panel.topic, panel.field)
        and (panel.needs is None or _has(log, *panel.needs))
        and not (panel.field == "position" and not _has(log, "/reference", "position"))
        and not (coasting and panel.field == "attitude_error")
    ]
    law = [_of_signal(log, f"law.{field}") for field in log.topics.get("/law", {})]
    found = read(log, [*standard, *law], points)
    shown = [one for one in found[: len(standard)] if one.value.any()]
    changing = [one for one in found[len(standard) :] if np.ptp(one.value, axis=0).any()]
    return [*shown, *changing[:LAW_PANELS]][:MOST]


def _has(log: Log, topic: str, field: str) -> bool:
    return log.topics.get(topic, {}).get(field, (0,)) != (0,)


def _of_thrust(log: Log) -> list[Panel]:
    """Return the panel of the engine's thrust, and that of when each thruster fires."""
    commanded = log.topics.get("/command", {})
    firing = next((name for name in ("on_time", "thruster_thrust") if name in commanded), None)
    thrusters = commanded[firing][0] if firing else 0
    (count,) = log.topics["/truth"].get("thrust", (0,))
    found = []
    if count > thrusters:
        part = slice(0, count - thrusters)
        found.append(Panel("Thrust of the engine", "/truth", "thrust", part=part))
    if firing:
        found.append(Panel("Firings of thrusters", "/command", firing, lanes=True))
    return found


def _of_connections(log: Log) -> list[Panel]:
    """Return the panels of where the vehicle's port is at each connection of spacecraft."""
    names = [
        name.removesuffix(_CLOSED)
        for name in log.topics.get("/truth", {})
        if name.endswith(_CLOSED)
    ]
    return [
        Panel(f"Port of {name}, {what}", "/truth", f"{name}_{what}", names="xyz")
        for name in names
        for what in ("position", "velocity")
    ]


def _of_parts(log: Log) -> Iterator[Panel]:
    """Yield the panels of how each moving part is bent, and of where each boresight points."""
    for field in log.topics.get("/truth", {}):
        part, _, what = field.rpartition("_")
        if what in OF_PARTS:
            yield Panel(f"{OF_PARTS[what]} {part}", "/truth", field)
        for angle, name in ANGLES.items():
            if field.endswith(f"_{angle}"):
                boresight = field.removesuffix(f"_{angle}")
                yield Panel(f"Angle of {boresight} from {name}", "/truth", field)


def chosen(log: Log, signals: Sequence[str]) -> list[Curves]:
    """Return the curves of ``signals``, named as in a check: ``law.theta_hat``, ``truth.rate[0]``.

    Raises:
        ValueError: the log has no such signal, with the near names.
    """
    return read(log, [_of_signal(log, signal) for signal in signals])


def read(log: Log, panels: Sequence[Panel], points: int = POINTS) -> list[Curves]:
    """Return the panels' curves from the log, which is read once; in its units of their fields."""
    panels = [replace(panel, quantity=unit(log, panel.topic, panel.field)) for panel in panels]
    lines = {}
    for number, panel in enumerate(panels):
        lines[number, "value"] = Line(panel.topic, panel.field, _change(panel))
        if panel.desired is not None and panel.desired[1] in log.topics.get(panel.desired[0], {}):
            lines[number, "desired"] = Line(*panel.desired, _change(panel))
    found = dict(zip(lines, outlines(log, list(lines.values()), points), strict=True))
    return [
        _prefixed(Curves(panel, *found[number, "value"], *found.get((number, "desired"), ())))
        for number, panel in enumerate(panels)
    ]


def _prefixed(curves: Curves) -> Curves:
    """Return the curves with a prefix before their unit where numbers are very small or large."""
    panel = curves.panel
    largest = float(np.nanmax(np.abs(curves.value), initial=0.0))
    if panel.unit not in _PREFIXED or panel.log_scale or not 0.0 < largest < np.inf:
        return curves
    if 1e-2 <= largest < 1e4:
        return curves
    fitting = [prefix for prefix, factor in PREFIXES.items() if factor <= largest]
    prefix = fitting[-1] if fitting else "n"
    factor = PREFIXES[prefix]
    desired = None if curves.desired is None else curves.desired / factor
    return replace(
        curves, panel=replace(panel, prefix=prefix), value=curves.value / factor, desired=desired
    )


def _change(panel: Panel) -> Callable[[Array], Array]:
    """Return what makes the panel's values of a field's rows (n, c), which come in their order."""
    first: list[Array] = []

    def change(rows: Array) -> Array:
        if panel.part is not None:
            rows = rows[:, panel.part]
        if panel.drift:
            first.append(rows[0])
            rows = np.linalg.norm(rows - first[0], axis=1, keepdims=True)
        return panel.scale * rows

    return change


def unit(log: Log, topic: str, field: str) -> Unit:
    """Return the unit that a logged field has, and how it is displayed if that is declared."""
    declared = DECLARED.get(topic, {}).get(field, NO_UNIT)
    si = log.units.get(topic, {}).get(field, declared.si)
    return declared if declared.si == si else Unit(si)


def _of_signal(log: Log, signal: str) -> Panel:
    topic, field, part = find_signal(log.topics, signal)
    title = f"Law: {signal.removeprefix('law.')}" if topic == "/law" else signal
    return Panel(title, topic, field, part=part)
