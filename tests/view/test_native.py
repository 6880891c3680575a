"""MuJoCo's own viewer, with a window that only remembers what it is shown."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import mujoco.viewer
import numpy as np
import pytest

from mjspace.errors import InputError
from mjspace.log.reader import Log
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.live_flight import LiveFlight
from mjspace.view import native


class Window:
    """A window that is closed when it has been shown an attitude of the last period."""

    def __init__(self, data: Any, last: np.ndarray) -> None:
        self._data, self._last = data, last
        self.shown: list[np.ndarray] = []

    def __enter__(self) -> "Window":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def is_running(self) -> bool:
        return not (self.shown and np.allclose(self.shown[-1], self._last, atol=0.01))

    def lock(self) -> Any:
        return nullcontext()

    def sync(self) -> None:
        self.shown.append(self._data.qpos[3:7].copy())


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> Callable[[np.ndarray], list[Window]]:
    def opened(last: np.ndarray) -> list[Window]:
        found: list[Window] = []

        def launch(model: Any, data: Any) -> Window:
            found.append(Window(data, last))
            return found[0]

        monkeypatch.setattr(mujoco.viewer, "launch_passive", launch)
        return found

    return opened


def test_a_log_is_shown_in_its_own_states(pictured_log: Path, windows: Any) -> None:
    attitudes = Log(pictured_log).read("/truth")["attitude"]
    found = windows(attitudes[-1])
    native.replay(Log(pictured_log), lambda: False)
    shown = np.array(found[0].shown)
    assert 2 <= len(shown) <= 60  # a second, at most 50 frames each
    assert all(np.abs(attitudes - one).max(axis=1).min() < 1e-12 for one in shown)


def test_a_scenario_is_flown_to_its_end(windows: Any) -> None:
    assembly = assemble(*load("wheel-failure", ["duration=0.3", "checks=[]", "faults=[]"]))
    flight = LiveFlight(assembly)
    found = windows(np.full(4, np.inf))  # it is not closed
    native.fly(flight, lambda: flight.over)
    assert flight.over
    assert 2 <= len(found[0].shown) <= 15  # 15 periods


def test_without_a_display_it_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match="--native: there is no display"):
        native.require_display()
