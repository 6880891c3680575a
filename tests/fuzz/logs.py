"""Damaged, foreign and hostile logs, made from a seed."""

import gzip
import hashlib
import io
import struct
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import NamedTuple

import mcap_parts as parts
import numpy as np
import zstandard
from mcap.records import Channel, Metadata
from mcap_parts import ATTACHMENT, CHANNEL, CHUNK, METADATA, SCHEMA, Parts

from mjspace.log.chunk import record_bytes
from mjspace.log.index import Exactly

BASES = {
    "b-dot": ["duration=30"],
    "pmsm-speed": ["duration=0.02"],
}
"""Short flights whose environment has terms with places in memory, by scenario with overrides."""
NUMBERS = (0, 1, 2, 5, 0x7F, 0xFF, 0xFFFF, 2**31 - 1, 2**32 - 1, 2**63, 2**64 - 1, 10**18)
DOUBLES = (
    *(np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-310, -1.0, 0.5, 3.0, 1e3, 1e6, 1e9, 1e18, -1e9),
    *(2.0**31, 2.0**53, 2.0**63, 6.02214076e23),
)


class Case(NamedTuple):
    """A log to hand to every command."""

    name: str
    content: bytes
    must_differ: bool = False
    """Whether ``replay --verify`` must refuse it or report a difference."""


def cases(bases: dict[str, Path], seed: int | str) -> Iterator[Case]:
    """Yield mutated logs without end; ``bases`` are whole logs by name."""
    random = Random(seed)
    whole = {name: parts.parts_of(path, 5) for name, path in bases.items()}
    number = 0
    while True:
        base = random.choice(list(whole))
        mutate = random.choice(MUTATIONS)
        content = mutate(random, whole[base].copy())
        # A number may be replaced by what it was.
        poisoned = isinstance(content, Parts) and content.chunks != whole[base].chunks
        if isinstance(content, Parts):
            content = parts.joined(content)
        yield Case(f"{number}-{base}-{mutate.__name__}", content, poisoned and mutate is state)
        number += 1


def flips(random: Random, log: Parts) -> bytes:
    """Flip some bits anywhere, half of them in what is small."""
    data = bytearray(parts.joined(log))
    model = data.index(b"model.mjb.gz")
    for _ in range(random.randint(1, 4)):
        at = random.randrange(len(data))
        if random.random() < 0.8:
            after = random.randrange(min(model + 735_000, len(data) - 1), len(data))
            at = random.choice([random.randrange(model), after])
        data[at] ^= 1 << random.randrange(8)
    return bytes(data)


def cut(random: Random, log: Parts) -> bytes:
    """Cut it short, or leave a piece out, or fill a piece with zeros."""
    data = parts.joined(log)
    tail = 750_000 if random.random() < 0.3 else 0
    a, b = sorted(random.randrange(tail if tail < len(data) else 0, len(data)) for _ in range(2))
    kind = random.randrange(4)
    if kind == 0:
        return data[:a]
    if kind == 1:
        return data[:a] + data[min(b, a + 5000) :]
    if kind == 2:
        return data[:a] + bytes(random.choice([10, 1000, 100_000]))
    return data[:a] + data[a : min(b, a + 5000)] * 2 + data[a:]


def order(random: Random, log: Parts) -> bytes:
    """Remove, repeat or swap records."""
    found = list(parts.pieces(log))
    for _ in range(random.randint(1, 3)):
        i, j = random.randrange(len(found)), random.randrange(len(found))
        _reordered(found, i, j, random.randrange(3))
    return parts.MAGIC + b"".join(found) + parts.ending(log)


def lengths(random: Random, log: Parts) -> bytes:
    """Give a record another length or opcode."""
    found = [bytearray(piece) for piece in parts.pieces(log)]
    piece = random.choice(found)
    if random.random() < 0.7:
        length = int.from_bytes(piece[1:9], "little")
        other = random.choice([*NUMBERS, length + 1, length - 1, length + random.randrange(9999)])
        piece[1:9] = struct.pack("<Q", other % 2**64)
    else:
        piece[0] = random.choice([*range(18), 0x80, 0xFF])
    return parts.MAGIC + b"".join(found) + parts.ending(log)


def numbers(random: Random, log: Parts) -> Parts | bytes:
    """Write an absurd number anywhere near the beginning of a record's content."""
    i = random.randrange(len(log.before))
    opcode, content = log.before[i]
    log.before[i] = opcode, _spoilt(random, content)
    return log


def chunks(random: Random, log: Parts) -> bytes:
    """Spoil the head, the index or the compressed content of a chunk, or make it a bomb."""
    found = list(parts.pieces(log))
    places = [i for i, piece in enumerate(found) if piece[0] == CHUNK]
    i = random.choice(places)
    kind = random.randrange(5)
    if kind == 0:
        found[i] = found[i][:9] + _spoilt(random, found[i][9:])
    elif kind == 1:
        piece = bytearray(found[i])
        length = 9 + int.from_bytes(piece[1:9], "little")
        for _ in range(random.randint(1, 3)):
            at = random.randrange(length, len(piece) - 8)
            piece[at : at + 8] = struct.pack("<Q", random.choice(NUMBERS))
        found[i] = bytes(piece)
    elif kind == 2:
        size = random.choice([10**6, 10**8, 10**9])
        bomb = zstandard.ZstdCompressor().compress(bytes(min(size, 10**8)))
        found[i] = parts.chunk(log.chunks[places.index(i)], bomb, size)
    elif kind == 3:
        claim = random.choice([2**20, 2**33, 2**63])
        bomb = b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", claim) + bytes(random.randrange(99))
        found[i] = parts.chunk(log.chunks[places.index(i)], bomb, random.choice([claim, 100]))
    else:
        size = int.from_bytes(found[i][1:9], "little") + 9
        found[i] = found[i][:size]
    return parts.MAGIC + b"".join(found) + parts.ending(log)


def messages(random: Random, log: Parts) -> Parts:
    """Change messages within a chunk: their heads, data, order; with or without the digests."""
    _without_digests(random, log)
    for _ in range(random.randint(1, 3)):
        chunk = random.choice(log.chunks)
        i, j = random.randrange(len(chunk)), random.randrange(len(chunk))
        kind = random.randrange(5)
        if kind < 3:
            _reordered(chunk, i, j, kind)
        elif kind == 3:
            chunk[i] = _spoilt(random, chunk[i])
        else:
            head = bytearray(chunk[i])
            number = random.choice([*NUMBERS, 10**9, 20 * 10**9])
            at, size = random.choice([(0, 2), (2, 4), (6, 8), (14, 8)])
            head[at : at + size] = (number % 256**size).to_bytes(size, "little")
            chunk[i] = bytes(head)
        if not chunk:
            log.chunks.remove(chunk)
    return log


def state(random: Random, log: Parts) -> Parts:
    """Poison numbers of /state, in one row or in all."""
    log.after = [one for one in log.after if b"sha256" not in one[1][:20]]
    channel = next(
        int.from_bytes(content[:2], "little")
        for opcode, content in log.before
        if opcode == CHANNEL and b"/state" in content[:20]
    )
    rows = [
        (chunk, i)
        for chunk in log.chunks
        for i, message in enumerate(chunk)
        if int.from_bytes(message[:2], "little") == channel
    ]
    first = rows[0][0][rows[0][1]]  # times and sequence, a tag, the length of physics, physics
    begin = next(at for at in range(23, 33) if first[at] < 0x80) + 1
    count = sum((byte & 0x7F) << 7 * i for i, byte in enumerate(first[23:begin])) // 8
    places = [random.randrange(count) for _ in range(random.randint(1, 3))]
    values = [random.choice(DOUBLES) for _ in places]
    if random.random() < 0.5:  # an index or a count, off by little
        values = [random.choice([-2.0, -1.0, 7.0, 40.0, 100.0, 4096.0]) for _ in places]
    chosen = rows if random.random() < 0.6 else [random.choice(rows[:-1])]
    for chunk, i in chosen:
        message = bytearray(chunk[i])
        for place, value in zip(places, values, strict=True):
            at = begin + 8 * place
            message[at : at + 8] = struct.pack("<d", value)
        chunk[i] = bytes(message)
    return log


def attachments(random: Random, log: Parts) -> Parts:
    """Change what is attached, with its checksum right."""
    places = [i for i, one in enumerate(log.before) if one[0] == ATTACHMENT]
    i = random.choice(places)
    name, data = (of(log.before[i][1]) for of in (parts.name_of, parts.data_of))
    kind = random.randrange(5)
    if kind == 0:
        del log.before[i]
        return log
    if kind == 1:
        name = random.choice([b"", b"x" * 5000, b"\xff\xfe", b"law.py", b"../../x", b"a\x1b[2Jb"])
    elif name == b"model.mjb.gz" or kind == 2:
        i = next(k for k in places if parts.name_of(log.before[k][1]) == b"model.mjb.gz")
        name, data = b"model.mjb.gz", _model(random, parts.data_of(log.before[i][1]))
        _set_metadata(log, "model_sha256", _digest(data))
    else:
        i = next(k for k in places if parts.name_of(log.before[k][1]) == b"scenario.toml")
        name, data = b"scenario.toml", _scenario(random, parts.data_of(log.before[i][1]))
    log.before[i] = ATTACHMENT, parts.attachment(name, data)
    return log


def metadata(random: Random, log: Parts) -> Parts:
    """Drop a key of the metadata, or give it an absurd value."""
    found = _metadata(log)
    for key in random.sample(sorted(found), random.randint(1, 4)):
        value = random.choice(
            [None, "", "nan", "inf", "-1", "0", "1e308", "9" * 5000, "x", "\x1b[31m", "1e-300", "ü"]
        )
        _set_metadata(log, key, value)
    if random.random() < 0.5:
        _set_metadata(log, "control_period", random.choice([None, "0", "1e-9", "1e9", "x"]))
    return log


def channels(random: Random, log: Parts) -> Parts:
    """Declare a topic otherwise, or twice, or with a foreign schema."""
    places = [i for i, one in enumerate(log.before) if one[0] in (SCHEMA, CHANNEL)]
    i = random.choice(places)
    opcode, content = log.before[i]
    if opcode == SCHEMA or random.random() < 0.2:
        j = random.choice([k for k in places if log.before[k][0] == SCHEMA])
        other = random.choice([k for k in places if log.before[k][0] == SCHEMA])
        number, data = log.before[j][1][:2], log.before[other][1][2:]
        spoilt = random.random() < 0.5
        log.before[j] = SCHEMA, number + (_spoilt(random, data) if spoilt else data)
        return log
    channel = Channel.read(Exactly(_stream(content)))
    kind = random.randrange(5)
    if kind == 0:
        channel.topic = random.choice(["/state", "/truth", "/events", "/x", "", "/tf"])
    elif kind == 1:
        channel.schema_id = random.randrange(14)
    elif kind == 2 and channel.metadata:
        key = random.choice(sorted(channel.metadata))
        values = ["", "-1", "0", "999999999", "3,3", "99999,99999", "x", "9" * 5000, "1,", "٣"]
        channel.metadata[key] = random.choice(values)
    elif kind == 3:
        channel.metadata = {k: v for k, v in channel.metadata.items() if random.random() < 0.7}
        channel.metadata["every"] = random.choice(["0", "2", "-3", "nan", "1000000"])
    else:
        channel.id = random.choice([0, 1, 2, 65535])
    declared = record_bytes(channel)[9:]
    if random.random() < 0.3:
        log.before.insert(i, (CHANNEL, declared))
    else:
        log.before[i] = CHANNEL, declared
    return log


MUTATIONS: tuple[Callable[[Random, Parts], Parts | bytes], ...] = (
    *(flips, cut, order, lengths, numbers, chunks, messages, messages, state, state, state),
    *(attachments, attachments, metadata, channels, channels),
)


def _reordered(items: list[bytes], i: int, j: int, kind: int) -> None:
    """Remove one, repeat one or swap two."""
    if kind == 0:
        del items[i]
    elif kind == 1:
        items.insert(i, items[j])
    else:
        items[i], items[j] = items[j], items[i]


def _spoilt(random: Random, content: bytes) -> bytes:
    data = bytearray(content)
    for _ in range(random.randint(1, 2)):
        size = random.choice([1, 2, 4, 8])
        at = random.randrange(max(min(len(data), random.choice([40, 400, 10**9])), 1))
        kind = random.randrange(4)
        if kind == 0:
            data[at : at + size] = (random.choice(NUMBERS) % 256**size).to_bytes(size, "little")
        elif kind == 1:
            del data[at : at + size]
        elif kind == 2:
            data[at:at] = random.randbytes(size)
        else:
            data[at : at + size] = random.choice([b"\xff\xfe", b"\x1b[2J", b"\0"])
    return bytes(data)


def _model(random: Random, packed: bytes) -> bytes:
    kind = random.randrange(6)
    if kind == 0:
        return random.choice([b"", b"no gzip", packed[: random.randrange(len(packed))]])
    if kind == 1:
        return gzip.compress(bytes(10**8), 1)
    mjb = bytearray(gzip.decompress(packed))
    if kind == 2:
        del mjb[random.randrange(len(mjb)) :]
    for _ in range(random.randint(1, 20)):
        at = random.randrange(random.choice([1000, len(mjb)]) % (len(mjb) - 8) + 1)
        number = random.choice([struct.pack("<d", random.choice(DOUBLES)), random.randbytes(4)])
        mjb[at : at + len(number)] = number
    return gzip.compress(bytes(mjb), 1)


def _scenario(random: Random, data: bytes) -> bytes:
    kind = random.randrange(5)
    lines = data.split(b"\n")
    if kind == 0:
        return random.choice([b"", b"\xff\xfe", b"= x", b"[" * 3000, b"a" * 10**6, data[:-30]])
    if kind == 1:
        return data[: random.randrange(len(data))]
    if kind == 2:
        del lines[random.randrange(len(lines))]
    elif kind == 3:
        i = random.randrange(len(lines))
        lines[i] = lines[i].split(b"=")[0] + b"= " + random.choice([b"1", b'"x"', b"[]", b"nan"])
    else:
        lines.insert(random.randrange(len(lines)), random.choice([b"x = 1", b"[y]", b"\xff"]))
    found = b"\n".join(lines)
    try:  # how long it flies is for others to attack
        long = float(tomllib.loads(found.decode()).get("duration", 0)) > 60
    except (ValueError, TypeError):
        long = False
    return data if long else found


def _without_digests(random: Random, log: Parts) -> None:
    if random.random() < 0.8:
        log.after = [one for one in log.after if b"sha256" not in one[1][:20]]


def _metadata(log: Parts) -> dict[str, str]:
    (content,) = (content for opcode, content in log.before if opcode == METADATA)
    return Metadata.read(Exactly(_stream(content))).metadata


def _set_metadata(log: Parts, key: str, value: str | None) -> None:
    found = {k: v for k, v in _metadata(log).items() if k != key}
    found |= {} if value is None else {key: value}
    i = next(i for i, one in enumerate(log.before) if one[0] == METADATA)
    log.before[i] = METADATA, record_bytes(Metadata("mjspace", found))[9:]


def _digest(data: bytes) -> str:

    return hashlib.sha256(data).hexdigest()


def _stream(content: bytes) -> io.BytesIO:

    return io.BytesIO(content)
