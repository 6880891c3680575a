"""The commands ``mjspace list`` and ``mjspace info``."""

import json
import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import InputError
from mjspace.terminal.options import Json, Set, Trust
from mjspace.terminal.reporting import open_log


def list_scenarios(
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="[WORD]...", help="Those alone that say all of these words."),
    ] = None,
    as_json: Json = False,
) -> None:
    """List the scenarios that come with mjspace, by the subject of their law."""
    from mjspace.scenario import files

    sought = [word.lower() for word in words or ()]
    found = {
        name: description
        for name, description in files.list_scenarios().items()
        if all(word in f"{name} {description}".lower() for word in sought)
    }
    if not found:
        raise InputError(f"list: no scenario says {' '.join(map(repr, words or ()))}")
    if as_json:
        print(json.dumps(found, indent=2))
        return
    subjects = files.subjects()
    width = max(map(len, found))
    for subject in dict.fromkeys(sorted(subjects[name] for name in found)):
        print(f"{subject}:")
        for name, description in found.items():
            if subjects[name] == subject:
                print(_fitting(f"  {name:{width}}  {description}"))


def _fitting(line: str) -> str:
    """Return the line, on a terminal cut to its width."""
    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else len(line)
    return line if len(line) <= columns else line[: columns - 3].rstrip() + "..."


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
