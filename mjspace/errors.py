"""Errors that are reported in one line: bad input, a flight that cannot go on, no renderer."""

import difflib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class InputError(ValueError):
    """Bad input: one line with the file or option, the key, what was found, what would be right."""


class FlightError(RuntimeError):
    """The flight cannot go on: something is not finite, MuJoCo warned, or a law raised."""


class NoRendererError(RuntimeError):
    """Nothing can be rendered on this machine; what to install."""


@contextmanager
def input_error_at(key: str) -> Iterator[None]:
    """Turn a ValueError or an OSError of the block into an InputError that names ``key``."""
    try:
        yield
    except InputError:
        raise
    except (ValueError, OSError) as error:
        message = str(error)
        named = message.startswith(key)
        raise InputError(message if named else f"{key}: {message}") from error


def nearest(name: str, names: Any) -> str:
    """Return ``": nearest is 'x' (have a, b, x)"`` for an error message."""
    near = difflib.get_close_matches(name, list(names), n=1, cutoff=0.5)
    have = ", ".join(names) or "none"
    return f": did you mean {near[0]!r}? (have {have})" if near else f": have {have}"


def print_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as one line, in place of ``warnings.showwarning``."""
    print(f"mjspace: warning: {message}", file=sys.stderr)
