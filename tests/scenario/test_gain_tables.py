"""Gains from a file: what is read, and which file and line are wrong."""

from pathlib import Path

import numpy as np
import pytest

from mjspace.scenario.gain_tables import arrays, columns, gains_in


def test_columns_are_grouped_by_their_names(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_text("# time, q0, q1\n0, 1, 2\n\n1, 3, 4  # late\n")
    assert columns(file) == {"time": [0.0, 1.0], "q": [[1.0, 2.0], [3.0, 4.0]]}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"line 1: .* a header"),
        ("0,1\n1,2\n", r"line 1: got '0, 1', should be a header"),
        ("time,x\n0,1\n1\n", r"line 3: got 1 values, the header has 2"),
        ("time,x\n0,1\n\n1,2,3\n", r"line 4: got 3 values, the header has 2"),
        ("time,x\n0,one\n", r"line 2: got 'one', should be a number"),
        ("time,x\n0,\n", r"line 2: got '', should be a number"),
        ("time,x\n", r"no row of numbers"),
        ("time,time\n0,1\n", r"line 1: got \['time', 'time'\]"),
        ("q1,q0\n0,1\n", r"line 1: got \['q1', 'q0'\], should be \['q0', 'q1'\]"),
    ],
)
def test_what_is_wrong_is_said_with_file_and_line(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "table.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=rf"^file: .*table\.csv.*{message}") as refused:
        columns(file)
    assert "\n" not in str(refused.value)
    with pytest.raises(ValueError, match=r"gone\.csv cannot be read"):
        columns(tmp_path / "gone.csv")


def test_arrays_are_grouped_by_their_names(tmp_path: Path) -> None:
    file = tmp_path / "net.npz"
    np.savez(file, w0=np.eye(2), w1=np.ones((1, 2)), b=np.arange(3))
    assert gains_in(file) == {"w": [[[1.0, 0.0], [0.0, 1.0]], [[1.0, 1.0]]], "b": [0, 1, 2]}


def test_what_is_no_file_of_arrays_is_said(tmp_path: Path) -> None:
    file = tmp_path / "net.npz"
    with pytest.raises(ValueError, match=r"^file: .*net\.npz cannot be read"):
        arrays(file)
    file.write_text("w0,1")
    with pytest.raises(ValueError, match=r"net\.npz cannot be read"):
        arrays(file)
    for bad in (np.array([np.nan]), np.array(["x"]), np.array([object()])):
        np.savez(file, w=bad)
        with pytest.raises(ValueError, match=r"net\.npz"):
            arrays(file)
    np.savez(file, w1=np.eye(2))
    with pytest.raises(ValueError, match=r"net\.npz: got \['w1'\], should be \['w0'\]"):
        arrays(file)
