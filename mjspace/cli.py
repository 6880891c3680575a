"""The command line: ``mjspace list | info | run | replay | render | plot | validate``.

Exit status: 0 every check came out as the scenario expects, 1 flown but one did not (or a replay
differed, or the flight ended early), 2 bad input. Modules are imported when a command needs them:
``--help`` answers at once.
"""

import json
import warnings
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from mjspace.errors import InputError, print_warning
from mjspace.rendering import graphics
from mjspace.terminal.options import Json, LogFile, Out, Plot, Set, Traceback, Video
from mjspace.terminal.terminal import (
    finish,
    in_full,
    open_log,
    progress_bar,
    report_errors,
)
from mjspace.validation.command import validate

app = typer.Typer(
    help="Fly control laws on multibody spacecraft in MuJoCo.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help, in half the time
)


def main() -> None:
    """Run the command line; the entry point."""
    warnings.showwarning = print_warning
    with report_errors():
        graphics.check()
        app()


@app.command("list")
def list_scenarios(as_json: Json = False) -> None:
    """List the scenarios that come with mjspace."""
    from mjspace.scenario.loading import description, scenario_names

    found = {name: description(name) for name in scenario_names()}
    if as_json:
        print(json.dumps(found, indent=2))
        return
    width = max(map(len, found))
    for name, text in found.items():
        print(f"{name:{width}}  {text}")


@app.command()
def info(
    target: Annotated[str, typer.Argument(metavar="SCENARIO|LOG")],
    overrides: Set = [],  # noqa: B006
    as_json: Json = False,
) -> None:
    """Show a scenario in full, or what a log holds."""
    if target.endswith(".mcap"):
        from mjspace.runner import report

        log = open_log(Path(target))
        if as_json:
            print(json.dumps(report.log_data(log), indent=2))
        else:
            report.print_log(log)
        return
    from mjspace.scenario.loading import load, to_toml

    scenario, _ = load(target, overrides)
    print(scenario.model_dump_json(indent=2) if as_json else to_toml(scenario).rstrip())


@app.command()
def run(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO", help="A name or a TOML file.")
    ] = "",
    every: Annotated[
        bool, typer.Option("--all", help="Every scenario that comes with mjspace, on all cores.")
    ] = False,
    overrides: Set = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(help="Seed of every random stream.")] = None,
    out: Out = None,
    duration: Annotated[str, typer.Option(help="Simulated time: 20, or '2 min'.")] = "",
    plot_it: Plot = False,
    video: Video = False,
    as_json: Json = False,
    traceback: Traceback = False,
) -> None:
    """Fly a scenario, log it and judge it."""
    from mjspace.runner.run import fly_to_log, output_folder
    from mjspace.scenario.loading import load
    from mjspace.simulation.assembly import assemble

    extra = [] if seed is None else [f"seed={seed}"]
    extra += [f"duration={duration}"] if duration else []
    if every == bool(scenario):
        raise InputError("run: give one SCENARIO, or --all; 'mjspace list' shows them")
    if every:
        if plot_it or video:
            raise InputError("--all: has no pictures; plot and render the logs that matter")
        _run_all([*overrides, *extra], output_folder(out, "all"), as_json)
    with in_full(traceback):
        loaded, folder = load(scenario, [*overrides, *extra])
        assembly = assemble(loaded, folder)
        with progress_bar(loaded.duration, "flying") as progress:
            path = output_folder(out, loaded.name) / "flight.mcap"
            result = fly_to_log(assembly, path, progress=progress)
    finish(result, plot_it, video, as_json, traceback)


def _run_all(overrides: list[str], out: Path, as_json: bool) -> NoReturn:
    from mjspace.runner import run_all
    from mjspace.scenario.loading import scenario_names

    with progress_bar(1.0, "flying", count="") as progress:
        outcomes = run_all.fly(scenario_names(), overrides, out, progress)
    if as_json:
        print(json.dumps(run_all.data(outcomes), indent=2))
    else:
        run_all.show(outcomes)
        print(f"logs   {out}")
    raise typer.Exit(0 if all(outcome.result["passed"] for outcome in outcomes) else 1)


@app.command()
def replay(
    log: LogFile,
    verify: Annotated[
        bool, typer.Option("--verify", help="Compare with the log bit by bit; write nothing.")
    ] = False,
    start: Annotated[
        float, typer.Option("--from", metavar="T", help="Begin at this logged time [s].")
    ] = 0.0,
    law: Annotated[
        str, typer.Option(help="Fly this law instead: module:Class or file.py:Class.")
    ] = "",
    gains: Annotated[
        list[str], typer.Option("--gain", metavar="KEY=VALUE", help="A gain of --law; repeatable.")
    ] = [],  # noqa: B006
    out: Out = None,
    plot_it: Plot = False,
    video: Video = False,
    as_json: Json = False,
    traceback: Traceback = False,
) -> None:
    """Fly a log again: to prove it, or under another law."""
    from mjspace.runner import replay as again
    from mjspace.runner.run import output_folder
    from mjspace.scenario.loading import component

    if gains and not law:
        raise InputError("--gain: goes with --law")
    if verify and law:
        raise InputError("--verify: another law flies another flight: leave --law out")
    logged = open_log(log)
    with in_full(traceback), progress_bar(logged.end, "flying") as progress:
        if verify:
            difference = again.verify(log, start=start, progress=progress)
        else:
            result = again.replay(
                log,
                output_folder(out, f"{logged.metadata.get('scenario', log.stem)}-replay"),
                start=start,
                law=component(law, gains) if law else None,
                progress=progress,
            )
    if not verify:
        finish(result, plot_it, video, as_json, traceback)
    elif as_json:
        print(json.dumps({"identical": difference is None, "difference": str(difference or "")}))
    else:
        print(difference or f"identical: every topic from t = {start:g} s to {logged.end:g} s")
    raise typer.Exit(1 if verify and difference else 0)


@app.command()
def render(
    log: LogFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="x.mp4, or x.png for a still.")],
    camera: Annotated[str, typer.Option(help="A camera of the model.")] = "chase",
    size: Annotated[str, typer.Option(metavar="WxH", help="In pixels.")] = "960x540",
    rate: Annotated[float, typer.Option(help="Frames a second.")] = 25.0,
    speed: Annotated[float, typer.Option(help="Simulated seconds for each second.")] = 1.0,
    at: Annotated[float | None, typer.Option(help="Time of a still [s]; else the end.")] = None,
) -> None:
    """Render a log to a video or a picture, offscreen."""
    from mjspace.errors import input_error_at
    from mjspace.rendering.render import render as to_picture

    width, _, height = size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise InputError(f"--size {size}: write width and height in pixels, as in 960x540")
    with progress_bar(open_log(log).end, "rendering") as progress, input_error_at("render"):
        to_picture(
            log,
            output,
            camera=camera,
            size=(int(width), int(height)),
            rate=rate,
            speed=speed,
            at=at,
            progress=progress,
        )
    print(output)


@app.command()
def plot(
    log: LogFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="A PNG file.")],
    signals: Annotated[
        list[str],
        typer.Option("--signal", help="Plot this signal, as truth.rate[0]; repeatable."),
    ] = [],  # noqa: B006
    phase: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="X Y", help="Plot a phase plane: one signal against another."),
    ] = None,
) -> None:
    """Plot a log to a PNG page."""
    from mjspace.errors import InputError, input_error_at
    from mjspace.plotting import phase_plane
    from mjspace.plotting.page import plot as to_picture

    if phase and signals:
        raise InputError("--phase: is a picture of its own: leave --signal out")
    open_log(log)
    with input_error_at("plot"):
        if phase:
            phase_plane.plot(log, output, *phase)
        else:
            to_picture(log, output, signals=signals)
    print(output)


app.command()(validate)
