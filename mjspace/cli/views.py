"""The command ``mjspace view``: a log replayed or a scenario flown live, or opened elsewhere."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjspace.errors import InputError, input_error_at, missing
from mjspace.terminal.options import Set, Trust
from mjspace.terminal.reporting import open_log, progress_bar

if TYPE_CHECKING:
    from mjspace.log.reader import Log


class Viewer(StrEnum):
    """A viewer of others that opens a log."""

    RERUN = "rerun"


def view(
    what: Annotated[
        str,
        typer.Argument(metavar="LOG|SCENARIO", help="A log to replay, or a scenario to fly live."),
    ],
    export: Annotated[
        Path | None, typer.Option(help="Write the replay of a log to this HTML file instead.")
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address to serve on; but for this machine's own with a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 is any that is free.")] = 8080,
    native: Annotated[
        bool, typer.Option("--native", help="In MuJoCo's own viewer, where there is a display.")
    ] = False,
    other: Annotated[
        Viewer | None,
        typer.Option("--with", help="Open a log in Rerun's viewer, in a window or a browser."),
    ] = None,
    overrides: Set = [],  # noqa: B006
    trust: Trust = False,
) -> None:
    """Look at a flight in a browser: a log's, or a scenario's that is flown as you look."""
    if sum((native, export is not None, other is not None)) > 1:
        raise InputError("--native, --export, --with: give one of them")
    _require(native, other)
    if not _is_log(what):
        if export is not None or other is not None:
            option = "--export" if other is None else "--with"
            raise InputError(f"{option}: is for a log: fly the scenario first, 'mjspace run'")
        _fly(what, overrides, None if native else (host, port), trust=trust)
        return
    if overrides or trust:
        raise InputError("--set, --trust: are for a scenario: a log is shown as it was flown")
    log = open_log(Path(what))
    if other is not None:
        _show_in_rerun(log)
        return
    with input_error_at("view"):
        if export is not None:
            _export(log, export)
        else:
            _replay(log, None if native else (host, port))


def _is_log(what: str) -> bool:
    from mjspace.log.file import MAGIC

    path = Path(what)
    if path.is_file():
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    return path.suffix == ".mcap"


def _export(log: "Log", output: Path) -> None:
    from mjspace.view.export import export

    with progress_bar(log.end, "recording") as progress:
        export(log, output, progress=progress)
    print(output)


def _replay(log: "Log", served: tuple[str, int] | None) -> None:
    """Replay the log on an address and a port, or natively."""
    from mjspace.interrupts import on_signals

    if served is None:
        from mjspace.view import native

        with on_signals() as stop:
            native.replay(log, stop)
        return
    from mjspace.view.replay import Replay
    from mjspace.view.server import serving

    with serving(*served, "mjspace") as (server, address):
        replay = Replay(server, log)
        with on_signals() as stop:
            print(f"{address}\nCtrl-C ends it.", flush=True)
            replay.run(stop)


def _show_in_rerun(log: "Log") -> None:
    from mjspace.conversion import rerun_viewer
    from mjspace.interrupts import on_signals

    with on_signals() as stop, progress_bar(log.end, "converting") as progress:
        rerun_viewer.show(log, stop, progress)


def _fly(
    scenario: str, overrides: list[str], served: tuple[str, int] | None, *, trust: bool
) -> None:
    """Fly the scenario on an address and a port, or natively."""
    from mjspace.interrupts import on_signals
    from mjspace.scenario.loading import load
    from mjspace.simulation.assembly import assemble
    from mjspace.simulation.live_flight import LiveFlight

    loaded, folder = load(scenario, overrides)
    assembly = assemble(loaded, folder, trust=trust)
    if served is None:
        from mjspace.view import native

        with on_signals() as stop:
            native.fly(LiveFlight(assembly), stop)
        return
    from mjspace.view.live import Live
    from mjspace.view.server import serving

    with serving(*served, "mjspace") as (server, address):
        live = Live(server, lambda: LiveFlight(assembly))
        with on_signals() as stop:
            print(f"{address}\nCtrl-C ends it.", flush=True)
            live.run(stop)


def _require(native: bool, other: Viewer | None) -> None:
    """Refuse to go on without what shows it: a display, or the packages of an extra.

    Raises:
        InputError: it is missing.
    """
    if native:
        from mjspace.view.native import require_display

        require_display()
    elif other is Viewer.RERUN:
        from mjspace.conversion.rerun_viewer import require_rerun

        require_rerun()
    else:
        from importlib.util import find_spec

        if find_spec("viser") is None:
            raise missing("view", "viser", "view")
