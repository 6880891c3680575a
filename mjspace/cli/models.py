"""The commands ``mjspace inspect`` and ``mjspace new``: models of one's own."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mjspace.errors import InputError, input_error_at, shortened
from mjspace.terminal.options import Json

if TYPE_CHECKING:
    from mjspace.scenario.model_source import ModelSource
    from mjspace.validation.inspection import Inspection


def inspect(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="An MJCF or URDF file.")],
    bus: Annotated[
        str, typer.Option(metavar="BODY", help="The bus, to be freed where nothing else is.")
    ] = "",
    wheels: Annotated[
        list[str],
        typer.Option("--wheel", metavar="PATTERN", help="Motors of reaction wheels; repeatable."),
    ] = [],  # noqa: B006
    without_armature: Annotated[
        bool, typer.Option("--without-armature", help="Leave the armature of its joints out.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show what is recognized in a model of yours, and what keeps it from flying."""
    from mjspace.validation import inspection_table

    roles = {"bus": bus or None, "wheels": wheels or None}
    _, found = _inspected(model, {"roles": roles, "without_armature": without_armature})
    if as_json:
        print(found.model_dump_json(indent=2))
    else:
        inspection_table.show(found)
    raise typer.Exit(0 if found.flies else 1)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the scenario and its folder.")],
    model: Annotated[
        Path | None, typer.Option(help="Your own MJCF or URDF; else the standard satellite.")
    ] = None,
) -> None:
    """Write a scenario, a law and a test that fly at once, to begin your own from."""
    from mjspace.validation import inspection_table, starting_point

    folder = Path(name)
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
        raise InputError(f"NAME: got {shortened(name)!r}, should be letters, digits, - and _")
    if folder.exists():
        raise InputError(f"NAME: {name} is there already: choose another name")
    source = found = None
    if model is not None:
        source, found = _inspected(model, {})
        if not found.flies:
            inspection_table.show(found)
            raise typer.Exit(1)
    for path, content in starting_point.files(name, source, found).items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    print(f"{folder}: fly it by 'mjspace run {folder}/{name}.toml'")


def _inspected(model: Path, plant: dict[str, Any]) -> tuple["ModelSource", "Inspection"]:
    from mjspace.simulation import mujoco_warnings
    from mjspace.validation import inspection

    mujoco_warnings.silence()
    with input_error_at("MODEL"):
        return inspection.inspect_file(model, plant)
