"""Events that a scenario declares: on rows made by hand, and in flight from block to block."""

from pathlib import Path

import numpy as np
import pytest

from mjspace import run
from mjspace.contract import Event
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.scenario.scenario import EventTable
from mjspace.simulation.assembly import assemble
from mjspace.simulation.events import with_declared_events
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

pytestmark = pytest.mark.filterwarnings(
    f"ignore::{UnphysicalInertiaWarning.__module__}.UnphysicalInertiaWarning"
)

ERROR = np.array([[3.0, 0.5], [0.5, np.nan], [0.4, 0.5], [2.0, 2.0], [-1.0, 2.0]])  # 2 vehicles
RATE = np.outer([1.0, 2.0, 3.0, 2.0, 1.0], [3.0, 0.0, 4.0])


def block(part: slice = slice(None)) -> Block:
    time = np.arange(5) / 10.0
    rate = np.broadcast_to(RATE[:, None], (5, 2, 3))
    rows = {"/truth": {"error": ERROR[part, :, None], "rate": rate[part]}}
    return Block(0, time[part], rows, [Event(0.2, 0, "WARNING", "saturated")])


def told(watched: EventTable, *parts: slice) -> list[Event]:
    inside, heard = np.zeros((2, 1), bool), []
    for part in parts or [slice(None)]:
        seen, inside = with_declared_events(block(part), [watched], inside)
        heard += [event for event in seen.events if event.message != "saturated"]
    return heard


LOW = EventTable(name="low", signal="truth.error", below=1.0)
LINES = [
    (0.0, 1, "INFO", "low: truth.error = 0.5"),
    (0.1, 0, "INFO", "low: truth.error = 0.5"),
    (0.2, 1, "INFO", "low: truth.error = 0.5"),  # what is no number is outside
    (0.4, 0, "INFO", "low: truth.error = -1"),
]


def test_each_entry_is_told_once_with_its_value() -> None:
    assert told(LOW) == LINES


def test_other_signals_are_shown_with_it() -> None:
    shown = LOW.model_copy(update={"shows": ["truth.rate", "truth.rate[2]"]})
    assert told(shown)[1][3] == "low: truth.error = 0.5; truth.rate = 6 0 8; truth.rate[2] = 8"


def test_wherever_the_blocks_end() -> None:
    for end in range(1, 5):
        assert told(LOW, slice(0, end), slice(end, 5)) == LINES


def test_a_band_of_a_vectors_norm_and_a_component() -> None:
    band = EventTable(name="x", signal="truth.rate", above=9.0, below=12.0, level="WARNING")
    assert [event[:3] for event in told(band)] == [
        (t, vehicle, "WARNING") for t in (0.1, 0.3) for vehicle in (0, 1)
    ]
    assert [e[0] for e in told(EventTable(name="x", signal="truth.rate[2]", above=11.0))] == [
        0.2,
        0.2,
    ]


def test_events_stand_in_order_with_those_of_the_motors() -> None:
    seen, _ = with_declared_events(block(), [LOW], np.zeros((2, 1), bool))
    assert [event[0] for event in seen.events] == [0.0, 0.1, 0.2, 0.2, 0.4]


def test_an_unknown_signal_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    declared = "events=[{name='x', signal='truth.attitude_eror', below=1}]"
    with pytest.raises(InputError, match=r"events\.0\.signal.*truth\.attitude_error"):
        run("contraction-ideal", overrides=[declared, "duration=0.1"], out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_flight_tells_the_same_alone_and_in_a_batch() -> None:
    """Blocks of many vehicles are shorter than those of one."""
    declared = "events=[{name='slower', signal='truth.rate', below='6 deg/s'}]"
    noise = "plant.wheels.torque_limit='2 N m'"
    scenario, folder = load("contraction-ideal", [declared, "duration=2", noise])
    built = assemble(scenario, folder)
    told = []
    for members in ((0,), tuple(range(64))):
        blocks = list(fly(built, first_start(built, members), members))
        events = [event for b in blocks for event in b.events if event[1] == 0]
        told.append([event for event in events if "slower" in event[3]])
    assert told[0] == told[1] != []


def test_a_check_of_no_event_is_refused() -> None:
    late = 'checks=[{name="x", signal="truth.rate", below=1.0, since="touchdown"}]'
    with pytest.raises(InputError, match=r"checks\.0\.since: no event 'touchdown' in events: \[\]"):
        load("contraction-ideal", [late])
