"""TOML as it comes from outside: parsed, and refused where no scenario can hold it."""

import tomllib
from typing import Any

from mjspace.errors import is_plain, shortened
from mjspace.units import OUT_OF_SCALE, is_out_of_scale

DEEPEST = 20
"""Tables and lists within each other."""


def parsed(text: str) -> dict[str, Any]:
    """Return the table that a TOML text holds.

    Raises:
        ValueError: it is no TOML, or its tables are nested too deeply, a number is out of all
            proportion, or a text has control characters.
    """
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise ValueError("its tables and lists are nested too deeply") from None
    except ValueError as error:
        if isinstance(error, tomllib.TOMLDecodeError):
            raise
        raise ValueError("a number has too many digits") from None  # Python reads 4300 of them
    _refuse_unfit(table)
    return table


def _refuse_unfit(table: dict[str, Any]) -> None:
    queue: list[tuple[tuple[str, ...], Any]] = [((), table)]
    while queue:
        place, value = queue.pop()
        fault = "tables and lists are nested too deeply" if len(place) > DEEPEST else _fault(value)
        if fault:
            key = ".".join(map(shortened, place))
            raise ValueError(f"{key}: {fault}" if key else fault)
        if isinstance(value, dict):
            queue += [((*place, name), item) for name, item in value.items()]
        elif isinstance(value, list):
            queue += [((*place, str(number)), item) for number, item in enumerate(value)]


def _fault(value: Any) -> str:
    """Return why no scenario can hold ``value``, looked at alone; "" where one can."""
    if isinstance(value, dict):
        for name in value:
            if not is_plain(name):
                return f"control characters in the key {shortened(name)!r}"
    elif isinstance(value, str) and not is_plain(value.replace("\n", " ")):
        return f"got {shortened(value)!r}: control characters in a text"
    elif isinstance(value, int) and abs(value) >= 2**63:
        return "a whole number of more than 64 bits"
    elif isinstance(value, float) and is_out_of_scale(value):
        return f"got {value:g}: {OUT_OF_SCALE}"
    return ""
