"""What a logged control period costs: its size, and processor time of the log's thread.

    python benchmarks/log_size.py [SECONDS]

Three scenarios, each flown for SECONDS (5 when left out) with everything logged. Their chunks are
compressed anew at each level of zstd; times are the least of ``ROUNDS`` passes in turn.
"""

import hashlib
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import zstandard
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from timing import alternating, head, row

import mjspace
from mjspace.contract import Array
from mjspace.log.chunk import LEVEL

SCENARIOS = ("contraction-adaptive", "dgvscmg-tracking", "lander")
LEVELS = (-10, -5, -3, -1, 1, 3)
ROUNDS = 3


def main() -> None:
    """Print a table for each scenario."""
    duration = sys.argv[1] if len(sys.argv) > 1 else "5"
    for scenario in SCENARIOS:
        with tempfile.TemporaryDirectory() as out:
            overrides = [f"duration={duration}", "checks=[]"]
            log = mjspace.run(scenario, overrides=overrides, out=out).log
            chunks, rows = list(contents(log.path)), len(log)
        report(scenario, chunks, rows)


def contents(log: Path) -> Iterator[bytes]:
    """Yield what each chunk of a log holds."""
    with log.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                yield zstandard.decompress(record.data, max_output_size=record.uncompressed_size)


def report(scenario: str, chunks: list[bytes], rows: int) -> None:
    """Print size and times for each of ``rows`` control periods, by level."""
    size = sum(map(len, chunks)) / rows
    print(f"{scenario}: {size:.0f} bytes a row, {rows} rows in {len(chunks)} chunks")
    sums = microseconds(rows, (zlib.crc32, chunks), (digest, chunks))
    print(f"CRC {sums[0]:.2f} us, SHA-256 {sums[1]:.2f} us a row\n")
    head("level", "bytes", "ratio", "pack us", "unpack us")
    for level in LEVELS:
        packer = zstandard.ZstdCompressor(level=level, write_checksum=True)
        packed = [packer.compress(chunk) for chunk in chunks]
        least = sum(map(len, packed)) / rows
        times = microseconds(rows, (packer.compress, chunks), (unpack, packed))
        name = f"{level}, the log's" if level == LEVEL else f"{level}"
        row(name, f"{least:.0f}", f"{size / least:.2f}", *(f"{us:.2f}" for us in times))
    print()


def digest(content: bytes) -> bytes:
    """Return the SHA-256 of ``content``."""
    return hashlib.sha256(content).digest()


def unpack(packed: bytes) -> bytes:
    """Return what was packed."""
    return zstandard.decompress(packed)


def microseconds(rows: int, *works: tuple[Callable[[bytes], object], list[bytes]]) -> Array:
    """Return the processor time [us] of each work on all of its blocks, for each of ``rows``."""
    timers = (partial(processor_seconds, *work) for work in works)
    least: Array = alternating(*timers, rounds=ROUNDS).min(axis=0)
    return 1e6 * least / rows


def processor_seconds(work: Callable[[bytes], object], blocks: list[bytes]) -> float:
    """Return the processor time [s] of ``work`` on all ``blocks``."""
    begin = time.thread_time()
    for block in blocks:
        work(block)
    return time.thread_time() - begin


if __name__ == "__main__":
    main()
