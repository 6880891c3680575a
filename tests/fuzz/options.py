"""Commands with odd options: each does its work, or refuses in one line with status 2."""

import random
import shutil
from collections.abc import Iterator
from pathlib import Path

from outcomes import Commands, faults

from mjspace.errors import is_plain

NUMBERS = [
    "0",
    "-1",
    "1e308",
    "1e-300",
    "nan",
    "inf",
    "-inf",
    "1",
    "0.02",
    "1e9",
    "x",
    "",
    "9" * 400,
]
TEXTS = [
    "",
    "x",
    "..",
    "/",
    "a" * 300,
    "\u202e",
    "\x1b[31m",
    "truth.rate",
    "truth.rate[0]",
    "law.x[9]",
]
TEXTS += ["state.physics", "truth.rate[-1]", "truth.[", "flight.mcap", "no/such/file", "*", "--"]
SETS = [
    "duration=0.02",
    "seed=-1",
    "seed=1e9",
    "law.kind=os:system",
    "x",
    "=",
    "a=b",
    "duration=1e308",
]
SETS += ["rates.control=inf", "sensors.attitude.delay=1000000", "plant.model=lander", "law={}"]
SETS += ["checks=[]", "environment.python=x.py:f", "law.gain=" + "[" * 500, "name=../x", "plant=1"]
SETS += ["law.kind=x.so:f", "law.kind=tcp://127.0.0.1:1", "law.kind=udp://x:99999", "law.x={}"]
SETS += ["log.state=0", "log.default='1 ns'", "reference.kind=tabulated:Table", "reference.file=/"]
SCENARIOS = [
    "contraction-ideal",
    "rcs-schmitt",
    "lander",
    "nothing",
    "",
    "flight.mcap",
    ".",
    "x.toml",
]
SIZES = ["20000x20000", "16x16", "0x0", "-1x5", "axb", "64x48", "1e3x1e3", "64", "65x49"]
FILES = ["x.png", "x.mp4", "x.avi", "", ".", "/x/y.png", "flight.mcap", "a" * 300 + ".png"]


def cases(seed: int | str) -> Iterator[tuple[str, list[str]]]:
    """Yield names of cases and the words of their command lines."""
    number = 0
    while True:
        yield f"{seed}-{number}", words(random.Random(f"{seed}-{number}"))
        number += 1


def words(draw: random.Random) -> list[str]:
    """Return a command with a few options."""

    def any_of(*lists: list[str]) -> str:
        return draw.choice(draw.choice(lists))

    def some(option: str, *lists: list[str]) -> list[str]:
        return [option, any_of(*lists)] if draw.random() < 0.4 else []

    log = draw.choice(("flight.mcap",) * 6 + ("x.toml", "none.mcap", "", "."))
    match draw.choice(
        ("run", "run", "info", "plot", "render", "render", "replay", "replay", "software", "odd")
    ):
        case "run":
            given = [
                "run",
                draw.choice(SCENARIOS),
                "--duration",
                draw.choice(("0.02", *filter(None, NUMBERS))),
            ]
            given += some("--set", SETS) + some("--set", SETS) + some("--seed", NUMBERS)
            given += some("--out", FILES, TEXTS)
        case "info":
            given = ["info", draw.choice([*SCENARIOS, log]), *some("--set", SETS)]
            given += draw.choice(([], ["--json"], ["--compiled"]))
        case "plot":
            given = ["plot", log, "-o", draw.choice(FILES), *some("--signal", TEXTS)]
            given += ["--phase", any_of(TEXTS), any_of(TEXTS)] if draw.random() < 0.2 else []
        case "render":
            given = ["render", log, "-o", draw.choice(FILES), *some("--rate", NUMBERS)]
            given += some("--speed", NUMBERS) + some("--at", NUMBERS) + some("--camera", TEXTS)
            given += ["--size", draw.choice(SIZES)]
        case "replay":
            given = ["replay", log, *draw.choice(([], ["--verify"], ["--trust"], ["--json"]))]
            given += some("--from", NUMBERS) + some("--out", TEXTS) + some("--gain", SETS)
            given += some("--law", ["coast:Coast", "os:system", "x.py:Y", "contraction:np", *TEXTS])
        case "software":
            given = [draw.choice(("linearize", "law-header")), draw.choice(SCENARIOS)]
            given += [*some("--set", SETS), *some("--set", SETS), "-o", any_of(FILES, TEXTS)]
        case _:
            odd = ("list", "validate", "--help", "--x", "replay", "recover", "\udcff", "")
            given = [draw.choice(odd), *some("--only", TEXTS), *some("--x", TEXTS)]
            given += ["--model", any_of(FILES, TEXTS)] if given[0] == "validate" else []
    return given


def attack(given: list[str], log: Path, folder: Path, commands: Commands) -> Iterator[str]:
    """Yield the faults of a command beside a copy of the ``log``, in the empty ``folder``."""
    shutil.copy(log, folder / "flight.mcap")
    text = 'base = "contraction-ideal"\nchecks = []\nduration = 0.02\n'
    (folder / "x.toml").write_text(text)
    found = commands.outcome(given, folder)
    usage = found.status == 2 and found.error.startswith("Usage:")
    yield from (f"{given}: {fault}" for fault in faults(found) if not usage)
    if not is_plain(found.error.replace("\n", "")):
        yield f"{given}: control characters: {found.error!r}"
