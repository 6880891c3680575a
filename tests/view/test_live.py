"""A live view: what a person asks for is done, and what is refused is said."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mjspace.errors import FlightError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.live_flight import LiveFlight
from mjspace.view.live import Live
from mjspace.view.server import Server, serving


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with serving("127.0.0.1", 0, "test") as (server, _):
        yield server


@pytest.fixture
def live(server: Server) -> Live:
    assembly = assemble(*load("wheel-failure", ["duration=4", "checks=[]", "faults=[]"]))
    return Live(server, lambda: LiveFlight(assembly))


def fly(live: Live, seconds: float) -> None:
    end = live.flight.time + seconds
    while live.flight.time < end - 1e-9 and not live.flight.over:
        live.advance(0.02)


def test_it_flies_as_much_as_wall_time_and_speed_say_and_stops_at_the_end(live: Live) -> None:
    live.advance(1.0)
    assert live.flight.time == pytest.approx(0.02)  # the first instant, and no more
    live.ask(lambda: live._play(True))
    live.speed = 0.5
    live.advance(0.08)
    assert live.flight.time == pytest.approx(0.06)
    live.speed = 1.0
    fly(live, 4.0)
    assert live.flight.over
    assert not live.playing


def test_what_is_asked_for_is_done_between_periods_and_listed(live: Live) -> None:
    live.ask(lambda: live._play(True))
    live.ask(lambda: live.flight.push(np.zeros(3), np.array([0.0, 0.5, 0.0]), 1.0))
    live.ask(lambda: live.flight.break_motor("wheel_2", "dead"))
    fly(live, 0.2)
    live.ask(lambda: live._play(False))
    live.advance(0.0)
    assert live.flight.period.applied[0][0, 2] == 0.0
    assert "push: force 0, 0, 0 N, torque 0, 0.5, 0 N m, for 1 s" in live._log.content
    assert "wheel_2 is dead" in live._log.content
    pushed = live.scene._arrows["disturbance torque"]
    assert pushed.visible
    live.ask(live._restart)
    live.advance(0.0)
    assert live.flight.time == pytest.approx(0.02)
    assert not live.flight.events


def test_gains_are_those_of_the_law_alone_and_refused_in_one_line(live: Live) -> None:
    assert set(live._gains) == {"attitude_gain", "rate_gain", "hysteresis"}
    refused = {"-1": "greater than 0", "[1, 2]": "shape", "x": "a number", "<b>": "&lt;b&gt;"}
    for text, said in {"9": "", **refused, '"8"': "a number"}.items():
        live._gains["rate_gain"].value = text
        live.ask(live._set_gains)
        live.advance(0.0)
        assert said in live._refused.content
        assert bool(said) == bool(live._refused.content)
    assert live.flight.gains()["rate_gain"][0] == 9.0


def test_a_law_that_raises_ends_it(server: Server, failing_law: Callable[..., Path]) -> None:
    assembly = assemble(*load(failing_law(0.05)))
    live = Live(server, lambda: LiveFlight(assembly))
    live.ask(lambda: live._play(True))
    with pytest.raises(FlightError, match="no way on"):
        live.run(lambda: live.flight.over)
