"""The command ``mjspace report``: a log, several, or a campaign as one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import input_error_at
from mjspace.terminal.reporting import open_log, progress_bar


def report(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="MCAP logs to compare."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="An HTML file.")],
    signals: Annotated[
        list[str],
        typer.Option("--signal", help="Plot this signal, as truth.rate[0]; repeatable."),
    ] = [],  # noqa: B006
    video: Annotated[
        bool, typer.Option("--video", help="Also the video of each log, if it is small.")
    ] = False,
) -> None:
    """Write a report of a log, or a comparison of several, that opens without a network."""
    from mjspace.runner.flight_report import write

    opened = [open_log(log) for log in logs]
    end = max(log.end for log in opened)
    with progress_bar(end, "rendering") as progress, input_error_at("report"):
        write(opened, output, signals=signals, video=video, progress=progress)
    print(output)
