"""What a benchmark is: a flight of a small model, what it measures, and how far off it may be."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from mjspace.contract import Array

Integrator = Literal["RK4", "Euler", "implicit", "implicitfast"]
Fault = Literal["sign", "armature", "integrator", "held", "erratum", "inertia"]

FAULTS: Mapping[Fault, str] = {
    "sign": "a wrong sign, as the benchmark says",
    "armature": "a tenth of each joint's inertia as armature on top of it",
    "integrator": "MuJoCo's default integrator, Euler",
    "held": "the loads held over the step instead of evaluated at every stage",
    "erratum": "a known error left in: a printed equation or a default, as the benchmark says",
    "inertia": "the main body's principal moments off by +1, -1 and +1 %",
}


@dataclass(frozen=True)
class Conditions:
    """How a benchmark is flown."""

    step: float  # s
    integrator: Integrator = "RK4"
    fault: Fault | None = None
    short: bool = False
    """Fly no longer than it takes to show a fault or an order; the same bounds hold."""


@dataclass(frozen=True)
class Bound:
    """A quantity that a benchmark measures, and how far from its target it may be."""

    quantity: str
    unit: str
    allowed: float
    reason: str
    """Why this bound and no other, with the value measured when it was set."""
    target: float = 0.0

    def admits(self, measured: float) -> bool:
        """Tell whether ``measured`` is within the bound; NaN is not."""
        return bool(abs(measured - self.target) <= self.allowed)


@dataclass(frozen=True)
class Order:
    """Where RK4's order of convergence is observed: the least of ``bounds`` that fall with it."""

    quantities: tuple[str, ...]
    """Errors among the benchmark's bounds."""
    steps: tuple[float, ...]
    """Steps [s], each half of the one before, between rounding and the limit of stability."""


@dataclass(frozen=True)
class Curve:
    """One line of a picture, or dots."""

    label: str
    x: Array
    y: Array
    dots: bool = False


@dataclass(frozen=True)
class Picture:
    """What a person should see of the motion: the truth and MuJoCo's flight, usually."""

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]

    @staticmethod
    def of(y_label: str, time: Array, names: str, exact: Array, measured: Array) -> "Picture":
        """Draw columns over time [s], lines for the truth and dots for MuJoCo.

        ``names`` are separated by blanks, one for each column of ``exact`` and ``measured``.
        """
        curves = []
        for name, truth, flown in zip(names.split(), exact.T, measured.T, strict=True):
            curves += [Curve(name, time, truth), Curve(f"{name}, MuJoCo", time, flown, dots=True)]
        return Picture("time [s]", y_label, tuple(curves))


@dataclass(frozen=True)
class Readings:
    """What one flight measured."""

    values: Mapping[str, float]
    """By the names of the benchmark's bounds."""
    motion: Picture
    error: Curve
    """The error that grows with the flight; its label says what it is, with the unit."""


@dataclass(frozen=True)
class Benchmark:
    """A flight whose end is known."""

    name: str
    title: str
    shows: str
    """What a user may trust MuJoCo with when this passes; and what the naive do wrong."""
    source: str
    """Of the truth: author, title, year, section or equation."""
    step: float  # s
    bounds: tuple[Bound, ...]
    fly: Callable[[Conditions], Readings]
    catches: Mapping[Fault, str]
    """The faults that must break a bound, and what each is here ('' where FAULTS says it all)."""
    order: Order | None = None
    others: tuple[Integrator, ...] = field(default=("Euler", "implicit", "implicitfast"))
    """Integrators shown beside RK4 as the warning they are."""
