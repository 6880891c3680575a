"""What the commands share: errors in one line and progress."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjspace import compiling
from mjspace.errors import shortened

if TYPE_CHECKING:
    from mjspace.log.reader import Log

silent: ContextVar[bool] = ContextVar("silent", default=False)
"""Whether no progress is shown: another program reads what is printed, or nobody does."""
DELAY = 1.0
"""What is done within this time [s] shows no bar."""


def open_log(path: Path) -> "Log":
    """Return the log at ``path``; InputError when there is none, or nothing in it."""
    from mjspace.errors import input_error_at
    from mjspace.log.reader import Log

    with input_error_at("log"):
        log = Log(path)
        log.require_periods()
    return log


@contextmanager
def progress_bar(
    total: float, doing: str, count: str = "{n:.1f}/{total:.1f} s "
) -> Iterator[Callable[[float], None]]:
    """Yield a function to call with the progress so far, of ``total``.

    A bar is drawn after a second, where the output is a terminal. A terminal that is closed
    draws none, and stops nothing.
    """
    with _bar(total, doing, count + "[{elapsed}<{remaining}]") as bar:

        def update(reached: float) -> None:
            with suppress(OSError):
                bar.update(reached - bar.n)

        yield update


@contextmanager
def flight_bar(duration: float) -> Iterator[Callable[[float, str], None]]:
    """Yield a function to call with the simulated time reached [s] and how the vehicle does.

    The bar is that of ``progress_bar``, with the simulated seconds per second of this computer.
    """
    with _bar(duration, "flying", "{n:.4g}/{total:.4g} s{postfix} [{remaining} left]") as bar:

        def update(reached: float, figures: str) -> None:
            if bar.disable:
                return
            with suppress(OSError):
                so_far = bar.format_dict
                rate = so_far["rate"] or reached / max(so_far["elapsed"], 1e-3)
                bar.set_postfix_str(f"{rate:.3g} x real time, {figures}", refresh=False)
                bar.update(reached - bar.n)

        yield update


@contextmanager
def frame_bar() -> Iterator[Callable[[int, int], None]]:
    """Yield a function to call with how many frames are drawn, of how many in all.

    As soon as a second tells how fast that goes, a line says how long it takes, under which there
    is a bar.
    """
    with _bar(None, "drawing", "{n}/{total} frames [{remaining} left]") as bar:

        def update(drawn: int, count: int) -> None:
            if bar.disable:
                return
            with suppress(OSError):
                if bar.total != count or drawn < bar.n:  # another video
                    bar.reset(count)
                    told.clear()
                spent = bar.format_dict["elapsed"]
                if not told and drawn > 1 and spent > 1.0:
                    told.append(count)
                    whole = count / drawn * spent
                    bar.write(f"drawing {count} frames, about {whole:.0f} s", file=sys.stderr)
                bar.update(drawn - bar.n)

        told: list[int] = []
        yield update


@contextmanager
def compile_bar(what: str, functions: int) -> Iterator[Callable[[int], None]]:
    """Say that ``what`` is compiled, with a bar of ``functions``: a ``compiling.Watch``."""
    with _bar(
        functions, "compiling", "{n}/{total} functions [{remaining} left]", at_once=True
    ) as bar:
        bar.write(f"mjspace: {compiling.telling(what)}", file=sys.stderr)

        def update(done: int) -> None:
            with suppress(OSError):
                bar.update(done - bar.n)

        yield update


@contextmanager
def count_bar(total: int, doing: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function to call with how many of ``total`` are done, and have failed, so far.

    The bar is that of ``progress_bar``, with the rate of what this process does.
    """
    with _bar(total, doing, "{n}/{total} {rate_fmt}{postfix} [{remaining}]") as bar:

        def update(done: int, failed: int) -> None:
            with suppress(OSError):
                if not bar.n:
                    bar.initial = done  # what is there already counts for no rate
                bar.set_postfix_str(f"{failed} failed", refresh=False)
                bar.update(done - bar.n)

        yield update


@contextmanager
def _bar(total: float | None, doing: str, figures: str, *, at_once: bool = False) -> Iterator[Any]:
    """Yield a bar with the ``figures`` beside it."""
    from tqdm import tqdm

    layout = "{desc} {percentage:3.0f}% |{bar}| " + figures
    bar = tqdm(
        total=total,
        desc=doing,
        delay=0.0 if at_once else DELAY,
        disable=silent.get() or None,  # None: where the output is no terminal
        leave=False,
        dynamic_ncols=True,
        bar_format=layout,
        unit="",
    )
    try:
        yield bar
    finally:
        with suppress(OSError):
            bar.close()


@contextmanager
def cause_shown(requested: bool) -> Iterator[None]:
    """Print the traceback of an error's cause, if ``requested``, before the error is re-raised."""
    try:
        yield
    except Exception as error:
        if requested:
            print_cause(error)
        raise


def print_cause(error: Exception) -> None:
    """Print the traceback of what caused ``error``, of the error itself where nothing did."""
    from traceback import print_exception

    print_exception(error.__cause__ or error)


@contextmanager
def report_errors() -> Iterator[None]:
    """Turn an error that the user can correct into one line and an exit status.

    Any other exception is a fault of mjspace and is re-raised."""
    try:
        yield
    except Exception as error:
        status = _status(error)
        if status is None:
            raise
        line = compiling.nowhere_to_keep(error) or shortened(str(error), 1500)
        print(f"mjspace: {line}", file=sys.stderr)
        sys.exit(status)


def _status(error: Exception) -> int | None:
    from mjspace.errors import FlightError, InputError, NoRendererError

    if isinstance(error, InputError):
        return 2
    if isinstance(error, FlightError | NoRendererError | OSError):
        return 1
    if compiling.nowhere_to_keep(error):
        return 1
    return None
