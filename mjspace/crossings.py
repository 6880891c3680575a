"""The events that a scenario declares: a logged signal comes into a region."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mjspace.checks import find_signal, magnitude
from mjspace.contract import Array
from mjspace.errors import blamed_on
from mjspace.scenario import Event
from mjspace.tape import Block, Happening, shapes


def with_crossings(block: Block, declared: Sequence[Event], before: Array) -> tuple[Block, Array]:
    """Return the block with an event for each entry, and who is inside at its end.

    ``before`` and what is returned, (N, events), say of each vehicle whether it is inside; one that
    begins inside has entered, and a value that is no number never is.

    Raises:
        InputError: an event is of no signal of this flight, with the near names.
    """
    happened: list[Happening] = []
    after = before.copy()
    topics = shapes(block)
    for number, event in enumerate(declared):
        with blamed_on(f"events.{number}.signal"):
            topic, field, index = find_signal(topics, event.signal)
        rows = block.rows[topic][field]
        rows = rows.reshape(*rows.shape[:2], -1)
        values = magnitude(rows if index is None else rows[..., index : index + 1])
        inside = event.admits(values)
        entered = inside & ~np.concatenate([before[None, :, number], inside[:-1]])
        after[:, number] = inside[-1]
        for k, vehicle in np.argwhere(entered):
            text = f"{event.name}: {event.signal} = {values[k, vehicle]:.6g}"
            happened.append((float(block.time[k]), int(vehicle), event.level, text))
    in_order = sorted([*block.events, *happened], key=lambda happening: happening[:2])
    return replace(block, events=in_order), after
