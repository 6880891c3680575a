"""The compiled model of a log, as far as a stranger's may be trusted: its numbers alone.

MuJoCo validates much of an MJB when it loads one, but indices and counts that are inconsistent with
each other make it read and write anywhere. A log's model is therefore never loaded as it is: what
its scenario compiles to here gives the structure, the log the floating-point numbers in it.
"""

import hashlib
import warnings
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjspace.errors import InputError
from mjspace.vehicle.vehicle import from_mjb, saved, to_mjb

_SPARE = 1 << 16  # for paths of files, which depend on where mjspace is installed


class OtherModelWarning(UserWarning):
    """A log's model is laid out otherwise than the one that its scenario compiles to here."""


def logged_model(
    here: Any, packed: bytes, metadata: Mapping[str, str], state: tuple[int, ...]
) -> Any:
    """Return the model of a log, with every bit of its floating-point numbers.

    ``here`` is what the log's scenario compiles to, ``packed`` the model as it is attached,
    ``state`` the shape of a row of its ``physics``. Where the two models have another structure it
    is ``here`` itself.

    Raises:
        InputError: the attached model is damaged, or its state is laid out otherwise.

    Warns:
        OtherModelWarning: the structures differ.
    """
    known = metadata.get("model_sha256")
    if known is not None and hashlib.sha256(packed).hexdigest() != known:
        raise InputError("log: model.mjb.gz is not the one that flew, by the log's digest of it")
    if state != (mujoco.mj_stateSize(here, mujoco.mjtState.mjSTATE_INTEGRATION),):
        raise InputError(
            "log: another version of mjspace laid its state out differently: fly it again with "
            f"version {metadata.get('mjspace', 'that flew it')} and the revision "
            f"{metadata.get('git') or 'that it names'}"
        )
    own = to_mjb(here)
    mjb = _unpacked(packed, len(own) + _SPARE)
    if mjb == own:
        return here
    numbers = _numbers_of(mjb, here, own)
    if numbers is None:
        warnings.warn(
            "the log's model is not the one that its scenario compiles to here, which is taken: "
            "another version of mjspace or MuJoCo wrote it, or somebody changed it",
            OtherModelWarning,
            stacklevel=2,
        )
        return here
    model = from_mjb(numbers)
    for name in _float_arrays(model):
        if not np.array_equal(np.isfinite(getattr(model, name)), np.isfinite(getattr(here, name))):
            raise InputError(f"log: model.mjb.gz holds numbers in {name} that are not finite")
    return model


def _unpacked(packed: bytes, limit: int) -> bytes:
    unpacker = zlib.decompressobj(wbits=31)
    try:
        mjb = unpacker.decompress(packed, limit + 1)
    except zlib.error as error:
        raise InputError(f"log: model.mjb.gz cannot be unpacked: {error}") from error
    if len(mjb) > limit:
        raise InputError("log: model.mjb.gz is larger than the model that its scenario compiles to")
    if not unpacker.eof:
        raise InputError("log: model.mjb.gz ends too early")
    return mjb


def _numbers_of(mjb: bytes, here: Any, own: bytes) -> bytes | None:
    """Return ``own``, the MJB of ``here``, with the numbers of ``mjb``; None: another structure.

    The names of the files that were compiled, and what tells where they are, may differ.
    """
    paths = saved(here)[1]
    start, stop = paths.start, paths.stop
    longer = len(mjb) - len(own)
    if here.npaths + longer < 0:
        return None

    def without_paths(data: bytes, stop: int) -> NDArray[np.uint8]:
        return np.frombuffer(data[:start] + data[stop:], np.uint8)

    def changed_by(change: Callable[[Any], None]) -> NDArray[np.bool_]:
        changed = from_mjb(own)
        change(changed)
        changes: NDArray[np.bool_] = mine != without_paths(to_mjb(changed), stop)
        return changes

    mine, theirs = without_paths(own, stop), without_paths(mjb, stop + longer)
    numbers = changed_by(_flip_numbers)
    other = np.flatnonzero((mine != theirs) & ~numbers & ~changed_by(_flip_places_of_paths))
    if len(other) and not _is_their_length(mine, theirs, other, here.npaths, longer):
        return None
    merged = mine.copy()
    merged[numbers] = theirs[numbers]
    return merged[:start].tobytes() + own[start:stop] + merged[start:].tobytes()


def _is_their_length(
    mine: NDArray[np.uint8],
    theirs: NDArray[np.uint8],
    other: NDArray[np.int_],
    length: int,
    longer: int,
) -> bool:
    """Tell whether ``other`` bytes, which differ, are but the ``length`` of all paths together."""
    for start in range(max(other[0] - 7, 0), other[0] + 1):
        both = (int(one[start : start + 8].view(np.int64)[0]) for one in (mine, theirs))
        if tuple(both) == (length, length + longer):
            return bool(other[-1] < start + 8)
    return False


def _flip_numbers(model: Any) -> None:
    for name in _float_arrays(model):
        _flip(getattr(model, name))
    for group in (model.opt, model.stat):
        for name in _float_arrays(group):
            _flip(getattr(group, name))
        for name in _names(group, float):
            number = np.array(getattr(group, name))
            _flip(number)
            setattr(group, name, float(number))


def _flip_places_of_paths(model: Any) -> None:
    for name in _names(model, np.ndarray):
        if name.endswith("_pathadr"):
            _flip(getattr(model, name))


def _flip(array: NDArray[Any]) -> None:
    array.reshape(-1).view(np.uint8)[:] ^= 0xFF


def _float_arrays(group: Any) -> list[str]:
    return [name for name in _names(group, np.ndarray) if getattr(group, name).dtype.kind == "f"]


def _names(group: Any, kind: type) -> list[str]:
    names = (name for name in dir(group) if not name.startswith("_"))
    return [name for name in names if isinstance(getattr(group, name), kind)]
