"""Text from outside as a terminal may show it: without control characters, and not too long."""

import unicodedata

_CONTROL = {"Cc", "Cf", "Cs"}  # control and format characters (bidirectional marks), surrogates
_LONGEST_NAME = 100


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
    half = most // 2 - 2
    return line if len(line) <= most else f"{line[:half]} ... {line[-half:]}"


def is_file_name(text: str) -> bool:
    """Return whether a text can be the name of a file or a folder, and leads to no other place."""
    short = 0 < len(text.encode(errors="replace")) <= _LONGEST_NAME
    return short and is_plain(text) and text not in (".", "..") and not set(text) & set("/\\:\0")


def _controls(character: str) -> bool:
    return unicodedata.category(character) in _CONTROL
