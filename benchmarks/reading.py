"""What reading a log takes, over bare decompression of its chunks.

``python benchmarks/reading.py [LOG]``: of a minute of contraction-adaptive, all logged at 1 kHz,
when left out. Medians of paired runs in one process; the commands are processes of their own.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.reader import make_reader
from mcap.records import Chunk

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
    cases: dict[str, Callable[[], object]] = {
        "one field": lambda: list(map(len, log.blocks("/truth", ["rate"]))),
        "every field of every topic": lambda: list(
            map(len, log.blocks_of_topics(dict.fromkeys(log.topics)))
        ),
        "the curves of a page": lambda: curves(log),
        "the digests": log.altered,
    }
    print(f"{path.stat().st_size / 1e6:.0f} MB, {len(log)} rows")
    print(f"{'':30}{'s':>8}{'ratio':>8}")
    print(f"{'decompression alone':30}{min(seconds(bare) for _ in range(ROUNDS)):8.2f}{1.0:8.2f}")
    for name, read in cases.items():
        pairs = [(seconds(read), seconds(bare)) for _ in range(ROUNDS)]
        ratio = median(a / b for a, b in pairs)
        print(f"{name:30}{min(a for a, _ in pairs):8.2f}{ratio:8.2f}")
    with tempfile.TemporaryDirectory() as folder:
        for words in (["info", path], ["plot", path, "-o", Path(folder, "page.png")]):
            command = [sys.executable, "-m", "mjspace", *map(str, words)]
            call = partial(subprocess.run, command, check=True, stdout=subprocess.DEVNULL)
            print(f"{f'mjspace {words[0]}':30}{median(seconds(call) for _ in range(3)):8.2f}")


def decompressed(path: Path) -> Callable[[], None]:
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


def seconds(run: Callable[[], object]) -> float:
    """Return how long ``run`` takes."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
