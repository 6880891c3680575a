"""A flight from scenario to verdict: fly it, and log and judge it as it flies."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path

from mjspace.errors import FlightError, InputError, is_file_name, shortened, users_place_of
from mjspace.interrupts import Interrupted, on_signals
from mjspace.runner.checks import (
    Verdict,
    refuse_other_dimensions,
    refuse_unfit_formulas,
    refuse_unknown,
)
from mjspace.runner.flight_log import units_of
from mjspace.runner.metrics import Measured, refuse_unknown_signals
from mjspace.runner.output import LOG, make_folder, refuse_existing, remove
from mjspace.runner.recorder import Recorder
from mjspace.runner.shown_log import Log, verdicts_table
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block, shapes

Progress = Callable[[float], None]
"""A function that is called with the simulated time reached [s]."""
Watch = Callable[[Block], None]
"""A function that is called with each block as it is flown; it must not change it."""


@dataclass(frozen=True)
class Result:
    """The log of a flight and its verdicts."""

    path: Path
    """The log."""
    verdicts: list[Verdict]
    trouble: str
    """Why it ended early; empty for a flight that reached its end."""
    signal: int
    """The signal that ended it, 0 for none."""
    error: FlightError | None = None
    """The error that ended it; its ``__cause__`` is what the user's own code raised."""
    metrics: list[Measured] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether it reached its end and every check came out as expected."""
        return not self.trouble and all(verdict.as_expected for verdict in self.verdicts)

    @property
    def log(self) -> Log:
        """The log, to read."""
        return Log(self.path)

    def _repr_html_(self) -> str:
        return str(verdicts_table(self.verdicts, self.trouble))


def run(
    scenario: str | Path,
    *,
    overrides: Iterable[str] = (),
    out: str | Path | None = None,
    trust: bool = False,
    force: bool = False,
    progress: Progress = lambda time: None,
) -> Result:
    """Fly a scenario, by name or path, and judge it; the log is ``flight.mcap`` in ``out``.

    ``overrides`` are ``"key=value"``, as ``--set`` takes them; ``out`` is
    ``runs/<scenario>/<UTC stamp>`` when left out. With ``trust`` the scenario may name files
    outside its folder and any installed module. A log that is there already is replaced with
    ``force`` alone.

    Raises:
        InputError: bad input, in one line; nothing has been written.
        FlightError: it could not even begin.
        OSError: the log cannot be written (any more); it keeps what it has.
    """
    loaded, folder = load(scenario, overrides)
    assembly = assemble(loaded, folder, trust=trust)
    path = output_folder(out, loaded.name) / LOG
    return fly_to_log(assembly, path, force=force, watch=telling_time(progress))


def telling_time(progress: Progress) -> Watch:
    """Return what calls ``progress`` with the time that a block reaches."""
    return lambda block: progress(float(block.time[-1]))


def output_folder(out: str | Path | None, name: str, last: str = "") -> Path:
    """Return where runs called ``name`` write, ``last`` within their folder: else the time of now.

    Raises:
        InputError: a name, as that of a log's scenario, which no folder can have.
    """
    if out is not None:
        return Path(out)
    if not is_file_name(name):
        raise InputError(f"{shortened(name)!r} is no name of a folder: give one by --out")
    return Path("runs") / name / (last or datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%fZ"))


def fly_to_log(
    assembly: Assembly,
    path: Path,
    *,
    member: int = 0,
    start: Start | None = None,
    force: bool = False,
    watch: Watch = lambda block: None,
) -> Result:
    """Fly one member of the scenario, from ``start`` or time zero, into a new log, and judge it.

    ``watch`` is called with each block that has been handed over to the log.

    Raises:
        InputError: a check or a metric names no signal of this flight, or has a bound of
            another dimension; ``path`` is there already, and not to be replaced by ``force``, or
            another run writes it. Nothing is written.
        FlightError: it could not even begin.
        OSError: the log cannot be written (any more); it keeps what it has.

    A signal that ends it before it has begun is obeyed as elsewhere.
    """
    refuse_existing(path, force=force)
    start = start or first_start(assembly, [member])
    trouble, where, ended_by = "", "", None
    with on_signals() as stop, Recorder(assembly) as recorder:
        blocks = stop.breaking_off(fly(assembly, start, [member], stop=stop))
        first = next(blocks)
        refuse_unjudgeable(assembly, first)
        make_folder(path.parent)
        if force:
            remove(path)
        recorder.begin(path, member, first)
        try:
            for block in chain([first], blocks):
                recorder.write(block)
                watch(block)
        except FlightError as error:
            trouble, ended_by = str(error), error
        except Interrupted as error:
            where = users_place_of(error)
        if stop():
            trouble = f"interrupted by signal {stop.signal} at t = {recorder.time:.6g} s"
            trouble += f": {where} did not return" if where else ""
        if trouble:
            recorder.event("ERROR", trouble)
        metrics, verdicts = recorder.metrics(), recorder.verdicts()
        for measured in metrics:
            recorder.event("WARNING" if measured.missing else "INFO", measured.line)
        for verdict in verdicts:
            recorder.event("INFO" if verdict.as_expected else "ERROR", verdict.line)
    return Result(path, verdicts, trouble, stop.signal, ended_by, metrics)


def refuse_unjudgeable(assembly: Assembly, first: Block) -> None:
    """Refuse checks and metrics of what a flight with this ``first`` block does not show.

    Raises:
        InputError: one names no signal of it, or has a bound of another dimension.
    """
    scenario, topics = assembly.scenario, shapes(first)
    refuse_unknown(scenario.checks, topics)
    refuse_unknown_signals(scenario.metrics, topics)
    units = units_of(assembly, first.kinds)
    refuse_unfit_formulas(scenario.checks, topics, units, scenario.rates.control)
    refuse_other_dimensions(scenario.checks, scenario.events, topics, units, scenario.metrics)
