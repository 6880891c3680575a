"""How every figure looks: inks, the colors of axes, and matplotlib's settings."""

from typing import Any

INK, FAINT = "#2b2d33", "#8a8f99"
# x, y, z first, as the axes of a rendered frame are colored; then what else a vector may have.
COLORS = (
    "#d1453b", "#2f9e44", "#2f6fd0", "#e08a1e", "#8a4fbf",
    "#1f9aa8", "#c2408f", "#7a6a4f", "#5b6470", "#a3b01e",
)  # fmt: skip
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e6ea",
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.size": 3,
    "ytick.major.size": 3,
    "ytick.minor.size": 0,
    "lines.linewidth": 1.2,
    "agg.path.chunksize": 10000,
}
