"""The command ``mjspace view``: a log replayed or a scenario flown live, in a browser."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mjspace.errors import InputError, input_error_at
from mjspace.terminal.reporting import open_log

if TYPE_CHECKING:
    from mjspace.log.reader import Log


def view(
    what: Annotated[
        str,
        typer.Argument(metavar="LOG|SCENARIO", help="A log to replay, or a scenario to fly live."),
    ],
    host: Annotated[
        str, typer.Option(help="Address to serve on; but for this machine's own with a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 is any that is free.")] = 8080,
) -> None:
    """Look at a flight in a browser."""
    with input_error_at("view"):
        _replay(open_log(Path(what)), host, port)


def _replay(log: "Log", host: str, port: int) -> None:
    _require_viser()
    from mjspace.interrupts import on_signals
    from mjspace.view.replay import Replay
    from mjspace.view.server import serving

    with serving(host, port, "mjspace") as (server, address):
        replay = Replay(server, log)
        print(f"{address}\nCtrl-C ends it.", flush=True)
        with on_signals() as stop:
            replay.run(stop)


def _require_viser() -> None:
    """Refuse to go on without the packages of the extra.

    Raises:
        InputError: viser is not installed.
    """
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise InputError(f"view: {error}: pip install 'mjspace[view]'") from error
