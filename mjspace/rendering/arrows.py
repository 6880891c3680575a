"""Which vectors of a flight are drawn as arrows, and at which scale."""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.log import arrows as viewers
from mjspace.log.arrows import color_of, to_one
from mjspace.log.reader import Log
from mjspace.rendering.captions import TURNING, flies_a_path
from mjspace.rendering.plume import PLUME
from mjspace.rendering.sampling import nearest_rows
from mjspace.vehicle.indices import bus_id

AXES = 3
"""The geom group of a model's body axes: no part of the vehicle, but drawn."""
ENGINE = "engine_thrust"
"""The motor of an engine, at a site along which it pushes."""
_AXIS = re.compile("axis_[xyz]$")
_PREFIXES = (("", 1.0), ("m", 1e-3), ("u", 1e-6), ("n", 1e-9))
_OF_AXES, _OF_HULL = 2.0, 1.2  # the longest arrow, over the body axes, or over what has none


class Kind(NamedTuple):
    """A vector that may be drawn."""

    name: str
    letter: str
    """At the arrow's point."""
    sources: Sequence[tuple[str, str]]
    """Topic and field; the first that a log has."""
    frame: str
    """Whose axes its numbers are in: the "world"'s, the "body"'s, or along the "engine"."""
    unit: str
    color: tuple[float, float, float]
    negligible: float
    """Not drawn where it never exceeds this, SI: at rest, or zero but for rounding."""
    shown: float = 1.0
    """Factor from SI to ``unit``."""
    share: float = 1.0
    """Of the longest arrow that it may have."""


_TORQUE = (("/command", "torque"), ("/law", "torque"))
_MOMENTUM, _RATE = (("/truth", "momentum"),), (("/truth", "rate"),)
_VELOCITY, _THRUST = (("/truth", "velocity"),), (("/truth", "thrust"),)
TORQUE = Kind("torque", "τ", _TORQUE, "body", "N m", to_one(color_of("commanded torque")), 1e-9)
MOMENTUM = Kind(
    "momentum", "H", _MOMENTUM, "world", "N m s", to_one(color_of("total momentum")), 1e-9
)
# Shorter, so that it does not end where the momentum does when it is along that.
RATE = Kind(
    *("rate", "ω", _RATE, "body", "deg/s", to_one(color_of("angular velocity")), 1e-6),
    shown=float(np.degrees(1.0)),
    share=0.7,
)
VELOCITY = Kind("velocity", "v", _VELOCITY, "world", "m/s", to_one(viewers.TRAIL), 1e-4)
THRUST = Kind("thrust", "F", _THRUST, "engine", "N", to_one(viewers.THRUST), 1e-3)


class Arrows(NamedTuple):
    """The arrows of one kind."""

    kind: Kind
    vectors: Array
    """At each time, SI, shape (n, 3)."""
    scale: float
    """What an arrow of one metre stands for, in the unit that is shown: 1, 2, 3 or 5 times a power
    of ten."""

    def length(self, number: int) -> Array:
        """Return the vector (3,) [m] that is drawn at a time, by its number."""
        drawn: Array = self.vectors[number] * (self.kind.shown / self.scale)
        return drawn

    def legend(self, number: int) -> str:
        """Return what the legend says at a time, by its number."""
        size = self.kind.shown * float(np.linalg.norm(self.vectors[number]))
        prefix, factor = next(
            (each for each in _PREFIXES if self.scale >= 0.1 * each[1]), _PREFIXES[-1]
        )
        unit = f"{prefix}{self.kind.unit}"
        return f"{self.kind.name} {size / factor:.3g} {unit} (1 m: {self.scale / factor:g} {unit})"


def arrows_of(log: Log, law: str, model: Any, times: Array) -> list[Arrows]:
    """Return the arrows of a flight of that ``law`` at the ascending ``times`` (n,) [s].

    Velocity and thrust of the engine where a path is flown, or else torque and momentum, with the
    rate of a vehicle whose attitude is not controlled. A vector that is zero throughout has none.
    """
    if flies_a_path(log):
        kinds = [VELOCITY, THRUST] if _has_engine(model) else [VELOCITY]
    else:
        kinds = [TORQUE, MOMENTUM, RATE] if law in TURNING else [TORQUE, MOMENTUM]
    found = []
    for kind in kinds:
        vectors = _read(log, kind, times)
        largest = 0.0 if vectors is None else float(np.linalg.norm(vectors, axis=1).max())
        if vectors is not None and largest > kind.negligible:
            scale = rounded_up(kind.shown * largest / (kind.share * longest(model)))
            found.append(Arrows(kind, vectors, scale))
    return found


def longest(model: Any) -> float:
    """Return how long an arrow may be [m]: twice as long as the body axes of the model.

    Of a model that does not draw any, somewhat longer than its bus reaches.
    """
    reach = np.linalg.norm(model.geom_pos, axis=1)
    if axes := list(body_axes(model)):
        return _OF_AXES * float((reach + model.geom_size[:, 1])[axes].max())
    hull = (model.geom_bodyid == bus_id(model)) & (model.geom_group != PLUME)
    return _OF_HULL * float((reach + model.geom_rbound)[hull].max(initial=0.0)) or 1.0


def body_axes(model: Any) -> dict[int, str]:
    """Return the letters of the body axes that the model draws, by geom: of ``axis_x`` x."""
    axes = np.flatnonzero(model.geom_group == AXES).tolist()
    names = {geom: model.geom(geom).name for geom in axes if model.geom_pos[geom].any()}
    return {geom: name[-1] for geom, name in names.items() if _AXIS.search(name)}


def rounded_up(value: float) -> float:
    """Return the least of 1, 2, 3 or 5 times a power of ten that is not below a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(
        next(n * power for n in (1.0, 2.0, 3.0, 5.0, 10.0) if n * power >= value * (1 - 1e-9))
    )


def _has_engine(model: Any) -> bool:
    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, ENGINE) >= 0)


def _read(log: Log, kind: Kind, times: Array) -> Array | None:
    """Return the vectors (n, 3), zero where they are not finite; None where none is logged."""
    for topic, field in kind.sources:
        shape = log.topics.get(topic, {}).get(field)
        if shape == (3,) or (shape is not None and kind.frame == "engine"):
            rows: Array = np.nan_to_num(np.array(list(nearest_rows(log, topic, field, times))))
            return rows if kind.frame != "engine" else rows[:, :1] * [0.0, 0.0, 1.0]
    return None
