"""Formats a result's numbers for the terminal and the report."""

import math

from mjspace.validation.benchmark import Integrator
from mjspace.validation.results import Row

OTHERS: tuple[Integrator, ...] = ("Euler", "implicit", "implicitfast")
"""The integrators compared with RK4, in the order of their columns."""


def measured(row: Row) -> str:
    """Return the value measured with RK4, with the digits that its bound needs."""
    return _number(row.measured, row)


def under(row: Row, integrator: Integrator) -> str:
    """Return the integrator's deviation from the target; '' where it was not flown."""
    value = row.others.get(integrator)
    return "" if value is None else f"{abs(value - row.target):.2g}"


def allowed(row: Row) -> str:
    """Return the bound, with its target where that is not zero, and the unit."""
    bound = f"{row.allowed:.2g}"
    if row.target != 0.0:
        bound = f"{_number(row.target, row)} ± {bound}"
    return f"{bound} {row.unit}".strip()


def _number(value: float, row: Row) -> str:
    if row.target == 0.0 or not math.isfinite(value):
        return f"{value:.2g}"
    # One digit more than the bound resolves.
    digits = 2 + math.floor(math.log10(abs(row.target))) - math.floor(math.log10(row.allowed))
    return f"{value:.{max(digits, 2)}g}"
