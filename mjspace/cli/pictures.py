"""The commands ``mjspace render`` and ``mjspace plot``."""

from pathlib import Path
from typing import Annotated

import typer

from mjspace.errors import InputError, input_error_at
from mjspace.terminal.options import LogFile, Quiet
from mjspace.terminal.reporting import frame_bar, open_log


def render(
    log: LogFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="x.mp4, or x.png for a still.")],
    camera: Annotated[str, typer.Option(help="A camera of the model.")] = "chase",
    size: Annotated[str, typer.Option(metavar="WxH", help="In pixels.")] = "960x540",
    rate: Annotated[float, typer.Option(help="Frames a second.")] = 25.0,
    speed: Annotated[float, typer.Option(help="Simulated seconds for each second.")] = 1.0,
    at: Annotated[float | None, typer.Option(help="Time of a still [s]; else the end.")] = None,
    arrows: Annotated[
        bool,
        typer.Option(
            "--arrows/--no-arrows", help="Arrows, letters at the axes, trail and landing site."
        ),
    ] = True,
    quiet: Quiet = False,
) -> None:
    """Render a log to a video or a picture, offscreen."""
    from mjspace.rendering.render import render as to_picture

    width, _, height = size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise InputError(f"--size {size}: write width and height in pixels, as in 960x540")
    opened = open_log(log)
    with frame_bar() as progress, input_error_at("render"):
        to_picture(
            opened,
            output,
            camera=camera,
            size=(int(width), int(height)),
            rate=rate,
            speed=speed,
            at=at,
            arrows=arrows,
            progress=progress,
        )
    print(output)


def plot(
    log: LogFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="x.png, x.pdf or x.svg.")],
    signals: Annotated[
        list[str],
        typer.Option("--signal", help="Plot this signal, as truth.rate[0]; repeatable."),
    ] = [],  # noqa: B006
    topics: Annotated[
        list[str], typer.Option("--topic", help="Plot all of this topic, as truth; repeatable.")
    ] = [],  # noqa: B006
    everything: Annotated[bool, typer.Option("--all", help="Plot every signal.")] = False,
    phase: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="X Y", help="Plot a phase plane: one signal against another."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Plot a log to a page: what matters of what flew, or the signals that are named."""
    from mjspace.log.columns import select
    from mjspace.plotting import phase_plane
    from mjspace.plotting.page import plot as to_picture

    if phase and (signals or topics or everything):
        raise InputError("--phase: is a picture of its own: leave --signal, --topic and --all out")
    if everything and (signals or topics):
        raise InputError("--all: plots every signal: leave --signal and --topic out")
    opened = open_log(log)
    with input_error_at("plot"):
        if phase:
            phase_plane.plot(log, output, *phase)
            print(output)
            return
        named = [each.name for each in select(opened, (), topics)] if topics or everything else []
        to_picture(log, output, signals=[*signals, *named])
    print(output)
