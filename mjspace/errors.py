"""Errors that are reported in one line: bad input, a flight that cannot go on, no renderer.

A line shows text from outside without control characters, and not too long.
"""

import difflib
import signal
import sys
import traceback
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from mjspace.interrupts import Interrupted

_TESTBED = Path(__file__).parent
_CONTROL = {"Cc", "Cf", "Cs"}  # control and format characters (bidirectional marks), surrogates
_LONGEST_NAME = 100


class InputError(ValueError):
    """Bad input: one line with the file or option, the key, what was found, what would be right."""


class FlightError(RuntimeError):
    """The flight cannot go on: something is not finite, MuJoCo warned, or a law raised."""


class NoRendererError(RuntimeError):
    """Nothing can be rendered on this machine; what to install."""


def missing(purpose: str, package: str, extra: str) -> InputError:
    """Return the error where a ``package`` that only some need is not installed.

    ``extra`` is what of ``pyproject.toml``'s optional dependencies installs it.
    """
    return InputError(f"{purpose} needs {package}: pip install 'mjspace[{extra}]'")


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


@contextmanager
def whole_or_none(path: Path) -> Iterator[BinaryIO]:
    """Yield a new file, in place of what is there; of a link, the link alone is replaced.

    A file that the block could not write to its end is removed; an OSError names it.
    """
    path.unlink(missing_ok=True)
    try:
        with path.open("xb") as file:
            yield file
    except OSError as error:
        if error.filename is None:
            path.unlink(missing_ok=True)
            error.filename = str(path)
        raise
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def failure(who: str, error: BaseException) -> FlightError:
    """Return the error that says what ``who`` raised, and at which line of the user's code.

    Where none of the user's code is involved, it is the line of the testbed's. Also SystemExit and
    the like are errors: user's code ends no program. A signal is none, and is raised.
    """
    pass_on_signals(error)
    place = place_of(error)
    hint = ": what it receives is read-only, copy it first" if "read-only" in str(error) else ""
    message = " ".join(str(error).split())
    raised = f"{who} raised {type(error).__name__} at {place}"
    return FlightError(f"{raised}: {message}{hint}" if message else raised)


def pass_on_signals(error: BaseException) -> None:
    """Raise ``error`` again if a signal is its cause, and none of the user's code."""
    is_ctrl_c = (
        isinstance(error, KeyboardInterrupt)
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if is_ctrl_c or isinstance(error, Interrupted):
        raise error


def nearest(name: str, names: Any) -> str:
    """Return ``": nearest is 'x' (have a, b, x)"`` for an error message."""
    near = difflib.get_close_matches(name, list(names), n=1, cutoff=0.5)
    have = ", ".join(names) or "none"
    return f": did you mean {near[0]!r}? (have {have})" if near else f": have {have}"


def print_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as one line, in place of ``warnings.showwarning``."""
    print(f"mjspace: warning: {printable(str(message))}", file=sys.stderr)


def place_of(error: BaseException) -> str:
    """Return "file.py:line" of the innermost frame of the user's, else of the testbed's."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if Path(frame.filename).is_relative_to(_TESTBED)]
    return users_place_of(error) or _place((ours or frames)[-1])


def users_place_of(error: BaseException) -> str:
    """Return "file.py:line" of the innermost frame of the user's; "" where there is none."""
    frames = traceback.extract_tb(error.__traceback__)
    users = [frame for frame in frames if _is_users(Path(frame.filename))]
    return _place(users[-1]) if users else ""


def _place(frame: traceback.FrameSummary) -> str:
    return f"{Path(frame.filename).name}:{frame.lineno}"


def _is_users(path: Path) -> bool:
    """Return whether it is a Python file outside the testbed and the libraries.

    Frames of Cython and of ``eval`` have names such as "_common.pyx" and "<string>".
    """
    import sysconfig  # with its paths it takes 3 ms, which a start without an error need not

    if path.is_relative_to(_TESTBED):
        return path.is_relative_to(_TESTBED / "controllers")
    libraries = (sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
    return path.suffix == ".py" and not any(map(path.is_relative_to, libraries))


def is_plain(text: str) -> bool:
    """Return whether a text has no character that controls a terminal or hides in it."""
    return (text.isascii() and text.isprintable()) or not any(map(_controls, text))


def printable(text: str) -> str:
    """Return the text with every control character but the line's end written out, as ``\\x1b``."""
    if is_plain(text):
        return text
    return "".join(
        character.encode("unicode_escape").decode()
        if _controls(character) and character != "\n"
        else character
        for character in text
    )


def shortened(text: str, most: int = 200) -> str:
    """Return the text on one line, without the middle of what is longer than ``most``."""
    line = " ".join(printable(text).split())
    gap = " ... "
    half = (most - len(gap)) // 2
    return line if len(line) <= most else f"{line[:half]}{gap}{line[-half:]}"


def is_file_name(text: str) -> bool:
    """Return whether a text can be the name of a file or a folder, and leads to no other place."""
    short = 0 < len(text.encode(errors="replace")) <= _LONGEST_NAME
    return short and is_plain(text) and text not in (".", "..") and not set(text) & set("/\\:\0")


def _controls(character: str) -> bool:
    return unicodedata.category(character) in _CONTROL
