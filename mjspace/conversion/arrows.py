"""Arrows for viewers: of the bus's motion, and of thrust, where and whither it acts."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.attitude import conjugate, rotate
from mjspace.contract import Array
from mjspace.conversion.shown import Frames
from mjspace.log.arrows import ARROWS, THRUST
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.rendering.arrows import ENGINE
from mjspace.rendering.flown_model import flown_model

_PERIOD = 0.05  # s between arrows, at least: 20 Hz


class Arrows(NamedTuple):
    """Arrows of one kind over time, in the bus's frame.

    A viewer shows the last ones until the next: in ``world`` they would lag behind a fast vehicle.
    """

    name: str
    color: tuple[int, int, int]
    """Red, green and blue, 0 to 255."""
    time: Array
    """s, shape (n,)."""
    origin: Array
    """From the bus [m], body axes, shape (n, k, 3)."""
    vector: Array
    """From there to the arrow's point [m], body axes, shape (n, k, 3)."""


def arrows_of(log: Log, frames: Mapping[str, Frames], bus: str, reach: float) -> list[Arrows]:
    """Return the arrows of what acted in a log, at most 20 times a second.

    The longest of each kind is as long as the vehicle's ``reach`` [m], the others in proportion;
    of thrust, twice that.
    What is of the bus begins there; a thrust ends where it acts. What was zero throughout
    has no arrow.

    Raises:
        ValueError: the log lacks its scenario or model, or is damaged.
    """
    every = max(round(_PERIOD / log.control_period), 1)
    truth = log.read("/truth", ["attitude"], every=_stride(log, "/truth", every))
    found = []
    for kind in ARROWS:
        if log.topics.get(kind.topic, {}).get(kind.field) != (3,):
            continue
        rows = log.read(kind.topic, [kind.field], every=_stride(log, kind.topic, every))
        values = rows[kind.field]
        if not kind.in_body:
            here = _nearest(truth["time"], rows["time"])
            values = rotate(conjugate(truth["attitude"][here]), values)
        origin = np.zeros((len(values), 1, 3))
        found.append(Arrows(kind.name, kind.color, rows["time"], origin, values[:, None]))
    found += _thrusts(log, frames, bus, every)
    scaled = (each._replace(vector=reach * _of_largest(each.vector)) for each in found)
    return [
        _pushing(each) if each.name == "thrust" else each for each in scaled if each.vector.any()
    ]


def _thrusts(log: Log, frames: Mapping[str, Frames], bus: str, every: int) -> Iterator[Arrows]:
    """Yield the thrust [N] of the engine and each thruster, in place of lengths."""
    count = int(np.prod(log.topics.get("/truth", {}).get("thrust", (0,))))
    if not count:
        return
    model = flown_model(log, scenario_of(log))
    sites = np.flatnonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_SITE)).tolist()
    sites.sort(key=lambda motor: model.actuator(motor).name != ENGINE)  # /truth has it first
    rows = log.read("/truth", ["thrust"], every=_stride(log, "/truth", every))
    shape = len(rows["time"]), count, 3
    origin, vector = np.zeros(shape), np.zeros(shape)
    for k, motor in enumerate(sites[:count]):
        site = model.actuator_trnid[motor, 0]
        along = rotate(model.site_quat[site], model.actuator_gear[motor, :3])
        frame = frames[model.body(model.site_bodyid[site]).name]
        here = _nearest(frame.time, rows["time"])
        back, turn = conjugate(frames[bus].quaternion[here]), frame.quaternion[here]
        place = frame.position[here] + rotate(turn, model.site_pos[site])
        origin[:, k] = rotate(back, place - frames[bus].position[here])
        push = rotate(back, rotate(turn, along / np.linalg.norm(along)))
        vector[:, k] = rows["thrust"][:, k, None] * push
    yield Arrows("thrust", THRUST, rows["time"], origin, vector)


def _pushing(arrows: Arrows) -> Arrows:
    """Return arrows twice as long, which nozzles do not hide, that end at the origin."""
    vector = 2.0 * arrows.vector
    return arrows._replace(origin=arrows.origin - vector, vector=vector)


def _stride(log: Log, topic: str, every: int) -> int:
    """Return every how many-th row of a topic to take for one in ``every`` control periods."""
    return max(every // log.every[topic], 1)


def _nearest(times: Array, wanted: Array) -> Any:
    """Return the index of the one of the ascending ``times`` (n,) nearest to each wanted (m,)."""
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(times) - 1)
    return np.where(wanted - times[before] <= times[after] - wanted, before, after)


def _of_largest(vectors: Array) -> Array:
    """Return vectors (n, k, 3) over the length of the longest; zero of what is not finite."""
    vectors = np.where(np.isfinite(vectors), vectors, 0.0)
    largest = float(np.linalg.norm(vectors, axis=-1).max(initial=0.0))
    return vectors / largest if largest > 0.0 else vectors
