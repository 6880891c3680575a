"""A log as a notebook shows it: topics and verdict, tables, the page of plots and the video."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from markupsafe import Markup

from mjspace.errors import missing, printable
from mjspace.log import reader
from mjspace.log.columns import select
from mjspace.log.flown_scenario import scenario_of
from mjspace.runner.checks import Verdict
from mjspace.runner.logged_verdicts import judged

_TAGS = {
    "image/png": Markup('<img style="max-width: 100%" src="data:{kind};base64,{data}">'),
    "video/mp4": Markup(
        '<video controls loop style="max-width: 100%" src="data:{kind};base64,{data}"></video>'
    ),
}


@dataclass(frozen=True)
class Shown:
    """A picture or a video, which a notebook shows."""

    kind: str
    """``image/png`` or ``video/mp4``."""
    data: bytes = field(repr=False)

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.data).decode()
        return str(_TAGS[self.kind].format(kind=self.kind, data=data))


class Log(reader.Log):
    """A flight's log, as ``mjspace.log.reader.Log`` reads it, with what a notebook shows of it."""

    def frame(
        self,
        topic: str,
        fields: Sequence[str] | None = None,
        start: float | None = None,
        end: float | None = None,
        every: int = 1,
    ) -> Any:
        """Return a topic as a ``pandas.DataFrame`` indexed by the time [s].

        It has a column for each number, as ``rate[0]``, in SI units; ``attrs["units"]`` has them.
        The arguments are those of ``read``.

        Raises:
            InputError: the log has no such topic or field, a chunk is damaged, or pandas is
                missing.
        """
        try:
            import pandas
        except ImportError:
            raise missing("a table", "pandas", "data") from None
        topic = topic if topic.startswith("/") else f"/{topic}"
        rows = self.read(topic, fields, start, end, every)
        prefix = f"{topic.removeprefix('/')}."
        columns: dict[str, Any] = {}
        units: dict[str, str] = {}
        signals = {signal.field: signal for signal in select(self, topics=[topic])}
        for signal in (signals[name] for name in rows if name in signals):
            names = [column.removeprefix(prefix) for column in signal.columns]
            columns |= dict(zip(names, signal.of(rows[signal.field]).T, strict=True))
            if unit := self.units[topic].get(signal.field):
                units |= dict.fromkeys(names, unit)
        found = pandas.DataFrame(columns, index=pandas.Index(rows["time"], name="time [s]"))
        found.attrs["units"] = units
        return found

    def plot(self, *signals: str) -> Shown:
        """Return the page of plots: the standard one, or one panel for each of ``signals``.

        Raises:
            ValueError: no such signal.
            OSError: the log cannot be read.
        """
        from mjspace.plotting.page import plot  # Matplotlib, which a flight does without

        with TemporaryDirectory() as folder:
            file = Path(folder) / "plot.png"
            plot(self, file, signals=signals)
            return Shown("image/png", file.read_bytes())

    def picture(self, at: float | None = None, **options: Any) -> Shown:
        """Return a picture of the time ``at`` [s], by default the end; options as of ``render``.

        Raises:
            ValueError: a time that was not logged, or an option that does not fit.
            NoRendererError: this machine cannot render; the message says what to install.
        """
        return self._rendered("image/png", at=at, **options)

    def video(self, **options: Any) -> Shown:
        """Return the video of the flight; options as of ``render``.

        Raises:
            ValueError: an option that does not fit.
            NoRendererError: this machine cannot render; the message says what to install.
        """
        return self._rendered("video/mp4", **options)

    def _rendered(self, kind: str, **options: Any) -> Shown:
        from mjspace.rendering.render import render  # OpenGL, likewise

        with TemporaryDirectory() as folder:
            file = Path(folder) / f"flight.{kind.partition('/')[2]}"
            render(self, file, **options)
            return Shown(kind, file.read_bytes())

    def _repr_html_(self) -> str:
        found = judged(self, scenario := scenario_of(self))
        title = f"{scenario.name}, {scenario.law.kind}: {len(self)} control periods"
        span = f", {self.start:g} to {self.end:g} s" if len(self) else ""
        return str(
            Markup("<p><b>{}</b></p>").format(printable(title + span))
            + verdicts_table(found.verdicts, found.trouble)
            + _topics_table(self)
        )


def verdicts_table(verdicts: Sequence[Verdict], trouble: str) -> Markup:
    """Return a flight's verdicts as a table of HTML, and why it ended early if it did."""
    rows = [
        (
            verdict.check.name,
            "-" if verdict.missing else f"{verdict.measured:.4g}",
            verdict.bound,
            verdict.outcome + ("" if verdict.as_expected else ", not as expected"),
        )
        for verdict in verdicts
    ]
    early = Markup("<p>ended early: {}</p>").format(printable(trouble)) if trouble else Markup()
    return _table(("check", "measured", "required", "verdict"), rows) + early


def _topics_table(log: reader.Log) -> Markup:
    rows = [
        (topic, ", ".join(_described(name, shape) for name, shape in fields.items()))
        for topic, fields in log.topics.items()
    ]
    return _table(("topic", "fields"), rows)


def _described(name: str, shape: tuple[int, ...]) -> str:
    return name + (f" {list(shape)}" if shape else "")


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Markup:
    """Return a table of texts, each escaped; nothing without rows."""
    if not rows:
        return Markup()
    cell = Markup('<{0} style="text-align: left">{1}</{0}>')
    lines = [("th", head), *(("td", row) for row in rows)]
    shown = [
        Markup("<tr>{}</tr>").format(
            Markup().join(cell.format(kind, printable(text)) for text in row)
        )
        for kind, row in lines
    ]
    return Markup("<table>{}</table>").format(Markup().join(shown))
