"""A page from its template: escaped throughout, with its style, script and pictures inside."""

import base64
import hashlib
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from mjspace.errors import printable, whole_or_none
from mjspace.reporting.charts import Chart, data

_OF_REPORT = (
    "default-src 'none'; script-src {}; style-src 'unsafe-inline'; img-src data:; media-src data:"
)
_OF_VIEWER = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob: data:; "
    "worker-src blob: data:; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
    "connect-src data: blob:"
)


def write(
    output: Path, template: str, charts: Sequence[Chart], *, viewer: str = "", **content: Any
) -> None:
    """Write a page of ``content`` and ``charts`` to ``output``, in place of what is there.

    Every text is escaped, and shown without control characters. A policy in the page lets a
    browser run no other script than its own two, and load nothing. ``viewer`` is a page of another
    origin's making that the template shows in a frame: it starts scripts of its own, which the
    policy then admits, as long as they load nothing either.

    Raises:
        ValueError: ``output`` does not end in .html.
        OSError: the file cannot be written.
    """
    require_html(output)
    environment = Environment(
        loader=PackageLoader("mjspace.reporting"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    scripts = [_part("uplot/uPlot.iife.min.js"), _part("templates/page.js")]
    if viewer:
        scripts.append(_part("templates/replay.js"))
    hashes = " ".join(f"'sha256-{_digest(script)}'" for script in scripts)
    text = environment.get_template(template).render(
        content
        | {
            "policy": _OF_VIEWER if viewer else _OF_REPORT.format(hashes),
            "viewer": escape(viewer),
            "styles": [Markup(_part(f)) for f in ("uplot/uPlot.min.css", "templates/page.css")],
            "scripts": [Markup(script) for script in scripts],
            "license": _part("uplot/LICENSE"),
            "charts": data(charts),
        }
    )
    with whole_or_none(output) as file:
        file.write(text.encode(errors="backslashreplace"))


def require_html(output: Path) -> None:
    """Refuse a file of another ending, before anything is computed.

    Raises:
        ValueError: it does not end in .html.
    """
    if output.suffix != ".html":
        raise ValueError(f"output {str(output)!r}: end it in .html")


def _shown(value: Any) -> Any:
    """Return what an expression of a template prints."""
    return printable(value) if type(value) is str else value


@cache
def _part(name: str) -> str:
    """Return a file of this room."""
    return (resources.files("mjspace.reporting") / name).read_text(encoding="utf-8").strip()


def _digest(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
