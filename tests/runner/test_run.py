"""Runs: progress, verdict, log, and flights that break off."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from blocks import blocks_of

from mjspace.errors import InputError
from mjspace.runner.run import output_folder, run
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block

SHORT = [
    "duration=0.1",
    "checks=[{name='end',signal='truth.rate[0]',statistic='final',below=1},"
    "{name='fast',signal='truth.rate',below=0.1}]",
    "events=[{name='turns',signal='truth.rate',above=0.1}]",
]


@pytest.fixture(autouse=True)
def _many_blocks() -> Iterator[None]:
    with blocks_of(8):
        yield


def test_progress_is_the_time_of_each_block_and_the_verdict_of_the_whole_log(
    tmp_path: Path,
) -> None:
    told: list[float] = []
    result = run("detumble-wheels", overrides=SHORT, out=tmp_path / "new", progress=told.append)
    assert told == pytest.approx([0.035, 0.075, 0.1], rel=1e-12)
    assert (result.trouble, result.signal, result.passed) == ("", 0, False)
    final, fast = result.verdicts
    assert final.measured == result.log.read("/truth", ["rate"])["rate"][-1, 0]
    events = result.log.events()
    assert [(e.time, e.level) for e in events] == [(0.0, "INFO"), (0.1, "INFO"), (0.1, "ERROR")]
    assert events[0].message.startswith("turns: truth.rate = ")
    assert [e.message for e in events[1:]] == [final.line, fast.line]
    # Once more into a folder that is there already.
    again = run("detumble-wheels", overrides=SHORT, out=tmp_path / "new", force=True)
    assert again.path == result.path


def test_a_flight_that_breaks_off_fails_though_its_checks_hold(
    tmp_path: Path, failing_law: Callable[..., Path]
) -> None:
    told: list[float] = []
    result = run(
        failing_law(0.0505), overrides=["duration=0.1"], out=tmp_path, progress=told.append
    )
    assert all(verdict.as_expected for verdict in result.verdicts)
    assert not result.passed
    assert "the law raised ArithmeticError" in result.trouble
    assert "no way on" in result.trouble
    assert isinstance(result.error and result.error.__cause__, ArithmeticError)
    assert result.log.complete
    assert result.log.end == told[-1] == pytest.approx(0.05)
    assert [(e.level, e.message) for e in result.log.events()] == [("ERROR", result.trouble)]


def test_an_interrupted_flight_is_judged_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments: Any, **options: Any) -> Iterator[Block]:
        for number, block in enumerate(fly(*arguments, **options)):
            if number == 1:
                os.kill(os.getpid(), signal.SIGTERM)
            yield block

    monkeypatch.setattr("mjspace.runner.run.fly", interrupted)
    result = run("detumble-wheels", overrides=[*SHORT[:1], "checks=[]"], out=tmp_path)
    assert result.signal == signal.SIGTERM
    assert result.trouble == "interrupted by signal 15 at t = 0.075 s"
    assert not result.passed
    assert result.error is None
    assert [e.message for e in result.log.events()] == [result.trouble]


def test_a_run_without_a_folder_has_one_of_its_own() -> None:
    assert output_folder("there", "x") == Path("there")
    folder = output_folder(None, "x")
    assert folder.parts[:2] == ("runs", "x")
    assert folder != output_folder(None, "x")


def test_a_log_knows_whose_flight_it_is(tmp_path: Path) -> None:
    result = run("detumble-wheels", overrides=["duration=0.01", "checks=[]"], out=tmp_path)
    assert result.log.metadata["member"] == "0"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("checks.0.below='3 m'", r"checks\.0\.below: got 3 m for truth\.rate\[0\], .* rad/s"),
        (
            "checks.1.signal='law.angle'",
            r"checks\.1\.below: got 0\.1 rad/s for law\.angle, .* rad$",
        ),
    ],
)
def test_a_bound_of_another_dimension_is_refused_before_anything_is_written(
    override: str, message: str, tmp_path: Path
) -> None:
    """Also where the law itself declares the signal's unit."""
    checks = SHORT[1].replace("below=0.1", "below='0.1 rad/s'")
    with pytest.raises(InputError, match=message):
        run("rcs-schmitt", overrides=[SHORT[0], checks, override], out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
