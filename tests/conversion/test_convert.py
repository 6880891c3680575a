"""A log in other tools' formats: the same numbers, read back by those tools."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from mjspace.conversion.convert import convert
from mjspace.errors import InputError
from mjspace.log.columns import select, stride
from mjspace.log.reader import Log
from mjspace.runner.run import run


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """Return a log of 201 control periods of 5 ms, of whose commands every tenth is logged."""
    overrides = ["duration=1", "checks=[]", "log.command='50 ms'"]
    return run("lqr-regulation", overrides=overrides, out=tmp_path_factory.mktemp("log")).log


def table(path: Path) -> tuple[list[str], list[list[str]]]:
    with path.open(newline="") as file:
        header, *lines = csv.reader(file)
    return header, lines


def test_a_table_has_the_logs_numbers_to_the_last_digit(log: Log, tmp_path: Path) -> None:
    convert(log, tmp_path / "x.csv", topics=["truth"])
    header, lines = table(tmp_path / "x.csv")
    truth = log.read("/truth")
    assert header[:9] == [
        *("time", "truth.wheel_speed[0]", "truth.wheel_speed[1]", "truth.wheel_speed[2]"),
        *(f"truth.attitude[{i}]" for i in range(4)),
        "truth.rate[0]",
    ]
    assert header[-1] == "truth.attitude_error"
    flat = [values.reshape(len(values), -1) for values in truth.values()]
    assert np.array_equal(np.array(lines, dtype=float), np.concatenate(flat, axis=1))


def test_parquet_has_columns_with_units(log: Log, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    convert(log, tmp_path / "x.parquet", signals=["truth.attitude_error", "truth.rate[1:3]"])
    found = parquet.read_table(tmp_path / "x.parquet")
    assert found.column_names == ["time", "truth.attitude_error", "truth.rate[1]", "truth.rate[2]"]
    assert found.schema.field("truth.rate[2]").metadata == {b"unit": b"rad/s"}
    assert np.array_equal(found["truth.rate[2]"].to_numpy(), log.read("/truth")["rate"][:, 2])


def test_without_pyarrow_one_line_says_what_to_install(
    log: Log, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'mjspace\[data\]'"):
        convert(log, tmp_path / "x.parquet")
    assert not (tmp_path / "x.parquet").exists()


def test_numpy_and_matlab_have_an_array_for_each_signal(log: Log, tmp_path: Path) -> None:
    truth = log.read("/truth")
    convert(log, tmp_path / "x.npz", topics=["state", "/truth", "command"])
    with np.load(tmp_path / "x.npz") as found:
        assert np.array_equal(found["truth.attitude"], truth["attitude"])
        assert np.array_equal(found["truth.time"], truth["time"])
        assert found["state.physics"].shape == (201, *log.shape("/state", "physics"))
        assert found["command.time"].shape == (21,)
        assert found["command.torque"].shape == (21, 3)
    convert(log, tmp_path / "x.mat", topics=["truth"])
    struct = loadmat(tmp_path / "x.mat", simplify_cells=True)["truth"]
    assert np.array_equal(struct["attitude"], truth["attitude"])
    assert np.array_equal(struct["time"], truth["time"])


def test_a_rate_leaves_out_rows(log: Log, tmp_path: Path) -> None:
    convert(log, tmp_path / "x.npz", rate=10.0)
    with np.load(tmp_path / "x.npz") as found:
        np.testing.assert_allclose(found["truth.time"], np.arange(11) / 10)
        np.testing.assert_allclose(found["command.time"], np.arange(11) / 10)


@pytest.mark.parametrize("rate", [7000.0, 150.0, 0.0, -1.0, np.nan])
def test_a_rate_that_does_not_fit_is_refused(log: Log, rate: float) -> None:
    with pytest.raises(ValueError, match="should be the log's 200 Hz over a whole number"):
        stride(log, rate)


def test_a_topic_that_is_logged_less_often_leaves_cells_empty(log: Log, tmp_path: Path) -> None:
    convert(log, tmp_path / "x.csv", signals=["command.torque[0]", "truth.rate[0]"])
    header, lines = table(tmp_path / "x.csv")
    assert header == ["time", "command.torque[0]", "truth.rate[0]"]
    assert [bool(line[1]) for line in lines] == [i % 10 == 0 for i in range(201)]
    assert all(line[2] for line in lines)


def test_what_is_not_there_is_refused_and_nothing_is_written(log: Log, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no topic '/rats' in the log: have /state, /truth"):
        select(log, topics=["rats"])
    with pytest.raises(ValueError, match=r"no signal 'truth\.rats'"):
        convert(log, tmp_path / "x.csv", signals=["truth.rats"])
    with pytest.raises(ValueError, match=r"end it in one of \.csv, \.parquet, \.npz, \.mat"):
        convert(log, tmp_path / "x.xls")
    assert not list(tmp_path.iterdir())
    assert "/state" not in {each.topic for each in select(log)}
