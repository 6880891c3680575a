"""Requirements and objectives in one line: ``final(truth.attitude_error) < 1 deg from 10 s``."""

import re
from typing import get_args

from pydantic import ValidationError

from mjspace.errors import InputError, nearest
from mjspace.scenario.scenario import Check

STATISTICS: tuple[str, ...] = get_args(Check.model_fields["statistic"].annotation)
_OBJECTIVE = re.compile(r"\s*(\w+)\s*\(\s*([^()\s]+)\s*\)\s*")
_BOUND = re.compile(r"(?P<sign>[<>])\s*(?P<value>[^<>]+?)(?:\s+from\s+(?P<start>.+))?\s*")


def objective(text: str, option: str) -> tuple[str, str]:
    """Return the statistic and the signal of ``rms(truth.attitude_error)``.

    Raises:
        InputError: it is not of that form; ``option`` is its name on the command line.
    """
    found = _OBJECTIVE.fullmatch(text)
    if found is None:
        raise InputError(f"{option} {text!r}: should be as 'rms(truth.attitude_error)'")
    return _statistic(found[1], option, text), found[2]


def requirement(text: str, option: str = "--require") -> Check:
    """Return the check that ``final(truth.attitude_error) < 1 deg from 10 s`` stands for.

    Raises:
        InputError: it is not of that form.
    """
    left = _OBJECTIVE.match(text)
    bound = None if left is None else _BOUND.fullmatch(text, left.end())
    if left is None or bound is None:
        raise InputError(
            f"{option} {text!r}: should be as 'final(truth.attitude_error) < 1 deg from 10 s'"
        )
    key = "below" if bound["sign"] == "<" else "above"
    table = {"name": text.strip(), "signal": left[2], key: _number(bound["value"])}
    table["statistic"] = _statistic(left[1], option, text)
    if bound["start"] is not None:
        table["start"] = _number(bound["start"])
    try:
        return Check.model_validate(table)
    except ValidationError as error:
        wrong = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise InputError(f"{option} {text!r}: {wrong.replace('Input should', 'should')}") from None


def _statistic(name: str, option: str, text: str) -> str:
    if name not in STATISTICS:
        raise InputError(f"{option} {text!r}: no statistic {name!r}{nearest(name, STATISTICS)}")
    return name


def _number(text: str) -> float | str:
    """Return a plain number as such, and a quantity as it is written."""
    try:
        return float(text)
    except ValueError:
        return text.strip()
