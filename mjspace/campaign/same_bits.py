"""Whether another machine computes the same bits: versions, the testbed's code, arithmetic."""

import hashlib
import math
from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from mjspace.log.provenance import software

_CODE, _ARITHMETIC = "code", "arithmetic"
_PACKAGES = {"mjspace": ("controllers", "assets"), "mjspace.controllers": (), "mjspace.assets": ()}
"""With what is a package of its own; installed, those lie in the first."""


@cache
def facts() -> dict[str, str]:
    """Return what the bits of a flight depend on, besides the scenario and its files."""
    return {**software(), _CODE: _code(), _ARITHMETIC: _arithmetic()}


def difference(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """Return why flights there would have other bits than here; "" where they have the same."""
    differ = [name for name in ours if theirs.get(name) != ours[name]]
    if not differ:
        return ""
    first = differ[0]
    if first == _CODE:
        return f"other code of mjspace {ours['mjspace']}"
    if first == _ARITHMETIC:
        return "other last digits of sines and matrices: another processor or C library"
    return f"{first} {theirs.get(first)}, not {ours[first]}"


def _code() -> str:
    """Return a digest of the testbed, its laws and models: a version has many states of them."""
    digest = hashlib.sha256()
    for package, others in _PACKAGES.items():
        spec = find_spec(package)
        assert spec is not None  # mjspace is here
        folder = Path(next(iter(spec.submodule_search_locations or ())))
        for file in sorted((*folder.rglob("*.py"), *folder.rglob("*.xml"))):
            inside = file.relative_to(folder)
            if inside.parts[0] not in others:
                digest.update(f"{package}/{inside.as_posix()}\0".encode() + file.read_bytes())
    return digest.hexdigest()


def _arithmetic() -> str:
    """Return a digest of what the C library, NumPy and its LAPACK make of fixed numbers.

    They choose among their routines by the processor, and those differ in the last digit.
    """
    x = np.linspace(0.01, 0.99, 257)
    matrix = np.cos(np.arange(144.0).reshape(12, 12)) + 12.0 * np.eye(12)
    symmetric = matrix + matrix.T
    functions = (np.sin, np.cos, np.tan, np.exp, np.log, np.arcsin, np.arctan, np.sqrt, np.cbrt)
    found = [function(x) for function in functions]
    found += [np.arctan2(x, 1.0 - x), np.power(x, 1.7), np.hypot(x, 3.0), np.cumsum(x)]
    found += [matrix @ matrix, np.linalg.inv(matrix), np.linalg.eigvalsh(symmetric)]
    found += [np.linalg.svd(matrix, compute_uv=False), np.linalg.cholesky(symmetric)]
    plain = [f(v) for v in x.tolist() for f in (math.sin, math.cos, math.exp, math.log, math.atan)]
    return hashlib.sha256(b"".join(map(np.ndarray.tobytes, [*found, np.array(plain)]))).hexdigest()
