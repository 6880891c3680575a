"""A campaign with the files that its scenario reads, for a machine that has none of them."""

import json
import os
import warnings
import weakref
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mjspace.campaign.members import Campaign, Population, populated
from mjspace.errors import InputError
from mjspace.runner import scratch
from mjspace.scenario.user_files import beside

_BUILT: dict[tuple[Campaign, str], Population] = {}
"""Of this process: the members of the campaign that it flew last."""


@dataclass(frozen=True)
class Carried:
    """A campaign, its scenario as it was read, and the user's files."""

    campaign: Campaign
    table: dict[str, Any]
    path: Path
    """Of the scenario's file, where the campaign began: errors name it."""
    folder: str
    """The scenario's, within what is unpacked."""
    origins: dict[str, str]
    files: dict[str, bytes]
    """By their places within what is unpacked."""
    absolute: dict[str, str]
    """The places there of files that the scenario names by absolute paths."""
    identity: str
    """Of the members, as JSON."""


def carried(members: Population) -> Carried:
    """Return what another machine needs to fly the members.

    Files keep their places relative to each other.

    Raises:
        OSError: a file cannot be read.
    """
    folder = Path(os.path.abspath(members.folder))
    paths = {name: Path(os.path.abspath(path)) for name, path in members.files.items()}
    contents = {path: path.read_bytes() for path in paths.values()}
    for path in paths.values():
        if path.suffix == ".py":
            contents |= {path.parent / name: text for name, text in beside(path).items()}
    top = os.path.commonpath([folder, *(path.parent for path in contents)])
    return Carried(
        campaign=members.campaign,
        table=dict(members.table),
        path=members.path,
        folder=os.path.relpath(folder, top),
        origins=dict(members.origins),
        files={os.path.relpath(path, top): content for path, content in contents.items()},
        absolute={n: os.path.relpath(p, top) for n, p in paths.items() if os.path.isabs(n)},
        identity=json.dumps(members.identity),
    )


def unpacked(what: Carried) -> Population:
    """Return the members, whose files are unpacked once for the calls of a process.

    Raises:
        InputError: they are not those that the campaign has where it began.
    """
    key = what.campaign, what.identity
    if key not in _BUILT:
        _BUILT.clear()
        _BUILT[key] = _unpacked(what)
    return _BUILT[key]


def _unpacked(what: Carried) -> Population:
    with ExitStack() as stack:
        top = stack.enter_context(scratch.folder())
        for name, content in what.files.items():
            (top / name).parent.mkdir(parents=True, exist_ok=True)
            (top / name).write_bytes(content)
        folder = top / what.folder
        folder.mkdir(parents=True, exist_ok=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # shown where the campaign began
            table = _renamed(what.table, {n: str(top / p) for n, p in what.absolute.items()})
            members = populated(what.campaign, table, what.path, folder, what.origins)
        if json.dumps(members.identity) != what.identity:
            raise InputError(f"{what.path}: {_differing(what, members)}")
        weakref.finalize(members, stack.pop_all().close)  # files are read for each member again
    return members


def _differing(what: Carried, members: Population) -> str:
    ours, theirs = json.loads(what.identity), members.identity
    sources = ours["sources"] | theirs["sources"]
    other = [n for n in sources if ours["sources"].get(n) != theirs["sources"].get(n)]
    named = ", ".join(other) or "the scenario"
    return f"another {named} where it is to fly: install there what is installed here"


def _renamed(value: Any, names: Mapping[str, str]) -> Any:
    """Return the value of a scenario with these files under other names."""
    if isinstance(value, dict):
        return {key: _renamed(item, names) for key, item in value.items()}
    if isinstance(value, list):
        return [_renamed(item, names) for item in value]
    if isinstance(value, str):
        place, colon, inside = value.partition(":")
        return type(value)(names[place] + colon + inside) if place in names else value
    return value
