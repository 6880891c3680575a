"""Worker processes: what is stopped, and that none outlives its parent."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from processes import in_session, left_in_session

from mjspace.errors import FlightError
from mjspace.interrupts import Stop
from mjspace.log.reader import Log
from mjspace.runner import workers

SLEEP = "import time; time.sleep(60)"


def test_once_stopped_nothing_begins_and_what_is_under_way_ends() -> None:
    began = time.monotonic()
    calls = [(exec, "pass"), *[(exec, SLEEP)] * 5]
    stop, done = Stop(), []
    for index, _ in workers.each(calls, stop):
        done.append(index)
        stop.signal = signal.SIGTERM
    assert done == [0]
    assert time.monotonic() - began < 30.0


def test_a_generator_that_is_left_ends_its_workers() -> None:
    began = time.monotonic()
    each = workers.each([(exec, "pass"), *[(exec, SLEEP)] * 5])
    next(each)
    each.close()
    assert time.monotonic() - began < 30.0


def test_a_worker_that_was_killed_is_one_line() -> None:
    suicide = f"import os; os.kill(os.getpid(), {int(signal.SIGKILL)})"
    with pytest.raises(FlightError, match="a process that flies was killed"):
        list(workers.each([(exec, suicide)]))


def test_a_stopped_worker_begins_nothing() -> None:
    """As what waits in its queue when the parent asks it to stop."""
    before = signal.getsignal(signal.SIGTERM)
    calls: list[int] = []
    workers._stopped.set()
    try:
        assert workers._make(calls.append, 1) == []
    finally:
        workers._stopped.clear()
        signal.signal(signal.SIGTERM, before)
    assert calls == []


INTERRUPTED = """
import signal
from multiprocessing.popen_forkserver import Popen
from mjspace.interrupts import ended_by_signals, on_signals
from mjspace.runner import workers
launch = Popen._launch
def launched(popen, process):
    launch(popen, process)
    signal.raise_signal(signal.SIGINT)
Popen._launch = launched
with ended_by_signals(), on_signals() as stop:
    list(workers.each([(exec, "pass")] * 4, stop, 4))
"""


@pytest.mark.skipif(workers._METHOD != "forkserver", reason="another process begins the workers")
def test_workers_that_are_beginning_when_a_signal_comes_say_nothing() -> None:
    """The first finds the semaphores of its parent gone."""
    found = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=30
    )
    assert (found.returncode, found.stderr) == (130, "mjspace: interrupted\n")


def test_every_call_is_made_though_a_pool_holds_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "_AHEAD", 2)
    calls = [(int, str(number)) for number in range(7)]
    assert sorted(workers.each(calls, processes=2)) == [(n, n) for n in range(7)]


PARENT = f"""
from mjspace.runner import workers
list(workers.each([(exec, "print('up', flush=True); {SLEEP}")] * 4))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks for the processes in /proc")
@pytest.mark.parametrize(
    "number", [signal.SIGKILL, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_no_process_outlives_its_parent(number: signal.Signals) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, start_new_session=True
    ) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()
        assert len(in_session(parent.pid)) > 2
        parent.send_signal(number)
        parent.stdout.read()  # until nobody holds it any more
    assert not left_in_session(parent.pid)


@pytest.mark.slow
def test_interrupted_flights_of_all_are_reported_with_their_logs_whole(tmp_path: Path) -> None:
    """A terminal sends Ctrl-C to the whole group: the parent decides what becomes of workers."""
    going = subprocess.Popen(
        [sys.executable, "-m", "mjspace", "run", "--all", "--out", str(tmp_path / "all")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not list(tmp_path.glob("all/*/flight.mcap")):
        assert going.poll() is None
        time.sleep(0.05)
    began = time.monotonic()
    os.killpg(going.pid, signal.SIGINT)
    out, err = going.communicate(timeout=60)
    assert time.monotonic() - began < 10.0
    assert going.returncode == 130
    assert "interrupted by signal 15" in out
    assert err.splitlines()[-1].startswith("mjspace: interrupted: ")
    assert not left_in_session(going.pid)
    for log in tmp_path.glob("all/*/flight.mcap"):
        assert Log(log).complete
