"""What Python computes of a compiled block, and where the block differs from it in any bit."""

from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.simulation.recording import Columns
from mjspace.vehicle.step_effect import State


class AfterPeriod(NamedTuple):
    """What a flight goes on from after the first period of a block."""

    physics: Array
    memory: State
    sensors: State
    law: Any

    def difference(self, compiled: Columns) -> str:
        """Return the name of the first field whose second row is another; "" for none."""
        names = getattr(self.law, "_fields", ())
        groups = {
            "physics": {"": self.physics},
            "memory": self.memory,
            "sensors": self.sensors,
            "law": dict(zip(names, self.law or (), strict=True)),
        }
        for group, arrays in groups.items():
            for name, rows in compiled[group].items():
                if len(rows) > 1 and _bits(rows[1]) != _bits(arrays[name]):
                    return f"{group} {name} after a period".replace("  ", " ")
        return ""


def difference(one: Columns, other: Columns) -> str:
    """Return the name of the first field whose first rows differ in any bit; "" for none."""
    for group in sorted(one.groups.keys() | other.groups.keys()):
        if one[group].keys() != other[group].keys():
            return f"{group} ({', '.join(one[group].keys() ^ other[group].keys())})"
        for name, values in one[group].items():
            if _bits(values[:1]) != _bits(other[group][name][:1]):
                return f"{group} {name}".rstrip()
    return ""


def _bits(values: Array) -> tuple[tuple[int, ...], bytes]:
    return values.shape, np.asarray(values, dtype=float).tobytes()
