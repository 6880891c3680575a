"""Verdicts and facts as tables for a person, or as plain data for another program."""

from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from mjspace.errors import printable
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.runner.checks import Verdict
from mjspace.runner.logged_code import code_of, digest
from mjspace.runner.run import Result

LINES_SHOWN = 5
"""Of each file of code in a log."""


def print_result(result: Result) -> None:
    """Print the table of checks, what went wrong if anything did, and where the log is."""
    console = Console()
    if result.verdicts:
        table = Table(box=None, pad_edge=False, header_style="bold")
        has_requirements = any(verdict.check.requirement for verdict in result.verdicts)
        if has_requirements:
            table.add_column("requirement")
        table.add_column("check")
        table.add_column("measured", justify="right")
        table.add_column("required")
        table.add_column("verdict")
        for verdict in result.verdicts:
            table.add_row(
                *[_shown(verdict.check.requirement)] * has_requirements,
                _shown(verdict.check.name),
                "-" if verdict.missing else f"{verdict.measured:.4g}",
                verdict.bound,
                _word(verdict),
            )
        console.print(table)
        for verdict in result.verdicts:
            if verdict.missing or verdict.check.because:
                console.print(verdict.line, style=_style(verdict), markup=False, highlight=False)
    if result.metrics:
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column("metric")
        table.add_column("value", justify="right")
        for measured in result.metrics:
            value = "-" if measured.missing else f"{measured.value:.4g}"
            table.add_row(_shown(measured.metric.name), value)
        console.print(table)
        for measured in result.metrics:
            if measured.missing:
                line = printable(measured.line)
                console.print(line, style="bold red", markup=False, highlight=False)
    if result.trouble:
        console.print(f"[bold red]ended early:[/] {_shown(result.trouble)}", highlight=False)


def _word(verdict: Verdict) -> str:
    expected = verdict.check.expected
    note = ""
    if expected == "FAIL":
        note = " as expected" if verdict.as_expected else f", expected {expected}"
    return f"[{_style(verdict)}]{verdict.outcome}{note}[/]"


def _style(verdict: Verdict) -> str:
    return "green" if verdict.as_expected else "bold red"


def result_data(result: Result) -> dict[str, Any]:
    """Return the result as ``--json`` prints it."""
    return {
        "passed": result.passed,
        "trouble": result.trouble,
        "log": str(result.path),
        "checks": [
            {
                "name": verdict.check.name,
                "requirement": verdict.check.requirement,
                "signal": verdict.check.signal,
                "formula": verdict.check.formula,
                "statistic": verdict.check.statistic,
                "measured": None if verdict.missing else verdict.measured,
                "below": verdict.check.below,
                "above": verdict.check.above,
                "verdict": verdict.outcome,
                "expected": verdict.check.expected,
                "as_expected": verdict.as_expected,
                "because": verdict.check.because,
                "missing": verdict.missing,
            }
            for verdict in result.verdicts
        ],
        "metrics": [
            {
                "name": measured.metric.name,
                "value": None if measured.missing else measured.value,
                "missing": measured.missing,
            }
            for measured in result.metrics
        ],
    }


def log_data(log: Log) -> dict[str, Any]:
    """Return what a log holds."""
    return {
        "metadata": dict(log.metadata),
        "complete": log.complete,
        "altered": log.altered(),
        "start": log.start,
        "end": log.end,
        "topics": {
            topic: {field: list(shape) for field, shape in fields.items()}
            for topic, fields in log.topics.items()
        },
        "units": log.units,
        "every": log.every,
        "attachments": sorted(log.attachments),
        "code": {name: digest(code) for name, code in _code(log).items()},
        "events": [
            {"time": time, "level": level, "message": message}
            for time, _, level, message in log.events()
        ],
    }


def print_log(log: Log) -> None:
    """Print what a log holds."""
    console = Console()
    whole = "complete" if log.complete else "[bold red]incomplete: the flight was cut off[/]"
    console.print(f"{log.start:g} to {log.end:g} s, {whole}", highlight=False)
    table = Table(box=None, pad_edge=False, show_header=False)
    for key, value in log.metadata.items():
        table.add_row(_shown(key), _shown(value))
    for topic, fields in log.topics.items():
        units = log.units[topic]
        listed = []
        for name, shape in fields.items():
            size = "x".join(map(str, shape)) or "1"
            listed.append(f"{name} {size}" + (f" [{units[name]}]" if name in units else ""))
        often = ""
        if log.every[topic] > 1:
            often = f"every {log.every[topic] * log.control_period:g} s: "
        table.add_row(topic, _shown(often + ", ".join(listed)))
    table.add_row("attachments", _shown(", ".join(sorted(log.attachments))))
    altered = log.altered()
    if altered is not None:
        changed = f"[bold red]{', '.join(altered)} changed since the flight[/]"
        table.add_row("digests", changed if altered else "every topic as it was written")
    console.print(table)
    for time, _, level, message in log.events():
        line = printable(f"{time:12.6f} s  {level:7}  {message}")
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    _print_code(console, log)


def _print_code(console: Console, log: Log) -> None:
    """Print the name, the digest and the first lines of what ``replay --trust`` would run."""
    for name, content in _code(log).items():
        is_text = name.endswith(".py")
        console.print(
            f"{name}, sha256 {digest(content)}: runs only with --trust"
            + ("; it begins" if is_text else ""),
            highlight=False,
            markup=False,
        )
        for line in content.decode(errors="replace").splitlines()[: LINES_SHOWN * is_text]:
            console.print(f"    {printable(line)}", highlight=False, markup=False, soft_wrap=True)


def _code(log: Log) -> dict[str, bytes]:
    """Return the code in the log by name; none where its scenario cannot be flown anyway."""
    try:
        return code_of(log, scenario_of(log))
    except ValueError:
        return {}


def _shown(text: str) -> str:
    """Return a text from outside as a cell of a table."""
    return escape(printable(text))
