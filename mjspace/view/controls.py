"""The controls that every view has: what is drawn, and what the camera follows."""

from threading import Event
from typing import Any

from mjspace.view.scene import ARROWS, FOLLOWS, Scene

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


def _legend() -> list[str]:
    axes = "Axes: x red, y green, z blue; pale, long and thin those of the reference."
    arrows = "Arrows, the largest of the flight at full length:"
    names = [
        f'- <span style="color:rgb{arrow.color}">&#9632;</span> {arrow.name}' for arrow in ARROWS
    ]
    return [axes, "", arrows, "", *names]
