"""What the tests of campaigns share."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

from mjspace.runner import workers


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process fly instead of others, which take seconds to begin."""

    def make(calls: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        # In another order than they are begun in, as processes may end.
        for index, (call, argument) in reversed(list(enumerate(calls))):
            yield index, call(argument)

    def each(calls: Sequence[Any], *_: Any) -> Iterator[tuple[int, Any]]:
        yield from make(calls)

    @contextmanager
    def team(*_: Any) -> Iterator[Callable[..., Any]]:
        yield make

    monkeypatch.setattr(workers, "each", each)
    monkeypatch.setattr(workers, "team", team)
