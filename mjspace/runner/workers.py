"""Processes that fly and draw, one a core, forked from one that has imported everything."""

import os
import signal
import warnings
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import islice
from multiprocessing import (
    forkserver,
    get_all_start_methods,
    get_context,
    parent_process,
    resource_tracker,
)
from multiprocessing.connection import Connection
from threading import Event, Thread
from typing import Any, TypeVar

from mjspace import compiling, interrupts
from mjspace.errors import FlightError, print_warning
from mjspace.interrupts import Interrupted, Stop

# Callbacks are global, so that every flight needs a process; threads do not survive a plain fork.
_METHOD = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
_CONTEXT = get_context(_METHOD)
_DIES_WITH_PARENT = "mjspace.runner.dies_with_parent"  # what imports it does
_LOOK = 0.2
"""A request to stop is looked for so often [s]."""
_AHEAD = 1000
"""Calls that a pool holds at most: each time that it is waited for takes a time for each."""
_stopped, _idle = Event(), Event()
"""Of a worker: it begins nothing any more; it is not making a call."""
_Result = TypeVar("_Result")


def warm_up(module: str) -> None:
    """Let the workers' parent begin to import ``module``, which takes seconds."""
    if _METHOD == "forkserver":
        _CONTEXT.set_forkserver_preload([_DIES_WITH_PARENT, module])
        resource_tracker.ensure_running()  # which would unblock the signals
        # A terminal sends its signals to all: what becomes of the workers, this process decides.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGHUP))
        try:
            forkserver.ensure_running()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def each(
    calls: Sequence[tuple[Callable[..., _Result], Any]],
    stop: Stop | None = None,
    processes: int | None = None,
) -> Generator[tuple[int, _Result], None, None]:
    """Make ``calls``, functions with their argument; yield (index, result) as they are done.

    There are as many ``processes`` as cores, where it is left out.

    Once ``stop`` is requested no other call begins, and those under way get SIGTERM: flights end
    with their log whole, and are yielded too. They get it as well when this generator is closed,
    or the process ends, in whatever way.

    Raises:
        FlightError: one of the processes was killed.
    """
    cores = min(processes or os.cpu_count() or 1, len(calls))
    with team(calls[0][0].__module__, stop, cores) as make:
        yield from make(calls)


@contextmanager
def team(
    module: str, stop: Stop | None = None, processes: int | None = None
) -> Generator[Callable[..., Generator[tuple[int, Any], None, None]], None, None]:
    """Yield a function that makes calls as ``each`` does, by the same processes each time.

    ``module`` has the functions that are called.
    """
    stop = stop or Stop()
    warm_up(module)
    theirs, ours = _CONTEXT.Pipe(duplex=False)
    cores = processes or os.cpu_count() or 1
    arguments = (theirs, compiling.watch.get())
    with ours, ProcessPoolExecutor(cores, _CONTEXT, _begin, arguments) as pool:
        try:
            yield partial(_made, pool, ours, stop)
        finally:
            ours.close()
            pool.shutdown(wait=False, cancel_futures=True)


def _made(
    pool: ProcessPoolExecutor,
    ours: Connection,
    stop: Stop,
    calls: Sequence[tuple[Callable[..., _Result], Any]],
) -> Generator[tuple[int, _Result], None, None]:
    """Make calls in the ``pool``, which ends when ``ours`` is closed."""
    due: dict[Future[Any], int] = {}
    left = enumerate(calls)

    def submit(count: int) -> None:
        for index, (call, argument) in islice(left, count):
            due[pool.submit(_make, call, argument)] = index

    try:
        with stop.breakable(at_once=True):  # the first waits until everything is imported
            submit(_AHEAD)
        while due:
            done, _ = wait(due, timeout=_LOOK, return_when=FIRST_COMPLETED)
            for future in done:
                index = due.pop(future)
                for result in future.result():
                    yield index, result
            if stop() and not ours.closed:
                ours.close()
                for future in [future for future in due if future.cancel()]:
                    del due[future]
            if not stop():
                submit(len(done))
    except BrokenProcessPool as error:
        if not stop():
            raise FlightError(
                "a process that flies was killed, as the system does for lack of memory"
            ) from error


def _make(call: Callable[..., _Result], argument: Any) -> list[_Result]:
    """Return the result in a list, which is empty if the worker is stopped before there is one."""
    _idle.clear()
    try:
        signal.signal(signal.SIGTERM, _break_off)
        return [] if _stopped.is_set() else [call(argument)]
    except Interrupted:
        return []
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        _idle.set()


def _break_off(number: int, _frame: Any) -> None:
    raise Interrupted(number)


def _begin(parents: Connection, watch: compiling.Watch) -> None:
    """Begin as a worker, which ends when the ``parents`` end of the pipe is closed."""
    from mjspace.simulation import mujoco_warnings  # here: this module must not cost what it saves

    mujoco_warnings.silence()
    warnings.showwarning = print_warning
    compiling.watch.set(watch)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _idle.set()
    Thread(target=_end_with, args=(parents,), daemon=True).start()


def _end_with(parents: Connection) -> None:
    parents.poll(None)
    _stopped.set()
    if not interrupts.received[0]:  # a flight that is ending already is left to it
        os.kill(os.getpid(), signal.SIGTERM)
    parent = parent_process()
    assert parent is not None
    while parent.is_alive() and not _idle.wait(_LOOK):
        pass
    _idle.wait(2.0 * interrupts.GRACE)
    parent.join(2.0 * interrupts.GRACE)  # a parent that goes on lets an idle worker end
    os._exit(1)
