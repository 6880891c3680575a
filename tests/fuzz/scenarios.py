"""Scenarios with mistakes: each is flown for a block, or refused in one line."""

import contextlib
import copy
import math
import random
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w
from outcomes import Commands, faults, written

from mjspace.scenario import files

Table = dict[str, Any]

NUMBERS = [0, -1, 1, 2, 7, 1e308, -1e308, 1e-300, 1e300, math.inf, -math.inf, math.nan, 0.0, -0.0]
NUMBERS += [1e6, 1e-9, 10**30, 2**63 - 1, 3.5, 1000000]
TEXTS = ["", "x", "x" * 5000, "1 s", "1e999 s", "nan deg", "-5 km", "7 parsec", "0 Hz", "1e-300 s"]
TEXTS += ["true", "../..", "/dev/null", "/etc/passwd", "law.error", "truth.rate[99]", "truth.[0]"]
TEXTS += ["100000 h", "\N{SNOWMAN}", "{}", "%s", "a:b:c", ":", "x.py:Y", "numpy:array"]
KINDS = ["os:system", "contraction:np", "contraction:Adaptive", "references:Hold", "phases:Phases"]
KINDS += ["lander:VariableStructure", "magnetic:BDot", "references:Turning", "dgvscmg:Cascade"]
KINDS += ["tabulated:Table", "coast:Coast", "bezier:Bezier", "linear_quadratic:Tracker", "units:"]
OTHERS = [
    True,
    False,
    [],
    {},
    [[]],
    [1.0],
    [1.0, 2.0, 3.0],
    [0.0] * 1000,
    {"a": {"b": 1}},
    [{}, {}],
]
OTHERS += [[[1.0, 0.0], [0.0, 1.0]], {"kind": "coast:Coast"}, [{"kind": "os:system"}]]


@cache
def tables() -> dict[str, Table]:
    """Return the scenarios that come with mjspace, merged over their bases."""
    return {name: files.read(files.find(name)) for name in files.scenario_names()}


def cases(seed: int | str) -> Iterator[tuple[str, bytes]]:
    """Yield names of cases and the TOML files that they are."""
    number = 0
    while True:
        yield f"{seed}-{number}", scenario(random.Random(f"{seed}-{number}"))
        number += 1


def scenario(draw: random.Random) -> bytes:
    """Return a scenario with one to four mistakes in it, or damaged as a text."""
    table = copy.deepcopy(tables()[draw.choice(list(tables()))])
    for _ in range(draw.choice((1, 1, 1, 1, 2, 3))):
        _change(table, draw)
    text = bytearray(tomli_w.dumps(table).encode())
    if draw.random() < 0.05:
        for _ in range(draw.choice((1, 2, 10))):
            text[draw.randrange(len(text))] = draw.randrange(draw.choice((128, 128, 256)))
    if draw.random() < 0.03:
        del text[draw.randrange(len(text)) :]
    if draw.random() < 0.02:
        text += draw.choice(
            (b"\nx=" + b"[" * 2000, b"\ny=" + b"9" * 5000, b"\n[a" + b".a" * 2000 + b"]")
        )
    return bytes(text)


def _change(table: Table, draw: random.Random) -> None:
    """Make one mistake."""
    places = list(_places(table))
    holder, key = draw.choice(places)
    if draw.random() < 0.8:  # most places of a scenario are in its checks
        holder, key = table, draw.choice([key for key in table if key not in ("checks", "events")])
        while isinstance(holder[key], dict | list) and holder[key] and draw.random() < 0.8:
            holder = holder[key]
            key = draw.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    mistake = draw.random()
    if mistake < 0.55:
        holder[key] = _value(draw, holder[key], key)
    elif mistake < 0.65:
        del holder[key]
    elif mistake < 0.75:
        other, its_key = draw.choice(places)
        with contextlib.suppress(KeyError, IndexError):  # one was in the other
            holder[key], other[its_key] = other[its_key], holder[key]
    elif mistake < 0.9:
        donor = tables()[draw.choice(list(tables()))]
        theirs, name = draw.choice(list(_places(donor)))
        if isinstance(name, str) and isinstance(holder, dict):
            holder[name] = copy.deepcopy(theirs[name])
    elif isinstance(holder, list):
        holder += copy.deepcopy(holder[:3])
    else:
        holder[draw.choice(("kind", "file", "x", "", "a b", "delay", "period"))] = _value(
            draw, 1.0, ""
        )
    _break_cycles(table)


def _break_cycles(value: Any, above: tuple[int, ...] = ()) -> None:
    """Replace what was moved into itself."""
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, item in list(items):
        if id(item) in (*above, id(value)):
            value[key] = 0
        else:
            _break_cycles(item, (*above, id(value)))


def _value(draw: random.Random, old: Any, key: Any) -> Any:
    """Return another value; often one that is nearly right."""
    near = draw.random()
    if key == "kind" and near < 0.6:
        return draw.choice(KINDS)
    if isinstance(old, int | float) and not isinstance(old, bool) and near < 0.5:
        return draw.choice(
            (old * 10.0, -old, old * 1e-6, old * 1e6, old * draw.choice(NUMBERS), old + 1)
        )
    if isinstance(old, list) and old and near < 0.4:
        return draw.choice((old[:-1], old + old, [*old, "x"], [[each] for each in old], old[0]))
    return draw.choice(draw.choice((NUMBERS, TEXTS, KINDS, OTHERS)))


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every place of a table: the table or list, and the key or index."""
    keys = list(value) if isinstance(value, dict) else range(len(value))
    for key in keys:
        yield value, key
        if isinstance(value[key], dict | list):
            yield from _places(value[key])


def attack(name: str, text: bytes, folder: Path, commands: Commands) -> Iterator[str]:
    """Yield the faults of beginning the flight of a scenario, in the empty ``folder``."""
    (folder / "case.toml").write_bytes(text)
    begin = "info", "case.toml", "--compiled"
    fly = "run", "case.toml", "--duration", "0.02", "--out", "out"
    given = begin if random.Random(name).random() < 0.8 else fly
    found = commands.outcome(given, folder)
    yield from faults(found)
    extra = written(folder) - {"case.toml"}
    if extra - {"out"} or (extra and found.status == 2):
        yield f"wrote {sorted(extra)}, status {found.status}"
