"""What reading a log takes, over bare decompression of its chunks.

``python benchmarks/reading.py [LOG]``: of a minute of contraction-adaptive, all logged at 1 kHz,
when left out. Least times, and medians of the ratios of runs in turn; the commands are processes
of their own, their start included.
"""

import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.reader import make_reader
from mcap.records import Chunk
from timing import Run, head, paired, ratio, row

import mjspace
from mjspace.log.reader import Log
from mjspace.plotting.panels import curves

ROUNDS = 5


def main() -> None:
    """Print the table."""
    if len(sys.argv) > 1:
        measure(Path(sys.argv[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        result = mjspace.run("contraction-adaptive", overrides=["duration=60"], out=folder)
        measure(result.path)


def measure(path: Path) -> None:
    """Print the table of one log."""
    log = Log(path)
    bare = decompressed(path)
    cases: dict[str, Run] = {
        "one field": lambda: list(map(len, log.blocks("/truth", ["rate"]))),
        "every field of every topic": lambda: list(
            map(len, log.blocks_of_topics(dict.fromkeys(log.topics)))
        ),
        "the curves of a page": lambda: curves(log),
        "the digests": log.altered,
    }
    head(f"{path.stat().st_size / 1e6:.0f} MB, {len(log):,} rows", "s", "bare", "ratio")
    for name, read in cases.items():
        times = paired(read, bare, rounds=ROUNDS)
        row(name, *(f"{s:.2f}" for s in times.min(axis=0)), f"{ratio(times):.2f}")
    with tempfile.TemporaryDirectory() as folder:
        for words in (["info", path], ["plot", path, "-o", Path(folder, "page.png")]):
            command = [sys.executable, "-m", "mjspace", *map(str, words)]
            call = partial(subprocess.run, command, check=True, stdout=subprocess.DEVNULL)
            row(f"`mjspace {words[0]}`", f"{paired(call, rounds=3).min():.2f}", "", "")


def decompressed(path: Path) -> Run:
    """Return what reads each chunk and decompresses it."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None

    def run() -> None:
        with path.open("rb") as file:
            for index in summary.chunk_indexes:
                file.seek(index.chunk_start_offset + 9)  # opcode and length
                zstandard.decompress(Chunk.read(ReadDataStream(file)).data, index.uncompressed_size)

    return run


if __name__ == "__main__":
    main()
