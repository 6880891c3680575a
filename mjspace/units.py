"""Units: conversion of ``"0.1 deg"`` to SI, the unit beside a field, and the unit on a plot."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self, get_type_hints

OUT_OF_SCALE = "its size is not from 1e-100 to 1e100"
"""What is said of a number that ``is_out_of_scale``."""

_MOST_PERIODS = 1e10
_DEG = math.pi / 180.0
_RPM = 2.0 * math.pi / 60.0

# unit as written -> (SI unit, factor)
UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "Hz": ("Hz", 1.0),
    "kHz": ("Hz", 1e3),
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "urad": ("rad", 1e-6),
    "deg": ("rad", _DEG),
    "arcmin": ("rad", _DEG / 60.0),
    "arcsec": ("rad", _DEG / 3600.0),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", _DEG),
    "deg/h": ("rad/s", _DEG / 3600.0),
    "rpm": ("rad/s", _RPM),
    "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", _DEG),
    "deg/s^3": ("rad/s^3", _DEG),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "km": ("m", 1e3),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 1e-2),
    "mm/s": ("m/s", 1e-3),
    "km/s": ("m/s", 1e3),
    "m/s^2": ("m/s^2", 1.0),
    "m^2": ("m^2", 1.0),
    "cm^2": ("m^2", 1e-4),
    "m^3": ("m^3", 1.0),
    "mm^3": ("m^3", 1e-9),
    "kg": ("kg", 1.0),
    "g": ("kg", 1e-3),
    "kg/m^3": ("kg/m^3", 1.0),
    "kg m": ("kg m", 1.0),
    "g mm": ("kg m", 1e-6),
    "kg m^2": ("kg m^2", 1.0),
    "g mm^2": ("kg m^2", 1e-9),
    "N": ("N", 1.0),
    "N/m^2": ("N/m^2", 1.0),
    "N m": ("N m", 1.0),
    "mN m": ("N m", 1e-3),
    "uN m": ("N m", 1e-6),
    "N m s": ("N m s", 1.0),
    "N m s/rad": ("N m s/rad", 1.0),
    "J": ("J", 1.0),
    "Wh": ("J", 3600.0),
    "W": ("W", 1.0),
    "mW": ("W", 1e-3),
    "T": ("T", 1.0),
    "nT": ("T", 1e-9),
    "A m^2": ("A m^2", 1.0),
    "A/m": ("A/m", 1.0),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "ohm": ("ohm", 1.0),
    "mohm": ("ohm", 1e-3),
    "H": ("H", 1.0),
    "mH": ("H", 1e-3),
    "uH": ("H", 1e-6),
    "N m/A": ("N m/A", 1.0),
    "mN m/A": ("N m/A", 1e-3),
    "V s/rad": ("N m/A", 1.0),
    # Of data sheets: densities of noise, and random walks.
    "rad/sqrt(Hz)": ("rad/sqrt(Hz)", 1.0),
    "arcsec/sqrt(Hz)": ("rad/sqrt(Hz)", _DEG / 3600.0),
    "rad/s/sqrt(Hz)": ("rad/s/sqrt(Hz)", 1.0),
    "deg/s/sqrt(Hz)": ("rad/s/sqrt(Hz)", _DEG),
    "deg/h/sqrt(Hz)": ("rad/s/sqrt(Hz)", _DEG / 3600.0),
    "rad/sqrt(s)": ("rad/s/sqrt(Hz)", 1.0),
    "deg/sqrt(s)": ("rad/s/sqrt(Hz)", _DEG),
    "deg/sqrt(h)": ("rad/s/sqrt(Hz)", _DEG / 60.0),
    "m/s^2/sqrt(Hz)": ("m/s^2/sqrt(Hz)", 1.0),
    "ug/sqrt(Hz)": ("m/s^2/sqrt(Hz)", 9.80665e-6),
    "m/s/sqrt(h)": ("m/s^2/sqrt(Hz)", 1.0 / 60.0),
    "m/sqrt(Hz)": ("m/sqrt(Hz)", 1.0),
    "m/s/sqrt(Hz)": ("m/s/sqrt(Hz)", 1.0),
    "T/sqrt(Hz)": ("T/sqrt(Hz)", 1.0),
    "nT/sqrt(Hz)": ("T/sqrt(Hz)", 1e-9),
    "rad/s/sqrt(s)": ("rad/s/sqrt(s)", 1.0),
    "deg/s/sqrt(s)": ("rad/s/sqrt(s)", _DEG),
    "deg/h/sqrt(h)": ("rad/s/sqrt(s)", _DEG / 3600.0 / 60.0),
    "m/s^2/sqrt(s)": ("m/s^2/sqrt(s)", 1.0),
    "T/sqrt(s)": ("T/sqrt(s)", 1.0),
    "nT/sqrt(s)": ("T/sqrt(s)", 1e-9),
    "T/(A m^2)": ("T/(A m^2)", 1.0),
    "nT/(A m^2)": ("T/(A m^2)", 1e-9),
    "ppm": ("", 1e-6),
}

_SYMBOLS = {s for name in UNITS for s in re.split(r"[ /]", re.sub(r"\^\d+", "", name))} | {"1"}
_DISPLAYED_IN = {"rad": "deg", "rad/s": "deg/s", "rad/s^2": "deg/s^2"}


@dataclass(frozen=True)
class Unit:
    """The SI unit of a field, declared in its annotation.

    ``rate: Annotated[Array, Unit("rad/s")]`` in a named tuple of the contract or of a law: the log
    stores it beside the field, and plots, pages and ``mjspace info`` read it from there.
    """

    si: str
    """As in ``UNITS``, or any other text where no quantity string is converted to it."""
    display: str = ""
    """For plots; if left out, degrees for radians and otherwise the SI unit."""

    @property
    def displayed(self) -> tuple[str, float]:
        """The unit of a plot, and the factor from SI to it."""
        name = self.display or _DISPLAYED_IN.get(self.si, self.si)
        return name, (1.0 if name == self.si else 1.0 / UNITS[name][1])


class Quantity(float):
    """A number in SI that was written with a unit, and the SI ``unit`` of that."""

    unit: str

    def __new__(cls, value: float, unit: str) -> Self:
        """Return the number ``value`` of ``unit``."""
        made = super().__new__(cls, value)
        made.unit = unit
        return made

    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]
        """Return what ``__new__`` takes, for copies and pickles."""
        return float(self), self.unit


def units_of(kind: type) -> dict[str, Unit]:
    """Return the units that the fields of the class ``kind`` declare, by field.

    A field without ``Unit`` in its annotation is absent; so are all of a class whose annotations
    are text that cannot be evaluated, as of a class inside a function.
    """
    try:
        hints = get_type_hints(kind, include_extras=True)
    except NameError:
        return {}
    found = {
        name: [each for each in getattr(hint, "__metadata__", ()) if isinstance(each, Unit)]
        for name, hint in hints.items()
    }
    return {name: units[0] for name, units in found.items() if units}


def to_si(value: Any, unit: str | None) -> Any:
    """Return ``value`` with every quantity string in it converted to the SI unit ``unit``.

    A number is taken as SI; a string is a number and a unit of the same dimension, ``"30 deg/s"``,
    or of any dimension where ``unit`` is None: it becomes a ``Quantity``. Lists are converted
    element by element and anything else is returned as it is.

    Raises:
        ValueError: the string is not a number with a unit, or the unit measures something else.
    """
    if isinstance(value, list | tuple):
        return [to_si(item, unit) for item in value]
    if not isinstance(value, str):
        return value
    if unit is None:
        return _any_to_si(value)
    if not unit and value.split()[-1:] != ["ppm"]:
        raise ValueError(f"got the text {value!r}, should be a plain number")
    return quantity(value, unit)


def quantity(text: str, *units: str) -> Quantity:
    """Return the number with a unit ``text`` in SI; its SI unit is one of ``units``.

    Raises:
        ValueError: it is not a number with a unit, or the unit measures something else.
    """
    magnitude, written = _split(text)
    right = [name for name, (si, _) in UNITS.items() if si in units] or units
    which = f"one of {', '.join(right)}" if len(right) > 1 else right[0]
    if not written:
        raise ValueError(f"{text!r} has no unit: write a plain number for {units[0]}, or {which}")
    if written not in right:
        raise ValueError(f"{text!r} has the unit {written!r}, should be {which}")
    unit, factor = UNITS.get(written, (written, 1.0))
    return Quantity(magnitude * factor, unit)


def quantity_in(value: Any, place: str = "") -> tuple[str, str] | None:
    """Return the first text in nested lists and tables that is a number with a unit.

    The unit need not be in ``UNITS``: a product of powers of its symbols is enough, as ``N m/rad``.

    Returns:
        Where in ``value`` it is, as ``[0].after`` (empty for ``value`` itself), and the text; None
        if there is none.
    """
    if isinstance(value, Mapping):
        items = {f"{place}.{key}": item for key, item in value.items()}
    elif isinstance(value, list | tuple):
        items = {f"{place}[{index}]": item for index, item in enumerate(value)}
    else:
        return (place, value) if isinstance(value, str) and _is_quantity(value) else None
    return next((found for at, item in items.items() if (found := quantity_in(item, at))), None)


def _is_quantity(value: str) -> bool:
    try:
        unit = _split(value)[1]
    except ValueError:
        return False
    symbols = re.split(r"[ /]", re.sub(r"\^-?\d+", "", unit))
    return bool(unit) and _SYMBOLS.issuperset(symbols)


def is_out_of_scale(number: float) -> bool:
    """Return whether a finite number is of no quantity in any unit: its powers may overflow."""
    return number != 0.0 and math.isfinite(number) and not 1e-100 <= abs(number) <= 1e100


def whole_number(span: float, unit: float, span_key: str, unit_key: str) -> int:
    """Return how many ``unit`` [s] make up ``span`` [s].

    Raises:
        ValueError: not a whole number of them, with both keys and the nearest right values; or more
            than can be flown.
    """
    if not span / unit <= _MOST_PERIODS:
        raise ValueError(
            f"{span_key}: {span:.10g} s is more than {_MOST_PERIODS:g} times {unit_key}, "
            f"{unit:.10g} s"
        )
    count = round(span / unit)
    if count < 1 or abs(span / unit - count) > 1e-6:
        below = math.floor(span / unit)
        near = [f"{n * unit:.10g} s" for n in (below, below + 1) if n > 0]
        raise ValueError(
            f"{span_key}: {span:.10g} s is not a whole number of {unit_key}, {unit:.10g} s: "
            f"the nearest are {' and '.join(near)}"
        )
    return count


def _any_to_si(value: str) -> Quantity:
    """Return the quantity ``value`` in the SI unit of whatever it measures.

    Raises:
        ValueError: not a number with a unit, or an unknown unit.
    """
    magnitude, written = _split(value)
    if written not in UNITS:
        what = f"the unknown unit {written!r}" if written else "no unit"
        raise ValueError(f"{value!r} has {what}: have {', '.join(UNITS)}, or write a plain number")
    unit, factor = UNITS[written]
    return Quantity(magnitude * factor, unit)


def _split(value: str) -> tuple[float, str]:
    text, _, written = value.strip().partition(" ")
    try:
        number = float(text)
    except ValueError:
        raise ValueError(f"got {value!r}, should be a number or a number with a unit") from None
    if is_out_of_scale(number):
        raise ValueError(f"got {value!r}: {OUT_OF_SCALE}")
    return number, " ".join(written.split())
