"""Write docs/gallery.md: a picture, a plot and the verdict of every scenario, from its log.

``python tools/gallery.py [NAME]...`` draws build/gallery/NAME/flight.mcap where it exists, and
flies the scenario into it where it does not: all of them take a quarter of an hour. The page then
has the scenarios of these names alone.
"""

import io
import sys
import warnings
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import mjspace
from mjspace.contract import Array
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.plotting.page import COASTS, draw, line_colors, scale_time
from mjspace.plotting.panels import Curves, chosen, curves
from mjspace.plotting.style import STYLE
from mjspace.rendering.captions import is_lander
from mjspace.rendering.render import render
from mjspace.runner.logged_verdicts import judged
from mjspace.scenario.files import list_scenarios, scenario_names, subjects
from mjspace.signals import find_signal

ROOT = Path(__file__).parents[1]
PAGE, PICTURES, LOGS = ROOT / "docs/gallery.md", ROOT / "docs/gallery", ROOT / "build/gallery"
STILL, PLOT = (432, 243), (368, 243)
"""Sizes in pixels."""
LARGEST = 20_000
"""Bytes of a picture."""
_FINAL = 25.0  # m above the ground, where the site is in the picture of a lander
_SAMPLES = 2000
_TOO_STEADY = 1e-3  # of a signal's change over its size: no curve to show
_NAMED = 3  # lines for whose names there is room
_A_CURVE = 20  # different values: what has fewer is a flag
HEAD = """# Gallery

{shown}, grouped as `mjspace list` groups them: an instant of the flight, a signal that
its checks are about, and their verdict. `mjspace render` and `mjspace plot` make such pictures
of any log ([what is drawn](rendering.md#what-is-drawn)). `make gallery` makes this page from the
flights.

{links}
"""


def main() -> None:
    """Write the page and its pictures."""
    names = sys.argv[1:] or scenario_names()
    PICTURES.mkdir(exist_ok=True)
    entries = {}
    for name in names:
        log = _log_of(name)
        (PICTURES / f"{name}.webp").write_bytes(_picture(log))
        entries[name] = _verdict(log)
        print(name, entries[name], flush=True)
    for file in PICTURES.glob("*.webp"):
        if file.stem not in entries:
            file.unlink()
    PAGE.write_text(page(entries))


def page(entries: dict[str, str]) -> str:
    """Return the page of these scenarios, each with its verdict."""
    subject_of, described = subjects(), list_scenarios()
    groups: dict[str, list[str]] = {}
    for name in sorted(entries):
        groups.setdefault(subject_of[name], []).append(name)
    all_of_them = len(entries) == len(described)
    shown = f"{'All' if all_of_them else f'{len(entries)} of the'} {len(described)} scenarios"
    titles = {group: group.capitalize() if group != "cmg" else "CMG" for group in sorted(groups)}
    links = " | ".join(f"[{title}](#{title.lower()})" for title in titles.values())
    lines = [HEAD.format(shown=shown, links=links)]
    for group, title in titles.items():
        subject = (import_module(f"mjspace.controllers.{group}").__doc__ or "").partition("\n")[0]
        lines += [f"## {title}", "", subject, ""]
        for name in groups[group]:
            lines += [
                f"**[`{name}`](../mjspace/scenarios/{name}.toml)**: {described[name]}. "
                f"*{entries[name]}*",
                "",
                f"![{name}: a picture and a plot](gallery/{name}.webp)",
                "",
            ]
    return "\n".join(lines)


def _log_of(name: str) -> Log:
    path = LOGS / name / "flight.mcap"
    if not path.exists():
        with warnings.catch_warnings(action="ignore"):
            mjspace.run(name, out=path.parent)
    return Log(path)


def _verdict(log: Log) -> str:
    found = judged(log, scenario_of(log))
    count, as_expected = len(found.verdicts), [each.as_expected for each in found.verdicts]
    if not found.passed:
        return f"FAIL: {as_expected.count(False)} of {count} checks"
    failing = [each.outcome for each in found.verdicts].count("FAIL")
    said = f"PASS: {count} check{'s' if count != 1 else ''}"
    return f"{said}, of which {failing} fail as expected" if failing else said


def _picture(log: Log) -> bytes:
    """Return still and plot side by side, as WebP of at most ``LARGEST``."""
    whole = Image.new("RGB", (STILL[0] + PLOT[0], STILL[1]), "white")
    with TemporaryDirectory() as folder:
        still = Path(folder, "still.png")
        render(log, still, size=(2 * STILL[0], 2 * STILL[1]), at=telling_instant(log))
        with Image.open(still) as image:
            whole.paste(image.resize(STILL, Image.Resampling.LANCZOS), (0, 0))
    whole.paste(_plot(log), (STILL[0], 0))
    for quality in range(80, 20, -6):
        content = io.BytesIO()
        whole.save(content, format="webp", quality=quality, method=6)
        if content.tell() <= LARGEST:
            break
    return content.getvalue()


def telling_instant(log: Log) -> float:
    """Return when to look [s]: shortly before a landing or docking, or in the middle of a motion.

    That is where rate and torque, each over its largest, are large together.
    """
    every = max(1, len(log) // (_SAMPLES * log.every["/truth"]))
    shapes = log.topics["/truth"]
    docking = [name for name in shapes if name.endswith("_closed")]
    if is_lander(log):
        rows = log.read("/truth", ["altitude"], every=every)
        low = rows["time"][rows["altitude"][:, 0] < _FINAL]
        return float(low[0]) if len(low) else log.end
    if docking:
        rows = log.read("/truth", docking[:1], every=every)
        changed = np.flatnonzero(np.diff(rows[docking[0]][:, 0]))
        return float(rows["time"][changed[0] if len(changed) else -1])
    rows = log.read("/truth", ["rate"], every=every)
    time, worth = rows["time"], _of_largest(rows["rate"])
    if log.topics.get("/command", {}).get("torque") == (3,):
        rows = log.read("/command", ["torque"], every=every)
        worth = worth + np.interp(time, rows["time"], _of_largest(rows["torque"]))
    inner = (time >= 0.05 * log.end) & (time <= 0.95 * log.end)
    return float(time[inner][worth[inner].argmax()]) if inner.any() else log.end


def _of_largest(vectors: Array) -> Array:
    norm = np.linalg.norm(np.nan_to_num(vectors), axis=1)
    found: Array = norm / max(norm.max(), 1e-300)
    return found


def _plot(log: Log) -> Image.Image:
    """Return the curve that says most, drawn by itself."""
    with matplotlib.rc_context({**STYLE, "font.size": 8.0, "lines.linewidth": 1.0}):
        figure = Figure(figsize=(PLOT[0] / 100.0, PLOT[1] / 100.0))
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.15, 0.17, 0.8, 0.70))
        one = _most_telling(log)
        draw(axes, one, line_colors(one))
        legend = axes.get_legend()
        if legend is not None and one.value.shape[1] > _NAMED:
            legend.remove()  # it would cover the title
        axes.set_xlabel(f"time [{scale_time(axes, log)}]", labelpad=1.0)
        content = io.BytesIO()
        figure.savefig(content, format="png", dpi=100)
        with Image.open(content) as image:
            return image.convert("RGB")


def _most_telling(log: Log) -> Curves:
    """Return a lander's height, or what the first check is about that is a curve."""
    scenario = scenario_of(log)
    standard = curves(log, coasting=scenario.law.kind == COASTS)
    if is_lander(log):
        return standard[0]
    named = {(one.panel.topic, one.panel.field): one for one in standard}
    for check in scenario.checks:
        topic, field, _ = find_signal(log.topics, check.signal)
        found = named.get((topic, field))
        if found is None or topic == "/law" or found.panel.drift:
            (found,) = chosen(log, [check.signal])
        if len(np.unique(found.value)) > _A_CURVE and _moves(found):
            return found
    return next(filter(_moves, standard), standard[0])


def _moves(one: Curves) -> bool:
    change = np.ptp(one.value, axis=0).max()
    return bool(change > _TOO_STEADY * np.abs(one.value).max())


if __name__ == "__main__":
    main()
