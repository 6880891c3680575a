"""The commands ``mjspace falsify`` and ``mjspace tune``: flights that fail, gains that fly well."""

import dataclasses
import json
from pathlib import Path
from typing import Annotated, Any

import typer

from mjspace.errors import InputError, printable
from mjspace.terminal.options import Json, Quiet, Scenario, Set, Traceback, Trust, Workers
from mjspace.terminal.reporting import cause_shown, count_bar


def falsify(
    scenario: Scenario,
    count: Annotated[int, typer.Option("--n", help="Flights at most.")] = 200,
    overrides: Set = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(help="Seed of the search and every sensor.")] = None,
    go_on: Annotated[
        bool,
        typer.Option("--go-on", help="Search on for a worse flight after one has failed."),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Folder of the counterexample; runs/<scenario>/counterexample-seed-<seed> when "
            "left out.",
        ),
    ] = None,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    traceback: Traceback = False,
) -> None:
    """Search a scenario's dispersions for a flight that fails, and make it minimal."""
    from mjspace.campaign.falsify import falsify as search
    from mjspace.campaign.falsify import nominal_draws, write
    from mjspace.campaign.members import Campaign, population
    from mjspace.runner.output import LOG, refuse_existing
    from mjspace.runner.run import output_folder

    if count < 1:
        raise InputError(f"--n {count}: should be 1 or more")
    members = population(Campaign(scenario, tuple(overrides), count, seed, trust))
    last = f"counterexample-seed-{members.scenario.seed}"
    folder = output_folder(out, members.scenario.name, last)
    refuse_existing(folder / LOG, force=False)
    with cause_shown(traceback), count_bar(count, "flying") as told:
        found = search(members, go_on=go_on, processes=workers, told=told)
    result = None if found.minimal is None else write(members, found.minimal, folder)
    keys = [dispersion.name for dispersion in members.dispersions]
    minimal = [None] * len(keys) if found.minimal is None else found.minimal.draws
    rows = list(zip(keys, nominal_draws(members), found.worst.draws, minimal, strict=True))
    if as_json:
        print(json.dumps(_data(found, rows, None if result is None else folder), indent=2))
    else:
        _show(found, rows, None if result is None else folder)
    if found.signal:
        raise typer.Exit(128 + found.signal)
    raise typer.Exit(0 if found.minimal is None else 1)


def _data(found: Any, rows: list[tuple[Any, ...]], folder: Path | None) -> dict[str, Any]:
    """Return what was found as ``--json`` prints it."""
    kinds = ("nominal", "worst", "minimal")
    return {
        "failed": found.minimal is not None,
        "flights": found.flights,
        "first_failure": found.before or None,
        "least_margin": found.worst.margin if found.worst.margin > -float("inf") else None,
        "why": found.worst.why,
        "draws": {key: dict(zip(kinds, values, strict=True)) for key, *values in rows},
        "out": None if folder is None else str(folder),
    }


def _show(found: Any, rows: list[tuple[Any, ...]], folder: Path | None) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    if found.minimal is None:
        console.print(
            f"none of {found.flights} flights fails; least relative margin "
            f"{found.worst.margin:.3g}: {escape(printable(found.worst.why))}"
        )
    else:
        console.print(f"flight {found.before} of {found.flights} is the first that fails")
        console.print(escape(printable(found.minimal.why)))
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("dispersion", no_wrap=True)
    for title in ("nominal", "worst", *([] if found.minimal is None else ["minimal"])):
        table.add_column(title, justify="right")
    for key, own, worst, minimal in rows:
        shown = [own, worst, *([] if found.minimal is None else [minimal])]
        cells = [_number(value) for value in shown]
        if found.minimal is not None and minimal == own:
            cells[-1] = "nominal"
        table.add_row(escape(printable(key)), *cells)
    console.print(table)
    if folder is not None:
        console.print(f"scenario and log in {folder}", markup=False)


def _number(value: Any) -> str:
    values = value if isinstance(value, list) else [value]
    return " ".join(f"{each:.4g}" for each in values)


def tune(
    scenario: Scenario,
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=LOW..HIGH",
            help="A number to be tuned, law.rate_gain=1..100; repeatable.",
        ),
    ],
    minimized: Annotated[
        str,
        typer.Option(
            "--minimize",
            help="'rms(truth.attitude_error)', or a metric's name: its mean over draws.",
        ),
    ],
    require: Annotated[
        list[str],
        typer.Option(help="'max(command.torque) < 1 N m': must hold in each flight; repeatable."),
    ] = [],  # noqa: B006
    count: Annotated[int, typer.Option("--n", help="Trials, of which each flies all draws.")] = 60,
    draws: Annotated[
        int, typer.Option(min=1, help="Draws of the dispersions that each trial flies.")
    ] = 4,
    fresh: Annotated[
        int, typer.Option(min=1, help="Other draws that before and after are compared on.")
    ] = 20,
    overrides: Set = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(help="Seed of the search and every draw.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder of the tuned scenario; runs/<scenario>/tuned else."),
    ] = None,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    traceback: Traceback = False,
) -> None:
    """Tune gains on several draws of the dispersions, and compare on others."""
    from mjspace.campaign.members import Campaign, population
    from mjspace.campaign.tune import Goal, varied, write
    from mjspace.campaign.tune import tune as search
    from mjspace.campaign.written import SCENARIO
    from mjspace.runner.run import output_folder

    if count < 1:
        raise InputError(f"--n {count}: should be 1 or more")
    chosen, goal = [varied(text) for text in vary], Goal(minimized, tuple(require))
    what = Campaign(scenario, tuple(overrides), count, seed, trust)
    tuned = population(what, alike=True).scenario
    goal.checks(tuned.metrics)  # refuses what is none, before anything flies
    folder = output_folder(out, tuned.name, "tuned")
    if (folder / SCENARIO).exists():
        raise InputError(f"{folder / SCENARIO}: is there already: give another folder by --out")
    with cause_shown(traceback), count_bar(count * draws, "flying") as told:
        found = search(what, chosen, goal, draws=draws, fresh=fresh, processes=workers, told=told)
    path = write(what, found.values, folder)
    if as_json:
        print(json.dumps({**dataclasses.asdict(found), "out": str(path)}, indent=2))
    else:
        _show_tuned(found, minimized, path)


def _show_tuned(found: Any, minimized: str, path: Path) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column(f"after {found.flights} flights", no_wrap=True)
    table.add_column("before", justify="right")
    table.add_column("after", justify="right")
    for key, value in found.values.items():
        own = found.own[key]
        table.add_row(escape(printable(key)), "-" if own is None else _number(own), _number(value))
    what = escape(printable(minimized))
    titles = {"mean": f"mean of {what}", "largest": f"largest {what}", "missed": "draws that fail"}
    for name, title in titles.items():
        table.add_row(title, *(_number(getattr(e, name)) for e in (found.before, found.after)))
    console.print(table)
    console.print(f"better in {found.better} draws that it was not tuned on; scenario in {path}")
