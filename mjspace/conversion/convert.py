"""A log in the formats of other tools: CSV, Parquet, NumPy's, MATLAB's and Rerun's."""

import csv
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mjspace.conversion import rerun, viewed
from mjspace.errors import whole_or_none
from mjspace.log.arrow import pyarrow_for
from mjspace.log.columns import Signal, blocks, select, stride, table
from mjspace.log.reader import Log

Progress = Callable[[float], None]

COPY = ".mcap"
"""The ending of a log."""


def convert(
    log: Log | Path | str,
    output: Path | str,
    *,
    signals: Sequence[str] = (),
    topics: Sequence[str] = (),
    rate: float | None = None,
    camera: str | None = None,
    progress: Progress = lambda time: None,
) -> None:
    """Write a log's signals as ``output``: .csv, .parquet, .npz, .mat, .rrd or .mcap.

    A table (.csv, .parquet) has a row for each instant, a column ``time`` [s] and one for each
    number, ``truth.rate[0]``, in SI units; where a topic has no row, the cell is empty. It is
    written chunk by chunk. The others hold an array for each signal and the times of each topic:
    ``truth.time`` and ``truth.rate``, in MATLAB the fields of a struct ``truth``. A recording of
    Rerun (.rrd) also has the shapes and frames of the bodies, the events and a layout.

    ``.mcap`` is a copy of the log with arrows for viewers on /arrows, and with the pictures of
    ``camera`` on /video where one is named.

    ``signals`` are named as in a check, ``topics`` as in the log; all but /state where neither is
    given. ``rate`` [Hz] leaves out rows: the control rate over a whole number.

    Raises:
        ValueError: another ending, no such signal or topic, or a rate that does not fit.
        InputError: the log is damaged; or the library of Parquet or Rerun is not installed.
        OSError: a file cannot be read or written.
    """
    log, output = Log.of(log), Path(output)
    if output.suffix == COPY:
        if signals or topics or rate is not None:
            raise ValueError(
                f"output {str(output)!r}: has all of the log: leave signals, topics and rate out"
            )
        if output.resolve() == log.path.resolve():
            raise ValueError(f"output {str(output)!r}: should not be the log itself")
        with whole_or_none(output) as file:
            viewed.write(log, file, camera, progress)
        return
    if camera is not None:
        raise ValueError(f"output {str(output)!r}: a camera's video is for {COPY} alone")
    if output.suffix not in WRITERS:
        endings = ", ".join([*WRITERS, COPY])
        raise ValueError(f"output {str(output)!r}: end it in one of {endings}")
    chosen, every = select(log, signals, topics), stride(log, rate)
    if not chosen:
        raise ValueError(f"{log.path} holds no signal of those")
    with whole_or_none(output) as file:
        WRITERS[output.suffix](log, file, chosen, every, progress)


def _csv(log: Log, file: BinaryIO, chosen: list[Signal], every: int, progress: Progress) -> None:
    import io

    text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
    writer = csv.writer(text)
    writer.writerow(_header(chosen))
    for rows in table(log, chosen, every):
        writer.writerows([["" if v != v else repr(v) for v in row] for row in rows.tolist()])
        progress(float(rows[-1, 0]))
    text.flush()
    text.detach()


def _parquet(
    log: Log, file: BinaryIO, chosen: list[Signal], every: int, progress: Progress
) -> None:
    pyarrow = pyarrow_for("Parquet")
    units = {"time": "s"} | {
        column: log.units[signal.topic].get(signal.field, "")
        for signal in chosen
        for column in signal.columns
    }
    schema = pyarrow.schema(
        [
            pyarrow.field(name, pyarrow.float64(), metadata={"unit": unit} if unit else None)
            for name, unit in units.items()
        ]
    )
    with pyarrow.parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for rows in table(log, chosen, every):
            arrays = [pyarrow.array(column, from_pandas=True) for column in rows.T]
            writer.write_table(pyarrow.Table.from_arrays(arrays, schema=schema))
            progress(float(rows[-1, 0]))


def _npz(log: Log, file: BinaryIO, chosen: list[Signal], every: int, progress: Progress) -> None:
    arrays = {
        f"{topic}.{name}": values
        for topic, found in _arrays(log, chosen, every, progress).items()
        for name, values in found.items()
    }
    np.savez_compressed(file, **arrays)


def _mat(log: Log, file: BinaryIO, chosen: list[Signal], every: int, progress: Progress) -> None:
    from scipy.io import savemat

    found = _arrays(log, chosen, every, progress)
    savemat(
        file,
        {
            _matlab(topic): {_matlab(n): v for n, v in arrays.items()}
            for topic, arrays in found.items()
        },
        do_compression=True,
        long_field_names=True,
    )


def _matlab(name: str) -> str:
    """Return the name as MATLAB may have it: of letters, digits and underscores, at most 63."""
    plain = re.sub(r"\W", "_", name)
    return plain[:63] if plain[:1].isalpha() else f"x{plain}"[:63]


def _arrays(
    log: Log, chosen: list[Signal], every: int, progress: Progress
) -> dict[str, dict[str, Any]]:
    """Return by topic the times [s] and each signal's numbers, (n,) and (n, k)."""
    kept: dict[str, dict[str, list[Any]]] = {}
    for found in blocks(log, chosen, every):
        for topic, rows in found.items():
            columns = kept.setdefault(topic.removeprefix("/"), {})
            columns.setdefault("time", []).append(rows["time"])
            for signal in chosen:
                if signal.topic == topic:
                    columns.setdefault(signal.field, []).append(signal.of(rows[signal.field]))
        with suppress(ValueError):
            progress(max(float(rows["time"][-1]) for rows in found.values()))
    return {
        topic: {name: np.concatenate(parts) for name, parts in columns.items()}
        for topic, columns in kept.items()
    }


def _header(chosen: list[Signal]) -> list[str]:
    return ["time", *(column for signal in chosen for column in signal.columns)]


WRITERS: dict[str, Callable[[Log, BinaryIO, list[Signal], int, Progress], None]] = {
    ".csv": _csv,
    ".parquet": _parquet,
    ".npz": _npz,
    ".mat": _mat,
    ".rrd": rerun.write,
}
"""By the ending of the file. A line registers each."""
