"""The page of plots: what is on it, and that no extreme of a long signal is lost."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_disk import room_for
from matplotlib.figure import Figure
from PIL import Image

from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.plotting import decimate
from mjspace.plotting.check_bounds import Bound, bounds
from mjspace.plotting.decimate import Line, outlines
from mjspace.plotting.page import _short, figure, plot
from mjspace.plotting.panels import LAW_PANELS, MOST, ROTATION, STANDARD, Panel, curves, read
from mjspace.runner.run import run
from mjspace.scenario.scenario import Check

ERROR, RATE, SPEED, MOMENTUM = (
    next(panel for panel in (*ROTATION, *STANDARD) if panel.field == field)
    for field in ("attitude_error", "rate", "wheel_speed", "momentum")
)


@pytest.fixture(scope="module")
def log(pictured_log: Path) -> Log:
    return Log(pictured_log)


@pytest.fixture(scope="module")
def page(log: Log) -> Figure:
    return figure(log)


def titles(page: Figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in page.axes if axes.axison]


def test_the_page_has_every_panel(page: Figure, log: Log) -> None:
    shown = titles(page)
    assert shown[:7] == [
        "Attitude error [deg]",
        "Body rate [deg/s]",
        "Commanded torque on the bus [N m]",
        "Wheel motor torque [N m]",
        "Wheel speed [rpm]",
        "Change of total momentum [N m s]",
        "Disturbance torque about the centre of mass [N m]",
    ]
    signals = shown[7:]
    assert 1 <= len(signals) <= LAW_PANELS
    assert all(title.removeprefix("Law: ") in log.topics["/law"] for title in signals)


def test_what_is_zero_throughout_is_left_out(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    force = Panel("Force", "/disturbance", "force")  # the bus stands where tides are zero
    monkeypatch.setattr("mjspace.plotting.panels.ROTATION", (force, RATE))
    assert titles(figure(log))[0] == "Body rate [deg/s]"


def test_angles_are_in_degrees_and_rates_have_their_reference(page: Figure, log: Log) -> None:
    error = np.degrees(log.read("/truth", ["attitude_error"])["attitude_error"]).max()
    assert np.max(page.axes[0].lines[0].get_ydata()) == pytest.approx(error, rel=1e-12)
    wanted = np.degrees(log.read("/reference", ["rate"])["rate"])
    drawn = [line.get_ydata() for line in page.axes[1].lines if line.get_alpha() is not None]
    for component, line in zip(wanted.T, drawn, strict=True):
        assert np.max(line) == pytest.approx(component.max(), rel=1e-12)


SI = 1.0
EACH_PANEL = [
    ("/truth", "attitude_error", 180.0 / np.pi),
    ("/truth", "rate", 180.0 / np.pi),
    ("/command", "torque", SI),
    ("/command", "wheel_torque", SI),
    ("/truth", "wheel_speed", 30.0 / np.pi),
    ("/truth", "momentum", SI),
    ("/disturbance", "torque", SI),
]


@pytest.mark.parametrize("number", range(len(EACH_PANEL)))
def test_each_panel_shows_its_signal_in_its_unit(number: int, page: Figure, log: Log) -> None:
    """Of each component a line, in its order, of logged points that lack at most every other."""
    topic, field, scale = EACH_PANEL[number]
    read = log.read(topic, [field])
    values = scale * read[field]
    if field == "momentum":
        values = np.linalg.norm(values - values[0], axis=1, keepdims=True)
    assert len(values) == 1001
    drawn = [
        line
        for line in page.axes[number].lines
        if len(np.asarray(line.get_xdata())) >= 1001 and line.get_alpha() is None
    ]
    assert len(drawn) == values.shape[1]
    for component, line in zip(values.T, drawn, strict=True):
        x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        rows = np.searchsorted(read["time"], x)
        assert rows[0] <= 1
        assert rows[-1] >= 999
        assert np.diff(rows).max() <= 3
        np.testing.assert_allclose(y, component[rows], rtol=1e-12)


def test_each_signal_of_the_law_is_drawn_as_logged(page: Figure, log: Log) -> None:
    for number in range(7, len(titles(page))):
        field = titles(page)[number].removeprefix("Law: ")
        read = log.read("/law", [field])
        values = read[field].reshape(1001, -1)
        lines = [x for x in page.axes[number].lines if len(np.asarray(x.get_xdata())) >= 1001]
        assert len(lines) == values.shape[1]
        for component, line in zip(values.T, lines, strict=True):
            rows = np.searchsorted(read["time"], np.asarray(line.get_xdata()))
            np.testing.assert_array_equal(np.asarray(line.get_ydata()), component[rows])


def test_change_of_momentum_starts_at_zero(page: Figure, log: Log) -> None:
    change = np.asarray(page.axes[5].lines[0].get_ydata())
    assert change[0] == 0.0
    # What 0.01 N m put in over the last second: the body has not turned far.
    assert change[-1] == pytest.approx(0.01, rel=0.1)


def test_saturation_is_marked_on_every_panel(page: Figure, log: Log) -> None:
    saturated = [event.time for event in log.events() if "saturated" in event.message]
    assert saturated
    for axes in page.axes[: len(titles(page))]:
        ticks = [line for line in axes.lines if line.get_marker() == "|"]
        assert set(saturated) <= set(np.asarray(ticks[0].get_xdata()))


def test_a_few_points_keep_the_extremes(log: Log) -> None:
    whole = log.read("/command", ["torque"])
    ((time, value),) = outlines(log, [Line("/command", "torque")], points=40)
    assert len(time) <= 42
    np.testing.assert_array_equal(value.max(axis=0), whole["torque"].max(axis=0))
    np.testing.assert_array_equal(value.min(axis=0), whole["torque"].min(axis=0))
    for component in range(3):
        # Each point is a logged one, at its own time, and they are in order.
        at = np.searchsorted(whole["time"], time[:, component])
        np.testing.assert_array_equal(whole["torque"][at, component], value[:, component])
        assert (np.diff(time[:, component]) >= 0.0).all()


def test_a_line_is_the_same_whatever_number_of_rows_is_searched_at_once(
    log: Log, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [Line("/command", "torque"), Line("/truth", "rate")]
    whole = outlines(log, lines, points=400)
    monkeypatch.setattr(decimate, "_TOGETHER", 100)
    for one, other in zip(outlines(log, lines, points=400), whole, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_log_is_read_once(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    passes: list[set[str]] = []

    def noted(log: Log, fields: Any) -> Any:
        passes.append({*fields})
        return blocks_of_topics(log, fields)

    monkeypatch.setattr(Log, "blocks_of_topics", noted)
    assert len(curves(log)) == 11
    assert passes == [{"/truth", "/reference", "/command", "/law", "/disturbance"}]


def test_a_short_log_keeps_every_row(log: Log) -> None:
    whole = log.read("/truth", ["rate"])
    ((time, value),) = outlines(log, [Line("/truth", "rate")])
    assert len(whole["time"]) == 1001
    np.testing.assert_array_equal(value[:1001], whole["rate"])
    np.testing.assert_array_equal(time[:1001, 0], whole["time"])


blocks_of_topics = Log.blocks_of_topics

CHECKS = [
    Check(name="a", signal="truth.attitude_error", below=0.1, start=0.2, end=0.9),
    Check(name="b", signal="truth.attitude_error", statistic="final", below=0.01),
    Check(name="c", signal="truth.rate[2]", statistic="peak", below=1.0),
    Check(name="d", signal="truth.rate", below=1.0),
    Check(name="e", signal="truth.momentum", statistic="drift", above=0.001),
    Check(name="f", signal="truth.momentum", below=0.002),
    Check(name="h", signal="truth.energy", statistic="peak", above=9.0, below=10.0),
    Check(name="g", signal="truth.attitude_error", below=0.1, target=1.0),
]
DEG = 180.0 / np.pi


@pytest.mark.parametrize(
    ("panel", "expected"),
    [
        (
            ERROR,
            [
                Bound("max < 5.73", 0.1 * DEG, 0.2, 0.9, True, 0),
                Bound("final < 0.573", 0.01 * DEG, 0.95, 1.0, True, 0),
            ],
        ),
        (
            RATE,
            [
                Bound("peak < 57.3", DEG, 0.0, 1.0, True, 2),
                Bound("peak < 57.3", -DEG, 0.0, 1.0, False, 2),
            ],
        ),
        (MOMENTUM, [Bound("drift > 0.001", 0.001, 0.0, 1.0, False, 0)]),
        (
            Panel("energy", "/truth", "energy"),
            [
                Bound("peak 9 to 10", 10.0, 0.0, 1.0, True, 0),
                Bound("peak 9 to 10", -10.0, 0.0, 1.0, False, 0),
                Bound("", 9.0, 0.0, 1.0, False, 0),
                Bound("", -9.0, 0.0, 1.0, True, 0),
            ],
        ),
        (SPEED, []),
        (Panel("one", "/truth", "rate", part=slice(1, 2)), []),
    ],
)
def test_bounds_stand_on_the_panel_of_their_signal(
    log: Log, panel: Panel, expected: list[Bound]
) -> None:
    found = list(bounds(read(log, [panel])[0].panel, CHECKS, log))
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        assert (one.text, one.upper, one.component) == (other.text, other.upper, other.component)
        assert (one.value, one.start, one.end) == pytest.approx(
            (other.value, other.start, other.end), abs=1e-12
        )


def test_bounds_are_drawn(page: Figure, log: Log) -> None:
    expected = {
        bound.text for bound in bounds(read(log, [ERROR])[0].panel, scenario_of(log).checks, log)
    }
    assert expected
    assert expected <= {text.get_text() for text in page.axes[0].texts}


def test_named_signals_are_drawn_alone(log: Log) -> None:
    assert titles(figure(log, ["truth.rate[2]", "law.theta_hat", "disturbance.force"])) == [
        "truth.rate[2] [deg/s]",
        "Law: theta_hat",
        "disturbance.force [N]",
    ]


def test_the_file_is_a_readable_page(pictured_log: Path, tmp_path: Path) -> None:
    plot(pictured_log, tmp_path / "x.png")
    image = np.asarray(Image.open(tmp_path / "x.png").convert("RGB"))
    assert image.shape[1] == 1375  # 12.5 inches at 110 dots
    assert 0.75 < (image == 255).all(axis=2).mean() < 0.98


def test_a_log_cut_short_is_drawn_as_far_as_it_goes(pictured_log: Path, tmp_path: Path) -> None:
    content = pictured_log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) * 3 // 4])
    page = figure(Log(cut))
    assert "Attitude error [deg]" in titles(page)
    assert any("cut short" in text.get_text() for text in page.texts)


def test_a_full_disk_is_named_and_leaves_no_picture(pictured_log: Path, tmp_path: Path) -> None:
    with room_for(3000), pytest.raises(OSError, match=r"File too large: '.*x\.png'"):
        plot(pictured_log, tmp_path / "x.png")
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("linked", [Path.symlink_to, Path.hardlink_to])
def test_a_link_is_not_followed(linked: Any, pictured_log: Path, tmp_path: Path) -> None:
    target, link = tmp_path / "precious", tmp_path / "x.png"
    target.write_text("mine")
    linked(link, target)
    plot(pictured_log, link, signals=["truth.rate"])
    plot(pictured_log, link, signals=["truth.rate"])  # a picture from before is replaced
    assert link.read_bytes().startswith(b"\x89PNG")
    assert not link.is_symlink()
    assert target.read_text() == "mine"


def test_bad_input_is_refused(pictured_log: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"end it in \.png, \.pdf, \.svg"):
        plot(pictured_log, tmp_path / "x.jpg")
    with pytest.raises(ValueError, match=r"truth\.rate"):
        plot(pictured_log, tmp_path / "x.png", signals=["truth.rates"])


def test_labels_of_an_axis_are_short_and_exact() -> None:
    values = (0.0, 0.25, -1.0, 0.001, -0.00025, 7.5e-4, 2e-6, 123456.0, -1.25e7)
    labels = [_short(value).replace("\N{MINUS SIGN}", "-") for value in values]
    assert labels == ["0", "0.25", "-1", "0.001", "-2.5e-4", "7.5e-4", "2e-6", "123456", "-1.25e7"]
    assert [float(label) for label in labels] == list(values)


def test_moving_parts_have_panels_by_their_names(tmp_path: Path) -> None:
    tank = "plant.slosh.tank={model='spring',mass=5,frequency=0.5}"
    short = ["duration=1.2", "checks=[]", tank, "initial.joint_position={tank_slide_x=0.01}"]
    log = run("flexible-bang-bang", overrides=short, out=tmp_path / "it").log
    shown = titles(figure(log))
    assert "Tip deflection of left [mm]" in shown
    assert "Displacement of what sloshes in tank [m]" in shown


@pytest.mark.parametrize(("ending", "begin"), [("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_pages_are_drawings_too(
    ending: str, begin: bytes, pictured_log: Path, tmp_path: Path
) -> None:
    plot(pictured_log, tmp_path / f"x.{ending}", signals=["truth.rate"])
    assert (tmp_path / f"x.{ending}").read_bytes().startswith(begin)


def test_a_page_of_a_lander_shows_where_it_is_and_what_it_burns(tmp_path: Path) -> None:
    short = ["duration=2", "checks=[]"]
    shown = titles(figure(run("lander", overrides=short, out=tmp_path / "it").log))
    assert shown[:4] == [
        "Height above the ground [m]",
        "Velocity [m/s]",
        "Position [m]",
        "Thrust of the engine [N]",
    ]
    assert "Propellant [kg]" in shown
    assert len(shown) == MOST


def test_firings_stand_in_a_lane_for_each_thruster(tmp_path: Path) -> None:
    log = run("rcs-three-axis", overrides=["duration=4", "checks=[]"], out=tmp_path / "it").log
    page = figure(log)
    (lanes,) = (axes for axes in page.axes if axes.get_title(loc="left") == "Firings of thrusters")
    on_time = log.read("/command", ["on_time"])["on_time"]
    assert len(lanes.collections) == on_time.shape[1] == 12
    assert on_time.any()
    for number, lane in enumerate(lanes.collections):
        highest = max(np.asarray(path.vertices)[:, 1].max() for path in lane.get_paths())
        fired = on_time[:, number].max() / on_time.max()
        assert highest == pytest.approx(number + 0.8 * fired)


def test_small_numbers_have_a_prefix(log: Log, tmp_path: Path) -> None:
    weak = ["duration=1", "checks=[]", "environment.torques=[{bias=[2e-7,0,0]}]"]
    page = figure(run("lqr-regulation", overrides=weak, out=tmp_path / "it").log)
    (axes,) = (a for a in page.axes if a.get_title(loc="left").startswith("Disturbance"))
    assert axes.get_title(loc="left") == "Disturbance torque about the centre of mass [nN m]"
    assert np.max(axes.lines[0].get_ydata()) == pytest.approx(200.0)
    (speed,) = read(log, [SPEED])
    assert speed.panel.unit == "rpm"  # which takes none


@pytest.mark.parametrize(
    ("duration", "unit", "last"), [(2.0, "s", "2"), (1200.0, "min", "20"), (36000.0, "h", "10")]
)
def test_time_is_in_the_unit_of_the_flight(
    duration: float, unit: str, last: str, tmp_path: Path
) -> None:
    step = f"rates={{physics={duration / 100},control={duration / 100}}}"
    still = ["initial.rate=[0,0,0]", "initial.wheel_speed=[0,0,0]", "law={kind='coast:Coast'}"]
    slow = [f"duration={duration}", "checks=[]", step, *still]
    page = figure(run("detumble-wheels", overrides=slow, out=tmp_path / "it").log)
    shown = [axes for axes in page.axes if axes.axison and axes.get_title(loc="left")]
    page.canvas.draw()
    labels = [label.get_text() for label in page.axes[0].get_xticklabels()]
    assert last in labels
    assert {axes.get_xlabel() for axes in shown} <= {f"time [{unit}]", ""}
    assert not any(title.startswith("Attitude error") for title in titles(page))  # it coasts
