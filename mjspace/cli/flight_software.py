"""The commands ``mjspace law-header``, ``mjspace serve-law`` and ``mjspace linearize``."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import InputError, input_error_at, shortened, whole_or_none
from mjspace.terminal.options import Scenario, Set, Trust


def law_header(
    scenario: Scenario,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="A file; the terminal when left out.")
    ] = None,
    overrides: Set = [],  # noqa: B006
    trust: Trust = False,
) -> None:
    """Write what a law of the scenario is compiled with: a C header, or the protobuf file.

    The header is for law.kind = "library.so:function", the file for "tcp://host:port".
    """
    from mjspace.scenario.loading import load
    from mjspace.scenario.trust import function_of, is_address, is_library
    from mjspace.simulation.assembly import without_law
    from mjspace.simulation.flight_software.interface import interface_of
    from mjspace.simulation.flight_software.proto import proto_file
    from mjspace.simulation.flight_software.structs import header, structs_of

    loaded, folder = load(scenario, overrides)
    kind = loaded.law.kind
    if not (is_library(kind) or is_address(kind)):
        raise InputError(
            f"law.kind: got {shortened(kind)!r}, should be as 'libmylaw.so:step', of a library "
            "that need not be there yet, or as 'tcp://127.0.0.1:5555'"
        )
    interface = interface_of(without_law(loaded, folder, trust=trust))
    if is_address(kind):
        text = proto_file(interface, loaded.name)
    else:
        with input_error_at("law"):
            text = header(structs_of(interface, loaded.law), loaded.name, function_of(kind))
    if output is None:
        print(text, end="")
        return
    with whole_or_none(output):
        output.write_text(text)
    print(f"header {output}")


def serve_law(
    law: Annotated[str, typer.Argument(metavar="LAW", help="module:Class or file.py:Class.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="To listen at; 0: any.")] = 5555,
    host: Annotated[
        str, typer.Option(help="Address to listen at; another than this one opens it to others.")
    ] = "127.0.0.1",
    gains: Annotated[
        list[str],
        typer.Option("--gain", metavar="KEY=VALUE", help="Instead of the scenario's; repeatable."),
    ] = [],  # noqa: B006
) -> None:
    """Fly a law in this process, for scenarios with law.kind = "tcp://127.0.0.1:5555"."""
    from mjspace.scenario.loading import component
    from mjspace.simulation.flight_software.serve import serve

    def tell(line: str) -> None:
        print(shortened(line, 1000), flush=True)

    with input_error_at("serve-law"):
        serve(component(law, gains), host, port, folder=Path(), tell=tell)


def linearize(
    scenario: Scenario,
    output: Annotated[
        Path, typer.Option("-o", "--output", "--out", help="A file for NumPy: plant.npz.")
    ],
    overrides: Set = [],  # noqa: B006
    trust: Trust = False,
) -> None:
    """Linearize the vehicle about its initial state: A, B, C, D, and Ad, Bd of a control period."""
    from mjspace.simulation.linearization import linearize as linearized

    plant = linearized(scenario, overrides, trust=trust)
    plant.save(output)
    print(f"plant   {output}")
    for name in ("states", "inputs", "outputs"):
        print(f"{name:7} {', '.join(getattr(plant, name))}")
