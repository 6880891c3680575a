"""MuJoCo's batch called through its C interface, for compiled functions that fly whole blocks.

``mujoco.batch.Batch`` steps from Python. ``mjb_apply`` of the C interface runs a C function on each
simulation, on the batch's threads, with MuJoCo's errors caught; Python has no method for it.
"""

import ctypes
import functools
import sys
import weakref
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import SimulationError

from mjspace.contract import Array

_ERROR_LENGTH = 1000


class _Config(ctypes.Structure):
    """``mjBatchConfig``."""

    _fields_ = (("nthread", ctypes.c_int), ("persistent", ctypes.c_bool))


@functools.cache
def library() -> ctypes.CDLL:
    """Return the library that the mujoco package has loaded."""
    name = {"win32": "mujoco.dll", "darwin": "libmujoco*.dylib"}.get(sys.platform, "libmujoco.so*")
    (path,) = Path(mujoco.__file__).parent.glob(name)
    loaded = ctypes.CDLL(str(path))
    pointer, text, count = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
    for name, result, arguments in (
        ("mjb_makeBatch", pointer, [pointer, count, pointer, text, count]),
        ("mjb_deleteBatch", None, [pointer]),
        ("mjb_state", pointer, [pointer]),
        ("mjb_warning", pointer, [pointer]),
        ("mjb_expand", pointer, [pointer, text, pointer, pointer]),
        ("mjb_setConst", count, [pointer, pointer, count]),
        ("mjb_setModels", None, [pointer, pointer]),
        ("mjb_apply", count, [pointer, pointer, count, pointer, pointer, count]),
        ("mjb_status", pointer, [pointer]),
        ("mjb_error", text, [pointer, count]),
    ):
        function = getattr(loaded, name)
        function.restype, function.argtypes = result, arguments
    return loaded


def stop_timers() -> None:
    """Let MuJoCo no longer time its own functions, for ``mjData.timer``, in this process.

    The Python package installs a clock, which is read some hundred times in a step with RK4: a
    quarter of the step of a satellite. A clock of the user's own stays.
    """
    if mujoco.get_mjcb_time() is None:
        ctypes.c_void_p.in_dll(library(), "mjcb_time").value = None


def address(function: str) -> int:
    """Return where MuJoCo's C ``function`` is."""
    return ctypes.cast(getattr(library(), function), ctypes.c_void_p).value or 0


class _Memory:
    """MuJoCo's memory of a batch, freed when nothing refers to this."""


class NativeBatch:
    """Simulations of a copy of ``model``, as ``mujoco.batch.Batch`` has them.

    Attributes:
        state: each simulation's integration state, (N, nstate): written and read between calls.
        warning: each simulation's warning counters, (N, mjNWARNING, 2), int32.
    """

    def __init__(
        self,
        model: Any,
        vehicles: int,
        threads: int,
        fields: Mapping[str, Array],
        own: Collection[str] = (),
    ) -> None:
        """Make it; ``fields`` of the model differ between vehicles, (N, ...).

        Each thread has its ``own`` copy of other fields, and of all that MuJoCo derives from them:
        a function that is applied may change both, and finds the fields anew at each vehicle.

        Raises:
            ValueError: MuJoCo cannot make it.
        """
        stop_timers()
        message = ctypes.create_string_buffer(_ERROR_LENGTH)
        config = _Config(threads, False)
        self._batch = library().mjb_makeBatch(
            model._address, vehicles, ctypes.byref(config), message, _ERROR_LENGTH
        )
        if not self._batch:
            raise ValueError(message.value.decode(errors="replace"))
        # The arrays keep this alive, not the batch: NumPy's arrays take part in no cycles that
        # Python frees.
        self._memory = _Memory()
        weakref.finalize(self._memory, library().mjb_deleteBatch, self._batch)
        self.vehicles = vehicles
        self._apply = library().mjb_apply  # called in every period of a law in Python
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION)
        rows = library().mjb_state(self._batch)
        self.state = self._array(rows, ctypes.c_double, (vehicles, size))
        counters = (vehicles, int(mujoco.mjtWarning.mjNWARNING), 2)
        self.warning = self._array(library().mjb_warning(self._batch), ctypes.c_int, counters)
        for name in own:
            library().mjb_expand(self._batch, name.encode(), None, None)
        if own:
            self._check(library().mjb_setConst(self._batch, None, 0))
        self._fields: dict[str, Array] = {}
        self.follow(fields)

    def follow(self, fields: Mapping[str, Array]) -> None:
        """Let those fields of the model be the vehicles' own, (N, ...), with all that derives.

        Raises:
            mujoco.batch.SimulationError: MuJoCo raised an error.
        """
        changed = False
        for name, values in fields.items():
            if name not in self._fields:
                at = library().mjb_expand(self._batch, name.encode(), None, None)
                self._fields[name] = self._array(at, ctypes.c_double, values.shape)
                changed = True
            changed |= not np.array_equal(self._fields[name], values)
            self._fields[name][...] = values
        if changed:
            self._check(library().mjb_setConst(self._batch, None, 0))

    def set_models(self, models: Sequence[Any]) -> None:
        """Let each simulation have its own of the ``models``, which have the sizes of the batch's.

        Nothing changes where there are none. It excludes ``fields`` and ``own`` ones.
        """
        self._models = tuple(models)  # which the batch reads
        if models:
            addresses = (ctypes.c_void_p * self.vehicles)(*(each._address for each in models))
            library().mjb_setModels(self._batch, addresses)

    def apply(self, function: int, argument: int) -> None:
        """Call the C ``function`` at that address on each simulation, then save its state.

        Raises:
            mujoco.batch.SimulationError: MuJoCo raised an error in some simulations, or what the
                function calls did, as a law's generalized ufunc may.
        """
        try:
            failed = self._apply(self._batch, None, 0, function, argument, 1)
        except SystemError as error:
            everyone = np.arange(self.vehicles)
            raise SimulationError(everyone, str(error.__cause__), self.vehicles) from error
        if failed:
            self._check(failed)

    def _check(self, failed: int) -> None:
        if failed:
            status = self._array(library().mjb_status(self._batch), ctypes.c_int, (self.vehicles,))
            which = np.flatnonzero(status)
            message = library().mjb_error(self._batch, int(which[0]))
            raise SimulationError(which, message.decode(errors="replace"), self.vehicles)

    def _array(self, at: int, kind: Any, shape: tuple[int, ...]) -> np.ndarray:
        """Return MuJoCo's memory as an array, which keeps that memory alive."""
        memory = (kind * int(np.prod(shape))).from_address(at)
        memory.owner = self._memory
        return np.ctypeslib.as_array(memory).reshape(shape)
