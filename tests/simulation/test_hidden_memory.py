"""A law that remembers more than its state is noticed, and left as it was."""

import threading
from collections import deque
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import pytest

from mjspace.simulation.hidden_memory import refusing_hidden_memory
from mjspace.tracing.inner_loops import Untraceable

COUNT = 0
TOTAL = np.zeros(3)
SEEN: list[float] = []


class Filter:
    def __init__(self) -> None:
        self.gains = {"fast": [1.0, 2.0]}
        self.last = np.zeros(2)


class Law:
    """Does in its step what it is told to."""

    def __init__(self, does: Callable[[Any], object]) -> None:
        self.does = does
        self.calls, self.scale, self.name = 0, 1.0, "law"
        self.seen: list[float] = []
        self.queue: deque[float] = deque([1.0], maxlen=1)
        self.integral, self.filter = np.zeros(3), Filter()

    @cached_property
    def table(self) -> Any:
        return np.arange(3.0)

    def step(self) -> None:
        self.does(self)


def count(law: Any) -> None:
    global COUNT
    COUNT += 1


def total(law: Any) -> None:
    global TOTAL
    TOTAL = TOTAL + 1.0


@pytest.mark.parametrize(
    ("does", "name"),
    [
        (lambda law: setattr(law, "calls", law.calls + 1), "its own calls"),
        (lambda law: setattr(law, "scale", -law.scale), "its own scale"),
        (lambda law: setattr(law, "scale", None), "its own scale"),
        (lambda law: law.seen.append(1.0), "its own seen"),
        (lambda law: law.queue.append(2.0), "its own queue"),
        (lambda law: setattr(law, "integral", law.integral + 1e-9), "its own integral"),
        (lambda law: law.integral.__setitem__(2, 1.0), "its own integral"),
        (lambda law: law.filter.gains["fast"].__setitem__(1, 3.0), "its own filter"),
        (lambda law: law.filter.gains.update(slow=[]), "its own filter"),
        (lambda law: law.filter.last.__iadd__(1.0), "its own filter"),
        (count, "COUNT of its module"),
        (total, "TOTAL of its module"),
        (lambda law: SEEN.append(1.0), "SEEN of its module"),
    ],
)
def test_a_change_is_refused_with_its_name_and_undone(does: Any, name: str) -> None:
    law = Law(does)
    with (
        pytest.raises(Untraceable, match=f"the law changes {name}"),
        refusing_hidden_memory(law) as called,
    ):
        called.step()
    assert (law.calls, law.scale, law.seen, list(law.queue)) == (0, 1.0, [], [1.0])
    assert not law.integral.any()
    assert law.filter.gains == {"fast": [1.0, 2.0]}
    assert not law.filter.last.any()
    assert (COUNT, SEEN) == (0, [])
    assert not TOTAL.any()


def test_what_is_computed_at_its_first_use_is_no_memory() -> None:
    law = Law(lambda law: law.table)
    with refusing_hidden_memory(law) as called:
        called.step()
    assert called is not law


def test_not_a_number_stays_one() -> None:
    law = Law(lambda law: None)
    law.scale = float("nan")
    with refusing_hidden_memory(law) as called:
        called.step()


def test_a_law_may_say_that_it_is_to_be_called() -> None:
    law: Any = Law(lambda law: None)
    law.compiled = False
    with pytest.raises(Untraceable, match="says compiled = False"), refusing_hidden_memory(law):
        pass


def test_a_law_that_cannot_be_copied_is_refused() -> None:
    law: Any = Law(lambda law: None)
    law.lock = threading.Lock()
    with (
        pytest.raises(Untraceable, match="cannot be copied: TypeError"),
        refusing_hidden_memory(law),
    ):
        pass


def test_what_python_s_builtins_hold_is_not_copied(monkeypatch: pytest.MonkeyPatch) -> None:
    """A notebook puts its shell there, which cannot be copied."""
    monkeypatch.setattr("builtins.shell", threading.Lock(), raising=False)
    with refusing_hidden_memory(Law(lambda law: None)):
        pass
