"""Imported by the process that workers are forked from: the kernel kills it with its parent.

It would end by itself, but not before it has imported everything. Workers end on their own.
"""

import ctypes
import signal
import sys
from types import TracebackType

_PR_SET_PDEATHSIG = 1  # linux/prctl.h

if sys.platform == "linux":
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _reported(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Report why a worker could not begin, unless its parent was interrupted meanwhile.

    The parent's semaphores and its end of the pipe are gone then. What a worker raises once it has
    begun, its pool hands on.
    """
    if not isinstance(error, FileNotFoundError | EOFError):
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _reported
