"""Ctrl-C, SIGTERM and SIGHUP: a request that a flight polls, or the end of a command."""

import os
import signal
import sys
import time
from array import array
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread, current_thread, main_thread
from types import FrameType
from typing import Any, NoReturn, TypeVar

GRACE = 1.0
"""What does not poll is broken off after this time [s]."""
AGAIN = 0.1
"""And again each time that it has passed [s], where the user's code catches everything."""
SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
received = array("q", [0])
"""The signal that a flight is to stop for, else 0: compiled code reads it at its address."""

_TESTBED = str(Path(__file__).parent) + os.sep
_Block = TypeVar("_Block")


class Interrupted(BaseException):
    """A signal ends what is being done; no ``except Exception`` stands in its way."""

    def __init__(self, number: int) -> None:
        super().__init__(f"interrupted by signal {number}")
        self.number = number


class Stop:
    """Whether the flight is to stop, and why."""

    def __init__(self) -> None:
        self.signal = 0
        self.since = 0.0
        self._breakable = self._at_once = False

    def __call__(self) -> bool:
        """Return whether a signal has been received."""
        return self.signal != 0

    @contextmanager
    def breakable(self, *, at_once: bool = False) -> Iterator[None]:
        """Let the context be broken off after the grace time, or by the request itself.

        Raises:
            Interrupted: so it was.
        """
        self._breakable, self._at_once = True, at_once
        tracing = sys.gettrace()
        try:
            yield
        finally:
            self._breakable = self._at_once = False
            if sys.gettrace() is not tracing:
                sys.settrace(tracing)

    def breaking_off(self, blocks: Iterator[_Block]) -> Iterator[_Block]:
        """Yield the ``blocks``; the making of each is breakable."""
        while True:
            try:
                with self.breakable():
                    block = next(blocks)
            except StopIteration:
                return
            yield block

    def request(self, number: int) -> None:
        """Request it for the signal of that number."""
        self.signal = received[0] = number
        self.since = time.monotonic()
        if self._at_once:
            self.break_off()

    def break_off(self, _number: int = 0, frame: FrameType | None = None) -> None:
        """Raise ``Interrupted`` in what is breakable: a handler of signals."""
        if self._breakable:
            self._raise_again_in(frame)
            raise Interrupted(self.signal)

    def _raise_again_in(self, frame: FrameType | None) -> None:
        """Let the next line of the user's code that is run raise it too.

        Such a line is run only if ``except:`` has caught it, and stands in that clause, from where
        it leaves the loop around. Python ends the tracing when a trace function raises.
        """

        def again(_frame: FrameType, event: str, _argument: object) -> Any:
            if event == "line":
                raise Interrupted(self.signal)
            return again

        while frame is not None and not frame.f_code.co_filename.startswith(_TESTBED):
            sys.settrace(lambda *_: None)  # without one, a frame's own is not called
            frame.f_trace = again
            frame = frame.f_back


@contextmanager
def on_signals() -> Iterator[Stop]:
    """Turn the signals into a request for as long as the context lasts.

    A second one is obeyed at once, as before the context; so is the first when ``Interrupted``
    leaves it. One that follows the first within ``AGAIN`` was sent to the process and to its group.
    Ignored signals stay ignored. Outside the main thread nothing is caught.
    """
    stop = Stop()
    if current_thread() is not main_thread():
        yield stop
        return
    handlers = {number: signal.getsignal(number) for number in (*SIGNALS, signal.SIGALRM)}
    caught = [n for n in SIGNALS if handlers[n] not in (signal.SIG_IGN, None)]

    def as_before() -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number in (*caught, signal.SIGALRM):
            signal.signal(number, handlers[number])

    def request(number: int, _frame: Any) -> None:
        if stop():
            if time.monotonic() > stop.since + AGAIN:
                as_before()
                signal.raise_signal(number)
            return
        signal.signal(signal.SIGALRM, stop.break_off)
        signal.setitimer(signal.ITIMER_REAL, GRACE, AGAIN)
        stop.request(number)

    with _noticed_by_compiled_code():
        for number in caught:
            signal.signal(number, request)
        try:
            yield stop
        except Interrupted as error:
            as_before()
            signal.raise_signal(error.number)
            raise
        finally:
            as_before()


@contextmanager
def _noticed_by_compiled_code() -> Iterator[None]:
    """Let a thread note a signal in ``received`` at once.

    Python's handlers run on the main thread alone, and not before it returns from compiled code.
    """
    read, write = os.pipe()
    os.set_blocking(write, False)

    def watch() -> None:
        while number := os.read(read, 1):
            if number[0] in SIGNALS:
                received[0] = number[0]

    thread = Thread(target=watch, name="signals", daemon=True)
    thread.start()
    before = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(write)
        thread.join()
        os.close(read)
        received[0] = 0


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Let a signal end the program in one line, with status 128 + its number.

    What is open is closed on the way; what does not end within the grace time, or before a second
    signal, is left as it is. An import that was broken off may raise anything.
    """
    ended_by = 0

    def end(number: int, _frame: Any) -> None:
        nonlocal ended_by
        if ended_by:
            leave()
        ended_by = number
        signal.signal(signal.SIGALRM, leave)
        signal.setitimer(signal.ITIMER_REAL, GRACE)
        sys.unraisablehook = lambda _: None  # where a callback was interrupted
        raise Interrupted(number)

    def leave(*_: Any) -> NoReturn:
        _say_so()
        os._exit(128 + ended_by)

    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, end)
    try:
        yield
    except BaseException:
        if not ended_by:
            raise
    if ended_by:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        _say_so()
        sys.exit(128 + ended_by)


def _say_so() -> None:
    with suppress(OSError, ValueError):  # the terminal may be closed
        print("mjspace: interrupted", file=sys.stderr, flush=True)
