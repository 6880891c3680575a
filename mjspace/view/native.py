"""MuJoCo's own viewer, where there is a display: a log replayed, or a scenario flown live."""

import time as clock
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import mujoco.viewer

from mjspace.errors import InputError
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.rendering.flown_model import flown_model
from mjspace.rendering.graphics import has_display
from mjspace.simulation.live_flight import LiveFlight

_FRAME = 1.0 / 50.0  # s of wall time


def require_display() -> None:
    """Refuse where no window can be opened.

    Raises:
        InputError: there is no display.
    """
    if not has_display():
        raise InputError("--native: there is no display: leave it out to look in a browser")


def replay(log: Log, stop: Callable[[], bool]) -> None:
    """Play a log in a window, in real time and again from the beginning at its end.

    Raises:
        InputError: the log's model cannot be built, or the log is damaged.
    """
    model = flown_model(log, scenario_of(log))

    def states() -> Iterator[Any]:
        began = clock.monotonic()
        for block in log.blocks("/state", ["physics"]):
            for time, state in zip(block["time"], block["physics"], strict=True):
                if time - log.start >= clock.monotonic() - began:
                    yield state
                    while clock.monotonic() - began < time - log.start + _FRAME and not stop():
                        clock.sleep(0.2 * _FRAME)

    _show(model, states, stop)


def fly(flight: LiveFlight, stop: Callable[[], bool]) -> None:
    """Fly a scenario in a window, in real time up to its end.

    Raises:
        FlightError: the flight cannot go on.
    """

    def states() -> Iterator[Any]:
        before = clock.monotonic() - flight.time
        while not (flight.over or stop()):
            while flight.time <= clock.monotonic() - before and not flight.over:
                flight.fly(1)
            yield flight.period.physics[0]
            clock.sleep(_FRAME)

    _show(flight.assembly.vehicle.model, states, stop)


def _show(model: Any, states: Callable[[], Iterator[Any]], stop: Callable[[], bool]) -> None:
    """Show the ``states``, again and again, until the window is closed."""
    data = mujoco.MjData(model)
    with mujoco.viewer.launch_passive(model, data) as window:
        while window.is_running() and not stop():
            for state in states():
                if stop() or not window.is_running():
                    return
                with window.lock():
                    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
                    mujoco.mj_fwdPosition(model, data)
                window.sync()
            clock.sleep(_FRAME)
