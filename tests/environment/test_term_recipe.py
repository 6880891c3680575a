"""The recipe of a native disturbance in docs/extending.md, followed to the letter."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r'^```(\w+)(?: title="(into )?(\S+)")?\n(.*?)^```$', re.M | re.S)
ABOVE = "    python: KindName | None"
"""The line above which the recipe has its own written."""


@pytest.mark.long  # the callback is compiled afresh
def test_a_native_disturbance_is_one_file_and_one_line(tmp_path: Path) -> None:
    page = (ROOT / "docs/extending.md").read_text()
    section = page.partition("## A native disturbance\n")[2].partition("\n## ")[0]
    shutil.copytree(ROOT / "mjspace", tmp_path / "mjspace")  # with its caches of machine code
    commands, changed = [], []
    for language, how, place, text in FENCE.findall(section):
        path = tmp_path / place
        if place and not how:
            assert not path.exists()
            path.write_text(text)
        elif how:
            before = path.read_text()
            assert before.count(ABOVE) == 1
            path.write_text(before.replace(ABOVE, text + ABOVE))
        elif language == "console":
            commands += [line.removeprefix("$ mjspace ") for line in text.splitlines()]
        if place.startswith("mjspace/"):
            changed.append(place)
    assert len(changed) == 2
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    for command in commands:
        call = [sys.executable, "-m", "mjspace", *shlex.split(command)]
        done = subprocess.run(
            call, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        assert "PASS" in done.stdout
