"""The page on the papers says what its entries and the flights say."""

import re
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mjspace.runner.checks import refuse_unknown
from mjspace.scenario.loading import load
from mjspace.signals import Topics, find_signal
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import shapes

ROOT = Path(__file__).parents[1]
WILD = "\N{SNOWMAN}"
pytestmark = pytest.mark.filterwarnings("ignore::mjspace.vehicle.vehicle.UnphysicalInertiaWarning")


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(ROOT / "tools")
    return import_module("papers_page")


def with_any_numbers(tool: ModuleType, papers: Any) -> re.Pattern[str]:
    """Return what matches the page, whatever was measured: a group for each number."""
    claims = sys.modules["paper_claims"]
    numbers = {}
    for paper in papers:
        for flight, measured in paper.measured.items():
            changed = paper.flight(flight)
            own = load(changed.scenario, changed.set)[0].checks
            numbers[paper.title, flight] = [
                claims.Number(one.judged(own).signal, WILD) for one in measured
            ]
    text = re.escape(tool.page(papers, numbers))
    return re.compile(text.replace(WILD, r"([-+.\de]+)(?: [^*]+)?"))


def test_the_page_has_every_entry_as_it_stands_and_no_other(tool: ModuleType) -> None:
    papers = tool.papers()
    assert with_any_numbers(tool, papers).fullmatch(tool.PAGE.read_text())
    pictures = [picture for paper in papers for picture in paper.figures]
    assert {path.name for path in tool.PICTURES.iterdir()} == {one.file for one in pictures}
    assert all(path.stat().st_size < 60_000 for path in tool.PICTURES.iterdir())


@pytest.mark.slow
def test_every_signal_that_it_states_or_draws_is_logged(tool: ModuleType) -> None:
    for paper in tool.papers():
        stated: dict[str, list[Any]] = {}
        for flight, measured in paper.measured.items():
            stated[flight] = [one.stated for one in measured if one.stated]
        drawn = [curve for picture in paper.figures for p in picture.panels for curve in p.curves]
        for flight in paper.shown:
            signals = [s for curve in drawn if curve.flight == flight for s in (curve.x, curve.y)]
            if stated.get(flight) or signals:
                logged = topics(paper.flight(flight))
                refuse_unknown(stated.get(flight, []), logged)
                for signal in filter(None, signals):
                    find_signal(logged, signal)


def topics(flight: Any) -> Topics:
    assembly = assemble(*load(flight.scenario, flight.set))
    return shapes(next(iter(fly(assembly, first_start(assembly, [0]), [0]))))


@pytest.mark.long
def test_the_numbers_are_those_of_the_flights(tool: ModuleType, tmp_path: Path) -> None:
    papers = tool.papers()
    pattern = with_any_numbers(tool, papers)
    flown = pattern.fullmatch(tool.page(papers, tool.flown(papers, tmp_path)[0]))
    printed = pattern.fullmatch(tool.PAGE.read_text())
    assert flown
    assert printed
    # As small as rounding is another number on another machine.
    np.testing.assert_allclose(
        [float(number) for number in flown.groups()],
        [float(number) for number in printed.groups()],
        rtol=0.01,
        atol=1e-10,
    )
