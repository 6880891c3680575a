"""The command line through its real entry point, as a user types it."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from mjspace import __version__
from mjspace.cli import main
from mjspace.log.reader import Log

MJSPACE = [sys.executable, "-m", "mjspace"]
SHORT = ("--set", "duration=0.3")


def mjspace(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*MJSPACE, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=120
    )


@pytest.fixture(scope="module")
def flown(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, subprocess.CompletedProcess[str]]:
    folder = tmp_path_factory.mktemp("flown")
    done = mjspace("run", "contraction-ideal", *SHORT, "--set", "checks=[]", "--out", folder)
    return folder / "flight.mcap", done


def test_help_and_list() -> None:
    assert "replay" in mjspace("--help").stdout
    listed = json.loads(mjspace("list", "--json").stdout)
    assert "contraction-adaptive" in listed
    lines = mjspace("list").stdout
    for name, description in listed.items():
        assert f"{name} " in lines
        assert description
    assert lines.startswith("arms:\n  arm-reaction ")
    assert "\nlanding:\n  lander " in lines
    some = json.loads(mjspace("list", "Lander", "crater", "--json").stdout)
    assert list(some) == ["lander-craters", "lander-divert"]
    none = mjspace("list", "warp")
    assert (none.returncode, none.stderr) == (2, "mjspace: list: no scenario says 'warp'\n")


def test_version() -> None:
    done = mjspace("--version")
    assert (done.returncode, done.stdout) == (0, f"mjspace {__version__}\n")


def test_a_run_that_keeps_its_checks_ends_with_0(
    flown: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    log, done = flown
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # no warning of the papers' inertia, which is meant
    assert str(log) in done.stdout
    assert Log(log).end == pytest.approx(0.3)


def test_a_run_that_fails_a_check_ends_with_1_and_says_which(tmp_path: Path) -> None:
    check = "checks=[{name='impossible', signal='truth.attitude_error', below=-1}]"
    done = mjspace("run", "contraction-ideal", *SHORT, "--set", check, "--out", tmp_path)
    assert done.returncode == 1
    assert "impossible" in done.stdout
    assert "FAIL" in done.stdout
    events = Log(tmp_path / "flight.mcap").events()
    assert any(e.level == "ERROR" and "impossible" in e.message for e in events)


def test_json_is_all_there_is(tmp_path: Path) -> None:
    done = mjspace("run", "contraction-ideal", *SHORT, "--out", tmp_path, "--seed", "5", "--json")
    found = json.loads(done.stdout)
    assert found["passed"] is (done.returncode == 0)
    assert {check["name"] for check in found["checks"]}
    assert Log(found["log"]).metadata["seed"] == "5"


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["run", "contraction-idael"], ["contraction-ideal"]),
        (["run"], ["SCENARIO", "--all"]),
        (["run", "contraction-ideal", "--all"], ["SCENARIO", "--all"]),
        (["run", "--all", "--plot"], ["--all", "pictures"]),
        (["run", "nowhere.toml"], ["nowhere.toml"]),
        (
            ["run", "contraction-ideal", "--set", "law.rate_gian=1"],
            ["law", "rate_gian", "rate_gain"],
        ),
        (["run", "contraction-ideal", "--set", "law.rate_gain=-1"], ["law", "rate_gain", "-1"]),
        (["run", "contraction-ideal", "--set", "plant.model=cubsat"], ["cubsat", "satellite_3rw"]),
        (["run", "contraction-ideal", "--duration", "2 kg"], ["duration", "2 kg"]),
        (["run", "contraction-ideal", "--set", "initial.wheel_speed=[1]"], ["initial"]),
        (
            ["run", "contraction-ideal", "--set", "sensors.rate.delay='1.5 ms'"],
            ["sensors.rate.delay"],
        ),
        (
            ["run", "contraction-ideal", "--set", "checks.0.signal=truth.eror"],
            ["checks.0.signal", "truth.eror"],
        ),
        (
            ["run", "contraction-ideal", "--set", "environment.python=x.py:f"],
            ["environment.python"],
        ),
        (["info", "nothing.mcap"], ["nothing.mcap"]),
        (["info", "nothing.mcap", "--compiled"], ["--compiled: nothing.mcap is a log"]),
        (["replay", "nothing.mcap"], ["nothing.mcap"]),
        (["plot", "nothing.mcap", "-o", "x.png"], ["nothing.mcap"]),
        (["render", "nothing.mcap", "-o", "x.png"], ["nothing.mcap"]),
    ],
)
def test_bad_input_gets_one_line_and_2_and_nothing_is_written(
    tmp_path: Path,
    arguments: list[str],
    parts: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["mjspace", *arguments])
    with warnings.catch_warnings():
        warnings.simplefilter("default")  # told, as on a command line, not raised
        with pytest.raises(SystemExit) as ended:
            main()
    assert ended.value.code == 2
    told = capsys.readouterr().err.splitlines()
    lines = [line for line in told if not line.startswith("mjspace: warning")]
    assert len(lines) == 1, told
    for part in parts:
        assert part in lines[0]
    assert not list(tmp_path.iterdir())


def test_info_shows_a_scenario_with_its_defaults_and_a_log(
    flown: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    assert "coulomb_friction = 0.0" in mjspace("info", "contraction-ideal").stdout
    found = json.loads(mjspace("info", flown[0], "--json").stdout)
    assert found["complete"] is True
    assert found["topics"]["/truth"]["rate"] == [3]
    assert found["units"]["/truth"]["rate"] == "rad/s"
    assert found["units"]["/law"] == {}
    shown = " ".join(mjspace("info", flown[0]).stdout.split())
    assert "contraction-ideal" in shown
    assert "rate 3 [rad/s]" in shown


def test_info_says_what_of_a_flight_is_compiled() -> None:
    said = "compiled: sensors, law and actuators"
    assert mjspace("info", "contraction-ideal", "--compiled").stdout == f"{said}\n"
    assert json.loads(mjspace("info", "contraction-ideal", "--compiled", "--json").stdout) == said


def test_info_names_all_that_keeps_a_flight_in_python() -> None:
    assert re.fullmatch(
        r"flown in Python: a Python number, or text, made of a measured value \(dgvscmg\.py:\d+\), "
        r"and the law has an inner loop\n",
        mjspace("info", "dgvscmg-slow-loops", *SHORT, "--compiled").stdout,
    )
    noisy = "faults=[{motor='wheel_1',kind='noisy',value=0.01,at=1}]"
    assert mjspace("info", "wheel-failure", "--set", noisy, "--compiled").stdout == (
        "flown in Python: the faults: a noisy motor is called in Python\n"
    )


def test_replay_verifies_and_flies_another_law(
    flown: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    log, _ = flown
    done = mjspace("replay", log, "--verify")
    assert (done.returncode, done.stdout.split(":")[0]) == (0, "identical"), done.stderr
    done = mjspace("replay", log, "--verify", "--from", "0.2", "--json")
    assert json.loads(done.stdout)["identical"] is True
    law = ["--from", "0.1", "--law", "contraction:Ideal", "--gain", "rate_gain=10"]
    done = mjspace("replay", log, *law, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert Log(tmp_path / "flight.mcap").start == pytest.approx(0.1)
    assert mjspace("replay", log, "--verify", "--law", "contraction:Ideal").returncode == 2


def start_long_flight(folder: Path) -> subprocess.Popen[str]:
    """Return a flight that would last long, once its log has begun to grow."""
    going = subprocess.Popen(
        [*MJSPACE, "run", "contraction-ideal", "--duration", "10000", "--out", str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until(lambda: logged(folder / "flight.mcap") > 0.0, going)
    return going


def logged(log: Path) -> float:
    """Return the time that the log reaches, zero while there is none."""
    try:
        return Log(log).end
    except (OSError, ValueError):
        return 0.0


def wait_until(condition: Callable[[], bool], going: subprocess.Popen[str]) -> None:
    for _ in range(1200):
        if condition():
            return
        assert going.poll() is None, going.communicate()
        time.sleep(0.1)
    going.kill()
    raise AssertionError(f"nothing happened for two minutes: {going.communicate()}")


def test_a_killed_run_keeps_what_was_logged(tmp_path: Path) -> None:
    going = start_long_flight(tmp_path)
    log = tmp_path / "flight.mcap"
    first = logged(log)
    wait_until(lambda: logged(log) > first, going)  # it grows as it flies
    before = logged(log)
    going.send_signal(signal.SIGKILL)
    going.communicate()
    killed = Log(log)
    assert not killed.complete
    assert killed.end >= before
    assert len(killed.read("/truth")["time"]) == len(killed)
    assert mjspace("info", log).returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_its_log(tmp_path: Path, number: signal.Signals) -> None:
    going = start_long_flight(tmp_path)
    going.send_signal(number)
    out, err = going.communicate(timeout=60)
    assert going.returncode == 128 + number, err
    assert "interrupted" in out
    log = Log(tmp_path / "flight.mcap")
    assert log.complete
    assert any("interrupted" in event.message for event in log.events())
    assert mjspace("replay", tmp_path / "flight.mcap", "--verify").returncode == 0


@pytest.mark.skipif(os.geteuid() != 0, reason="a full disk is made by mounting a small one")
def test_a_full_disk_ends_the_run_and_keeps_what_was_logged(tmp_path: Path) -> None:
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", tmp_path], check=False
    )
    if mounted.returncode:
        pytest.skip("this root may not mount")
    try:
        done = mjspace("run", "contraction-ideal", "--duration", "100", "--out", tmp_path)
        assert done.returncode == 1
        assert "No space left" in done.stderr
        assert len(done.stderr.splitlines()) == 1
        log = Log(tmp_path / "flight.mcap")
        assert not log.complete
        assert log.end > 0.5
    finally:
        subprocess.run(["umount", tmp_path], check=True)


def test_what_ones_own_law_raises_is_shown_in_full_on_request(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "class Law:\n"
        "    def reset(self, measurement, reference):\n"
        "        return None\n"
        "    def step(self, state, time, measurement, reference):\n"
        "        return 1 / 0\n"
    )
    (tmp_path / "own.toml").write_text(
        'description = "raises"\nduration = 1\nreference.kind = "references:Hold"\n'
        'law.kind = "own.py:Law"\n'
    )
    line = "mjspace: stopped at t = 0 s: the law raised ZeroDivisionError at own.py:5: division"
    brief = mjspace("run", str(tmp_path / "own.toml"), "--out", str(tmp_path / "out"))
    assert brief.returncode == 1
    assert brief.stderr.startswith(line)
    assert len(brief.stderr.splitlines()) == 1
    full = mjspace("run", str(tmp_path / "own.toml"), "--out", str(tmp_path / "out"), "--traceback")
    assert full.returncode == 1
    assert full.stderr.startswith("Traceback (most recent call last):")
    assert 'own.py", line 5, in step' in full.stderr
    assert full.stderr.splitlines()[-1].startswith(line)
