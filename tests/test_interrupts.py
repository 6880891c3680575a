"""Signals: a command ends in one line, a flight with its log whole, whatever it is doing."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mjspace import interrupts
from mjspace.errors import FlightError
from mjspace.interrupts import Interrupted
from mjspace.log.reader import Log
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.native_batch import NativeBatch

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


def ended(code: str, *numbers: signal.Signals, env: Any = None) -> tuple[int, str, str]:
    """Return how a program ends that receives the signals once it has said that it is ready."""
    going = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=env,
    )
    assert going.stdout is not None
    going.stdout.readline()
    time.sleep(0.05)  # until it sleeps
    for number in numbers:
        going.send_signal(number)
        time.sleep(0.05)
    out, err = going.communicate(timeout=10)
    return going.returncode, out, err


COMMAND = """
import sys, time
from mjspace.interrupts import ended_by_signals
with ended_by_signals():
    try:
        print("ready", flush=True)
        {what}
    finally:
        print("closed")
"""


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_a_command_in_one_line_and_closes_what_is_open(
    number: signal.Signals,
) -> None:
    code = COMMAND.format(what="time.sleep(60)")
    assert ended(code, number) == (128 + number, "closed\n", "mjspace: interrupted\n")


def test_an_import_that_was_broken_off_may_raise_anything() -> None:
    what = "\n        ".join(
        ["try: time.sleep(60)", "except BaseException as e: raise ImportError('broken') from e"]
    )
    found = ended(COMMAND.format(what=what), signal.SIGINT)
    assert found == (130, "closed\n", "mjspace: interrupted\n")


CATCHES = "\n        ".join(
    ["while True:", "    try: time.sleep(60)", "    except BaseException: pass"]
)


def test_what_catches_everything_is_left_after_the_grace_time_or_a_second_signal() -> None:
    began = time.monotonic()
    assert ended(COMMAND.format(what=CATCHES), signal.SIGTERM)[::2] == (
        143,
        "mjspace: interrupted\n",
    )
    assert time.monotonic() - began > interrupts.GRACE
    began = time.monotonic()
    twice = ended(COMMAND.format(what=CATCHES), signal.SIGINT, signal.SIGINT)
    assert twice[::2] == (130, "mjspace: interrupted\n")
    assert time.monotonic() - began < interrupts.GRACE


def test_an_ignored_signal_stays_ignored() -> None:
    ignored = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)"
    within = "with on_signals() as stop: time.sleep(0.3); print(stop())"
    code = f"{ignored}\nfrom mjspace.interrupts import on_signals\n" + COMMAND.format(what=within)
    assert ended(code, signal.SIGHUP) == (0, "False\nclosed\n", "")


def test_a_signal_during_the_imports_is_one_line(tmp_path: Path) -> None:
    """Also in what the command line itself is made of, which comes first."""
    (tmp_path / "typer.py").write_text("import time; print('ready', flush=True); time.sleep(60)")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    code = "from mjspace.__main__ import main; main()"
    assert ended(code, signal.SIGINT, env=environment) == (130, "", "mjspace: interrupted\n")


@pytest.fixture
def law(failing_law: Callable[..., Path]) -> Callable[..., Path]:
    """Write a scenario of 0.2 s whose law does ``what`` after a time; return its path."""
    before = 'base = "detumble-wheels"\nchecks = []\nduration = 0.2\n'
    return lambda what, at=0.0505: failing_law(at, before, what)


def soon(number: signal.Signals, reached: Callable[[], bool] = lambda: True) -> None:
    """Send the process that signal soon after something is reached."""

    def send() -> None:
        while not reached():
            time.sleep(0.01)
        time.sleep(0.1)
        os.kill(os.getpid(), number)

    threading.Thread(target=send, daemon=True).start()


GUARDED = """
            while True:
                try:
                    time.sleep(1e9)
                except:
                    pass
"""


@pytest.mark.parametrize("what", ["while True: pass", "time.sleep(1e9)", GUARDED])
def test_a_law_that_does_not_return_is_broken_off_and_the_log_is_whole(
    law: Callable[..., Path], what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interrupts, "GRACE", 0.2)
    marked = tmp_path / "there"
    path = law(f"Path({str(marked)!r}).touch()\n            {what}")
    soon(signal.SIGTERM, marked.exists)
    began = time.monotonic()
    result = run(path, out=tmp_path / "out")
    assert time.monotonic() - began < 5.0
    assert result.signal == signal.SIGTERM
    assert result.trouble.startswith("interrupted by signal 15 at t = 0.05 s: law.py:")
    assert result.trouble.endswith(" did not return")
    assert result.log.complete
    assert result.log.end == pytest.approx(0.05)
    assert [event.message for event in result.log.events()] == [result.trouble]


def test_a_flight_broken_off_before_it_has_begun_is_ctrl_c_as_usual(
    law: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interrupts, "GRACE", 0.1)
    path = law(f"Path({str(tmp_path / 'there')!r}).touch(); time.sleep(1e9)", at=-1.0)
    soon(signal.SIGINT, (tmp_path / "there").exists)
    with pytest.raises(KeyboardInterrupt):
        run(path, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.parametrize("error", ["SystemExit", "KeyboardInterrupt", "GeneratorExit"])
def test_a_law_ends_no_program(law: Callable[..., Path], error: str, tmp_path: Path) -> None:
    result = run(law(f"raise {error}"), out=tmp_path / "out")
    assert result.trouble == f"stopped at t = 0.055 s: the law raised {error} at law.py:16"
    assert result.signal == 0
    assert isinstance(result.error, FlightError)
    assert result.log.complete
    assert result.log.end == pytest.approx(0.05)


@pytest.mark.parametrize("where", ["module", "class"])
def test_a_law_that_cannot_be_made_ends_no_program_either(
    law: Callable[..., Path], where: str, tmp_path: Path
) -> None:
    path = law("pass")
    text = (tmp_path / "law.py").read_text()
    exits = "raise SystemExit(0)\n"
    constructor = f"\n    def __init__(self):\n        {exits}"
    (tmp_path / "law.py").write_text(exits + text if where == "module" else text + constructor)
    with pytest.raises(ValueError, match=r"SystemExit( at law.py:20)?: 0"):
        run(path, out=tmp_path / "out")


def test_a_signal_ends_a_compiled_block_within_a_period(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: NativeBatch, function: int, argument: int) -> None:
        interrupts.received[0] = signal.SIGTERM
        apply(self, function, argument)

    apply = NativeBatch.apply
    monkeypatch.setattr(NativeBatch, "apply", interrupted)
    built = assemble(*load("detumble-wheels", ["duration=1"]))
    blocks: list[Any] = []
    try:
        with pytest.raises(Interrupted):
            blocks.extend(iter_until(fly(built, first_start(built, (0,))), blocks))
    finally:
        interrupts.received[0] = 0
    (block,) = blocks
    assert block.time == pytest.approx([0.0])  # which Python flew


def iter_until(flight: Any, blocks: list[Any]) -> Any:
    """Keep each block also where the flight raises."""
    for block in flight:
        blocks.append(block)
    return ()


def test_a_signal_is_noticed_while_python_is_not_running() -> None:
    """The handler waits for the main thread: a thread notes the signal for compiled code."""
    with interrupts.on_signals():
        signal.signal(signal.SIGTERM, lambda *_: None)  # as if it did not run
        os.kill(os.getpid(), signal.SIGTERM)
        due = time.monotonic() + 5.0
        while not interrupts.received[0] and time.monotonic() < due:
            time.sleep(0.001)
        assert interrupts.received[0] == signal.SIGTERM
    assert interrupts.received[0] == 0


def test_a_second_signal_is_obeyed_as_before() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt), interrupts.on_signals() as stop:  # noqa: PT012
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)  # to the process, and to its group
        time.sleep(1.5 * interrupts.AGAIN)
        reached.append(stop.signal)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1.0)
    assert reached == [signal.SIGINT]


def test_what_has_not_begun_is_broken_off_at_once() -> None:
    began = time.monotonic()
    with (  # noqa: PT012
        pytest.raises(KeyboardInterrupt),
        interrupts.on_signals() as stop,
        stop.breakable(at_once=True),
    ):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(10.0)
    assert time.monotonic() - began < interrupts.GRACE


def test_a_log_ends_whole_at_a_hang_up(tmp_path: Path, law: Callable[..., Path]) -> None:
    result = run(law(f"import os; os.kill(os.getpid(), {int(signal.SIGHUP)})"), out=tmp_path / "o")
    assert result.signal == signal.SIGHUP
    assert Log(result.path).complete
