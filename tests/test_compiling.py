"""What is compiled at its first use is compiled by one process, and said."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import pytest

from mjspace import compiling
from mjspace.compiling import first_use
from mjspace.terminal.reporting import report_errors


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """What users are told: what is compiled and of how many functions, then how many are done."""
    found: list[Any] = []

    @contextmanager
    def watch(what: str, functions: int) -> Iterator[Callable[[int], None]]:
        found.append((what, functions))
        yield found.append
        found.append("over")

    token = compiling.watch.set(watch)
    yield found
    compiling.watch.reset(token)


def test_users_are_told_of_each_function_that_is_compiled(told: list[Any]) -> None:
    @numba.njit
    def inner(x: Any) -> Any:
        return 2.0 * x

    with first_use(__file__, "a sum", 2):

        @numba.njit("f8(f8)")
        def outer(x: Any) -> Any:
            return 1.0 + inner(x)

    assert outer(2.0) == 5.0
    assert told == [("a sum", 2), 1, 2, "over"]


def test_nobody_is_told_where_nothing_is_compiled(told: list[Any]) -> None:
    with first_use(__file__, "nothing", 1):
        pass
    assert told == []


def test_who_waits_for_another_process_says_so(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    told: list[Any],
) -> None:
    monkeypatch.setattr(compiling, "_PATIENCE", 0.0)
    ready, file = tmp_path / "ready", str(tmp_path / "x.py")
    hold = (
        "import time, pathlib\n"
        "from mjspace.compiling import first_use\n"
        f"with first_use({file!r}):\n"
        f"    pathlib.Path({str(ready)!r}).touch()\n"
        "    time.sleep(0.5)\n"
    )
    with subprocess.Popen([sys.executable, "-c", hold]) as other:
        while not ready.exists() and other.poll() is None:
            pass
        with first_use(file, "a sum", 1):
            other.wait(1.0)  # it has let go of the lock, which is why this one has it
    assert told == []
    assert capsys.readouterr().err == (
        "mjspace: another process compiles a sum, for all: waiting for it\n"
    )


def test_where_nothing_can_be_kept_one_line_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from numba.core import caching

    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])
    with pytest.raises(SystemExit) as ended, report_errors():
        numba.njit(cache=True)(lambda x: x)
    assert ended.value.code == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mjspace: what is compiled can be kept neither")
    assert "NUMBA_CACHE_DIR" in line


@pytest.mark.long  # everything is compiled anew, in a minute
def test_the_first_flights_of_two_processes_compile_once_and_say_so(tmp_path: Path) -> None:
    alone = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-m", "mjspace", "run", "wheel-pyramid", "--duration", "0.2"]
    command += ["--set", "checks=[]", "--out"]

    def start(name: str) -> "subprocess.Popen[str]":
        words = [*command, tmp_path / name]
        return subprocess.Popen(words, env=alone, stderr=subprocess.PIPE, text=True)

    with start("a") as one, start("b") as other:
        lines = sorted([*one.communicate()[1].splitlines(), *other.communicate()[1].splitlines()])
    assert (one.returncode, other.returncode) == (0, 0)
    said = [line for line in lines if "waiting" not in line]
    assert said == [
        "mjspace: compiling the environment for this machine, once",
        "mjspace: compiling the loop of a flight for this machine, once",
    ]
    with start("c") as third:
        assert third.communicate()[1] == ""


@pytest.mark.long  # likewise
def test_as_many_functions_are_compiled_as_the_bars_say(tmp_path: Path) -> None:
    code = (
        "from contextlib import contextmanager\n"
        "from mjspace import compiling\n"
        "@contextmanager\n"
        "def watch(what, functions):\n"
        "    done = []\n"
        "    yield lambda now: done.append(now)\n"
        "    print(functions, len(done))\n"
        "compiling.watch.set(watch)\n"
        "from mjspace.environment.install import install_callbacks\n"
        "from mjspace.simulation.block_kernel import block_function\n"
        "install_callbacks()\n"
        "block_function()\n"
    )
    alone = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=alone, capture_output=True, text=True)
    counts = [list(map(int, line.split())) for line in done.stdout.splitlines()]
    assert len(counts) == 2, done.stderr
    for expected, compiled in counts:
        assert compiled == pytest.approx(expected, rel=0.1)
