"""A scenario flown live in the browser, where a person pushes, changes gains and breaks motors."""

import json
import time as clock
from collections.abc import Callable, Mapping
from queue import Empty, SimpleQueue
from threading import Event
from typing import Any

import numpy as np
from markupsafe import escape

from mjspace.contract import Array
from mjspace.errors import printable
from mjspace.log.scene import scene as geometry
from mjspace.simulation.live_flight import BROKEN, LiveFlight
from mjspace.vehicle.indices import bus_id
from mjspace.view.controls import FRAME, PLOTS, SPEEDS, add_display, keep_showing
from mjspace.view.history import History
from mjspace.view.scene import Moment, Scene
from mjspace.view.server import Server
from mjspace.view.shapes import bodies, scene_update

_FLYING = 0.7  # of that: the rest is for drawing
_EVENTS = 8
_KICK = 0.05  # rad/s, what the push that is proposed gives in a second


class Live:
    """A flight in a server. What a person does is done between control periods.

    Attributes:
        flight: the flight; another one after a restart.
        playing: whether it goes on.
        speed: simulated seconds for each second, as far as this machine is quick enough.
    """

    def __init__(self, server: Server, begin: Callable[[], LiveFlight]) -> None:
        """Draw the first moment of the flight that ``begin`` returns, each time anew.

        Raises:
            FlightError: it cannot begin.
        """
        self._begin, self.flight = begin, begin()
        self.playing, self.speed = False, 1.0
        self._asked = SimpleQueue[Callable[[], None]]()
        self._changed = Event()
        self._gui = server.gui
        model = self.flight.assembly.vehicle.model
        self.scene = Scene(
            server, bodies(scene_update(geometry(model).update)), model.body(bus_id(model)).name
        )
        self._debt, self._plotted, self._shown = 0.0, 0.0, -1
        self._add_controls()
        self._history = History(self._gui, self.flight)
        self._draw()

    def run(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Serve until ``stop`` returns True.

        Raises:
            FlightError: the law raised, or the motion is no longer finite.
        """
        keep_showing(self.advance, self._changed, stop)

    def advance(self, seconds: float) -> None:
        """Do what was asked for, fly for so many ``seconds`` of wall time, and draw.

        Raises:
            FlightError: as ``run``.
        """
        changed = self._changed.is_set()
        self._changed.clear()
        while True:
            try:
                self._asked.get_nowait()()
            except Empty:
                break
        if self.playing:
            self._fly(seconds * self.speed)
        if self.playing or changed:
            self._draw()

    def ask(self, deed: Callable[[], None]) -> None:
        """Have something done between two control periods: another thread may ask."""
        self._asked.put(deed)
        self._changed.set()

    def _fly(self, seconds: float) -> None:
        control = self.flight.assembly.scenario.rates.control
        self._debt += seconds
        due = clock.monotonic() + _FLYING * FRAME
        while self._debt >= control and not self.flight.over and clock.monotonic() < due:
            self.flight.fly(1)
            self._debt -= control
            self._history.note(self.flight)
        self._debt = min(self._debt, control)  # a machine that is too slow does not catch up
        if self.flight.over:
            self._play(False)

    def _draw(self) -> None:
        flight = self.flight
        vectors = self._vectors()
        for name, vector in vectors.items():
            norm = float(np.linalg.norm(vector))
            self.scene.longest[name] = max(self.scene.longest.get(name, 0.0), norm)
        moment = Moment(flight.period.time, flight.poses(), flight.desired.attitude, vectors)
        self.scene.show(moment)
        now = clock.monotonic()
        if not self.playing or now > self._plotted + PLOTS:
            self._plotted = now
            self._history.note(flight)
            self._history.draw()
            end = " - the scenario is over" if flight.over else ""
            self._clock.content = f"**t = {flight.period.time:.2f} s**{end}"
            if len(flight.events) != self._shown:
                self._shown = len(flight.events)
                self._log.content = _listed(flight)

    def _vectors(self) -> Mapping[str, Array]:
        period = self.flight.period
        found = {"angular velocity": period.truth.rate[0]}
        torque = getattr(period.command, "torque", None)
        if torque is not None and torque[0].shape == (3,):
            found["commanded torque"] = torque[0]
        if period.wrench is not None:
            found["disturbance torque"] = period.wrench[0, 3:]
        return found

    def _play(self, playing: bool) -> None:
        self.playing = playing and not self.flight.over
        self._button.label = "Pause" if self.playing else "Play"

    def _restart(self) -> None:
        self.flight, self._debt, self._shown = self._begin(), 0.0, -1
        for name, field in self._gains.items():
            field.value = _shown(self.flight.gains()[name][0])

    def _add_controls(self) -> None:
        gui = self._gui
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.main_panel.dock_left()
        self._clock = gui.add_markdown("")
        self._button = gui.add_button("Play")
        again = gui.add_button("Restart")
        chosen = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        self._add_push()
        self._gains = self._add_gains()
        if self.flight.motors:
            self._add_faults()
        self._log = gui.add_markdown("")
        add_display(gui, self.scene, self._changed)
        self._button.on_click(lambda _: self.ask(lambda: self._play(not self.playing)))
        again.on_click(lambda _: self.ask(self._restart))

        @chosen.on_update
        def _(_: Any) -> None:
            self.speed = float(chosen.value)

    def _add_push(self) -> None:
        kick = float(f"{_KICK * np.diag(self.flight.assembly.vehicle.inertia).max():.1g}")
        with self._gui.add_folder("Push"):
            force = self._gui.add_vector3("force [N], inertial", (0.0, 0.0, 0.0), step=1e-6)
            torque = self._gui.add_vector3("torque [N m], body", (0.0, kick, 0.0), step=1e-6)
            seconds = self._gui.add_number("for [s]", 1.0, min=0.0, step=1e-6)
            button = self._gui.add_button("Push")

        def push() -> None:
            vectors = np.array(force.value), np.array(torque.value)
            self.flight.push(*vectors, float(seconds.value))

        button.on_click(lambda _: self.ask(push))

    def _add_gains(self) -> dict[str, Any]:
        """Add a field for each gain of the law; return them by name."""
        gains, found = self.flight.gains(), {}
        if not gains:
            return {}
        with self._gui.add_folder("Gains"):
            for name, (value, declared) in gains.items():
                unit = f" [{declared['unit']}]" if declared["unit"] else ""
                hint = f"{declared['range']} {declared['form']}".strip() or None
                label = printable(f"{name}{unit}")
                found[name] = self._gui.add_text(label, _shown(value), hint=hint)
            button = self._gui.add_button("Set gains")
            self._refused = self._gui.add_markdown("")
        button.on_click(lambda _: self.ask(self._set_gains))
        return found

    def _set_gains(self) -> None:
        """Fly on with what stands in the fields of the gains, or say what of it is refused."""
        refused = []
        for name, (before, _) in self.flight.gains().items():
            text = self._gains[name].value
            if text == _shown(before):
                continue
            try:
                self.flight.set_gain(name, json.loads(text))
            except json.JSONDecodeError:
                refused.append(f"{name}: got {text!r}, should be a number, or numbers in brackets")
            except ValueError as error:
                refused.append(str(error))
        self._refused.content = "\n\n".join(escape(printable(each)) for each in refused)

    def _add_faults(self) -> None:
        with self._gui.add_folder("Break"):
            motor = self._gui.add_dropdown("motor", self.flight.motors)
            kind = self._gui.add_dropdown("it is", BROKEN)
            button = self._gui.add_button("Break")
            repair = self._gui.add_button("Repair all")
        button.on_click(
            lambda _: self.ask(lambda: self.flight.break_motor(motor.value, kind.value))
        )
        repair.on_click(lambda _: self.ask(lambda: self.flight.repair()))


def _shown(value: Any) -> str:
    """Return a gain as JSON."""
    return json.dumps(np.asarray(value, float).tolist())


def _listed(flight: LiveFlight) -> str:
    return "\n".join(
        f"- {event.time:.2f} s: {escape(printable(event.message))}"
        for event in flight.events[-_EVENTS:]
    )
