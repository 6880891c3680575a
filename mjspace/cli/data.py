"""The commands ``convert``, ``layout`` and ``compare``: logs for other tools, and in pairs."""

import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjspace.cli.campaigns import compare_campaigns
from mjspace.errors import InputError, input_error_at, whole_or_none
from mjspace.terminal.options import Json, LogFile, Quiet
from mjspace.terminal.reporting import open_log, progress_bar

if TYPE_CHECKING:
    from mjspace.log.compare import Comparison

Signals = Annotated[
    list[str],
    typer.Option("--signal", help="This signal alone, as truth.rate[0]; repeatable."),
]
Topics = Annotated[
    list[str], typer.Option("--topic", help="All of this topic, as truth; repeatable.")
]
SHOWN = 20
"""Signals of a comparison that a person is shown: those that differ most."""


def convert(
    log: LogFile,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="x.csv, .parquet, .npz, .mat, .rrd or .mcap."),
    ],
    signals: Signals = [],  # noqa: B006
    topics: Topics = [],  # noqa: B006
    rate: Annotated[
        float | None, typer.Option(help="Rows a second; all of the log's when left out.")
    ] = None,
    video: Annotated[
        str | None,
        typer.Option(metavar="CAMERA", help="In x.mcap, also the pictures of this camera: chase."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write a log for other tools: a table, arrays, or for viewers.

    x.rrd is a recording for Rerun; x.mcap a copy of the log with arrows, for Foxglove, Lichtblick
    and Rerun.
    """
    from mjspace.conversion.convert import convert as to_file

    with progress_bar(open_log(log).end, "converting") as progress, input_error_at("convert"):
        to_file(
            log, output, signals=signals, topics=topics, rate=rate, camera=video, progress=progress
        )
    print(output)


def layout(
    log: LogFile,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="A file for Foxglove and Lichtblick: x.json.")
    ],
) -> None:
    """Write the panels of what flew in a log, for import in Foxglove or Lichtblick."""
    from mjspace.log import foxglove_layout
    from mjspace.log.frames import bus_of

    opened = open_log(log)
    if output.suffix != ".json":
        raise InputError(f"layout: output '{output}': end it in .json")
    with input_error_at("layout"), whole_or_none(output) as file:
        video = next(opened.records("/video"), None) is not None
        file.write(foxglove_layout.layout(bus_of(opened), opened.topics, video=video))
    print(output)


def compare(
    first: LogFile,
    second: Annotated[Path, typer.Argument(metavar="OTHER", help="Another MCAP log.")],
    signals: Signals = [],  # noqa: B006
    topics: Topics = [],  # noqa: B006
    tolerance: Annotated[
        float, typer.Option(help="Of each signal, in its SI unit; exit status 1 beyond it.")
    ] = 0.0,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Plot what differs most, one over the other: x.png."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare two logs, signal by signal, at the instants that both have.

    Or two folders of campaigns on the same draws, as of two laws: which members succeed in one
    alone, and by how much the margins differ.
    """
    if first.is_dir() and second.is_dir():
        if signals or topics or tolerance or output is not None:
            raise InputError("compare: of two campaigns, --json is the only option")
        compare_campaigns(first, second, as_json)
        return
    from mjspace.log.compare import compare as of_logs

    if not tolerance >= 0.0:
        raise InputError(f"--tolerance {tolerance:g}: should be a number from 0 on")
    one, two = open_log(first), open_log(second)
    with progress_bar(min(one.end, two.end), "comparing") as progress, input_error_at("compare"):
        found = of_logs(
            one, two, signals=signals, topics=topics, tolerance=tolerance, progress=progress
        )
        if output is not None:
            from mjspace.plotting.overlay import plot

            most = sorted(found.signals, key=lambda each: -each.share)
            plot(one, two, output, [each.name for each in most if each.largest > 0.0])
    if as_json:
        print(json.dumps(_data(found), indent=2))
    else:
        _show(found, tolerance)
        if output is not None:
            print(output)
    sys.exit(1 if found.beyond else 0)


def _data(found: "Comparison") -> dict[str, object]:
    """Return the comparison as ``--json`` prints it: no number where JSON has none."""
    signals = [dataclasses.asdict(each) for each in found.signals]
    for each in signals:
        each.pop("squares")
        for key in ("largest", "rms"):
            if not each[key] < float("inf"):
                each[key] = None
    return {
        "start": found.start,
        "end": found.end,
        "signals": signals,
        "only_first": found.only_first,
        "only_second": found.only_second,
    }


def _show(found: "Comparison", tolerance: float) -> None:
    """Print what differs, most first, and what one log alone has."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    differ = sorted((s for s in found.signals if s.largest > 0.0), key=lambda each: -each.share)
    count = len(found.signals)
    span = f"{found.start:g} to {found.end:g} s"
    if not differ:
        console.print(f"{count} signals are equal, {span}", highlight=False)
    else:
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column("signal", no_wrap=True)
        for title in ("largest", "at [s]", "RMS", "relative", "from [s]"):
            table.add_column(title, justify="right")
        for each in differ[:SHOWN]:
            unit = f" [{each.unit}]" if each.unit else ""
            table.add_row(
                f"{each.name}{unit}".replace("[", r"\["),
                f"{each.largest:.4g}",
                f"{each.at:g}",
                f"{each.rms:.4g}",
                f"{each.share:.2g}",
                "-" if each.beyond is None else f"{each.beyond:g}",
            )
        console.print(table)
        hidden = len(differ) - SHOWN
        more = f", {hidden} more not shown" if hidden > 0 else ""
        console.print(
            f"{len(differ)} of {count} signals differ{more}, {len(found.beyond)} by more than "
            f"{tolerance:g}, {span}",
            highlight=False,
        )
    for which, names in (("first", found.only_first), ("second", found.only_second)):
        if names:
            console.print(f"only in the {which}: {', '.join(names)}", highlight=False, markup=False)
