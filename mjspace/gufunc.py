"""Generalized ufuncs that numba compiles when they are first called, not when they are declared."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class _Gufunc:
    """A function and how numba compiles it."""

    signatures: Sequence[str]
    layout: str
    function: Callable[..., None]

    @cached_property
    def ufunc(self) -> Any:
        """The compiled ``numpy.ufunc``; its machine code is kept beside the function's file."""
        from numba import guvectorize

        with _one_process(Path(self.function.__code__.co_filename).parent):
            return guvectorize(self.signatures, self.layout, cache=True)(self.function).ufunc


def gufunc(signatures: Sequence[str], layout: str) -> Callable[[Callable[..., None]], _Gufunc]:
    """Return a decorator like ``numba.guvectorize``, which compiles at the first use of ``ufunc``.

    A scenario's tables stand in the same files as such functions. They are read without the
    compiler, whose import takes 0.3 s, and without the machine code of parts that do not fly.
    """
    return partial(_Gufunc, signatures, layout)


@contextmanager
def _one_process(folder: Path) -> Iterator[None]:
    """Let one process at a time compile and keep what is declared in a ``folder``.

    numba keeps a loop and the function in it in two files, which name each other by numbers of the
    process that wrote them: of two processes that compile at once, the files of either may remain,
    and whoever reads them jumps to nowhere. Where there are no locks all is as without.
    """
    handle = -1
    with suppress(ImportError, OSError):
        import fcntl

        handle = os.open(folder, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if handle >= 0:
            os.close(handle)
