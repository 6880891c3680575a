"""The blocks of documentation pages: files with their titles, commands, Python."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
_FENCE = re.compile(r'^```(\w+)(?: title="(\S+)")?\n(.*?)^```$', re.M | re.S)


def blocks(text: str) -> list[tuple[str, str, str]]:
    """Return (language, title or "", content) of each fenced block of a page's ``text``."""
    return _FENCE.findall(text)


def write_files(page: str, folder: Path) -> None:
    """Write the files that the ``page`` shows into the ``folder``."""
    for _, name, text in blocks((ROOT / page).read_text()):
        if name:
            (folder / name).write_text(text)
