"""The phase plane of a flight with thrusters."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest
from full_disk import room_for
from matplotlib.colors import to_hex, to_rgb
from PIL import Image

from mjspace.log.reader import Log
from mjspace.plotting.phase_plane import figure, plot
from mjspace.plotting.style import COLORS, STYLE
from mjspace.runner.run import run


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("schmitt")
    return run("rcs-schmitt", overrides=["duration=0.25", "checks=[]"], out=folder).path


def test_the_path_is_in_degrees_and_colored_where_thrusters_fire(flown: Path) -> None:
    log = Log(flown)
    page = figure(log, "law.angle", "law.angle_rate")
    axes, law = page.axes[0], log.read("/law")
    assert axes.get_xlabel() == "law.angle [deg]"
    assert axes.get_ylabel() == "law.angle_rate [deg/s]"
    lines = {line.get_label(): line for line in axes.lines}
    np.testing.assert_allclose(lines["coast"].get_xdata(), np.degrees(law["angle"][:, 0]))
    # one pulse of 0.14 s, by the two thrusters that turn it back, and the row where it ends
    fired = np.asarray(lines["thrusters 6, 7"].get_ydata())
    assert to_hex(lines["thrusters 6, 7"].get_color()) == COLORS[0]
    on = np.flatnonzero(law["firing"][:, 0])
    assert np.flatnonzero(~np.isnan(fired)).tolist() == [*on, on[-1] + 1]
    (end,) = np.asarray(lines["end"].get_xdata())
    assert end == np.degrees(law["angle"][-1, 0])
    # it begins to fire after the first period, and ends once
    assert len(axes.collections[0].get_offsets()) == 2
    assert any(text.get_text() == "rcs-schmitt" for text in page.texts)


def test_signals_of_no_thruster_may_be_drawn(pictured_log: Path) -> None:
    axes = figure(Log(pictured_log), "truth.rate[0]", "truth.wheel_speed[0]").axes[0]
    assert axes.get_ylabel() == "truth.wheel_speed[0] [rpm]"
    assert not axes.collections


def test_the_file_is_a_picture(flown: Path, tmp_path: Path) -> None:
    plot(flown, tmp_path / "x.png", "law.angle", "law.angle_rate")
    image = np.asarray(Image.open(tmp_path / "x.png").convert("RGB")).astype(int)
    assert image.shape == (780, 975, 3)
    # The same page drawn here says where the path and its ends are; they have their colours there.
    with matplotlib.rc_context(STYLE):
        page = figure(Log(flown), "law.angle", "law.angle_rate")
        page.set_dpi(130)
        page.canvas.draw()
    axes = page.axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    for label, part in (("end", 0), ("thrusters 6, 7", 0.5)):
        line = lines[label]
        places = axes.transData.transform(np.column_stack(line.get_data()))
        places = places[np.isfinite(places).all(axis=1)]
        x, y = places[int(part * len(places))]
        near = image[779 - int(y) - 2 : 779 - int(y) + 3, int(x) - 2 : int(x) + 3].reshape(-1, 3)
        color = 255 * np.array(to_rgb(line.get_color()))
        assert np.abs(near - color).max(axis=1).min() < 12, label  # smoothed at the edge


def test_a_full_disk_is_named_and_leaves_no_picture(flown: Path, tmp_path: Path) -> None:
    with room_for(3000), pytest.raises(OSError, match=r"File too large: '.*x\.png'"):
        plot(Log(flown), tmp_path / "x.png", "truth.rate[0]", "truth.rate[1]")
    assert not (tmp_path / "x.png").exists()


def test_a_link_is_not_followed(flown: Path, tmp_path: Path) -> None:
    (tmp_path / "x.png").symlink_to(tmp_path / "precious")
    plot(flown, tmp_path / "x.png", "law.angle", "truth.rate[0]")
    assert [path.name for path in tmp_path.iterdir()] == ["x.png"]


def test_bad_input_is_refused(flown: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"end it in \.png"):
        plot(flown, tmp_path / "x.svg", "law.angle", "law.angle_rate")
    with pytest.raises(ValueError, match=r"'truth.rate' has 3 numbers: pick one"):
        plot(flown, tmp_path / "x.png", "law.angle", "truth.rate")
    with pytest.raises(ValueError, match=r"did you mean .law\.angle."):
        plot(flown, tmp_path / "x.png", "law.angel", "truth.rate[0]")
