"""The user's files that a log holds: what of them would run again, and where they are unpacked."""

import hashlib
from pathlib import Path

from mjspace.errors import InputError, shortened
from mjspace.log.flown_scenario import model_of
from mjspace.log.reader import Log
from mjspace.scenario.scenario import Scenario
from mjspace.scenario.trust import is_address


def code_of(log: Log, scenario: Scenario, *, law: bool = True) -> dict[str, bytes]:
    """Return the files of the log that flying its ``scenario`` would run or read, by name.

    Those are the files of the reference, the estimator and the disturbance, where they came from no
    module, and with ``law`` those of the law, which may be a shared library.

    Raises:
        ValueError: an attachment is damaged.
    """
    kinds = [kind for role, kind in scenario.kinds.items() if law or role != "law"]
    places = [kind.partition(":")[0] for kind in kinds]
    files = [place for place in places if place.endswith((".py", ".so"))]
    folders = tuple(place.partition("/")[0] + "/" for place in files if "/" in place)
    names = [name for name in log.attachments if name in files or name.startswith(folders)]
    return {name: log.attachment(name) for name in names}


def model_files(log: Log, scenario: Scenario) -> dict[str, bytes]:
    """Return the files of a user's own model in the log, by name: data, which nothing runs.

    Raises:
        ValueError: one of them is missing or damaged.
    """
    source = model_of(log, scenario)
    if source is None:
        return {}
    folder, _, _ = source.name.rpartition("/")
    return {f"{folder}/{name}": content for name, content in source.files.items()}


def require_trust(files: dict[str, bytes]) -> None:
    """Refuse to run ``files`` out of a log.

    Raises:
        InputError: there are any; with their names and digests.
    """
    if files:
        named = ", ".join(f"{name} (sha256 {digest(text)})" for name, text in files.items())
        raise InputError(
            f"log: to fly it again runs code out of the log, {named}: look at it with 'mjspace "
            "info', then give --trust if it is yours"
        )


def refuse_connection(scenario: Scenario) -> None:
    """Refuse to connect to the law of a log's ``scenario``, where it is in another process.

    Raises:
        InputError: it is; with its address.
    """
    if is_address(scenario.law.kind):
        raise InputError(
            f"log: to fly it again needs the law that listened at {shortened(scenario.law.kind)}: "
            "start it there, then give --trust, which connects to it"
        )


def unpack(files: dict[str, bytes], folder: Path) -> None:
    """Write ``files`` into the ``folder``.

    Raises:
        InputError: a name leads out of it.
    """
    for name, content in files.items():
        file = folder / name
        if not file.resolve().is_relative_to(folder.resolve()):
            raise InputError(f"log: the attachment {name!r} leads out of its folder")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)


def digest(content: bytes) -> str:
    """Return the beginning of the SHA-256 of a file, by which a person can tell it."""
    return hashlib.sha256(content).hexdigest()[:16]
