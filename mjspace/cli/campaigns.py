"""The command ``mjspace campaign``: a scenario flown many times, and how often it works."""

import dataclasses
import json
import sys
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjspace.errors import InputError, printable
from mjspace.terminal.options import Force, Json, Quiet, Scenario, Set, Traceback, Trust, Workers
from mjspace.terminal.reporting import cause_shown, count_bar, progress_bar

if TYPE_CHECKING:
    from mjspace.campaign.members import Campaign


class Keep(StrEnum):
    """Whose logs are kept."""

    failures = "failures"
    all = "all"
    none = "none"


def campaign(
    scenario: Scenario,
    count: Annotated[int, typer.Option("--n", help="Members: flights of the campaign.")] = 100,
    overrides: Set = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(help="Seed of every draw and sensor.")] = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out",
            help="Folder of the results, or URL as s3://bucket/folder, where the same command goes "
            "on; runs/<scenario>/campaign-seed-<seed> when left out.",
        ),
    ] = None,
    keep: Annotated[Keep, typer.Option(help="Whose logs are kept.")] = Keep.failures,
    gate: Annotated[
        str, typer.Option(help="'success >= 0.99 @ 0.95': rate and confidence; exit status 1 else.")
    ] = "",
    member: Annotated[
        int | None, typer.Option(help="Fly this member alone, into a log, and judge it.")
    ] = None,
    workers: Workers = None,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Fly on the Dask cluster of this scheduler, tcp://host:8786."
        ),
    ] = None,
    report_it: Annotated[
        bool, typer.Option("--report", help="Also write a report of the answer: report.html.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    traceback: Traceback = False,
) -> None:
    """Fly a scenario many times with its dispersions: how often does it work?"""
    from mjspace.campaign import campaign as flown
    from mjspace.campaign import report, statistics
    from mjspace.campaign.distributed import cluster
    from mjspace.campaign.members import Campaign
    from mjspace.campaign.places import is_remote, place

    if count < 1:
        raise InputError(f"--n {count}: should be 1 or more")
    if force and member is None:
        raise InputError("--force: replaces the log of a --member; a campaign replaces nothing")
    if dask and (workers or member is not None):
        raise InputError("--dask: goes without --workers and --member, which fly on this machine")
    required = statistics.gate(gate) if gate else None
    what = Campaign(scenario, tuple(overrides), count, seed, trust)
    folder = flown.folder_of(what, place(out) if out else None)
    if report_it and is_remote(folder):
        raise InputError("--report: is written to a folder: give one by --out")
    if member is not None:
        if report_it:
            raise InputError("--report: is of a campaign; 'mjspace report' makes that of a log")
        _one(what, folder, member, force, as_json, traceback)
    with cause_shown(traceback), ExitStack() as stack:
        on = stack.enter_context(cluster(dask)) if dask else None
        told = stack.enter_context(count_bar(count, "flying"))
        flight = flown.fly(what, folder, keep=keep.value, processes=workers, dask=on, told=told)
    found = report.answer(flight.store, required)
    pictures = {"report": folder / "report.html"} if report_it else {}
    if report_it:
        from mjspace.campaign import html_report

        html_report.write(flight.store, found, pictures["report"])
    if as_json:
        shown = {name: str(path) for name, path in pictures.items()}
        print(json.dumps(report.data(found) | shown, indent=2))
    else:
        report.show(found)
        print(f"table  {folder / 'members'}")
        for name, path in pictures.items():
            print(f"{name:6} {path}")
    if flight.signal:
        done = f"{found.rate.members} of {count} flown; the same command goes on"
        print(f"mjspace: interrupted: {done}", file=sys.stderr)
        raise typer.Exit(128 + flight.signal)
    raise typer.Exit(0 if found.passed else 1)


def _one(
    what: "Campaign", folder: Path, member: int, force: bool, as_json: bool, traceback: bool
) -> None:
    """Fly one member, print its verdict and exit."""
    from mjspace.campaign import campaign as flown
    from mjspace.campaign.members import population
    from mjspace.runner import report

    duration = population(what).scenario.duration
    with cause_shown(traceback), progress_bar(duration, "flying") as progress:
        result = flown.fly_one(what, folder, member, force=force, progress=progress)
    if as_json:
        print(json.dumps(report.result_data(result), indent=2))
    else:
        report.print_result(result)
        print(f"log    {result.path}")
    raise typer.Exit(128 + result.signal if result.signal else not result.passed)


def compare_campaigns(first: Path, second: Path, as_json: bool) -> None:
    """Print what two campaigns on the same draws show."""
    from mjspace.campaign.pairs import compare

    pairs = compare(first, second)
    if as_json:
        derived = {name: getattr(pairs, name) for name in ("members", "difference", "probability")}
        data = dataclasses.asdict(pairs) | derived | {"interval": list(pairs.interval)}
        print(json.dumps(data, indent=2))
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    low, high = pairs.interval
    percent = f"{100.0 * pairs.confidence:g} %"
    console.print(
        f"of {pairs.members} members {pairs.both} succeed in both, {pairs.first} in the first "
        f"alone, {pairs.second} in the second alone, {pairs.neither} in neither"
    )
    console.print(
        f"success rate of the second less the first's: {pairs.difference:+.4g}, {percent} interval "
        f"{low:+.4g} to {high:+.4g}; by chance alone with probability {pairs.probability:.2g}"
    )
    both = ("margin of check", "better", pairs.checks), ("metric", "larger", pairs.metrics)
    for what, word, paired in both:
        if not paired:
            continue
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column(what)
        titles = ("members", f"{word} in the second", "median difference", f"{percent} interval")
        for title in titles:
            table.add_column(title, justify="right")
        for each in paired:
            table.add_row(
                escape(printable(each.name)),
                str(each.members),
                f"{100.0 * each.larger:.3g} %",
                f"{each.difference:+.3g}",
                f"{each.interval[0]:+.3g} to {each.interval[1]:+.3g}",
            )
        console.print(table)
