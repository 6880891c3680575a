"""The report of a campaign as one HTML file: its answer with histograms, correlations, scatter."""

import json
import os
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from mjspace.campaign.report import Answer, CheckFigures, MetricFigures
from mjspace.campaign.results import DESCRIPTION, JudgedResults, value_column
from mjspace.contract import Array
from mjspace.reporting import page
from mjspace.reporting.charts import Bound, Chart, Series
from mjspace.scenario.dispersions import Dispersion
from mjspace.scenario.metrics import Metric

_BINS = 40  # at most
_DRAWS = 12  # of a tornado
_POINTS = 5000  # of a scatter
FAILED, SUCCEEDED = 0, 1
"""Colors of the page: red and green."""


def write(results: JudgedResults, found: Answer, output: Path) -> None:
    """Write what the members of a campaign show to one HTML file, which needs no network.

    Logs are linked by their place relative to it.

    Raises:
        ValueError: ``output`` does not end in .html.
        OSError: a file cannot be read or written.
    """
    page.require_html(output)
    charts = [
        _histogram(
            f"{figures.name} {figures.bound}",
            results.column(f"{name}: measured"),
            f"measured: {check.formula or f'{check.statistic} of {check.signal}'}",
            check.below,
            check.above,
        )
        for (name, check), figures in zip(results.checks.items(), found.checks, strict=True)
    ]
    charts += [
        _histogram(m.name, results.column(value_column(m.name)), _meaning(m))
        for m in results.scenario.metrics
    ]
    description = json.loads((results.folder / DESCRIPTION).read_text(encoding="utf-8"))
    software = description.get("software")
    page.write(
        output,
        "campaign.html.j2",
        [*_scatter(results, found), *charts],
        title=f"{results.scenario.name}: campaign",
        scenario=results.scenario,
        found=found,
        checks=list(zip(results.checks.values(), found.checks, strict=True)),
        tornados=[
            *((f"{f.name} {f.bound}", _tornado(f)) for f in found.checks),
            *((f"{f.name}, a metric", _tornado(f)) for f in found.metrics),
        ],
        worst=[(each, _link(Path(each.log), output) if each.log else "") for each in found.worst],
        dispersions=[_parameters(dispersion) for dispersion in results.scenario.dispersions],
        software=software if isinstance(software, dict) else {},
        draws=results.draws,
        toml=str(description["scenario"]),
    )


def _histogram(
    title: str, measured: Array, what: str, below: float | None = None, above: float | None = None
) -> Chart:
    """Return how the measured values are distributed, with the bounds of a check."""
    values = measured[np.isfinite(measured)]
    # Values that are equal but for the last digits have no bins of their own.
    if len(values) and np.ptp(values) <= 1e-9 * np.abs(values).max():
        values = np.full_like(values, values[0])
    few = min(_BINS, max(1, len(np.histogram_bin_edges(values, "auto")) - 1)) if len(values) else 1
    counts, edges = np.histogram(values, bins=few)
    bounds = [
        Bound(f"{sign} {bound:.4g}", (float(bound), 0.0), (float(bound), np.inf))
        for sign, bound in (("<", below), (">", above))
        if bound is not None
    ]
    centers = 0.5 * (edges[:-1] + edges[1:])
    series = Series("members", centers, counts.astype(float), None)
    return Chart(title, "members", [series], "bars", what, bounds=bounds)


def _meaning(metric: Metric) -> str:
    """Return what the number is."""
    if metric.signal is None:
        return f"{metric.function} of {', '.join(metric.signals)}"
    return f"{metric.statistic} of {metric.signal}"


def _tornado(figures: CheckFigures | MetricFigures) -> list[tuple[str, float]]:
    """Return the draws on which a check or a metric depends, the strongest first."""
    known = [(draw, value) for draw, value in figures.correlations.items() if value is not None]
    return sorted(known, key=lambda each: -abs(each[1]))[:_DRAWS]


def _scatter(results: JudgedResults, found: Answer) -> list[Chart]:
    """Return the members over the two draws on which any check depends most; none of fewer."""

    def weight(draw: str) -> float:
        return max((abs(check.correlations[draw] or 0.0) for check in found.checks), default=0.0)

    first = sorted(results.draws, key=weight, reverse=True)[:2]
    if len(first) < 2:
        return []
    x, y = (results.column(draw) for draw in first)
    passed = results.column("passed") > 0.5
    series = [
        _points(name, x[chosen], y[chosen], color)
        for name, chosen, color in (
            ("succeeded", passed, SUCCEEDED),
            ("failed", ~passed, FAILED),
        )
        if chosen.any()
    ]
    return [
        Chart("Members over the two draws that matter most", first[1], series, "points", first[0])
    ]


def _points(name: str, x: Array, y: Array, color: int) -> Series:
    """Return the points in the order of ``x``: of very many, some that are evenly chosen."""
    every = -(-len(x) // _POINTS)
    x, y = x[::every], y[::every]
    order = np.argsort(x, kind="stable")
    shown = name if every == 1 else f"{name}, one of {every}"
    return Series(shown, x[order], y[order], color)


def _link(log: Path, output: Path) -> str:
    """Return the address of a log from the page."""
    return quote(Path(os.path.relpath(log.absolute(), output.absolute().parent)).as_posix())


def _parameters(dispersion: Dispersion) -> tuple[str, str, str]:
    """Return the key, the distribution and its parameters."""
    table = dispersion.model_dump(exclude_none=True, exclude={"key", "keys", "distribution"})
    words = (f"{key} {_numbers(value)}" for key, value in table.items())
    return dispersion.name, dispersion.distribution, "; ".join(words)


def _numbers(value: Any) -> str:
    """Return a number, a list or a matrix of them, by rows."""
    if not isinstance(value, list):
        return f"{value:.6g}"
    rows = any(isinstance(each, list) for each in value)
    return (" / " if rows else ", ").join(map(_numbers, value))
