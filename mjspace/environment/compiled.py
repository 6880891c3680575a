"""Functions that numba compiles when something needs them, not when their file is imported."""

import functools
from collections.abc import Callable
from typing import Any


class compiled:  # noqa: N801 - a decorator
    """Decorates a function for numba: compiled into what calls it, or when Python calls it.

    A scenario's tables stand in the same files as these functions and are read without the
    compiler, whose import takes 0.6 s.

    Compiled functions call each other across files. Python may call one that calls functions of
    its own file only, since the cache of its machine code notices changes of that file alone; the
    callback of ``kernel`` notices those of the whole room.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self._function = function

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code from Python."""
        return self._alone(*arguments)

    @functools.cached_property
    def _alone(self) -> Any:
        from numba import njit

        return njit(self._function, cache=True, error_model="numpy")

    @functools.cached_property
    def _within(self) -> Any:
        from numba import njit

        # Inlined, since a call that passes all the arrays of ``bodies`` takes 50 ns; and without
        # entries from Python and C, which double the time to compile.
        inner: dict[str, Any] = {"forceinline": True}
        inner |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return njit(self._function, error_model="numpy", **inner)

    @property
    def _numba_type_(self) -> Any:
        """What numba takes this object for in a function that it compiles."""
        return self._within._numba_type_
