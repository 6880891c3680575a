"""What the commands share: errors in one line, progress, warnings, and the end of a flight."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from mjspace.log.reader import Log
    from mjspace.runner.run import Result


def finish(result: "Result", plot_it: bool, video: bool, as_json: bool, traceback: bool) -> None:
    """Print the verdict, make the pictures that were asked for, and exit with the status."""
    from mjspace.runner import report

    if traceback and result.error is not None:
        _print_cause(result.error)

    pictures = {}
    if not as_json:
        report.print_result(result)
        print(f"log    {result.path}")
    if plot_it:
        from mjspace.plotting.page import plot as to_plot

        pictures["plot"] = result.path.with_suffix(".png")
        to_plot(result.path, pictures["plot"])
    if video:
        from mjspace.rendering.render import render as to_video

        pictures["video"] = result.path.with_suffix(".mp4")
        with progress_bar(result.log.end, "rendering") as progress:
            to_video(result.path, pictures["video"], progress=progress)
    if as_json:
        shown = {name: str(path) for name, path in pictures.items()}
        print(json.dumps(report.result_data(result) | shown, indent=2))
    else:
        for name, path in pictures.items():
            print(f"{name:6} {path}")
    if result.signal:
        raise typer.Exit(128 + result.signal)
    raise typer.Exit(0 if result.passed else 1)


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
    """Give a function to tell how far it is; a bar is drawn on a terminal after two seconds."""
    from tqdm import tqdm

    layout = "{desc} {percentage:3.0f}% |{bar}| " + count + "[{elapsed}<{remaining}]"
    with tqdm(
        total=total, desc=doing, delay=2, disable=None, leave=False, bar_format=layout
    ) as bar:
        yield lambda reached: bar.update(reached - bar.n) and None


@contextmanager
def in_full(traceback: bool) -> Iterator[None]:
    """Print what caused an error, with its traceback, before the error goes on."""
    try:
        yield
    except Exception as error:
        if traceback:
            _print_cause(error)
        raise


def _print_cause(error: Exception) -> None:
    from traceback import print_exception

    print_exception(error.__cause__ or error)


@contextmanager
def report_errors() -> Iterator[None]:
    """Turn what a user can mend into one line and an exit status; anything else is a bug."""
    try:
        yield
    except Exception as error:
        status = _status(error)
        if status is None:
            raise
        print(f"mjspace: {error}", file=sys.stderr)
        sys.exit(status)


def _status(error: Exception) -> int | None:
    from mjspace.errors import FlightError, InputError, NoRendererError

    if isinstance(error, InputError):
        return 2
    if isinstance(error, FlightError | NoRendererError | OSError):
        return 1
    return None
