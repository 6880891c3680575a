"""A SHA-256 of each topic's rows: a log that was changed afterwards is recognised by it.

It is over log time, publish time and content of every message of the topic, in their order: not
over its framing, so that a tool may compress or cut the chunks anew. Whoever changes a log on
purpose can change its digests too: they are no signature.
"""

import hashlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from mjspace.log.encoding import HEADER

RECORD = "mjspace.sha256"
"""Name of the metadata record that holds the digests, by topic."""

FROM: int = HEADER.fields["log_time"][1]  # type: ignore[index]
"""The first byte of a message record that counts."""


class RowDigests:
    """The digests of a log's topics, while it grows by blocks or is read chunk by chunk."""

    def __init__(self, topics: Iterable[str]) -> None:
        self._hashes = {topic: hashlib.sha256() for topic in topics}

    def add_rows(self, records: NDArray[np.void]) -> None:
        """Add a block of message records, whose fields are the topics."""
        content = records.view(np.uint8).reshape(len(records), records.itemsize)
        for topic, (dtype, start, *_) in (records.dtype.fields or {}).items():
            part = content[:, start + FROM : start + dtype.itemsize]
            self._hashes[topic].update(np.ascontiguousarray(part).data)

    def add_messages(self, topic: str, tails: bytes) -> None:
        """Add message records of one topic, each without the bytes before ``FROM``."""
        self._hashes[topic].update(tails)

    def by_topic(self) -> dict[str, str]:
        """Return the digests so far, in hexadecimal."""
        return {topic: hashed.hexdigest() for topic, hashed in self._hashes.items()}
