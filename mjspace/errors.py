"""Errors that are told in one line: bad input, a flight that cannot go on, no renderer."""

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """Bad input: one line with which file or option, which key, what was found, what would do."""


class FlightError(RuntimeError):
    """The flight cannot go on: something is not finite, MuJoCo warned, or a law raised."""


class NoRendererError(RuntimeError):
    """Nothing can be rendered on this machine; what to install."""


@contextmanager
def blamed_on(key: str) -> Iterator[None]:
    """Turn what a part or a file of the user's raises into an InputError that names ``key``."""
    try:
        yield
    except InputError:
        raise
    except (ValueError, OSError) as error:
        message = str(error)
        named = message.startswith(key)
        raise InputError(message if named else f"{key}: {message}") from error
