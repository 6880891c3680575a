"""The command ``mjspace report``: a log, several, or a campaign as one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import InputError, input_error_at
from mjspace.terminal.options import Quiet
from mjspace.terminal.reporting import frame_bar, open_log


def report(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="MCAP logs, side by side; or a campaign's folder."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="An HTML file.")],
    signals: Annotated[
        list[str],
        typer.Option("--signal", help="Plot this signal, as truth.rate[0]; repeatable."),
    ] = [],  # noqa: B006
    video: Annotated[
        bool, typer.Option("--video", help="Also the video of each log, if it is small.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Write a report of a log, of several side by side, or of a campaign, as one HTML file."""
    from mjspace.campaign.results import DESCRIPTION
    from mjspace.runner.flight_report import write

    if any((path / DESCRIPTION).is_file() for path in logs):
        if len(logs) > 1 or signals or video:
            raise InputError(
                "report: a campaign's folder stands alone, without --signal and --video; "
                "'mjspace compare' compares two"
            )
        campaign(logs[0], output)
        return
    opened = [open_log(log) for log in logs]
    with frame_bar() as progress, input_error_at("report"):
        write(opened, output, signals=signals, video=video, progress=progress)
    print(output)


def campaign(folder: Path, output: Path) -> None:
    """Write the report of the campaign in the folder."""
    from mjspace.campaign import html_report, report
    from mjspace.campaign.results import results_in

    results = results_in(folder)
    with input_error_at("report"):
        html_report.write(results, report.answer(results, None), output)
    print(output)
