"""Declared parameters: a unit, a shape and a range for each number, a form for the whole array."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
Form = Literal["", "inertia", "direction", "unit vector", "quaternion", "increasing"]

ROUNDED = 1e-3
"""By how much the norm of a unit vector or a quaternion may differ from 1: three decimals."""


@dataclass(frozen=True)
class Range:
    """An interval of finite numbers; ``at_most=inf`` admits infinity as well, for "no limit"."""

    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    whole: bool = False
    """Whether only whole numbers are admitted."""

    def admits(self, value: _Array) -> NDArray[np.bool_]:
        """Return whether each number is inside."""
        inside = np.isfinite(value)
        for limit in (self.at_least, self.at_most):
            if limit is not None and np.isinf(limit):
                inside |= value == limit
        if self.above is not None:
            inside &= value > self.above
        if self.at_least is not None:
            inside &= value >= self.at_least
        if self.below is not None:
            inside &= value < self.below
        if self.at_most is not None:
            inside &= value <= self.at_most
        return inside & (value == np.rint(value)) if self.whole else inside

    def demand(self, value: float) -> str:
        """Return in words what ``value``, which is outside the range, should be."""
        words = {"greater than {:.6g}": self.above, "{:.6g} or more": self.at_least}
        words |= {"less than {:.6g}": self.below, "{:.6g} or less": self.at_most}
        ends = [w.format(v) for w, v in words.items() if v is not None and np.isfinite(v)]
        ends = ["a whole number"] * self.whole + ends
        if not np.isfinite(value):
            return "should be a number" if np.isnan(value) else "should be finite"
        return "should be " + " and ".join(ends)

    def __str__(self) -> str:
        """Return the range as a person reads it, ``>= 0, < 1``; empty where it has no end."""
        ends = {">": self.above, ">=": self.at_least, "<": self.below, "<=": self.at_most}
        words = [f"{s} {v:.4g}" for s, v in ends.items() if v is not None and np.isfinite(v)]
        infinite = [
            f"or {v}" for v in (self.at_least, self.at_most) if v is not None and np.isinf(v)
        ]
        return " ".join([", ".join(["whole"] * self.whole + words), *infinite]).strip()


def numbers(value: Any) -> _Array:
    """Return ``value``, a number, an array or nested lists, as an array of float64.

    Raises:
        ValueError: something in it is not a number (a truth value, text), or the rows of a list
            differ in length.
    """
    wrong = _not_a_number(value)
    if wrong is not None:
        raise ValueError(f"got {wrong!r}, should be a number")
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"got {value!r}, whose rows differ in length") from None


def _not_a_number(value: Any) -> Any:
    """Return the first item of nested lists that is not a number; None if all are numbers."""
    if isinstance(value, list | tuple):
        return next((w for item in value if (w := _not_a_number(item)) is not None), None)
    array = np.asarray(value)
    return None if array.dtype.kind in "iuf" else (value if value is not None else "nothing")


def refuse_unfit(
    gains: Mapping[str, Any],
    declared: Mapping[str, Mapping[str, Any]],
    *,
    of_each_vehicle: bool = False,
) -> None:
    """Refuse ``gains`` that do not fit their declarations by ``contract.gain``.

    ``of_each_vehicle`` admits one more leading axis than declared.

    Raises:
        ValueError: the first that does not fit, with its name, its value and what would be right.
    """
    sizes: dict[str, tuple[str, int]] = {}
    for name, value in gains.items():
        metadata = declared.get(name, {})
        if "unit" not in metadata:
            continue
        try:
            array = numbers(value)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        shape = () if metadata["one_for_all"] and array.ndim == 0 else metadata["shape"]
        extra = of_each_vehicle and array.ndim == len(shape) + 1
        for one in array if extra else [array]:
            _refuse_shape(name, one, shape)
            _refuse_values(name, one, metadata)
        sized = array.shape[1:] if extra else array.shape
        for size, along in zip(sized, shape, strict=True):
            if isinstance(along, str):
                other, count = sizes.setdefault(along, (name, size))
                if size != count:
                    raise ValueError(f"{name}: {size} rows for {count} of {other}: give as many")


def _refuse_shape(name: str, array: _Array, shape: tuple[int | str | None, ...]) -> None:
    right = len(array.shape) == len(shape) and all(
        size == want or not isinstance(want, int)
        for want, size in zip(shape, array.shape, strict=True)
    )
    if not right:
        words = ["n" if size is None else str(size) for size in shape]
        want = " x ".join(words) + " numbers" if shape else "one number"
        raise ValueError(f"{name}: got an array of shape {array.shape}, should be {want}")


def _refuse_values(name: str, array: _Array, metadata: Mapping[str, Any]) -> None:
    unit = f" {metadata['unit']}" if metadata["unit"] else ""
    for index in map(tuple, np.argwhere(~metadata["range"].admits(array))):
        place, wrong = "".join(f"[{i}]" for i in index), array[index]
        demand = metadata["range"].demand(wrong)
        raise ValueError(f"{name}{place}: got {wrong:g}{unit}, {demand}")
    if metadata["form"] and (complaint := FORMS[metadata["form"]](array)):
        raise ValueError(f"{name}: {complaint}")


def _inertia(matrix: _Array) -> str:
    if np.max(np.abs(matrix - matrix.T)) > 1e-9 * np.max(np.abs(matrix)):
        return f"got {matrix.tolist()}, not symmetric"
    least = np.linalg.eigvalsh(matrix)[0]
    if not least > 0.0:
        return f"not positive definite: a principal moment is {least:g} kg m^2"
    return ""


def _direction(vectors: _Array) -> str:
    for vector in np.atleast_2d(vectors):
        if not np.linalg.norm(vector) > 1e-6:
            return f"got {vector.tolist()}, which has no direction"
    return ""


def _of_norm_one(what: str) -> Callable[[_Array], str]:
    def complaint(vectors: _Array) -> str:
        for vector in np.atleast_2d(vectors):
            norm = float(np.linalg.norm(vector))
            if not abs(norm - 1.0) <= ROUNDED:
                return (
                    f"got {vector.tolist()}, whose norm is {norm:.6g}: "
                    f"{what} has 1, to within {ROUNDED:g}"
                )
        return ""

    return complaint


def _increasing(values: _Array) -> str:
    for i in np.flatnonzero(~(np.diff(values) > 0.0)):
        return f"[{i + 1}] {values[i + 1]:g} is not after [{i}] {values[i]:g}"
    return ""


FORMS: dict[str, Callable[[_Array], str]] = {
    "inertia": _inertia,
    "direction": _direction,
    "unit vector": _of_norm_one("a unit vector"),
    "quaternion": _of_norm_one("the quaternion of an attitude"),
    "increasing": _increasing,
}
"""By form, a function that says what is wrong with an array; empty text if nothing is."""


class Gains:
    """Base of a law or a reference that refuses unfit gains however it is constructed.

    Constructed in Python, a gain may have a leading axis more: one for each vehicle of a batch.
    A dataclass with a ``__post_init__`` of its own begins it with ``super().__post_init__()``.
    Without this base the gains are checked by the scenario's loader alone.
    """

    def __post_init__(self) -> None:
        """Check the declared gains; ValueError for one that does not fit."""
        declared: tuple[Any, ...] = fields(self)  # type: ignore[arg-type]
        refuse_unfit(
            {f.name: getattr(self, f.name) for f in declared},
            {f.name: f.metadata for f in declared},
            of_each_vehicle=True,
        )


def gain(
    unit: str | None = "",
    shape: tuple[int | str | None, ...] = (),
    default: Any = MISSING,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    whole: bool = False,
    form: Form = "",
    one_for_all: bool = False,
) -> Any:
    """Declare a law's or a reference's parameter: its SI unit, array shape and range.

    Where the unit depends on another gain, as that of a bound on a signal, it is None: a quantity
    of any dimension is converted. In ``shape``, None is any length, and a name is a length that all
    gains with that name share: ``("wheel", 3)`` and ``("wheel",)``. Every number has to be finite
    and within ``above`` or ``at_least`` and ``below`` or ``at_most``; ``at_most=inf`` admits
    infinity, for a limit that may be absent. ``whole`` admits whole numbers only. ``form`` is what
    the array has to be as a whole: an "inertia" (symmetric, positive definite), or rows that are
    each a "direction" (not zero), a "unit vector" or a "quaternion" (of norm 1 to 1e-3), or
    "increasing" values. ``one_for_all`` admits a single number in place of the array.

    The scenario's loader refuses what does not fit, and ``Gains`` does so for a law that is
    constructed in Python. A gain without a default that is named as a fact of the plant is
    (``inertia``, ``wheel_axes``, ``wheel_inertia``, ``control_period``, ``inner_period``, and those
    of servos and arms, as ``mjspace law-header`` lists them) may be left out: it is then that fact.
    """
    limits = Range(above, at_least, below, at_most, whole)
    metadata: dict[str, Any] = {"unit": unit, "shape": shape, "range": limits, "form": form}
    metadata["one_for_all"] = one_for_all
    if default is MISSING:
        return field(metadata=metadata)
    if shape and not one_for_all:
        return field(metadata=metadata, default_factory=lambda: np.array(default, dtype=float))
    return field(metadata=metadata, default=default)
