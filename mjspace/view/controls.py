"""What every view has: its loop, the controls of what is drawn, and what the camera follows."""

import time as clock
from collections.abc import Callable
from threading import Event
from typing import Any

from mjspace.log.arrows import ARROWS
from mjspace.view.scene import FOLLOWS, Scene

FRAME = 1.0 / 25.0
"""Wall time between two drawings of the scene [s]."""
PLOTS = 0.2
"""Wall time between two drawings of the plots [s]."""
SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "5", "10", "50", "200", "1000")
"""Simulated seconds for each second."""


def add_display(gui: Any, scene: Scene, changed: Event) -> None:
    """Add the choices of what is drawn; ``changed`` is set when one is made."""
    with gui.add_folder("Shown"):
        follow = gui.add_dropdown("camera follows", FOLLOWS, initial_value=scene.follow)
        boxes = {what: gui.add_checkbox(what, value) for what, value in scene.shown.items()}
        gui.add_markdown("\n".join(_legend()))

    @follow.on_update
    def _(_: Any) -> None:
        scene.follow = follow.value
        changed.set()

    for what, box in boxes.items():

        @box.on_update
        def _(_: Any, what: str = what, box: Any = box) -> None:
            scene.shown[what] = box.value
            changed.set()


def keep_showing(
    advance: Callable[[float], None], changed: Event, stop: Callable[[], bool]
) -> None:
    """Call ``advance`` with the wall time since the last call [s] until ``stop`` returns True.

    It is called every ``FRAME``, and at once where ``changed`` is set.
    """
    before = clock.monotonic()
    while not stop():
        now = clock.monotonic()
        advance(now - before)
        before = now
        changed.wait(max(0.0, FRAME - (clock.monotonic() - now)))


def _legend() -> list[str]:
    axes = "Axes: x red, y green, z blue; pale, long and thin those of the reference."
    arrows = "Arrows, the largest of the flight at full length:"
    names = [
        f'- <span style="color:rgb{arrow.color}">&#9632;</span> {arrow.name}' for arrow in ARROWS
    ]
    return [axes, "", arrows, "", *names]
