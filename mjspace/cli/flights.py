"""The commands ``mjspace run`` and ``mjspace replay``."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, NoReturn

import typer

from mjspace.errors import InputError
from mjspace.terminal.options import (
    Force,
    Json,
    LogFile,
    Out,
    Plot,
    Quiet,
    Report,
    Scenario,
    Set,
    Traceback,
    Trust,
    Video,
)
from mjspace.terminal.reporting import (
    cause_shown,
    flight_bar,
    frame_bar,
    open_log,
    print_cause,
    progress_bar,
)

if TYPE_CHECKING:
    from mjspace.runner.run import Result


class Pictures(NamedTuple):
    """What is made of a log, besides the verdict."""

    plot: bool
    video: bool
    report: bool


def run(
    scenario: Scenario = "",
    every: Annotated[
        bool, typer.Option("--all", help="Every scenario that comes with mjspace, on all cores.")
    ] = False,
    overrides: Set = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(help="Seed of every random stream.")] = None,
    out: Out = None,
    force: Force = False,
    duration: Annotated[str, typer.Option(help="Simulated time: 20, or '2 min'.")] = "",
    plot_it: Plot = False,
    video: Video = False,
    report_it: Report = False,
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    traceback: Traceback = False,
) -> None:
    """Fly a scenario, log it and judge it."""
    from mjspace.runner.live import figures
    from mjspace.runner.output import LOG
    from mjspace.runner.run import fly_to_log, output_folder
    from mjspace.scenario.loading import load
    from mjspace.simulation.assembly import assemble

    extra = [] if seed is None else [f"seed={seed}"]
    extra += [f"duration={duration}"] if duration else []
    if every == bool(scenario):
        raise InputError("run: give one SCENARIO, or --all; 'mjspace list' shows them")
    if every:
        if plot_it or video or report_it:
            raise InputError("--all: has no pictures; plot, render or report the logs that matter")
        _run_all([*overrides, *extra], output_folder(out, "all"), force, as_json)
    with cause_shown(traceback):
        loaded, folder = load(scenario, [*overrides, *extra])
        assembly = assemble(loaded, folder, trust=trust)
        with flight_bar(loaded.duration) as show:
            path = output_folder(out, loaded.name) / LOG
            result = fly_to_log(
                assembly,
                path,
                force=force,
                watch=lambda block: show(float(block.time[-1]), figures(assembly, block)),
            )
    pictures = Pictures(plot_it, video, report_it)
    _finish(result, pictures, as_json, traceback)


def _run_all(overrides: list[str], out: Path, force: bool, as_json: bool) -> NoReturn:
    from mjspace.runner import run_all
    from mjspace.scenario.files import scenario_names

    names = scenario_names()
    with progress_bar(1.0, "flying", count="") as progress:
        outcomes, signal = run_all.fly(names, overrides, out, progress, force=force)
    if as_json:
        print(json.dumps(run_all.data(outcomes), indent=2))
    else:
        run_all.show(outcomes)
        print(f"logs   {out}")
    if signal:
        whole = sum(not outcome.result["trouble"] for outcome in outcomes)
        print(f"mjspace: interrupted: {whole} of {len(names)} flown to the end", file=sys.stderr)
        raise typer.Exit(128 + signal)
    raise typer.Exit(0 if all(outcome.result["passed"] for outcome in outcomes) else 1)


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
    force: Force = False,
    plot_it: Plot = False,
    video: Video = False,
    report_it: Report = False,
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
    traceback: Traceback = False,
) -> None:
    """Fly a log again: to prove it, or under another law."""
    from mjspace.runner import replay as again
    from mjspace.runner.run import output_folder

    if gains and not law:
        raise InputError("--gain: is for another law: name it by --law")
    if verify and law:
        raise InputError("--verify: compares the flight under the logged law: leave --law out")
    logged = open_log(log)
    with cause_shown(traceback), progress_bar(logged.end, "flying") as progress:
        if verify:
            difference = again.verify(log, start=start, trust=trust, progress=progress)
        else:
            result = again.replay(
                log,
                output_folder(out, f"{logged.metadata.get('scenario', log.stem)}-replay"),
                start=start,
                law=law or None,
                gains=gains,
                trust=trust,
                force=force,
                progress=progress,
            )
    if not verify:
        pictures = Pictures(plot_it, video, report_it)
        _finish(result, pictures, as_json, traceback)
    elif as_json:
        print(json.dumps({"identical": difference is None, "difference": str(difference or "")}))
    else:
        print(difference or f"identical: every topic from t = {start:g} s to {logged.end:g} s")
    raise typer.Exit(1 if verify and difference else 0)


def _finish(result: "Result", made: Pictures, as_json: bool, traceback: bool) -> None:
    """Print the verdict, make the requested pictures, and exit with the status."""
    from mjspace.runner import report

    if traceback and result.error is not None:
        print_cause(result.error)

    pictures = {}
    if not as_json:
        report.print_result(result)
        print(f"log    {result.path}")
    if made.plot:
        from mjspace.plotting.page import plot as to_plot

        pictures["plot"] = result.path.with_suffix(".png")
        to_plot(result.path, pictures["plot"])
    if made.video:
        from mjspace.rendering.render import render as to_video

        pictures["video"] = result.path.with_suffix(".mp4")
        with frame_bar() as progress:
            to_video(result.path, pictures["video"], progress=progress)
    if made.report:
        from mjspace.runner.flight_report import write as to_report

        pictures["report"] = result.path.with_suffix(".html")
        to_report([result.path], pictures["report"])
    if as_json:
        shown = {name: str(path) for name, path in pictures.items()}
        print(json.dumps(report.result_data(result) | shown, indent=2))
    else:
        for name, path in pictures.items():
            print(f"{name:6} {path}")
    if result.signal:
        raise typer.Exit(128 + result.signal)
    raise typer.Exit(0 if result.passed else 1)
