"""A replay in one HTML file: it opens from disk, loads nothing, and its plots follow."""

import re
from pathlib import Path

import browser
import chromium
import numpy as np
import pytest

from mjspace.log.reader import Log
from mjspace.view.export import export


@pytest.fixture(scope="module")
def file(pictured_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "replay.html"
    export(Log(pictured_log), path)
    return path


def test_the_file_can_be_mailed_and_loads_nothing(file: Path) -> None:
    text = file.read_text()
    assert len(text) < 5e6  # 1.9 MB
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    assert "default-src &#39;none&#39;" in policy[1]
    assert not re.search(r"https?:", policy[1])


def test_another_ending_is_refused_before_anything_is_recorded(
    pictured_log: Path, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=r"x\.mp4.*end it in \.html"):
        export(Log(pictured_log), tmp_path / "x.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@chromium.needed
def test_the_file_plays_from_disk_and_a_click_into_a_plot_goes_there(
    file: Path, tmp_path: Path
) -> None:
    with browser.opened(file.as_uri(), tmp_path / "profile") as page:
        page.until("Number(document.getElementById('viewer')?.dataset.time) > 0.1")
        x, y, width = page.value(f"(r => [r.x, r.y, r.width])({PLOT}.getBoundingClientRect())")
        pictures = []
        for share in (0.2, 0.95):
            page.click(x + share * width, y + 40)
            # The axis is from 0 to 1 s; a pixel is 2 to 4 ms.
            shown = "Number(document.getElementById('viewer').dataset.time)"
            page.until(f"Math.abs({shown} - {share}) < 0.01")
            pictures.append(page.still_picture("document.getElementById('viewer')"))
    before, after = pictures
    assert (np.abs(after - before).max(axis=-1) > 30).mean() > 0.01


PLOT = "document.querySelector('.u-over')"
