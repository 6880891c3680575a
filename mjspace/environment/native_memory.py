"""Arrays over C memory, for native callbacks that get MuJoCo's structs as pointers.

A struct is read as an array of 8-byte words; ``struct_offsets`` says which word is which.
"""

from typing import Any

import numpy as np
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.numpy_support import carray


def _generate_pointer(typing_context: Any, word: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


pointer: Any = intrinsic(_generate_pointer)


@njit(cache=True)
def ints(words: Any, word: int, count: int) -> Any:
    """Return the ``count`` C ints that the pointer at ``words[word]`` points to."""
    return carray(pointer(words[word]), (count,), np.int32)


@njit(cache=True)
def floats(words: Any, word: int, shape: Any) -> Any:
    """Return the array of doubles, of ``shape``, that the pointer at ``words[word]`` points to."""
    return carray(pointer(words[word]), shape, np.float64)
