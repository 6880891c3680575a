"""A page opened in headless Chromium, where it is installed: its DOM and what the console says."""

import shutil
import subprocess
from pathlib import Path

import pytest

PROGRAM = shutil.which("chromium") or shutil.which("google-chrome")
needed = pytest.mark.skipif(PROGRAM is None, reason="no Chromium is installed")
_QUIET = ("disable-gpu", "no-first-run", "disable-background-networking", "disable-sync")


def opened(page: Path, folder: Path, *, width: int = 1280) -> tuple[str, list[str]]:
    """Return the DOM of the page, once its scripts have run, and the lines of the console."""
    done = subprocess.run(
        [
            str(PROGRAM),
            *("--headless", "--no-sandbox", *(f"--{option}" for option in _QUIET)),
            *("--disable-component-update", f"--user-data-dir={folder}"),
            *("--enable-logging=stderr", "--virtual-time-budget=5000"),
            *(f"--window-size={width},900", "--dump-dom", page.absolute().as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]
