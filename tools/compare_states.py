"""Compare the logged ``/state`` of two folders of flights, as ``mjspace run --all`` writes them.

Usage: python tools/compare_states.py BEFORE AFTER

Prints each flight whose bytes differ, or that only one folder has, with the first time and field;
exits with 1 if there is any. Bytes are compared, so that -0.0 and 0.0 differ.
"""

import sys
from pathlib import Path

from mjspace.log.reader import Log
from mjspace.runner.former_names import as_logged
from mjspace.runner.replay import first_difference
from mjspace.simulation.recording import Rows


def state(path: Path) -> Rows:
    """Return every field of ``/state``."""
    return {"/state": Log(path).read("/state")}


def compare(before: Path, after: Path) -> str:
    """Return how the states of two logs differ, '' where they are the same bytes."""
    one = state(before)
    other = as_logged(state(after), one)
    fields = one["/state"].keys() ^ other["/state"].keys()
    if fields:
        return f"only one of them has {', '.join(sorted(fields))}"
    for field in one["/state"]:
        shapes = [rows["/state"][field].shape[1:] for rows in (one, other)]
        if shapes[0] != shapes[1]:
            return f"/state.{field} has the shape {shapes[0]} and {shapes[1]}"
    periods = len(one["/state"]["time"]), len(other["/state"]["time"])
    found = first_difference(*sorted((other, one), key=lambda rows: len(rows["/state"]["time"])))
    if found is not None:
        return f"{found.topic}.{found.field}[{found.index}] from t = {found.time:g} s on"
    return "" if periods[0] == periods[1] else f"{periods[0]} and {periods[1]} periods"


def main(before: Path, after: Path) -> int:
    """Compare every flight of the two folders and return the exit status."""
    names = {path.parent.name for folder in (before, after) for path in folder.glob("*/*.mcap")}
    differing = 0
    for name in sorted(names):
        paths = [folder / name / "flight.mcap" for folder in (before, after)]
        missing = [path for path in paths if not path.exists()]
        how = f"no {missing[0]}" if missing else compare(*paths)
        differing += bool(how)
        if how:
            print(f"{name}: {how}")
    print(f"{len(names)} flights, {differing} of them differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))
