"""Keys of a scenario that are set one by one: ``law.rate_gain=3``, on the command line or not."""

import tomllib
from collections.abc import Iterable
from typing import Any

from mjspace.errors import InputError, is_plain
from mjspace.scenario import raw
from mjspace.scenario.trust import CommandLineText

_COMPONENTS = ("law", "reference", "estimator")


def apply(table: dict[str, Any], overrides: Iterable[str], option: str = "--set") -> dict[str, str]:
    """Set each ``key=value``, a dotted key and a TOML value, in ``table``; a bare word is a string.

    Another ``kind`` of a law, a reference or an estimator takes the table's gains away, those of
    another class; the other overrides come after it, wherever they stand.

    Returns:
        The option that set each key, for messages.

    Raises:
        InputError: an override is not of that form, or leads into something that is no table.
    """
    parsed = [_parsed(override, option) for override in overrides]
    origins = {}
    for override, key, value in sorted(parsed, key=lambda one: _turn(one[1])):
        _set(table, key, value, f"{option} {override}")
        origins[key] = f"{option} {override}"
    return origins


def _parsed(override: str, option: str) -> tuple[str, str, Any]:
    key, equals, text = override.partition("=")
    key = key.strip()
    if not equals or not key:
        raise InputError(f"{option} {override}: write key=value")
    if not is_plain(override):
        raise InputError(f"{option} {override}: control characters")
    if key.count(".") >= raw.DEEPEST:
        raise InputError(f"{option} {override}: the key has too many parts")
    try:
        return override, key, _of_command_line(raw.parsed(f"value = {text}")["value"])
    except tomllib.TOMLDecodeError:
        return override, key, CommandLineText(text.strip())
    except ValueError as error:
        raise InputError(f"{option} {override}: {error}") from None


def _of_command_line(value: Any) -> Any:
    """Return a TOML value with its texts marked."""
    if isinstance(value, dict):
        return {key: _of_command_line(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_of_command_line(item) for item in value]
    return CommandLineText(value) if isinstance(value, str) else value


def _turn(key: str) -> tuple[bool, int]:
    """Return what kinds are sorted first by, the outer before the inner."""
    return not _is_kind(key), key.count(".") if _is_kind(key) else 0


def _is_kind(key: str) -> bool:
    """Return whether the key says of which class such a component is, inside one or not."""
    parts = key.split(".")
    return len(parts) > 1 and parts[0] in _COMPONENTS and parts[-1] == "kind"


def _set(table: dict[str, Any], key: str, value: Any, origin: str) -> None:
    *parents, last = key.split(".")
    place: Any = table
    for part in parents:
        if isinstance(place, list) and part.isdigit() and int(part) < len(place):
            place = place[int(part)]
        elif isinstance(place, dict):
            place = place.setdefault(part, {})
        else:
            raise InputError(f"{origin}: {part!r} is not in a table")
    if isinstance(place, list) and last.isdigit() and int(last) < len(place):
        place[int(last)] = value
    elif isinstance(place, dict):
        if _is_kind(key) and place.get("kind") != value:
            place.clear()
        place[last] = value
    else:
        raise InputError(f"{origin}: {last!r} is not in a table")
