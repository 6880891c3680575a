"""Processes that fly and draw, one a core, forked from one that has imported everything."""

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import forkserver, get_all_start_methods, get_context
from typing import Any, TypeVar

from mjspace.errors import print_warning

# Callbacks are global, so that every flight needs a process; threads do not survive a plain fork.
_METHOD = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
_CONTEXT = get_context(_METHOD)
_Result = TypeVar("_Result")


def warm_up(module: str) -> None:
    """Let the workers' parent begin to import ``module``, which takes seconds."""
    if _METHOD == "forkserver":
        _CONTEXT.set_forkserver_preload([module])
        forkserver.ensure_running()


def each(
    calls: Sequence[tuple[Callable[..., _Result], Any]],
) -> Iterator[tuple[int, _Result]]:
    """Make ``calls``, functions with their argument; yield (index, result) as they are done."""
    warm_up(calls[0][0].__module__)
    workers = min(os.cpu_count() or 1, len(calls))
    with ProcessPoolExecutor(workers, _CONTEXT, initializer=_quiet) as pool:
        futures = {
            pool.submit(call, argument): index for index, (call, argument) in enumerate(calls)
        }
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _quiet() -> None:
    from mjspace.simulation import mujoco_warnings  # here: this module must not cost what it saves

    mujoco_warnings.silence()
    warnings.showwarning = print_warning
