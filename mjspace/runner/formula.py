"""Checks of temporal logic: a formula of STL, and by how much a flight satisfies it.

rtamt reads the formula; its robustness (A. Donze and O. Maler 2010, "Robust satisfaction of
temporal logic over real-valued signals", FORMATS) is computed for whole blocks of periods here.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import missing, nearest
from mjspace.scenario.scenario import Check
from mjspace.signals import Topics, find_signal
from mjspace.units import UNITS, Quantity, to_si

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
_QUANTITY = rf"{_NUMBER}(?:\s*(?:{_UNIT})(?![\w/^]))?"
_INTERVAL = re.compile(rf"\[\s*({_QUANTITY})\s*[:,]\s*({_QUANTITY})\s*\]")
_ATOM = re.compile(rf"\b([A-Za-z_]\w*)\b(?:\s*(<=|>=|<|>)\s*({_QUANTITY}))?")
_WORDS = {
    *("always", "eventually", "once", "historically", "rise", "fall", "until", "since", "xor"),
    *("not", "and", "or", "implies", "iff", "prev", "next", "true", "false", "G", "F", "X", "U"),
}
_LEAST_CHUNK = 1000  # periods that are judged at once: more than the windows of most formulas


@dataclass(frozen=True)
class Atom:
    """A comparison of a signal with a number; or a flag of the log, which holds where it is 1."""

    name: str
    sign: float
    """1 where the signal has to be greater, -1 where less."""
    bound: float

    def robustness(self, values: Array) -> Array:
        """Return by how much it holds, over the size of the bound."""
        return self.sign * (values - self.bound) / (abs(self.bound) or 1.0)


@dataclass(frozen=True)
class Formula:
    """A formula over the samples of a log."""

    atoms: list[Atom]
    always: bool
    """Whether it has to hold from every sample on; else from the first."""
    root: Any
    """rtamt's node; of ``always``, what is inside."""
    before: int
    """Samples that it looks back."""
    after: int
    """Samples that it looks ahead."""


def parsed(text: str, signals: Mapping[str, str], period: float) -> Formula:
    """Return the formula that ``text`` says of ``signals``, sampled with a ``period`` [s].

    Raises:
        InputError: rtamt is not installed.
        ValueError: it is no formula, or one that does not look ahead a limited time.
    """
    atoms: list[Atom] = []

    def interval(found: re.Match[str]) -> str:
        ends = [_seconds(each) / period for each in found.groups()]
        low, high = math.ceil(ends[0] - 1e-6), math.floor(ends[1] + 1e-6)
        if not 0 <= low <= high:
            raise ValueError(f"{found[0]}: no sample is in it, they are {period:g} s apart")
        return f"[{low}:{high}]"

    def atom(found: re.Match[str]) -> str:
        name, sign, bound = found.groups()
        if sign is None and name in _WORDS:
            return found[0]
        if name not in signals:
            raise ValueError(f"no {name!r} among signals{nearest(name, signals)}")
        if sign is None:
            atoms.append(Atom(name, 1.0, 0.5))
        else:
            atoms.append(Atom(name, 1.0 if sign[0] == ">" else -1.0, _si(bound)))
        return f"(atom{len(atoms) - 1} >= 0)"

    written = "".join(
        part if number % 2 else _ATOM.sub(atom, part)
        for number, part in enumerate(re.split(r"(\[[^\]]*\])", _INTERVAL.sub(interval, text)))
    )
    root = _tree(written, len(atoms), text)
    always = type(root).__name__ == "Always"
    root = root.children[0] if always else root
    return Formula(atoms, always, root, *_reach(root))


def _tree(written: str, atoms: int, text: str) -> Any:
    try:
        import rtamt
    except ImportError:
        raise missing("a formula", "rtamt, for Python 3.12 or earlier", "logic") from None
    specification = rtamt.StlDiscreteTimeOfflineSpecification()
    for number in range(atoms):
        specification.declare_var(f"atom{number}", "float")
    specification.spec = written
    try:
        specification.parse()
    except rtamt.RTAMTException as error:
        message = re.sub(r"^.*?Syntax ERROR, ", "", " ".join(str(error).split()))
        raise ValueError(f"{text!r}: {message.partition(' expecting')[0]}") from None
    (root,) = specification.ast.specs
    return root


def _reach(node: Any) -> tuple[int, int]:
    """Return how many samples a node looks back and ahead."""
    kind = type(node).__name__
    if kind == "Predicate":
        return 0, 0
    if kind not in _MEANING:
        untimed = f"Timed{kind}" in _MEANING
        hint = ": inside a formula give it a time, as in [0:60 s]" if untimed else ""
        raise ValueError(f"{kind.lower()} cannot be judged as it flies{hint}")
    reach = [_reach(child) for child in _children(node)]
    before, after = (max(each) for each in zip(*reach, strict=True))
    if kind in ("TimedAlways", "TimedEventually"):
        return before, after + int(node.end)
    if kind in ("TimedOnce", "TimedHistorically"):
        return before + int(node.end), after
    return before + (kind in ("Rise", "Fall")), after


def _children(node: Any) -> list[Any]:
    return list(dict.fromkeys(node.children))


def _ahead(values: Array, low: int, high: int, largest: bool) -> Array:
    """Return the largest or least of the samples from ``low`` to ``high`` ahead (behind if < 0)."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # 30 ms of each start

    size = high - low + 1
    empty = -np.inf if largest else np.inf
    keep = max(abs(low), abs(high))
    padded = np.concatenate([np.full(keep, empty), values, np.full(keep, empty)])
    # The filter's window begins size // 2 before its sample.
    extreme = maximum_filter1d if largest else minimum_filter1d
    found = extreme(padded, size, mode="constant", cval=empty)
    start = keep + low + size // 2
    rolled: Array = found[start : start + len(values)]
    return rolled


def _changed(values: Array, sign: float) -> Array:
    """Return whether it begins (1) or ends (-1) to hold; nothing does at the first sample."""
    earlier = np.concatenate([values[:1], values[:-1]])
    return np.minimum(-sign * earlier, sign * values)


_MEANING: dict[str, Callable[..., Array]] = {
    "Neg": lambda node, a: -a,
    "Conjunction": lambda node, a, b: np.minimum(a, b),
    "Disjunction": lambda node, a, b: np.maximum(a, b),
    "Implies": lambda node, a, b: np.maximum(-a, b),
    "Iff": lambda node, a, b: -np.abs(a - b),
    "Xor": lambda node, a, b: np.abs(a - b),
    "Rise": lambda node, a: _changed(a, 1.0),
    "Fall": lambda node, a: _changed(a, -1.0),
    "TimedAlways": lambda node, a: _ahead(a, int(node.begin), int(node.end), False),
    "TimedEventually": lambda node, a: _ahead(a, int(node.begin), int(node.end), True),
    "TimedHistorically": lambda node, a: _ahead(a, -int(node.end), -int(node.begin), False),
    "TimedOnce": lambda node, a: _ahead(a, -int(node.end), -int(node.begin), True),
}
"""The robustness of each of rtamt's nodes, from those of its children."""


def robustness(node: Any, atoms: Array) -> Array:
    """Return the robustness (n,) of a node at each sample, from those of the atoms (k, n)."""
    kind = type(node).__name__
    if kind == "Predicate":
        found: Array = atoms[int(node.children[0].var.removeprefix("atom"))]
        return found
    return _MEANING[kind](node, *(robustness(child, atoms) for child in _children(node)))


def formula_of(check: Check, topics: Topics, period: float) -> Formula:
    """Return a check's formula, if the log of these ``topics`` has its signals.

    Raises:
        InputError: rtamt is not installed.
        ValueError: a signal is not there, or it is no formula.
    """
    signals = check.signals or {}
    for signal in signals.values():
        find_signal(topics, signal)
    return parsed(check.formula or "", signals, period)


class Monitor:
    """The robustness of a formula in a flight; it remembers as many samples as it looks around."""

    def __init__(self, formula: Formula) -> None:
        self._formula = formula
        self._atoms = np.empty((len(formula.atoms), 0))
        self._done = 0  # of the samples that are kept, those that have been judged
        self._least = math.inf
        self.count = 0
        """Samples that have been judged."""

    def add(self, values: Mapping[str, Array]) -> None:
        """Go on with n > 0 samples (n,) of each signal."""
        formula = self._formula
        rows = [atom.robustness(values[atom.name]) for atom in formula.atoms]
        self._atoms = np.hstack([self._atoms, np.array(rows)])
        if np.isnan(rows).any():  # the filters pass over it, and it must fail
            self._least = math.nan
        waiting = self._atoms.shape[1] - self._done - formula.after
        if waiting >= _LEAST_CHUNK:
            self._judge()

    def value(self) -> float:
        """Return the least robustness so far, of the samples whose windows are whole."""
        if self._atoms.shape[1] - self._done > self._formula.after:
            self._judge()
        return self._least

    def _judge(self) -> None:
        formula = self._formula
        if not (self.count and not formula.always):
            whole = self._atoms.shape[1] - formula.after
            found = robustness(formula.root, self._atoms)[self._done : whole]
            found = found if formula.always else found[:1]
            self._least = float(np.min([self._least, found.min()]))
            self.count += len(found)
            self._done = whole
        kept = max(self._done - formula.before, 0)
        self._atoms, self._done = self._atoms[:, kept:], self._done - kept


def _si(text: str) -> float:
    found = re.fullmatch(rf"({_NUMBER})\s*(.*)", text.strip())
    assert found is not None  # by the pattern of an atom
    value: float = to_si(f"{found[1]} {found[2]}", None) if found[2] else float(text)
    return value


def _seconds(text: str) -> float:
    value = _si(text)
    if isinstance(value, Quantity) and value.unit != "s":
        raise ValueError(f"{text!r} is no time")
    return float(value)
