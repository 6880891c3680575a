"""One thread that carries out calls in their order, a few behind whoever makes them."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class Background:
    """A thread of its own for calls whose effect nobody needs at once.

    After a call that raised, none is carried out any more, and everything here raises the same.
    """

    def __init__(self, name: str, ahead: int) -> None:
        """Start the thread ``name``, which may be ``ahead`` calls behind."""
        self._ahead = ahead
        self._thread = ThreadPoolExecutor(1, thread_name_prefix=name)
        self._due: deque[Future[None]] = deque()
        self._failure: BaseException | None = None

    def call(self, function: Callable[..., object], *arguments: Any) -> None:
        """Have ``function(*arguments)`` carried out; wait while ``ahead`` calls are not done."""
        self._catch_up(self._ahead - 1)
        self._due.append(self._thread.submit(self._carry_out, function, arguments))

    def wait(self) -> None:
        """Wait until every call has been carried out."""
        self._catch_up(0)

    def close(self) -> None:
        """Wait until every call has been carried out, and end the thread."""
        try:
            self.wait()
        finally:
            self._thread.shutdown()

    def _catch_up(self, behind: int) -> None:
        while self._due and (self._due[0].done() or len(self._due) > behind):
            self._due.popleft().result()
        if self._failure is not None:
            raise self._failure

    def _carry_out(self, function: Callable[..., object], arguments: tuple[Any, ...]) -> None:
        if self._failure is None:
            try:
                function(*arguments)
            except BaseException as failure:
                self._failure = failure
