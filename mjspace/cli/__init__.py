"""The command line: ``list``, ``info``, ``run``, ``replay``, ``render``, ``plot``, ``validate``.

``campaign`` flies a scenario many times, ``falsify`` searches for a flight that fails, ``margins``
says how much worse it may become, ``tune`` finds gains. ``view`` shows a log, or a scenario in
flight, in a browser; ``report`` makes an HTML page of logs or a campaign. ``convert`` and
``compare`` are for logs, ``law-header``, ``serve-law`` and ``linearize`` for flight software;
``recover`` saves what is whole of a damaged log. Exit status: 0 every check came out as the
scenario expects, 1 flown but one did not (or a replay or a comparison differed, or the flight ended
early), 2 bad input. Modules are imported when a command needs them: ``--help`` answers at once.
"""

import sys
import warnings
from typing import Annotated

import typer

from mjspace import __version__, compiling
from mjspace.cli import (
    campaigns,
    data,
    flight_software,
    flights,
    margins,
    models,
    pictures,
    recovery,
    reports,
    scenarios,
    searches,
    validation,
    views,
)
from mjspace.errors import print_warning
from mjspace.rendering import graphics
from mjspace.terminal.reporting import compile_bar, report_errors

app = typer.Typer(
    invoke_without_command=True,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help, in half the time
)


@app.callback()
def _every_command(
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Fly control laws on multibody spacecraft in MuJoCo."""
    if version:
        print(f"mjspace {__version__}")
        raise typer.Exit


app.command("list")(scenarios.list_scenarios)
app.command()(scenarios.info)
app.command()(models.inspect)
app.command()(models.new)
app.command()(flights.run)
app.command()(flights.replay)
app.command()(campaigns.campaign)
app.command()(searches.falsify)
app.command()(margins.margins)
app.command()(searches.tune)
app.command()(pictures.render)
app.command()(pictures.plot)
app.command()(views.view)
app.command()(reports.report)
app.command()(data.convert)
app.command()(data.layout)
app.command()(data.compare)
app.command()(flight_software.law_header)
app.command()(flight_software.serve_law)
app.command()(flight_software.linearize)
app.command()(recovery.recover)
app.command()(validation.validate)


def main() -> None:
    """Run the command line; the entry point."""
    warnings.showwarning = print_warning
    compiling.watch.set(compile_bar)
    for stream in (sys.stdout, sys.stderr):  # whatever the terminal's encoding
        stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    with report_errors():
        graphics.check()
        app()
