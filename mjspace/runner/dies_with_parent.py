"""Imported by the process that workers are forked from: the kernel kills it with its parent.

It would end by itself, but not before it has imported everything. Workers end on their own.
"""

import ctypes
import signal
import sys

_PR_SET_PDEATHSIG = 1  # linux/prctl.h

if sys.platform == "linux":
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
