"""Long signals in few points: the least and the greatest value of each stretch of a log."""

import math
from collections.abc import Callable

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log

POINTS = 4000  # more than a page has pixels across


def outline(
    log: Log,
    topic: str,
    field: str,
    change: Callable[[Array], Array] = lambda rows: rows,
    points: int = POINTS,
) -> tuple[Array, Array]:
    """Return (time [s], value) of a field's c components, each (m, c), with m <= ``points`` + 2.

    Each component has its own times: those of its extremes. Where the log has no more rows than
    ``points``, all are there. ``change`` is applied first, to rows (n, c) in the log's order. The
    log is read once, with one chunk of it in memory.

    Raises:
        ValueError: the log has no such topic or field, or no row.
    """
    period = float(log.metadata["control_period"]) * log.every[topic]
    rows_logged = round((log.end - log.start) / period) + 1
    # Two points for each stretch, in their order: a stretch of two rows is those two.
    width = max(2, math.ceil(2 * rows_logged / points))
    stamps, rows, done = np.empty(0), None, []
    for block in log.blocks(topic, [field]):
        new = change(block[field].reshape(len(block["time"]), -1))
        stamps = np.concatenate([stamps, block["time"]])
        rows = new if rows is None else np.concatenate([rows, new])
        whole = len(stamps) // width * width
        done.append(_extremes(stamps[:whole], rows[:whole], width))
        stamps, rows = stamps[whole:], rows[whole:]
    if rows is None:
        raise ValueError(f"{log.path} holds nothing on {topic}")
    missing = -len(stamps) % width
    stamps = np.pad(stamps, (0, missing), mode="edge") if missing else stamps
    rows = np.pad(rows, ((0, missing), (0, 0)), mode="edge") if missing else rows
    done.append(_extremes(stamps, rows, width))
    times, values = zip(*done, strict=True)
    return np.concatenate(times), np.concatenate(values)


def _extremes(stamps: Array, rows: Array, width: int) -> tuple[Array, Array]:
    """Return times and values of two rows for each ``width`` of them, shapes (m, c)."""
    components = rows.shape[1]
    stretches = rows.reshape(-1, width, components)
    first_last = np.sort([stretches.argmin(axis=1), stretches.argmax(axis=1)], axis=0)
    chosen = np.moveaxis(first_last, 0, 1)
    times = np.broadcast_to(stamps.reshape(-1, width, 1), stretches.shape)
    return (
        np.take_along_axis(times, chosen, axis=1).reshape(-1, components),
        np.take_along_axis(stretches, chosen, axis=1).reshape(-1, components),
    )
