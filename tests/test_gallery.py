"""The gallery names scenarios that exist, and has their pictures."""

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest
from PIL import Image

from mjspace.scenario.files import list_scenarios

ROOT = Path(__file__).parents[1]
PAGE, PICTURES = ROOT / "docs/gallery.md", ROOT / "docs/gallery"
LARGEST, TOGETHER = 20_000, 2_500_000  # bytes


def test_every_entry_is_a_scenario_with_a_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "tools")
    tool = import_module("gallery")
    monkeypatch.delitem(sys.modules, "gallery")
    text = PAGE.read_text()
    verdicts = dict(re.findall(r"^\*\*\[`(.+?)`\].*\*((?:PASS|FAIL): .+)\*$", text, re.MULTILINE))
    assert len(verdicts) >= 40
    assert verdicts.keys() <= list_scenarios().keys()
    assert {path.stem for path in PICTURES.iterdir()} == verdicts.keys()
    # So do descriptions and subjects: but for new scenarios the page is what the tool writes.
    shown = re.compile(r"^(All|\d+ of the) \d+ scenarios", re.MULTILINE)
    assert shown.sub("", tool.page(verdicts)) == shown.sub("", text)


def test_pictures_are_small() -> None:
    sizes = [path.stat().st_size for path in PICTURES.iterdir()]
    assert max(sizes) <= LARGEST
    assert sum(sizes) <= TOGETHER
    for path in PICTURES.iterdir():
        with Image.open(path) as image:
            assert (image.format, image.size) == ("WEBP", (800, 243))
