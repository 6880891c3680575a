"""Flights that get a signal at any instant: what their logs have lost, and what they leave."""

import os
import random
import select
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from processes import in_session

from mjspace.log import lock
from mjspace.log.reader import Log
from mjspace.runner.replay import verify
from mjspace.runner.run import run

ALL = "--all"
SCENARIOS = (
    *("contraction-ideal", "contraction-noise", "detumble-wheels", "dgvscmg-ideal", "lander"),
    *("wheel-failure", "rcs-schmitt", "yo-yo-despin", "b-dot", "pd-plus"),
)
LATEST = 2.0
"""The signal comes until then [s]; ten times as late where one process more has to begin first."""
LOST = 1.0
"""What a kill may cost [s] of wall time."""
ANSWERED = 2.0
"""Until then [s] a request to stop is answered; by all and their processes in twice that."""
IN_FLIGHT = 0.05
"""A block that is handed over later [s] than the signal was sent was flown in spite of it."""
ENDS = 20.0
"""What takes longer [s] hangs."""


@dataclass(frozen=True)
class Kill:
    """A scenario, or all of them, and what ends its flight."""

    scenario: str
    number: signal.Signals
    delay: float
    """From the beginning of the process [s]."""


@dataclass(frozen=True)
class Found:
    """What was found afterwards."""

    trouble: str
    """What should not be; "" where all is well."""
    lost: float
    """Wall time of the flight that the log lacks [s]."""
    answered: float
    """Wall time from the signal to the end of the process [s]."""
    verified: int
    """Control periods that were flown again."""


def cases(seed: int) -> Iterator[tuple[str, Kill]]:
    """Yield kills with their names, without end: three of ten are requests, one of 25 is of all."""
    chance = random.Random(seed)
    requests = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    for number in count():
        kind = signal.SIGKILL if chance.random() < 0.7 else chance.choice(requests)
        everything = chance.random() < 0.04
        scenario = ALL if everything else chance.choice(SCENARIOS)
        delay = chance.uniform(0.0, LATEST * (10.0 if everything else 1.0))
        name = f"seed {seed}, case {number}: {scenario}, {kind.name} after {delay:.3f} s"
        yield name, Kill(scenario, kind, delay)


def attempt(kill: Kill, lost: float = LOST, answered: float = ANSWERED) -> Found:
    """Begin a flight, end it by the signal, and look at what is left."""
    with tempfile.TemporaryDirectory() as folder:
        work, notes = Path(folder) / "work", os.pipe()
        work.mkdir()
        begin = _begin_all if kill.scenario == ALL else _begin_flight
        child, wait = begin(kill.scenario, work, notes[1])
        os.close(notes[1])
        try:
            return _judged(kill, child, wait, work, notes[0], lost, answered)
        finally:
            os.close(notes[0])


def _begin_flight(scenario: str, work: Path, notes: int) -> tuple[int, Callable[[], int | None]]:
    """Return a fork of this process that flies, and its exit status while it is asked for."""

    def note(reached: float) -> None:
        os.write(notes, f"{time.monotonic()} {reached}\n".encode())

    def fly() -> int:
        warnings.simplefilter("ignore")
        result = run(scenario, out=work / "out", progress=note)
        return 128 + result.signal if result.signal else 0

    child = _forked(fly, work)
    status: list[int] = []

    def ended() -> int | None:
        if not status:
            found, how = os.waitpid(child, os.WNOHANG)
            status.extend([os.waitstatus_to_exitcode(how)] if found else [])
        return status[0] if status else None

    return child, ended


def _begin_all(_: str, work: Path, notes: int) -> tuple[int, Callable[[], int | None]]:
    nothing = subprocess.DEVNULL
    command = [sys.executable, "-m", "mjspace", "run", "--all", "--out", str(work / "out")]
    going = subprocess.Popen(
        command, cwd=work, stdout=nothing, stderr=nothing, start_new_session=True
    )
    return going.pid, going.poll


def _forked(function: Callable[[], int], work: Path) -> int:
    """Return a fork of this process that ends with what ``function`` returns, in its own session.

    Signals are what they are for the command.
    """
    with warnings.catch_warnings():
        # Python 3.12 warns of the threads of NumPy's linear algebra, which the fork does not need.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child:
        return child
    status = 99
    try:
        os.setsid()
        os.chdir(work)
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nothing, stream)
        status = function()
    except KeyboardInterrupt:
        status = 128 + signal.SIGINT
    except BaseException:
        (work / "traceback").write_text(traceback.format_exc())
    finally:
        os._exit(status)


def _judged(
    kill: Kill,
    child: int,
    ended: Callable[[], int | None],
    work: Path,
    notes: int,
    most_lost: float,
    longest: float,
) -> Found:
    _until(ended, kill.delay)
    whole = ended() is not None
    began = time.monotonic()
    if not whole:
        os.kill(child, kill.number)
    _until(ended, ENDS)
    took = time.monotonic() - began
    status = ended()
    if status is None:
        os.killpg(child, signal.SIGKILL)
        return Found(f"hangs: {ENDS:g} s after the signal", 0.0, took, 0)
    _until(lambda: None if in_session(child) else 0, 3.0)
    left = in_session(child)
    noted = _noted(notes)
    lost, periods = 0.0, 0
    troubles = [f"left running: {left}"] if left else []
    if (work / "traceback").exists():
        troubles.append((work / "traceback").read_text())
    asked = kill.number != signal.SIGKILL
    if asked and took > longest * (2.0 if kill.scenario == ALL else 1.0):
        troubles.append(f"answered after {took:.2f} s")
    # It may have flown to its end in the instant in which the signal was sent.
    whole = whole or (status == 0 and noted != [] and noted[-1][0] < began + IN_FLIGHT)
    if not whole and status not in (128 + kill.number, -kill.number):
        troubles.append(f"exit status {status}")
    logs = list(work.glob("out/*/flight.mcap" if kill.scenario == ALL else "out/flight.mcap"))
    troubles += [f"left {each}" for each in work.rglob("*") if each.is_file() and each not in logs]
    end = -1.0
    for path in logs:
        if lock.is_locked(path):
            troubles.append(f"{path} is locked")
        try:
            log = Log(path)
        except ValueError as error:
            if asked:
                troubles.append(str(error))
            continue  # killed before its head was written
        if asked and not log.complete:
            troubles.append("the log is not complete")
        if len(log):
            end, periods = log.end, len(log)
            troubles += _differences(path, work) if kill.scenario != ALL else []
    if not whole and noted and kill.number == signal.SIGKILL:
        # What was handed over before the first block that is not in the log is there.
        safe = [at for at, reached in noted if reached <= end + 1e-9]
        lost = began - max(safe, default=noted[0][0])
        if lost > most_lost:
            troubles.append(f"lost {lost:.2f} s")
    return Found("; ".join(troubles), lost, took if asked and not whole else 0.0, periods)


def _differences(path: Path, work: Path) -> list[str]:
    """Return how the log differs from its flight, flown again in a process of its own."""
    said = work.parent / "said"

    def again() -> int:
        warnings.simplefilter("ignore")
        said.write_text(str(verify(path) or ""))
        return 0

    child = _forked(again, work)
    _, status = os.waitpid(child, 0)
    if status or (work / "traceback").exists():
        return [f"replay --verify: {(work / 'traceback').read_text()}"]
    text = said.read_text()
    return [text] if text else []


def _until(ended: Callable[[], int | None], seconds: float) -> None:
    due = time.monotonic() + seconds
    while ended() is None and time.monotonic() < due:
        time.sleep(0.002)


def _noted(notes: int) -> list[tuple[float, float]]:
    """Return (wall time [s], simulated time reached [s]) of each block that was handed over."""
    text = b""
    while select.select([notes], [], [], 0.0)[0] and (more := os.read(notes, 65536)):
        text += more
    lines = [line.split() for line in text.decode().splitlines()]
    return [(float(at), float(reached)) for at, reached in lines]
