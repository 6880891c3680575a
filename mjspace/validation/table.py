"""The results as a table on the terminal."""

from functools import partial

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from mjspace.validation import wording
from mjspace.validation.benchmark import FAULTS
from mjspace.validation.passport import Passport
from mjspace.validation.results import Results

_PASS, _FAIL = "[green]PASS[/]", "[bold red]FAIL[/]"
_WIDE = 150  # columns that a table with reasons needs


def show(results: Results) -> None:
    """Print every quantity with its bound and verdict, then which fault was caught by whom.

    A narrow terminal omits the reasons of the bounds; the report has them.
    """
    console = console_of_terminal()
    console.print(_quantities(results, reasons=console.width >= _WIDE))
    if not results.quick:
        console.print()
        console.print(_matrix(results))
    for section in results.sections:
        for injected in section.missed:
            console.print(
                f"{_FAIL} {section.name} did not detect: {escape(injected.meaning)}",
                highlight=False,
            )
    for remark in results.remarks:
        console.print(remark, highlight=False, markup=False)


def show_passport(passport: Passport) -> None:
    """Print what the guards say of the model, what was measured of it, and which step it needs."""
    console = console_of_terminal()
    say = partial(console.print, highlight=False, soft_wrap=True)
    say(
        f"{passport.model}: {passport.integrator}, step {passport.step:g} s",
        markup=False,
    )
    for finding in passport.findings:
        word = "[bold red]refused[/]" if finding.refused else "[yellow]warning[/]"
        say(f"{word}: {escape(finding.text)}")
    table = table_of("quantity", "measured", "allowed", "verdict", "why that bound")
    for row in passport.rows:
        table.add_row(
            row.quantity,
            wording.measured(row),
            wording.allowed(row),
            _PASS if row.passed else _FAIL,
            escape(row.reason),
        )
    console.print(table)
    for reason in passport.unjudged:
        say(f"[yellow]not judged[/]: {escape(reason)}")
    for advice in passport.advice:
        say(advice, markup=False)


def console_of_terminal() -> Console:
    """Return the terminal; where there is none, one wide enough for the reasons."""
    console = Console()
    return console if console.is_terminal else Console(width=_WIDE)


def _quantities(results: Results, *, reasons: bool) -> Table:
    others = () if results.quick else wording.OTHERS
    why = ("why that bound",) if reasons else ()
    table = table_of("benchmark", "quantity", "measured", "allowed", "verdict", *others, *why)
    for section in results.sections:
        for row in section.rows:
            table.add_row(
                section.name if row is section.rows[0] else "",
                escape(row.quantity),
                wording.measured(row),
                wording.allowed(row),
                _PASS if row.passed else _FAIL,
                *(wording.under(row, name) for name in others),
                *([escape(row.reason)] if reasons else []),
            )
    return table


def _matrix(results: Results) -> Table:
    table = table_of("caught faults", *FAULTS)
    for section in (section for section in results.sections if section.faults):
        marks = {injected.fault: injected for injected in section.faults}
        table.add_row(
            section.name,
            *(
                ""
                if fault not in marks
                else "[green]caught[/]"
                if marks[fault].broken
                else "[bold red]MISSED[/]"
                if marks[fault].expected
                else "[dim]-[/]"
                for fault in FAULTS
            ),
        )
    return table


def table_of(*columns: str) -> Table:
    """Return a table without lines; measured values are to the right, reasons dim."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in columns:
        if name == "measured" or name in wording.OTHERS:
            style = "yellow" if name in wording.OTHERS else ""
            table.add_column(name, justify="right", no_wrap=True, style=style)
        elif name == "why that bound":
            table.add_column(name, style="dim")
        else:
            table.add_column(name, no_wrap=name == "benchmark")
    return table
