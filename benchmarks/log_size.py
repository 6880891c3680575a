"""What a logged control period costs: its size, and processor time of the log's thread.

    python benchmarks/log_size.py [SECONDS]

Three scenarios, each flown for SECONDS (5 when left out) with everything logged. Their chunks are
compressed anew at each level of zstd; times are the least of ``ROUNDS`` passes.
"""

import hashlib
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import zstandard
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

import mjspace
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
    sums = microseconds(zlib.crc32, chunks, rows), microseconds(digest, chunks, rows)
    print(f"  CRC {sums[0]:.2f} us, SHA-256 {sums[1]:.2f} us a row")
    print(f"  {'level':>5}{'bytes':>8}{'ratio':>7}{'pack us':>9}{'unpack us':>11}")
    for level in LEVELS:
        packer = zstandard.ZstdCompressor(level=level, write_checksum=True)
        packed = [packer.compress(chunk) for chunk in chunks]
        least = sum(map(len, packed)) / rows
        times = microseconds(packer.compress, chunks, rows), microseconds(unpack, packed, rows)
        mark = "  <- the log's" if level == LEVEL else ""
        print(f"  {level:5}{least:8.0f}{size / least:7.2f}{times[0]:9.2f}{times[1]:11.2f}{mark}")


def digest(content: bytes) -> bytes:
    """Return the SHA-256 of ``content``."""
    return hashlib.sha256(content).digest()


def unpack(packed: bytes) -> bytes:
    """Return what was packed."""
    return zstandard.decompress(packed)


def microseconds(work: Callable[[bytes], object], blocks: list[bytes], rows: int) -> float:
    """Return the processor time [us] of ``work`` on all ``blocks``, for each of ``rows``."""
    passes = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        for block in blocks:
            work(block)
        passes.append(time.thread_time() - begin)
    return 1e6 * min(passes) / rows


if __name__ == "__main__":
    main()
