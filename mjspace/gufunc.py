"""Generalized ufuncs that numba compiles when they are first called, not when they are declared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from mjspace.compiling import first_use


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

        with first_use(self.function.__code__.co_filename):
            return guvectorize(self.signatures, self.layout, cache=True)(self.function).ufunc


def gufunc(signatures: Sequence[str], layout: str) -> Callable[[Callable[..., None]], _Gufunc]:
    """Return a decorator like ``numba.guvectorize``, which compiles at the first use of ``ufunc``.

    A scenario's tables stand in the same files as such functions. They are read without the
    compiler, whose import takes 0.3 s, and without the machine code of parts that do not fly.
    """
    return partial(_Gufunc, signatures, layout)
