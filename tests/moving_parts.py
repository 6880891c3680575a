"""Vehicles with flexible, sloshing and jointed parts, and what is measured of their motion."""

from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from compiled_flights import Flown, flown

from mjspace.scenario.loading import validate
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.vehicle import stability

PANEL = {"length": "3 m", "width": "1 m", "mass": "10 kg", "frequency": "0.5 Hz"}
SIDES = {
    "left": {"position": [0, 0.4, 0], "euler": [0, 0, "90 deg"]},
    "right": {"position": [0, -0.4, 0], "euler": [0, 0, "-90 deg"]},
}
HELD = {"mass": 1e8, "bus_inertia": (1e8 * np.eye(3)).tolist(), "wheels": {"axes": []}}
"""A bus so heavy that it holds its parts to 1e-6 of their frequency."""


def built(plant: dict[str, Any], folder: Path = Path(), **other: Any) -> Assembly:
    """Return the assembly of a satellite with that ``plant`` table, coasting unless told."""
    table = {
        "description": "a moving part",
        "duration": 2.0,
        "rates": {"physics": 2e-3, "control": 1e-2},
        "plant": plant,
        "reference": {"kind": "references:Hold"},
        "law": {"kind": "coast:Coast"},
    }
    return assemble(validate(table | other, "it"), folder)


def modes(assembly: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (k,) [rad/s] and shapes (nv, k) of the modes with springs in them."""
    linear = stability.linearized(assembly.vehicle.model)
    assert linear is not None
    squares, shapes = scipy.linalg.eigh(linear.stiffness, linear.inertia)
    springs = squares > 1e-6 * squares.max()
    return np.sqrt(squares[springs]), shapes[:, springs]


def position_of(assembly: Assembly, shape: np.ndarray) -> dict[str, float]:
    """Return ``initial.joint_position`` for a mode's shape (nv,)."""
    model = assembly.vehicle.model
    return {model.joint(i).name: float(shape[model.jnt_dofadr[i]]) for i in range(1, model.njnt)}


def fly(plant: dict[str, Any], **other: Any) -> Flown:
    """Return the flight of that ``plant``, compiled."""
    flight = flown(built(plant, **other))
    assert not flight.trouble
    return flight


def decay_of(samples: np.ndarray, period: float) -> tuple[float, float]:
    """Return undamped frequency [rad/s] and damping ratio of one decaying mode's samples (n,)."""
    before = np.stack([samples[1:-1], samples[:-2]], axis=-1)
    (a, b), *_ = np.linalg.lstsq(before, samples[2:], rcond=None)
    pole = np.log(complex(0.5 * a, np.sqrt(-b - 0.25 * a * a))) / period
    return abs(pole), -pole.real / abs(pole)
