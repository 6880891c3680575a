"""What a log may claim that it unpacks to."""

from pathlib import Path

import pytest
import zstandard
from log_samples import fly

from mjspace.errors import InputError
from mjspace.log import limits
from mjspace.log.index import inventory
from mjspace.log.reader import Log
from mjspace.log.salvage import salvage


def bomb(path: Path, claim: int, packed: bytes) -> Path:
    """Write a log whose first chunk claims to unpack to so many bytes, and return it."""
    whole = fly(path.with_name("whole.mcap"))
    content, place = whole.read_bytes(), inventory(whole).chunks[0]
    inner = content[place.position : place.position + 16] + claim.to_bytes(8, "little") + bytes(4)
    inner += b"\4\0\0\0zstd" + len(packed).to_bytes(8, "little") + packed
    chunk = b"\6" + len(inner).to_bytes(8, "little") + inner
    path.write_bytes(content[: place.position - 9] + chunk + content[place.position + place.size :])
    return path


def claiming(size: int) -> bytes:
    """Return a zstd frame whose header claims so many bytes."""
    return b"\x28\xb5\x2f\xfd\xe0" + size.to_bytes(8, "little") + bytes(3)


@pytest.mark.parametrize(
    ("claim", "packed", "message"),
    [
        (2**33, claiming(2**33), r"claims 8 GiB, packed in 16 bytes: .* set MJSPACE_UNPACK_LIMIT="),
        (100, claiming(2**33), "its two sizes differ"),
        (10**8, zstandard.compress(bytes(10**8)), "claims 95.37 MiB, packed in 2.999 KiB"),
        (100, zstandard.compress(bytes(101)), "its two sizes differ"),
    ],
)
def test_a_bomb_is_refused_by_what_it_claims(
    tmp_path: Path, claim: int, packed: bytes, message: str
) -> None:
    path = bomb(tmp_path / "bomb.mcap", claim, packed)
    with pytest.raises(InputError, match=f"the chunk at byte .* cannot be read: .*{message}"):
        Log(path).read("/truth")
    assert len(salvage(path).chunks) == 3


def test_the_limit_is_raised_by_the_variable_that_the_message_names(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(ValueError, match=f"set {limits.VARIABLE}=301 .MiB."):
        limits.refuse_bomb(300 * limits.MIB + 1, 300 * limits.MIB)
    monkeypatch.setenv(limits.VARIABLE, "301")
    limits.refuse_bomb(300 * limits.MIB + 1, 1)
    monkeypatch.setenv(limits.VARIABLE, "a lot")
    with pytest.raises(InputError, match="MJSPACE_UNPACK_LIMIT=a lot: write a whole number of MiB"):
        limits.refuse_bomb(1, 1)


def test_what_is_small_or_packed_as_flights_are_is_not_a_bomb() -> None:
    for declared, packed in ((2**16, 1), (2_302_395, 140_000), (2**28, 2**28), (10**6, 1001)):
        limits.refuse_bomb(declared, packed)
    for declared, packed in ((2**16 + 1, 65), (2**28 + 1, 2**28)):
        with pytest.raises(ValueError, match="at once"):
            limits.refuse_bomb(declared, packed)
