"""Write the tables of docs/performance.md: run the benchmarks that stand in it, on an idle machine.

``python tools/performance_page.py [SCRIPT...]``: those of benchmarks/ that are named, or all that
the page has. A table stands between ``<!-- benchmark: SCRIPT ARGUMENTS -->`` and ``<!-- end -->``.
"""

import platform
import re
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/performance.md"
BLOCK = re.compile(r"(<!-- benchmark: (.*?) -->\n).*?(<!-- end -->)", re.DOTALL)


def main() -> None:
    """Run them and rewrite their blocks."""
    chosen = sys.argv[1:]

    def table(block: re.Match[str]) -> str:
        script, *arguments = shlex.split(block[2])
        if chosen and script not in chosen:
            return block[0]
        command = [sys.executable, f"benchmarks/{script}", *arguments]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
        command_line = f"python benchmarks/{block[2]}"
        return (
            f"{block[1]}\n`{command_line}`, {measured_on()}\n\n{done.stdout.strip()}\n\n{block[3]}"
        )

    PAGE.write_text(BLOCK.sub(table, PAGE.read_text()))


def measured_on() -> str:
    """Return when and where."""
    versions = f"MuJoCo {version('mujoco')}, NumPy {version('numpy')}"
    day = datetime.now(UTC).date()
    return f"{day}, {processor()}, Python {platform.python_version()}, {versions}:"


def processor() -> str:
    """Return the processor's name, and how many there are."""
    cpuinfo = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*: (.*)", cpuinfo.read_text()) if cpuinfo.exists() else []
    return f"{len(names)} x {names[0]}" if names else platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
