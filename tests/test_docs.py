"""What the pages say is run: files are written, commands typed, Python executed."""

import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FENCE = re.compile(r"^```(\w+)(?: file=(\S+))?\n(.*?)^```$", re.M | re.S)
PAGES = ["docs/tutorial.md", "docs/rendering.md", "docs/lander.md", "README.md"]


def test_the_scenario_reference_is_what_the_model_says() -> None:
    reference = runpy.run_path(str(ROOT / "tools/scenario_reference.py"))
    assert reference["PAGE"].read_text() == reference["page"]()


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_everything_on_the_page_works(page: str, tmp_path: Path) -> None:
    blocks = FENCE.findall((ROOT / page).read_text())
    assert blocks
    paths = [str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = os.environ | {"PATH": os.pathsep.join(paths)}

    def do(command: list[str]) -> None:
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, (command, done.stdout, done.stderr)

    for language, file, text in blocks:
        if file:
            (tmp_path / file).write_text(text)
        elif language == "python":
            do([sys.executable, "-c", text])
        elif language == "console":
            for line in text.splitlines():
                if line.startswith("$ mjspace"):
                    do(shlex.split(line.removeprefix("$ "), comments=True))
