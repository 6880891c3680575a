"""Benchmarks: a flight of a small model, its measured quantities, and their bounds."""

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
    """Conditions of one flight of a benchmark."""

    step: float  # s
    integrator: Integrator = "RK4"
    fault: Fault | None = None
    short: bool = False
    """Fly only as long as a fault or an order needs to be measured; the same bounds hold."""


@dataclass(frozen=True)
class Bound:
    """A quantity that a benchmark measures, with its target and allowed deviation."""

    quantity: str
    unit: str
    allowed: float
    reason: str
    """The reason for this bound, with the value measured when it was set."""
    target: float = 0.0

    def admits(self, measured: float) -> bool:
        """Tell whether ``measured`` is within the bound; NaN is not."""
        return bool(abs(measured - self.target) <= self.allowed)


@dataclass(frozen=True)
class Order:
    """The errors and steps from which RK4's order of convergence is observed."""

    quantities: tuple[str, ...]
    """Errors among the benchmark's bounds."""
    steps: tuple[float, ...]
    """Steps [s], each half of the one before, between rounding and the stability limit."""


@dataclass(frozen=True)
class Curve:
    """One line, or dots, of a figure."""

    label: str
    x: Array
    y: Array
    dots: bool = False


@dataclass(frozen=True)
class Picture:
    """Figure of the motion: usually the exact solution and MuJoCo's flight."""

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]

    @staticmethod
    def of(y_label: str, time: Array, names: str, exact: Array, measured: Array) -> "Picture":
        """Return a figure over time [s], with lines for the exact solution and dots for MuJoCo.

        ``names`` are separated by blanks, one for each column of ``exact`` and ``measured`` (n, k).
        """
        curves = []
        for name, truth, flown in zip(names.split(), exact.T, measured.T, strict=True):
            curves += [Curve(name, time, truth), Curve(f"{name}, MuJoCo", time, flown, dots=True)]
        return Picture("time [s]", y_label, tuple(curves))


@dataclass(frozen=True)
class Readings:
    """Measured values of one flight."""

    values: Mapping[str, float]
    """Values by the names of the benchmark's bounds."""
    motion: Picture
    error: Curve
    """Error over time; the label has its name and unit."""


@dataclass(frozen=True)
class Benchmark:
    """A flight whose exact result is known."""

    name: str
    title: str
    shows: str
    """What the benchmark proves about MuJoCo when it passes, and common mistakes it detects."""
    source: str
    """Source of the exact result: author, title, year, section or equation."""
    step: float  # s
    bounds: tuple[Bound, ...]
    fly: Callable[[Conditions], Readings]
    catches: Mapping[Fault, str]
    """The faults that must violate a bound, each with its meaning here ('' for that of FAULTS)."""
    order: Order | None = None
    others: tuple[Integrator, ...] = field(default=("Euler", "implicit", "implicitfast"))
    """Integrators that are flown for comparison with RK4."""
