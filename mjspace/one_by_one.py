"""Flying a law that knows nothing of batches: one vehicle at a time, stacked again."""

from typing import Any

import numpy as np

from mjspace.contract import Law, Measurement, Wanted


class OneByOne:
    """A law of arrays without a vehicle axis, flown on arrays with one."""

    def __init__(self, law: Law) -> None:
        self._law = law

    def reset(self, measurement: Measurement, reference: Wanted) -> Any:
        """Return the law's state with a vehicle axis."""
        return _stack([self._law.reset(one, reference) for one in _vehicles(measurement)])

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Wanted
    ) -> tuple[Any, Any, Any]:
        """Return the law's state, command and signals with a vehicle axis."""
        states = _vehicles(state) if state else [state] * len(measurement.rate)
        flown = [
            self._law.step(s, time, m, reference)
            for s, m in zip(states, _vehicles(measurement), strict=True)
        ]
        return (
            _stack([f[0] for f in flown]),
            _stack([f[1] for f in flown]),
            _stack([f[2] for f in flown]),
        )


def _vehicles(arrays: Any) -> list[Any]:
    return [type(arrays)(*row) for row in zip(*arrays, strict=True)]


def _stack(tuples: list[Any]) -> Any:
    """Return the named tuples as one, a vehicle axis before each field; None is an empty tuple."""
    if tuples[0] is None:
        return ()
    return type(tuples[0])(*(np.array(field, dtype=float) for field in zip(*tuples, strict=True)))
