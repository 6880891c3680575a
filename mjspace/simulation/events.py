"""The events that a scenario declares: a logged signal comes into a region."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mjspace.contract import Array, Event
from mjspace.errors import input_error_at
from mjspace.scenario.scenario import EventTable
from mjspace.signals import Topics, find_signal, magnitude
from mjspace.simulation.recording import Block, shapes


def with_declared_events(
    block: Block, declared: Sequence[EventTable], before: Array
) -> tuple[Block, Array]:
    """Return the block with an event for each entry, and who is inside at its end.

    ``before`` and what is returned, (N, events), are True for each vehicle that is inside. One that
    begins inside has entered; NaN is never inside.

    Raises:
        InputError: an event names a signal that this flight does not have, with the near names.
    """
    happened: list[Event] = []
    after = before.copy()
    topics = shapes(block)
    for number, event in enumerate(declared):
        with input_error_at(f"events.{number}.signal"):
            values = magnitude(_rows(block, topics, event.signal))
        with input_error_at(f"events.{number}.shows"):
            shown = {name: _rows(block, topics, name) for name in event.shows}
        inside = event.admits(values)
        entered = inside & ~np.concatenate([before[None, :, number], inside[:-1]])
        after[:, number] = inside[-1]
        for k, vehicle in np.argwhere(entered):
            text = f"{event.name}: {event.signal} = {values[k, vehicle]:.6g}"
            for name, of_name in shown.items():
                text += f"; {name} = {' '.join(f'{value:.4g}' for value in of_name[k, vehicle])}"
            happened.append(Event(float(block.time[k]), int(vehicle), event.level, text))
    in_order = sorted([*block.events, *happened], key=lambda event: (event.time, event.vehicle))
    return replace(block, events=in_order), after


def _rows(block: Block, topics: Topics, signal: str) -> Array:
    """Return the signal's numbers, (n, N, k)."""
    topic, field, part = find_signal(topics, signal)
    rows = block.rows[topic][field]
    return rows.reshape(*rows.shape[:2], -1)[..., part]
