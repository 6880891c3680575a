"""A learned policy: a small neural network that computes a torque from what is observed.

A multilayer perceptron: it starts with y = the observation; each hidden layer makes tanh(W y + b)
of it, and the W y + b of the last layer is the torque. The observation is bit for bit that of a
scenario's ``[task]``, in which such a network is trained. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import times
from mjspace.attitude import tracking_error
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand


class Signals(NamedTuple):
    """Signals of the policy."""

    observation: Array
    """What the network is given, side by side, (..., n)."""


@dataclass(frozen=True)
class TorquePolicy(Gains):
    """The torque on the bus [N m], body axes, that the network makes of its observation."""

    batched: ClassVar[bool] = True

    weights: list[Any]
    """W of each layer, (rows, columns), the last of three rows."""
    biases: list[Any]
    """b of each layer, (rows,); of the last [N m]."""
    observation: list[str]
    """Signals side by side, each whole, as of a scenario's ``[task]``: of ``measurement``,
    ``reference`` and ``error``."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.observation, list) or not self.observation:
            raise ValueError(f"observation: got {self.observation!r}, should be a list of signals")
        for name in self.observation:
            topic = str(name).partition(".")[0]
            if topic not in ("measurement", "reference") and name not in _ERRORS:
                raise ValueError(
                    f"observation: got {name!r}, should be a whole signal of measurement or "
                    f"reference, or {' or '.join(_ERRORS)}"
                )
        columns = None
        for number, (weight, bias) in enumerate(self._layers):
            if weight.ndim != 2 or columns not in (None, weight.shape[1]):
                raise ValueError(
                    f"weights: layer {number} is {weight.shape}, should be (rows, "
                    f"{columns or 'columns'})"
                )
            columns = weight.shape[0]
            if bias.shape != (columns,):
                raise ValueError(f"biases: layer {number} is {bias.shape}, should be ({columns},)")
        if columns != 3:
            raise ValueError(f"weights: the last layer has {columns} rows, should have 3: a torque")

    @cached_property
    def _layers(self) -> list[tuple[Array, Array]]:
        weights, biases = _arrays("weights", self.weights), _arrays("biases", self.biases)
        if len(weights) != len(biases):
            raise ValueError(f"biases: of {len(biases)} layers, should be of {len(weights)}")
        return list(zip(weights, biases, strict=True))

    def reset(self, measurement: Measurement, reference: Reference) -> None:
        """Return no state.

        Raises:
            ValueError: the observation has another length than the network takes.
        """
        size = self._observed(measurement, reference).shape[-1]
        if size != (takes := self._layers[0][0].shape[1]):
            raise ValueError(
                f"observation: {', '.join(self.observation)} are {size} numbers, the network's "
                f"first layer takes {takes}"
            )

    def step(
        self, state: None, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[None, TorqueCommand, Signals]:
        """Return no state, the torque on the bus, and the observation."""
        observation = self._observed(measurement, reference)
        *hidden, (weight, bias) = self._layers
        layer = observation
        for each, offset in hidden:
            layer = np.tanh(times(each, layer) + offset)
        torque = times(weight, layer) + bias
        return None, TorqueCommand(torque), Signals(observation)

    def _observed(self, measurement: Measurement, reference: Reference) -> Array:
        q, w = measurement.attitude, measurement.rate
        error = tracking_error(q, w, reference.attitude, reference.rate)
        errors = dict(zip(_ERRORS, error, strict=True))
        topics = {"measurement": measurement, "reference": reference}
        parts = []
        for name in self.observation:
            topic, _, field = name.partition(".")
            part = errors[name] if topic == "error" else getattr(topics[topic], field)
            parts.append(np.broadcast_to(part, (*w.shape[:-1], part.shape[-1])))
        return np.concatenate(parts, axis=-1)


def _arrays(name: str, layers: Any) -> list[Array]:
    """Return the arrays of a gain that has one for each layer."""
    try:
        arrays = [np.array(layer, dtype=float) for layer in layers]
    except (TypeError, ValueError):
        arrays = []
    if not arrays or not all(np.isfinite(array).all() for array in arrays):
        raise ValueError(f"{name}: should be a list of arrays of finite numbers, one a layer")
    return arrays


_ERRORS = ("error.attitude", "error.rate")
