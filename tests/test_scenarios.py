"""Every scenario, whole: it flies, keeps its checks, and its log is what other tools expect."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mjspace.flight import run
from mjspace.loading import scenario_names

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::mjspace.plant.UnphysicalInertiaWarning"),
]


@pytest.mark.parametrize("name", scenario_names())
def test_it_keeps_its_checks_and_its_log_is_clean(name: str, tmp_path: Path) -> None:
    result = run(name, out=tmp_path)
    assert not result.trouble
    assert result.verdicts
    assert result.passed, [verdict.line for verdict in result.verdicts]
    assert result.log.complete
    rerun = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if rerun is None:
        pytest.skip("rerun is not installed; the flight itself is judged")
    done = subprocess.run([rerun, "mcap", "check", result.path], capture_output=True, text=True)
    table = [line.split() for line in done.stdout.splitlines() if "/" in line[:40]]
    listed = {row[3]: row[0] for row in table if len(row) > 3 and row[3].startswith("/")}
    assert set(result.log.topics) <= set(listed), done.stdout
    assert set(listed.values()) == {"ok"}, done.stdout
