"""The command ``mjspace validate``."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace import workers
from mjspace.errors import InputError, blamed_on
from mjspace.options import Json
from mjspace.terminal import progress_bar


def validate(
    only: Annotated[
        list[str], typer.Option("--only", metavar="NAME", help="This benchmark; repeatable.")
    ] = [],  # noqa: B006
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Each benchmark once, short; no faults, orders and figures."),
    ] = False,
    model: Annotated[
        Path | None, typer.Option(help="Examine this MJCF or MJB model instead.")
    ] = None,
    basilisk: Annotated[
        str, typer.Option(metavar="PYTHON", help="Also compare with the bsk of this interpreter.")
    ] = "",
    out: Annotated[
        Path | None, typer.Option(help="Folder to write; runs/validate/<UTC stamp> when left out.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure MuJoCo's physics against closed forms; or the physics of a model of yours."""
    if model is not None:
        if only or quick or basilisk or out:
            raise InputError("--model: a passport is of one model: leave the other options out")
        from mjspace.validation import passport, table

        with blamed_on(f"--model {model}"):
            issued = passport.issue(model)
        if as_json:
            print(issued.model_dump_json(indent=2))
        else:
            table.show_passport(issued)
        raise typer.Exit(0 if issued.passed else 1)

    workers.warm_up("mjspace.validation.benchmarks")
    from mjspace.flight import output_folder
    from mjspace.validation import report, suite, table
    from mjspace.validation.basilisk import compared

    with blamed_on("--only"):
        wanted = suite.chosen(only)
    with progress_bar(1.0, "validating", count="") as progress:
        results = suite.validate(wanted, quick=quick, progress=progress)
    results = compared(results, basilisk)
    data, page = report.write(results, output_folder(out, "validate"))
    if as_json:
        print(data.read_text().rstrip())
    else:
        table.show(results)
        print(f"data   {data}\nreport {page}")
    raise typer.Exit(0 if results.passed else 1)
