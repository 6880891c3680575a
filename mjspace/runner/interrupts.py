"""Ctrl-C and SIGTERM as a request that the flight polls, so that its log ends complete."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import current_thread, main_thread
from typing import Any


@dataclass
class Stop:
    """Whether the flight is to stop, and why."""

    signal: int = 0

    def __call__(self) -> bool:
        """Return whether a signal has been received."""
        return self.signal != 0


@contextmanager
def on_signals() -> Iterator[Stop]:
    """Turn SIGINT and SIGTERM into a request for as long as the context lasts.

    A second one is obeyed at once, as before. Outside the main thread nothing is caught.
    """
    stop = Stop()
    if current_thread() is not main_thread():
        yield stop
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def request(number: int, _frame: Any) -> None:
        stop.signal = number
        for each, handler in before.items():
            signal.signal(each, handler)

    for number in before:
        signal.signal(number, request)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
