"""The command ``mjspace validate``."""

from pathlib import Path
from typing import Annotated, NoReturn

import typer

from mjspace.errors import InputError, input_error_at
from mjspace.terminal.options import Json, Quiet
from mjspace.terminal.reporting import progress_bar


def validate(
    only: Annotated[
        list[str], typer.Option("--only", metavar="NAME", help="This benchmark; repeatable.")
    ] = [],  # noqa: B006
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Each benchmark once, short; no faults, orders and figures."),
    ] = False,
    model: Annotated[
        Path | None, typer.Option(help="Examine this MJCF, URDF or MJB model instead.")
    ] = None,
    basilisk: Annotated[
        str, typer.Option(metavar="PYTHON", help="Also compare with the bsk of this interpreter.")
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write; runs/validate/<UTC stamp> when left out, none with --model."
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure MuJoCo's physics against closed forms; or the physics of a model of yours."""
    if model is not None:
        if only or quick or basilisk:
            raise InputError(
                "--model: a passport is of one model: leave --only, --quick and --basilisk out"
            )
        _examine(model, out, as_json)

    from mjspace.runner import workers

    workers.warm_up("mjspace.validation.benchmarks")
    from mjspace.runner.run import output_folder
    from mjspace.validation import report, suite, table
    from mjspace.validation.basilisk import compared

    with input_error_at("--only"):
        chosen = suite.chosen(only)
    with progress_bar(1.0, "validating", count="") as progress:
        results = suite.validate(chosen, quick=quick, progress=progress)
    results = compared(results, basilisk)
    data, page = report.write(results, output_folder(out, "validate"))
    if as_json:
        print(data.read_text(encoding="utf-8").rstrip())
    else:
        table.show(results)
        print(f"data   {data}\nreport {page}")
    raise typer.Exit(0 if results.passed else 1)


def _examine(model: Path, out: Path | None, as_json: bool) -> NoReturn:
    """Print the passport of one model, and write it where a folder is named."""
    from mjspace.simulation import mujoco_warnings
    from mjspace.validation import passport, report, table

    mujoco_warnings.silence()
    with input_error_at(f"--model {model}"):
        issued = passport.issue(model)
    written = () if out is None else report.write_passport(issued, out)
    if as_json:
        print(issued.model_dump_json(indent=2))
    else:
        table.show_passport(issued)
        for what, path in zip(("data", "report"), written, strict=False):
            print(f"{what:6} {path}")
    raise typer.Exit(0 if issued.passed else 1)
