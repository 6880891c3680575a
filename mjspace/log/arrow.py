"""Parquet's library, which an installation may lack."""

from typing import Any

from mjspace.errors import missing


def pyarrow_for(purpose: str) -> Any:
    """Return ``pyarrow`` with ``pyarrow.parquet``, for the ``purpose`` that an error names.

    Raises:
        InputError: it is not installed, with what installs it.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise missing(purpose, "pyarrow", "data") from None
    return pyarrow
