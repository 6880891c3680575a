"""Options that several commands have."""

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Annotated

import typer

from mjspace import compiling
from mjspace.terminal.reporting import silent


def _obey_quiet(context: typer.Context, quiet: bool) -> bool:
    """Let nothing but errors and warnings appear, or with ``--json``, which is read first, that."""
    as_json = context.params.get("as_json", False)
    silent.set(quiet or as_json)
    if quiet or as_json:
        compiling.watch.set(compiling.say_nothing)
    if quiet and not as_json:
        context.with_resource(redirect_stdout(StringIO()))
    return quiet


def _names(incomplete: str) -> list[str]:
    """Return the scenarios whose names begin so, for a shell's completion."""
    from mjspace.scenario.files import scenario_names

    return [name for name in scenario_names() if name.startswith(incomplete)]


Scenario = Annotated[
    str,
    typer.Argument(metavar="SCENARIO", help="A name or a TOML file.", autocompletion=_names),
]
Set = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Override a key of the scenario; repeatable."),
]
Json = Annotated[
    bool, typer.Option("--json", is_eager=True, help="Answer in JSON, for another program.")
]
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", callback=_obey_quiet, help="Print errors and warnings alone, or the JSON."
    ),
]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help="The MCAP log of a flight.")]
Out = Annotated[
    Path | None,
    typer.Option("--out", help="Folder to write; runs/<scenario>/<UTC stamp> when left out."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace a log that is there already.")]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes that fly; one a core when left out.")
]
Plot = Annotated[bool, typer.Option("--plot", help="Also plot the log: flight.png.")]
Report = Annotated[
    bool, typer.Option("--report", help="Also write a report of the log: flight.html.")
]
Traceback = Annotated[
    bool, typer.Option("--traceback", help="Show what your own code raised in full.")
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Let it run code out of the log, from any installed module or another folder.",
    ),
]
Video = Annotated[bool, typer.Option("--video", help="Also render the log: flight.mp4.")]
