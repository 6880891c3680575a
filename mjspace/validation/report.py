"""The results as pages: one self-contained HTML file, and Markdown with its figures."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from mjspace.runner import workers
from mjspace.validation import figures, wording
from mjspace.validation.benchmark import FAULTS
from mjspace.validation.passport import Passport
from mjspace.validation.results import Results, Section

JSON, HTML = "validation.json", "validation.html"


def write(results: Results, folder: Path) -> tuple[Path, Path]:
    """Write the JSON and the HTML report into ``folder``, made if need be; return their paths.

    A quick run's report has no figures, which would take longer than the flights.

    Raises:
        OSError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    data, page = folder / JSON, folder / HTML
    data.write_text(results.model_dump_json() + "\n", encoding="utf-8")
    page.write_text(
        _rendered(
            "report.html.j2", results=results, figures={} if results.quick else _drawn(results)
        ),
        encoding="utf-8",
    )
    return data, page


def write_passport(passport: Passport, folder: Path) -> tuple[Path, Path]:
    """Write a model's passport as JSON and HTML into ``folder``, made if need be; return the paths.

    Raises:
        OSError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    data, page = folder / "passport.json", folder / "passport.html"
    data.write_text(passport.model_dump_json(indent=2) + "\n", encoding="utf-8")
    page.write_text(_rendered("passport.html.j2", passport=passport), encoding="utf-8")
    return data, page


def write_markdown(results: Results, page: Path) -> None:
    """Write ``page`` and, in a folder of the same name beside it, its figures.

    Raises:
        OSError: a file cannot be written.
    """
    folder = page.with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    for name, drawing in _drawn(results).items():
        (folder / f"{name}.svg").write_text(drawing, encoding="utf-8")
    page.write_text(
        _rendered("report.md.j2", results=results, figures=folder.name), encoding="utf-8"
    )


def _drawn(results: Results) -> dict[str, str]:
    """Return the sections' figures as SVG, by name."""
    calls = [(figures.svg, section) for section in results.sections]
    return {results.sections[index].name: drawing for index, drawing in workers.each(calls)}


def _rendered(template: str, **content: Any) -> str:
    """Return the page for ``results`` and ``figures``, or for a ``passport``.

    ``figures`` are SVG texts by name, or the name of the folder that contains them.
    """
    environment = Environment(
        loader=PackageLoader("mjspace.validation"),
        autoescape=select_autoescape(["html.j2"]),
        undefined=StrictUndefined,
    )
    environment.filters["cell"] = lambda text: text.replace("|", "\\|")
    words: dict[str, Any] = {
        "faults": FAULTS,
        "others": wording.OTHERS,
        "measured": wording.measured,
        "allowed": wording.allowed,
        "under": wording.under,
        "anchor": _anchor,
    }
    return environment.get_template(template).render(words | content)


def _anchor(section: Section) -> str:
    """Return the fragment that GitHub gives the section's heading."""
    kept = (c for c in section.title.lower() if c.isalnum() or c in " -_")
    return "".join(kept).replace(" ", "-")
