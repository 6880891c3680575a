"""A log replayed in the browser: play, pause, scrub, with plots that follow."""

import time as clock
from collections.abc import Callable
from threading import Event, Thread
from typing import Any

from mjspace.errors import InputError
from mjspace.log.frames import bus_of
from mjspace.log.reader import Log
from mjspace.plotting.panels import Curves, curves
from mjspace.view import plots
from mjspace.view.controls import PLOTS, SPEEDS, add_display, keep_showing
from mjspace.view.moments import Moments, Survey
from mjspace.view.scene import Scene
from mjspace.view.server import Server
from mjspace.view.shapes import bodies


class Replay:
    """A log in a server. The first moment is drawn at once, the plots when the log has been read.

    Attributes:
        time: what is shown or about to be shown [s].
        playing: whether time goes on by itself.
        speed: simulated seconds for each second.
        surveyed: set when the plots are there.
    """

    def __init__(self, server: Server, log: Log) -> None:
        """Draw the first moment.

        Raises:
            InputError: the log is damaged, or holds nothing to draw.
        """
        self._server, self._log = server, log
        self._moments = Moments(log)
        drawn = bodies(self._moments.frames.scene())
        self.scene = Scene(server, drawn, bus_of(log))
        self.time, self.playing, self.speed = log.start, False, 1.0
        self.surveyed, self._changed = Event(), Event()
        self._plots: list[plots.Plot] = []
        self._read: tuple[Survey, list[Curves]] | None = None
        self._trouble: Exception | None = None
        self._plotted = 0.0
        self._button, self._slider = self._add_controls()
        self.scene.show(self._moments.at(self.time))

    def run(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Serve until ``stop`` returns True.

        Raises:
            InputError: the log is damaged further on.
        """
        Thread(target=self._survey, name="survey", daemon=True).start()
        keep_showing(self.advance, self._changed, stop)

    def advance(self, seconds: float) -> None:
        """Draw what is shown so many ``seconds`` of wall time later.

        Raises:
            InputError: the log is damaged there.
        """
        if self._trouble is not None:
            raise self._trouble
        changed = self._changed.is_set()
        self._changed.clear()
        if self._read is not None and not self.surveyed.is_set():
            self._show_survey(*self._read)
            changed = True
        if self.playing:
            self.time = min(self.time + seconds * self.speed, self._log.end)
            if self.time >= self._log.end:
                self._play(False)
        elif not changed:
            return
        self._slider.value = self.time
        self.scene.show(self._moments.at(self.time))
        now = clock.monotonic()
        if not self.playing or now > self._plotted + PLOTS:
            self._plotted = now
            for plot in self._plots:
                plot.show(self.time)

    def seek(self, time: float) -> None:
        """Show another ``time`` [s]; it stays where it was, playing or not."""
        self.time = min(max(time, self._log.start), self._log.end)
        self._changed.set()

    def _play(self, playing: bool) -> None:
        if playing and self.time >= self._log.end:
            self.time = self._log.start
        self.playing = playing
        self._button.label = "Pause" if playing else "Play"
        self._changed.set()

    def _add_controls(self) -> tuple[Any, Any]:
        """Add what plays the log; return the button that plays, and the slider of the time."""
        gui, log = self._server.gui, self._log
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.main_panel.dock_left()
        button = gui.add_button("Play")
        step = max(log.control_period, 1e-9)
        end = max(log.end, log.start + step)
        slider = gui.add_slider("time [s]", log.start, end, step, log.start)
        chosen = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        add_display(gui, self.scene, self._changed)

        @button.on_click
        def _(_: Any) -> None:
            self._play(not self.playing)

        @slider.on_update
        def _(event: Any) -> None:
            if event.client is not None:  # a person's, not the replay's own
                self.seek(float(slider.value))

        @chosen.on_update
        def _(_: Any) -> None:
            self.speed = float(chosen.value)

        return button, slider

    def _survey(self) -> None:
        """Read the whole log once for the arrows and the trail, and once for the plots."""
        try:
            survey = self._moments.survey(self.scene.size)
            self._read = survey, curves(self._log, points=plots.POINTS)
        except (InputError, OSError) as error:
            self._trouble = error
        self._changed.set()

    def _show_survey(self, survey: Survey, found: list[Curves]) -> None:
        self.scene.longest, self.scene.path = survey
        self._plots = plots.add(self._server.gui, found)
        self.surveyed.set()
