"""Every scenario, whole: it flies, keeps its checks, and its log is what other tools expect."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.runner.checks import Verdict
from mjspace.runner.run import Result, run
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import load

LONG = 100_000  # integration steps: a quarter of a minute, on a busy machine half of one
FLAGSHIPS = {"dgvscmg-tracking", "lander"}  # flown whole however long


def is_long(name: str) -> bool:
    scenario, _ = load(name)
    return scenario.duration / scenario.rates.physics > LONG and name not in FLAGSHIPS


def whole(name: str) -> Any:
    return pytest.param(name, marks=pytest.mark.long if is_long(name) else pytest.mark.slow)


@pytest.mark.parametrize("name", [whole(name) for name in scenario_names()])
def test_it_keeps_its_checks_and_its_log_is_clean(name: str, tmp_path: Path) -> None:
    result = run(name, out=tmp_path)
    assert not result.trouble
    assert result.verdicts
    assert result.passed, [v.line for v in result.verdicts if not v.as_expected]
    # A crash is judged in any flight above a ground: only the scenario's own checks have a bound.
    own = [verdict for verdict in result.verdicts if verdict.check in load(name)[0].checks]
    loose = [verdict.line for verdict in own if not is_tight(verdict)]
    assert not loose
    assert_clean(result)


def is_tight(verdict: Verdict) -> bool:
    """Return whether a change of the measured value by a factor of three would be noticed.

    The bound of a check that is to fail is where it would hold.

    What is as small as rounding, and differs between machines as that does, has a factor of 200.
    """
    measured, check = verdict.measured, verdict.check
    if check.expected == "FAIL":
        return True
    factor = 200.0 if abs(measured) < 1e-11 else 3.0
    scale = 0.0 if check.target is None else float(np.linalg.norm(check.target))
    return any(
        abs(bound - measured) <= (1.0 - 1.0 / factor) * max(abs(bound), abs(measured))
        or abs(bound) <= max(1e-12, 1e-6 * scale)
        for bound in (check.below, check.above)
        if bound is not None
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in scenario_names() if is_long(name)])
def test_a_long_one_begins_and_its_log_is_clean(name: str, tmp_path: Path) -> None:
    result = run(name, overrides=["duration=1", "checks=[]"], out=tmp_path)
    assert not result.trouble
    assert_clean(result)


def assert_clean(result: Result) -> None:
    assert result.log.complete
    rerun = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if rerun is None:
        pytest.skip("rerun is not installed; the flight itself is judged")
    done = subprocess.run([rerun, "mcap", "check", result.path], capture_output=True, text=True)
    table = [line.split() for line in done.stdout.splitlines() if "/" in line[:40]]
    listed = {row[3]: row[0] for row in table if len(row) > 3 and row[3].startswith("/")}
    assert set(result.log.topics) <= set(listed), done.stdout
    assert set(listed.values()) == {"ok"}, done.stdout
