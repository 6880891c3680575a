"""Logs whose numbers somebody changed on purpose: refused, or reported as different."""

from pathlib import Path

import numpy as np
import pytest
from log_samples import rewritten

from mjspace.environment.base import MAGIC
from mjspace.environment.magnetic_field import FIELD, MOMENT
from mjspace.errors import InputError
from mjspace.log.encoding import doubles
from mjspace.log.reader import Log
from mjspace.runner.logged_assembly import assembly_of
from mjspace.runner.replay import replay, start_of, verify
from mjspace.runner.run import run


def poisoned(log: Log, out: Path, column: int, value: float, row: int | None = None) -> Path:
    """Write the log anew with one number of /state.physics changed, in all its rows or in one."""
    layout = doubles(log.topics["/state"])

    def change(topic: str, number: int, data: bytes) -> bytes:
        if topic != "/state" or number != (number if row is None else row):
            return data
        changed = np.frombuffer(bytearray(data), layout.dtype)
        changed["physics"][0, column] = value
        return changed.tobytes()

    return rewritten(log.path, out, change, digests=False)


@pytest.fixture(scope="module")
def coils(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """A flight with magnetorquers, whose environment changes in flight."""
    return run("b-dot", overrides=["duration=20"], out=tmp_path_factory.mktemp("coils")).log


def test_nothing_that_tells_where_memory_is_comes_from_the_log(coils: Log, tmp_path: Path) -> None:
    """Of the environment's parameters the field's cubic and the moment alone change in flight."""
    row = coils.read("/state", ["physics"])["physics"]
    begin = int(np.flatnonzero(row[0] == MAGIC)[0])
    changing = {*range(begin + FIELD.start, begin + FIELD.stop)}
    changing |= {*range(begin + MOMENT.start, begin + MOMENT.stop)}
    with assembly_of(coils) as assembly:
        right = start_of(coils, assembly, 10.0).physics
        np.testing.assert_array_equal(right[0], row[2])
        end = begin + assembly.vehicle.model.nuserdata
        for column in range(begin, end):
            path = poisoned(coils, tmp_path / "x.mcap", column, 1e6)
            taken = start_of(Log(path), assembly, 10.0).physics
            expected = right.copy()
            if column in changing:
                expected[0, column] = 1e6
            np.testing.assert_array_equal(taken, expected)


def test_a_log_of_other_constants_is_not_identical(coils: Log, tmp_path: Path) -> None:
    row = coils.read("/state", ["physics"])["physics"][0]
    begin = int(np.flatnonzero(row == MAGIC)[0])
    for column, value, where in ((2, -1.0, None), (3, 2.0**53, 0), (5, 1e6, 3)):
        difference = verify(poisoned(coils, tmp_path / "x.mcap", begin + column, value, where))
        assert difference is not None
        assert (difference.field, difference.index) == ("physics", begin + column)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_state_that_is_not_finite_is_refused(coils: Log, tmp_path: Path, value: float) -> None:
    path = poisoned(coils, tmp_path / "x.mcap", 9, value)
    for fly_again in (verify, lambda log: replay(log, tmp_path / "out")):
        with pytest.raises(InputError, match=r"log: /state\.physics\[9\] is (nan|inf), not finite"):
            fly_again(path)
    assert not (tmp_path / "out").exists()


def test_a_log_that_begins_otherwise_than_its_scenario_is_not_identical(
    coils: Log, tmp_path: Path
) -> None:
    """Also where it has no effect: the moment of the period before is overwritten at once."""
    row = coils.read("/state", ["physics"])["physics"][0]
    column = int(np.flatnonzero(row == MAGIC)[0]) + MOMENT.start
    difference = verify(poisoned(coils, tmp_path / "x.mcap", column, 1.0, 0))
    assert str(difference).endswith("logged 1.0, flown 0.0: the scenario begins otherwise")


def test_a_log_that_lacks_rows_is_not_identical(coils: Log, tmp_path: Path) -> None:
    def without(topic: str, number: int, data: bytes) -> bytes | None:
        return None if (topic, number) == ("/truth", 2) else data

    gap = rewritten(coils.path, tmp_path / "gap.mcap", without, digests=False)
    with pytest.raises(InputError, match=r"log: /truth lacks its row at t = 10 s"):
        verify(gap)
