"""What is checked of a log's numbers when they are read: they may be damaged, or a stranger's."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from mjspace.contract import Event
from mjspace.errors import InputError
from mjspace.log.encoding import HEADER
from mjspace.log.index import ChunkPlace

CONTROL_PERIOD = "control_period"
"""The key of the metadata that has the control period [s]."""


def number(path: Path, metadata: Mapping[str, str], key: str, above: float) -> float:
    """Return the number that a log's ``metadata`` have.

    Raises:
        InputError: there is none, or it is not ``above`` that bound or is absurdly large.
    """
    text = metadata.get(key)
    if text is None:
        raise InputError(f"{path}: the metadata lack {key}")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not above < value < 2.0**31:
        raise InputError(f"{path}: the metadata have {key} = {text[:20]!r}, not a number for it")
    return value


def stamps(found: NDArray[np.uint64], place: ChunkPlace) -> None:
    """Check the stamps (n,) [ns] of a topic in a chunk.

    Raises:
        ValueError: they do not increase, or are not within the chunk's span.
    """
    if not place.start <= found[0] <= found[-1] <= place.end < 2**63:
        raise ValueError(f"stamps out of the span of the chunk at byte {place.position}")
    if (found[1:] <= found[:-1]).any():
        raise ValueError(f"time does not go on in the chunk at byte {place.position}")


def span(path: Path, topic: str, first: np.void, last: np.void, period: float) -> None:
    """Check the headers of a topic's first and last row against the control ``period`` [s].

    Raises:
        InputError: the stamps do not fit the number of control periods.
    """
    periods = int(last["sequence"]) - int(first["sequence"])
    elapsed = (int(last["log_time"]) - int(first["log_time"])) / 1e9
    if abs(elapsed - periods * period) > 0.5 * period:
        raise InputError(
            f"{path}: {topic} is damaged: {periods} control periods of {period:g} s in "
            f"{elapsed:g} s"
        )


def event(record: bytes) -> Event:
    """Return the entry of /events in a Message record.

    Raises:
        ValueError: it is not one.
    """
    try:
        entry = LogMessage.FromString(record[HEADER.itemsize :])
        time = entry.timestamp.ToNanoseconds() / 1e9
        return Event(time, 0, LogMessage.Level.Name(entry.level), entry.message)
    except (DecodeError, ValueError) as error:
        raise ValueError(f"an entry of it cannot be read: {error}") from error
