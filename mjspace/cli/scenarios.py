"""The commands ``mjspace list`` and ``mjspace info``."""

import json
from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import InputError
from mjspace.terminal.options import Json, Set, Trust
from mjspace.terminal.reporting import open_log


def list_scenarios(as_json: Json = False) -> None:
    """List the scenarios that come with mjspace."""
    from mjspace.scenario import files

    found = files.list_scenarios()
    if as_json:
        print(json.dumps(found, indent=2))
        return
    width = max(map(len, found))
    for name, description in found.items():
        print(f"{name:{width}}  {description}")


def info(
    target: Annotated[str, typer.Argument(metavar="SCENARIO|LOG")],
    overrides: Set = [],  # noqa: B006
    compiled: Annotated[
        bool,
        typer.Option(
            "--compiled",
            help="Of a scenario: begin its flight and say what of it is compiled, or why not.",
        ),
    ] = False,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """Show a scenario in full, or what a log holds."""
    if target.endswith(".mcap"):
        if compiled:
            raise InputError(f"--compiled: {target} is a log: name its scenario instead")
        from mjspace.runner import report

        log = open_log(Path(target))
        if as_json:
            print(json.dumps(report.log_data(log), indent=2))
        else:
            report.print_log(log)
        return
    from mjspace.scenario.loading import load, to_toml

    scenario, folder = load(target, overrides)
    if compiled:
        from mjspace.simulation.assembly import assemble
        from mjspace.simulation.loop import what_is_compiled

        found = what_is_compiled(assemble(scenario, folder, trust=trust))
        print(json.dumps(found) if as_json else found)
        return
    print(scenario.model_dump_json(indent=2) if as_json else to_toml(scenario).rstrip())
