"""The command ``mjspace law-header``."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import InputError, input_error_at, shortened, whole_or_none
from mjspace.terminal.options import Set, Trust

Scenario = Annotated[str, typer.Argument(metavar="SCENARIO", help="A name or a TOML file.")]


def law_header(
    scenario: Scenario,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="A file; the terminal when left out.")
    ] = None,
    overrides: Set = [],  # noqa: B006
    trust: Trust = False,
) -> None:
    """Write the C header of a law in a shared library, for law.kind = "library.so:function"."""
    from mjspace.scenario.loading import load
    from mjspace.scenario.trust import function_of, is_library
    from mjspace.simulation.assembly import without_law
    from mjspace.simulation.flight_software.interface import interface_of
    from mjspace.simulation.flight_software.structs import header, structs_of

    loaded, folder = load(scenario, overrides)
    kind = loaded.law.kind
    if not is_library(kind):
        raise InputError(
            f"law.kind: got {shortened(kind)!r}, should be as 'libmylaw.so:step': the header is of "
            "a law in a shared library, which need not be there yet"
        )
    with input_error_at("law"):
        function = function_of(kind)
        interface = interface_of(without_law(loaded, folder, trust=trust))
        text = header(structs_of(interface, loaded.law), loaded.name, function)
    if output is None:
        print(text, end="")
        return
    with whole_or_none(output):
        output.write_text(text)
    print(f"header {output}")
