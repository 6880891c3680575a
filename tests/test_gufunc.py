"""Machine code that processes share is compiled by one of them."""

import fcntl
import os
from pathlib import Path
from typing import Any

import numba
import pytest

from mjspace.gufunc import gufunc


def is_free(folder: Path) -> bool:
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    finally:
        os.close(handle)
    return True


def test_one_process_compiles_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """numba's files of two that compile at once may not fit together: a crash ever after."""
    folder, free, true = Path(__file__).parent, [], numba.guvectorize

    def watched(*arguments: Any, **options: Any) -> Any:
        free.append(is_free(folder))
        return true(*arguments, **options | {"cache": False})

    monkeypatch.setattr(numba, "guvectorize", watched)

    @gufunc(["void(f8[:], f8[:])"], "(n)->(n)")
    def twice(x: Any, y: Any) -> None:
        for i in range(len(x)):
            y[i] = 2.0 * x[i]

    assert twice.ufunc([1.0, 2.0]).tolist() == [2.0, 4.0]
    assert free == [False]
    assert is_free(folder)


def test_nothing_is_compiled_past_the_lock() -> None:
    root = Path(__file__).parents[1]
    modules = [*root.glob("mjspace/**/*.py"), *root.glob("controllers/**/*.py")]
    users = [path.name for path in modules if "import guvectorize" in path.read_text()]
    assert users == ["gufunc.py"]
