"""A topic of a log as a pandas table."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjspace.errors import missing
from mjspace.log.columns import select
from mjspace.log.reader import Log


def frame(
    log: Log,
    topic: str,
    fields: Sequence[str] | None = None,
    start: float | None = None,
    end: float | None = None,
    every: int = 1,
) -> Any:
    """Return a ``pandas.DataFrame``: a row for each logged instant, indexed by the time [s].

    It has a column for each number, as ``rate[0]``, in SI units; ``attrs["units"]`` has them by
    column, where the log knows them. The arguments are those of ``Log.read``.

    Raises:
        InputError: the log has no such topic or field, a chunk is damaged, or pandas is missing.
    """
    try:
        import pandas
    except ImportError:
        raise missing("a table", "pandas", "data") from None
    topic = topic if topic.startswith("/") else f"/{topic}"
    rows = log.read(topic, fields, start, end, every)
    prefix = f"{topic.removeprefix('/')}."
    columns, units = {}, {}
    signals = {signal.field: signal for signal in select(log, topics=[topic])}
    for signal in (signals[field] for field in rows if field in signals):
        unit = log.units[topic].get(signal.field)
        for name, values in zip(signal.columns, signal.of(rows[signal.field]).T, strict=True):
            columns[name.removeprefix(prefix)] = values
            if unit:
                units[name.removeprefix(prefix)] = unit
    found = pandas.DataFrame(columns, index=pandas.Index(np.asarray(rows["time"]), name="time [s]"))
    found.attrs["units"] = units
    return found
