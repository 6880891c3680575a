"""What a terminal shows while something takes its time, and what --quiet leaves of it."""

import io
import itertools
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mjspace import compiling
from mjspace.cli import app
from mjspace.runner.live import figures
from mjspace.runner.run import fly_to_log
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.terminal import reporting
from mjspace.terminal.reporting import compile_bar, flight_bar, frame_bar

SHORT = ["run", "detumble-wheels", "--duration", "0.05", "--set", "checks=[]", "--out"]


class Terminal(io.StringIO):
    """Keeps what is shown."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Show bars at once, 100 columns wide; what a command changes of that is undone."""
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(reporting, "DELAY", 0.0)
    monkeypatch.setattr("tqdm.tqdm.monitor_interval", 0)  # a thread that would outlive the test
    shown, told = reporting.silent.set(False), compiling.watch.set(compiling.say_so)
    yield
    reporting.silent.reset(shown)
    compiling.watch.reset(told)


def test_a_flight_shows_time_speed_and_how_the_vehicle_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tqdm.std.time", itertools.count(100.0).__next__)
    with redirect_stderr(Terminal()) as screen, flight_bar(60.0) as show:
        show(15.0, "error 0.2 deg, wheel 3 N m s")
        shown = screen.getvalue()
    assert "flying  25% |" in shown
    assert "| 15/60 s, " in shown
    assert " x real time, error 0.2 deg, wheel 3 N m s [00:0" in shown


def test_where_nobody_looks_nothing_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    with flight_bar(60.0) as show, frame_bar() as drawn:
        show(15.0, "error 0.2 deg")
        drawn(3, 30)
    assert capsys.readouterr() == ("", "")


def test_a_video_says_how_many_frames_it_draws_and_how_long_that_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 100.0
    monkeypatch.setattr("tqdm.std.time", lambda: now)
    with redirect_stderr(Terminal()) as screen, frame_bar() as show:
        for drawn in range(30):
            now = 100.0 + 0.2 * drawn
            show(drawn, 300)
    lines = [line for line in screen.getvalue().replace("\r", "\n").splitlines() if "about" in line]
    assert lines == ["drawing 300 frames, about 60 s"]


def test_what_is_compiled_is_said_on_a_line_of_its_own() -> None:
    with redirect_stderr(Terminal()) as screen, flight_bar(60.0):  # noqa: SIM117
        with compile_bar("the environment", 40) as show:
            show(12)
    lines = screen.getvalue().replace("\r", "\n").splitlines()
    said = "mjspace: compiling the environment for this machine, once"
    assert said in [line.removeprefix("\x1b[A") for line in lines]  # up to where the bar began


def test_the_figures_are_those_of_the_log_at_that_time(tmp_path: Path) -> None:
    scenario, folder = load("detumble-wheels", ["duration=0.05", "checks=[]"])
    assembly, told = assemble(scenario, folder), []
    watch = lambda block: told.append(figures(assembly, block))  # noqa: E731
    truth = fly_to_log(assembly, tmp_path / "x.mcap", watch=watch).log.read("/truth")
    error = np.degrees(truth["attitude_error"][-1, 0])
    wheel = np.abs(assembly.vehicle.wheel_inertia * truth["wheel_speed"][-1]).max()
    assert told[-1] == f"error {error:.3g} deg, wheel {wheel:.3g} N m s"


def test_a_lander_tells_its_altitude(tmp_path: Path) -> None:
    scenario, folder = load("lander", ["duration=0.1", "checks=[]"])
    assembly, told = assemble(scenario, folder), []
    watch = lambda block: told.append(figures(assembly, block))  # noqa: E731
    truth = fly_to_log(assembly, tmp_path / "x.mcap", watch=watch).log.read("/truth", ["altitude"])
    assert told[-1].endswith(f" deg, altitude {truth['altitude'][-1, 0]:.3g} m")


def test_quiet_prints_nothing_and_the_status_tells(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, [*SHORT, str(tmp_path / "good"), "--quiet"])
    assert (done.exit_code, done.stdout) == (0, "")
    never = 'checks=[{name="x", signal="truth.rate", statistic="max", below=0}]'
    words = [*SHORT, str(tmp_path / "bad"), "-q", "--set", never]
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, done.stdout) == (1, "")


@pytest.mark.parametrize("both", [["--json", "--quiet"], ["--quiet", "--json"]])
def test_quiet_leaves_the_json(tmp_path: Path, both: list[str]) -> None:
    done = CliRunner().invoke(app, [*SHORT, str(tmp_path), *both])
    assert json.loads(done.stdout)["passed"]


def test_a_shell_completes_the_names_of_scenarios() -> None:
    words = {"COMP_WORDS": "mjspace run wheel-p", "COMP_CWORD": "2"}
    command = Path(sys.executable).with_name("mjspace")
    asked = os.environ | words | {"_MJSPACE_COMPLETE": "complete_bash"}
    done = subprocess.run([command], env=asked, capture_output=True, text=True)
    assert done.stdout.split() == ["wheel-pyramid", "wheel-pyramid-least-squares"], done.stderr
