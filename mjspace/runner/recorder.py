"""A flight's blocks, handed over to the thread that logs and judges them."""

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from mjspace.log.background import Background
from mjspace.runner.checks import Judge, Verdict
from mjspace.runner.flight_log import FlightLog, described
from mjspace.runner.metrics import Measured
from mjspace.runner.output import exists
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.recording import Block, one_vehicle, shapes

AHEAD = 2  # blocks that may wait for the disk: memory stays flat, and a kill costs no more


class Recorder:
    """Logs and judges one vehicle's flight on a thread of its own; a context manager.

    The thread is at most ``AHEAD`` blocks behind the flight, which waits for a slow disk. What it
    raises is raised here by the next call; the log then keeps what it has.
    """

    def __init__(self, assembly: Assembly) -> None:
        """Let the thread describe the model, while the flight is prepared; nothing is written."""
        self._assembly = assembly
        self._opened = ExitStack()
        self._log: FlightLog
        self._judge: Judge
        self._thread = Background("log", AHEAD)
        self._thread.call(described, assembly.vehicle.model)
        self.time: float
        """Of the last period written [s]."""

    def begin(self, path: Path, member: int, first: Block) -> None:
        """Create the log at ``path``; ``first`` is the flight's first block, for its shapes.

        Raises:
            ValueError: a check or a metric names a signal that this flight does not have.
        """
        assembly, scenario = self._assembly, self._assembly.scenario
        self._judge = Judge(
            scenario.checks,
            scenario.events,
            shapes(first),
            scenario.metrics,
            assembly.metrics,
            scenario.rates.control,
        )
        self._thread.call(self._create, path, member, first)

    def write(self, block: Block) -> None:
        """Log and judge a block of a flight of one vehicle.

        The block is handed over: its arrays are read later, and must not change any more.

        Raises:
            OSError: the log cannot be written (any more).
        """
        self._thread.call(self._write, block)
        self.time = float(block.time[-1])

    def event(self, level: str, text: str) -> None:
        """Log ``text`` at the flight's present time; ``level`` is INFO, WARNING or ERROR."""
        self._thread.call(self._write_event, self.time, level, text)

    def verdicts(self) -> list[Verdict]:
        """Return the verdict of each check on everything written so far.

        Raises:
            OSError: the log cannot be written (any more).
        """
        self._thread.wait()
        return self._judge.verdicts()

    def metrics(self) -> list[Measured]:
        """Return what each metric came to in everything written so far.

        Raises:
            OSError: the log cannot be written (any more).
        """
        self._thread.wait()
        return self._judge.metrics()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            with self._opened:
                self._thread.close()
        except OSError:
            if error is None:
                raise

    def _create(self, path: Path, member: int, first: Block) -> None:
        try:
            log = FlightLog(self._assembly, path, member, first)
        except FileExistsError as error:
            raise exists(path) from error
        self._log = self._opened.enter_context(log)

    def _write(self, block: Block) -> None:
        self._log.write(block)
        self._judge.add(block.time, one_vehicle(block))

    def _write_event(self, time: float, level: str, text: str) -> None:
        self._log.event(time, level, text)
