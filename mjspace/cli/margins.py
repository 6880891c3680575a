"""The command ``mjspace margins``: how much worse a scenario may become before it fails."""

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjspace.errors import InputError, input_error_at
from mjspace.terminal.options import Json, Quiet, Scenario, Set, Traceback, Trust, Workers
from mjspace.terminal.reporting import cause_shown, count_bar

if TYPE_CHECKING:
    from mjspace.campaign.margins import Margin


def margins(
    scenario: Scenario,
    overrides: Set = [],  # noqa: B006
    require: Annotated[
        list[str],
        typer.Option(
            help="'final(truth.attitude_error) < 1 deg from 10 s', instead of the scenario's "
            "checks; repeatable."
        ),
    ] = [],  # noqa: B006
    only: Annotated[
        list[str],
        typer.Option(
            help="delay, lag, gain-up, gain-down, inertia-up, inertia-down, sampling, rate-noise "
            "or attitude-noise; repeatable."
        ),
    ] = [],  # noqa: B006
    tolerance: Annotated[float, typer.Option(help="Of a margin, relative.")] = 0.05,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Picture of all flights: x.png.")
    ] = None,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    traceback: Traceback = False,
) -> None:
    """How much delay, gain error, inertia error, sampling time and noise does the law survive?"""
    from mjspace.campaign.margins import Question, find
    from mjspace.campaign.perturbations import KINDS

    if not 0.0 < tolerance < 1.0:
        raise InputError(f"--tolerance {tolerance:g}: should be between 0 and 1")
    if output is not None and output.suffix != ".png":
        raise InputError(f"--output {output}: end it in .png")
    if output is not None and not output.absolute().parent.is_dir():
        raise InputError(f"--output {output}: there is no folder {output.parent}")
    what = Question(scenario, tuple(overrides), tuple(require), tolerance, trust)
    with cause_shown(traceback), count_bar(len(only or KINDS), "flying") as told:
        found = find(what, only, processes=workers, told=told)
    if output is not None:
        from mjspace.plotting.margins import Row, plot

        rows = [
            Row(m.name, m.unit, [t.value for t in m.trials], [t.survived for t in m.trials])
            for m in found
        ]
        with input_error_at("--output"):
            plot(rows, scenario, output)
    if as_json:
        print(json.dumps([_data(margin) for margin in found], indent=2))
    else:
        _show(found)
        if output is not None:
            print(output)


def _data(margin: "Margin") -> dict[str, object]:
    """Return a margin as ``--json`` prints it."""
    failed = margin.failed
    return {
        "perturbation": margin.key,
        "unit": margin.unit,
        "survived": margin.survived,
        "failed": None if failed is None else failed.value,
        "why": "" if failed is None else failed.why,
        "trials": [dataclasses.asdict(trial) for trial in margin.trials],
    }


def _show(found: "list[Margin]") -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from mjspace.errors import printable

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("perturbation", no_wrap=True)
    table.add_column("survived", justify="right", no_wrap=True)
    table.add_column("failed", justify="right", no_wrap=True)
    table.add_column("flights", justify="right")
    table.add_column("what fails")
    for margin in found:
        failed, unit = margin.failed, f" {margin.unit}" if margin.unit else ""
        well = "-" if margin.survived is None else f"{margin.survived:.4g}{unit}"
        badly = "-" if failed is None else f"{failed.value:.4g}{unit}"
        why = "" if failed is None else escape(printable(failed.why))
        table.add_row(margin.name, well, badly, str(len(margin.trials)), why)
    Console(highlight=False).print(table)
