"""Functions of arrays that are taken down once and repeated without Python, as flights do.

A test that calls a law a hundred thousand times does it so: ``step = taken_down(loop.step, ...)``.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from mjspace.tracing.program import Program
from mjspace.tracing.replay import placed, prove, run
from mjspace.tracing.traced_array import TracedArray


def taken_down(function: Callable[..., Any], *examples: np.ndarray) -> Callable[..., Any]:
    """Return ``function`` of arrays like the ``examples``, which returns a tuple of arrays.

    It is taken down on other numbers; its first call is compared with Python, bit by bit.
    """
    program = Program()
    inputs = [program.copied(array * (1.0 + 1e-6) + 1e-9) for array in examples]
    with program.section() as sections, np.errstate(all="ignore"):
        outputs = function(*(TracedArray(array, program) for array in inputs))
    calls = sections[0]
    prove(calls, program.memory)
    words = placed(calls.words, calls.relative, program.memory.ctypes.data)
    proved = False

    def repeated(*values: np.ndarray) -> tuple[np.ndarray, ...]:
        nonlocal proved
        for held, value in zip(inputs, values, strict=True):
            held[...] = value
        run(calls.table, words)
        found = tuple(each.array.copy() for each in outputs)
        if not proved:
            for one, other in zip(found, function(*values), strict=True):
                assert one.tobytes() == other.tobytes()
            proved = True
        return found

    return repeated
