"""Plots of a live flight: what has happened in the last minute."""

from collections import deque
from typing import Any, NamedTuple

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.simulation.live_flight import LiveFlight
from mjspace.view.plots import COLORS, HEIGHT, WIDTH

_SAMPLES = 600  # of which each is drawn
_MINUTE = 60.0  # s


class _Chart(NamedTuple):
    handle: Any
    samples: deque[Array]  # time [s] and values, each (1 + c,)


class History:
    """Charts of body rate, attitude error, commanded torque and wheel speeds."""

    def __init__(self, gui: Any, flight: LiveFlight) -> None:
        """Add them, of what the ``flight`` has."""
        panel = gui.add_panel()
        self._charts: dict[str, _Chart] = {}
        with panel.add_tab("Plots"):
            for title, values in _values(flight).items():
                names = "xyz" if len(values) == 3 else "0123456789"
                lines = [
                    {"label": name, "stroke": color, "width": 1.4, "points": {"show": False}}
                    for name, color in zip(names[: len(values)], COLORS, strict=False)
                ]
                handle = gui.add_uplot(
                    tuple(np.zeros((1 + len(lines), 1))),
                    ({"label": "t [s]"}, *lines),
                    title=title,
                    scales={"x": {"time": False}},
                    legend={"show": False},
                    height=HEIGHT,
                )
                self._charts[title] = _Chart(handle, deque(maxlen=_SAMPLES))
        panel.dock_right()
        panel.set_width(WIDTH)

    def note(self, flight: LiveFlight) -> None:
        """Remember the present; what is more than a minute ago is forgotten."""
        now = flight.period.time
        for title, values in _values(flight).items():
            samples = self._charts[title].samples
            if samples and now < samples[-1][0]:
                samples.clear()  # it has begun anew
            if not samples or now - samples[-1][0] >= _MINUTE / _SAMPLES:
                samples.append(np.concatenate([[now], values]))
            while samples[0][0] < now - _MINUTE:
                samples.popleft()

    def draw(self) -> None:
        """Show what is remembered."""
        for handle, samples in self._charts.values():
            columns = np.array(samples).T
            handle.data = tuple(columns[: 1 + len(COLORS)])


def _values(flight: LiveFlight) -> dict[str, Array]:
    """Return the numbers of now, by the chart's title."""
    period = flight.period
    angle = attitude.rotation_angle(period.truth.attitude[0], flight.desired.attitude)
    found = {
        "Body rate [deg/s]": np.degrees(period.truth.rate[0]),
        "Attitude error [deg]": np.degrees(np.atleast_1d(angle)),
    }
    if "torque" in period.command._fields:
        found["Commanded torque on the bus [N m]"] = np.ravel(period.command.torque[0])
    speeds = getattr(period.truth, "wheel_speed", None)
    if speeds is not None and speeds.size:
        found["Wheel speed [rpm]"] = speeds[0] * 30.0 / np.pi
    return found
