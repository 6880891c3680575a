"""Write docs/papers.md and its figures: what the five papers claim, and what the flights show.

``python tools/papers_page.py`` flies what tools/papers/ names, a file for each paper, on all cores:
some minutes. A claim is an entry there: what the paper says and where, the verdict, and what was
measured. Each measurement is a check, one of a scenario by its name or one that the entry states,
and is judged as the checks of any flight are; one that does not come out as expected ends the tool,
so that no verdict outlives its flight.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from paper_claims import VERDICTS, Claim, Number, Paper, fly, papers
from paper_figures import draw

from mjspace.log.reader import Log
from mjspace.runner import workers
from mjspace.runner.output import LOG

PAGE = Path(__file__).parents[1] / "docs/papers.md"
PICTURES = PAGE.with_suffix("")
HEAD = """# The papers' claims and what the flights show

Five papers are the origin of many laws and scenarios of mjspace. Here are their claims and figures,
one by one, with what a flight on the multibody plant measured. The verdicts:

- **holds**: as the paper says;
- **holds corrected**: with what the row states and the errata that it names;
- **does not hold**: the numbers show what happens instead;
- **not flown**: without a number, for the reason that the row states.

What was measured names its signal and its flight, where that is another than the line before: a
[scenario](scenarios.md), or one with the changes that are listed below its table. Each number is
that of a check with bounds, judged on every control period. This page and its figures are written
by `python tools/papers_page.py` from `tools/papers/` and the flights, which take some minutes. In
the figures components 1, 2 and 3 are red, green and blue. Errata have the numbers that scenarios
and laws cite.
"""
Numbers = Mapping[tuple[str, str], Sequence[Number]]
"""What was measured, by paper and flight, in the order of the paper's entries."""


def page(of: Sequence[Paper], numbers: Numbers) -> str:
    """Return the page, with these numbers."""
    lines = [HEAD, f"| | {' | '.join(VERDICTS)} |", "|---|" + "---|" * len(VERDICTS)]
    for paper in of:
        counts = [sum(claim.verdict == each for claim in paper.claims) for each in VERDICTS]
        lines += [f"| [{paper.title}](#{_slug(paper.title)}) | {' | '.join(map(str, counts))} |"]
    lines += [""]
    for paper in of:
        lines += [f"## {paper.title}", "", f"{paper.source}. {paper.remark}", ""]
        lines += ["| claim | where | what was measured | verdict |", "|---|---|---|---|"]
        left = {flight: iter(numbers[paper.title, flight]) for flight in paper.measured}
        lines += [_row(paper, claim, left) for claim in paper.claims]
        lines += ["", *_flights(paper), "Errata:", ""]
        lines += [f"- **{number}**: {text}" for number, text in paper.errata.items()]
        for picture in paper.figures:
            lines += ["", f"![{picture.caption}]({PICTURES.name}/{picture.file})", ""]
            lines += [f"{picture.caption}."]
        lines += [""]
    return "\n".join(lines).rstrip() + "\n"


def _slug(title: str) -> str:
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def _row(paper: Paper, claim: Claim, left: Mapping[str, Iterator[Number]]) -> str:
    measured, before = [], ""
    for one in claim.measured:
        number = next(left[one.flight])
        where = f"`{number.signal}`"
        if one.flight != before:  # else that of the number before it
            where += f" of {_link(paper, one.flight)}"
        measured.append(f"{one.title}: **{number.value}** ({where})")
        before = one.flight
    verdict = f"**{claim.verdict}**" + f": {claim.because}" * bool(claim.because)
    if claim.errata:
        word = "erratum" if len(claim.errata) == 1 else "errata"
        verdict += f" ({word} {', '.join(claim.errata)})"
    cells = (claim.claim, claim.where, "<br>".join(measured), verdict)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _link(paper: Paper, flight: str) -> str:
    if flight in paper.flights:
        return f"*{flight}*"
    return f"[`{flight}`](../mjspace/scenarios/{flight}.toml)"


def _flights(paper: Paper) -> Iterator[str]:
    """Yield the lines on the flights that are scenarios with changes."""
    if paper.flights:
        yield from ("Flights with changes:", "")
        for name, flight in paper.flights.items():
            changes = ", ".join(f"`{change}`" for change in flight.set)
            yield f"- *{name}*: {_link(paper, flight.scenario)} with {changes}"
        yield ""


def flown(of: Sequence[Paper], folder: Path) -> tuple[Numbers, dict[tuple[str, str], Log]]:
    """Fly what the papers need, each flight into a folder of its own in ``folder``.

    Return what was measured and the logs, by paper and flight.

    Raises:
        ValueError: a flight ended early, or a check did not come out as expected.
    """
    calls = {}
    for number, paper in enumerate(of):
        for name in paper.shown:
            to = folder / f"{number}-{name}"
            calls[paper.title, name] = paper.flight(name), paper.measured.get(name, []), to
    places = list(calls)
    results = dict(workers.each([(fly, call) for call in calls.values()]))
    numbers = {place: results[index] for index, place in enumerate(places)}
    return numbers, {place: Log(calls[place][2] / LOG) for place in places}


def main() -> None:
    """Fly, and write the page and its figures."""
    of = papers()
    with TemporaryDirectory() as folder:
        numbers, logs = flown(of, Path(folder))
        PICTURES.mkdir(exist_ok=True)
        for paper in of:
            own = {flight: log for (title, flight), log in logs.items() if title == paper.title}
            for picture in paper.figures:
                draw(picture, own, PICTURES)
    PAGE.write_text(page(of, numbers))


if __name__ == "__main__":
    main()
