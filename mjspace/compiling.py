"""What numba compiles at its first use: by one process at a time, and users are told of it."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from contextvars import ContextVar
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

Watch = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
"""Is entered with what is compiled and how many functions that is; then told how many are done."""
_LOOK = 0.1
"""Another process is waited for in steps of this time [s]."""
_PATIENCE = 1.0
"""Of the wait for another process, which takes this long [s] to read code, users are told."""


@contextmanager
def say_so(what: str, _functions: int) -> Iterator[Callable[[int], None]]:
    """Say in one line that ``what`` is compiled."""
    _say(telling(what))
    yield lambda done: None


@contextmanager
def say_nothing(_what: str, _functions: int) -> Iterator[Callable[[int], None]]:
    """Say nothing."""
    yield lambda done: None


def nowhere_to_keep(error: BaseException) -> str:
    """Return what to do where ``error`` is that numba can keep code nowhere; "" for any other."""
    if "no locator available" not in str(error):
        return ""
    return (
        "what is compiled can be kept neither beside mjspace nor in a cache of yours: let the "
        "environment variable NUMBA_CACHE_DIR name a folder that can be written"
    )


def telling(what: str) -> str:
    """Return how users are told that ``what`` is compiled."""
    return f"compiling {what} for this machine, once"


watch: ContextVar[Watch] = ContextVar("watch", default=say_so)
"""How users are told; a process that is started to fly takes over what its parent has."""


@contextmanager
def first_use(file: str, what: str = "", functions: int = 0) -> Iterator[None]:
    """Let one process at a time compile and keep what is declared in the folder of a ``file``.

    numba keeps a loop and the function in it in two files, which name each other by numbers of the
    process that wrote them: of two processes that compile at once, the files of either may remain,
    and whoever reads them jumps to nowhere. Where there are no locks all is as without.

    Where ``what`` is named, which takes long, users are told if it has to be compiled;
    ``functions`` is about how many numba compiles for it, its own among them.
    """
    with _locked(Path(file).parent, what):
        if not what:
            yield
            return
        with ExitStack() as until_done, _called(_progress(what, functions, until_done)):
            yield


def _progress(what: str, functions: int, until_done: ExitStack) -> Callable[[], None]:
    """Return what is to be called as each function is done."""
    tell: list[Callable[[int], None]] = []
    done = 0

    def another() -> None:
        nonlocal done
        done += 1
        if not tell:
            tell.append(until_done.enter_context(watch.get()(what, functions)))
        tell[0](min(done, functions))

    return another


@contextmanager
def _called(another: Callable[[], None]) -> Iterator[None]:
    """Call ``another`` for each function that numba compiles in the block, and does not read."""
    from numba.core import event

    class Lowered(event.Listener):
        def on_start(self, event: Any) -> None:
            pass

        def on_end(self, event: Any) -> None:
            if event.data["name"].startswith("native_lowering"):
                another()

    listener = Lowered()
    event.register("numba:run_pass", listener)
    try:
        yield
    finally:
        event.unregister("numba:run_pass", listener)


@contextmanager
def _locked(folder: Path, what: str) -> Iterator[None]:
    handle = -1
    with suppress(ImportError, OSError):
        import fcntl

        handle = os.open(folder, os.O_RDONLY)
        due = time.monotonic() + _PATIENCE
        while True:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                is_heard = parent_process() is None and watch.get() is not say_nothing
                if what and is_heard and time.monotonic() > due:
                    _say(f"another process compiles {what}, for all: waiting for it")
                    due = float("inf")
                time.sleep(_LOOK)
    try:
        yield
    finally:
        if handle >= 0:
            os.close(handle)


def _say(line: str) -> None:
    print(f"mjspace: {line}", file=sys.stderr)
