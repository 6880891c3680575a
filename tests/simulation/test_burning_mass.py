"""What is seen of a vehicle that burns: its masses are those of the control instant, everywhere."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from blocks import blocks_of
from compiled_flights import assembly, assert_same, flown, one_of, start_of_row

from mjspace.simulation.assembly import Assembly
from mjspace.simulation.initial_state import Start, first_start

MEMBERS = (0, 1)
SEEN = [
    *("duration=8", "events=[]", "initial.rate=['1 deg/s','-2 deg/s','0.5 deg/s']"),
    "plant.rcs.specific_impulse='3 s'",  # a quarter of a kilogram in each second
]
"""A vehicle that burns all the while. MuJoCo computes relative velocities about its centre of mass,
which moves as the tank in the port empties: so that they differ in their last digits."""
CALLED = """
from mjspace.controllers.rendezvous.corridor import CorridorApproach


class Law(CorridorApproach):
    compiled = False
"""
LAWS = pytest.mark.parametrize("called", [False, True], ids=["compiled law", "called law"])


def approach(folder: Path, *overrides: str, called: bool) -> Assembly:
    (folder / "own.py").write_text(CALLED)
    own = ["law={kind='own.py:Law',mass=100,port=[0.6,0,0]}"] if called else []
    return assembly("corridor-approach", *SEEN, *own, *overrides, folder=folder)


def apart(built: Assembly) -> Start:
    """Return a start in which the second vehicle is behind the first."""
    start = first_start(built, MEMBERS)
    physics = start.physics.copy()
    physics[1, 1] -= 1.0
    return dataclasses.replace(start, physics=physics)


@LAWS
@pytest.mark.parametrize("threads", [1, 2])
def test_relative_motion_is_that_of_the_masses_of_the_instant(
    called: bool, threads: int, tmp_path: Path
) -> None:
    built = approach(tmp_path, called=called)
    start = apart(built)
    with blocks_of(7):
        compiled = flown(built, MEMBERS, start=start, threads=threads)
    assert compiled.compiled.startswith(
        "sensors, actuators and step effects" if called else "compiled: sensors, law, actuators"
    )
    assert_same(compiled, flown(built, MEMBERS, start=start, compiled=False))
    burnt = np.ptp(compiled.rows["/truth.propellant"], axis=0)
    assert (burnt > 0.5).all()  # kg of 2


@LAWS
def test_a_flight_goes_on_from_any_row_as_it_went(called: bool, tmp_path: Path) -> None:
    built = approach(tmp_path, "duration=5", called=called)
    with blocks_of(7):
        whole = flown(built, MEMBERS, start=apart(built))
        for row in (1, 6, 7, 13, 24):  # around a block's end, too
            start = start_of_row(built, whole, row)
            again = flown(built, MEMBERS, start=start)
            alone = flown(built, (1,), start=one_of(start, 1))
            for name, values in again.rows.items():
                if name != "time":
                    assert values.tobytes() == whole.rows[name][row:].tobytes(), (name, row)
                    expected = whole.rows[name][row:, 1:]
                    assert alone.rows[name].tobytes() == expected.tobytes(), (name, row)
