"""How much of a log is unpacked into memory at once, whatever it claims."""

import os

from mjspace.errors import InputError

VARIABLE = "MJSPACE_UNPACK_LIMIT"
"""The environment variable that raises the limits, to so many MiB whatever the file's size."""

MIB = 1 << 20
MOST = 256 * MIB
"""Of a chunk, an attachment or another record. The chunk of a flight has 0.25 s of wall time."""
FREE, RATIO = MIB // 16, 1000
"""What takes more than FREE has at most RATIO times the bytes that it is packed into: the chunks of
the scenarios' flights, of at most 2.3 MB, have up to 16 times as many."""
ROW = MIB
"""Most bytes of a topic's row; a vehicle's have some thousand."""


def refuse_bomb(declared: int, packed: int) -> None:
    """Refuse to unpack ``declared`` bytes from ``packed`` ones where that is out of proportion.

    Raises:
        ValueError: it is, or ``VARIABLE`` is not a number; the message says how to raise the limit.
    """
    raised = _raised()
    allowed = min(MOST, max(FREE, RATIO * packed)) if raised is None else raised
    if declared > allowed:
        raise ValueError(
            f"it claims {_size(declared)}, packed in {_size(packed)}: more than {_size(allowed)} "
            f"at once; if you trust it, set {VARIABLE}={-(-declared // MIB)} (MiB)"
        )


def _raised() -> int | None:
    text = os.environ.get(VARIABLE, "")
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise InputError(f"{VARIABLE}={text[:20]}: write a whole number of MiB, as 1024")
    return int(text) * MIB


def _size(count: int) -> str:
    for unit in ("bytes", "KiB", "MiB", "GiB"):
        if count < 1024 or unit == "GiB":
            break
        count /= 1024  # type: ignore[assignment]
    return f"{count:.4g} {unit}"
