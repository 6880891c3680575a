"""The gains of a law in flight: what may be changed, and the law with one of them changed."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from mjspace.contract import Law
from mjspace.ranges import numbers, refuse_unfit
from mjspace.simulation.estimated_law import EstimatedLaw
from mjspace.simulation.unbatched_law import UnbatchedLaw


def gains_of(law: Law) -> dict[str, tuple[Any, Mapping[str, Any]]]:
    """Return value and declaration of each gain of a law that ``contract.gain`` declares."""
    own: Any = law
    while isinstance(own, UnbatchedLaw | EstimatedLaw):
        own = own.law
    if not is_dataclass(own):
        return {}
    return {
        field.name: (getattr(own, field.name), field.metadata)
        for field in fields(own)
        if "unit" in field.metadata and np.size(getattr(own, field.name))
    }


def with_gain(law: Law, name: str, value: Any) -> Law:
    """Return the law with another value of a gain, in SI units.

    Raises:
        ValueError: it does not fit the gain's declaration, or the law refuses it.
    """
    if isinstance(law, UnbatchedLaw):
        return UnbatchedLaw(with_gain(law.law, name, value))
    if isinstance(law, EstimatedLaw):
        return EstimatedLaw(law.estimator, with_gain(law.law, name, value))
    before, declared = gains_of(law)[name]
    refuse_unfit({name: value}, {name: declared})
    array = numbers(value)
    if array.shape != np.shape(before):
        raise ValueError(f"{name}: got shape {array.shape}, should be {np.shape(before)}")
    own: Any = law
    changed: Law = replace(own, **{name: array if array.shape else type(before)(array)})
    return changed
