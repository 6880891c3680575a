"""TOML as it comes from outside: parsed, and refused where no scenario can hold it."""

import tomllib
from typing import Any

from mjspace.errors import is_plain, shortened
from mjspace.units import is_out_of_scale

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
    refuse_unfit(table)
    return table


def refuse_unfit(table: dict[str, Any]) -> None:
    """Refuse a table that no scenario can hold.

    Raises:
        ValueError: the first such key, and why.
    """
    queue: list[tuple[tuple[str, ...], Any]] = [((), table)]
    while queue:
        place, value = queue.pop()
        key = ".".join(map(shortened, place))
        if len(place) > DEEPEST:
            raise ValueError(f"{key}: tables and lists are nested too deeply")
        if isinstance(value, dict):
            for name in value:
                if not is_plain(name):
                    raise ValueError(f"{key} {shortened(name)!r}: control characters in a key")
            queue += [((*place, name), item) for name, item in value.items()]
        elif isinstance(value, list):
            queue += [((*place, str(number)), item) for number, item in enumerate(value)]
        elif isinstance(value, str) and not is_plain(value.replace("\n", " ")):
            raise ValueError(f"{key}: got {shortened(value)!r}: control characters in a text")
        elif isinstance(value, int) and abs(value) >= 2**63:
            raise ValueError(f"{key}: a whole number of more than 64 bits")
        elif isinstance(value, float) and is_out_of_scale(value):
            raise ValueError(f"{key}: got {value:g}: its size is not from 1e-100 to 1e100")
