"""Text from outside, as a terminal shows it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjspace.errors import is_file_name, is_plain, printable, shortened


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("a\x1b[31mb", r"a\x1b[31mb"),
        ("a\x07\x08\x7f", r"a\x07\x08\x7f"),
        ("\u202egnp.exe", r"\u202egnp.exe"),
        ("\udcff", r"\udcff"),
        ("line\nline", "line\nline"),
        ("lunar 45° Körper", "lunar 45° Körper"),
    ],
)
def test_control_characters_are_written_out(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert is_plain(text) == (text == shown and "\n" not in text)


@given(st.text(st.characters(exclude_categories=()), max_size=400))
def test_what_is_shown_is_plain_short_and_can_be_written(text: str) -> None:
    shown = shortened(text)
    assert is_plain(shown)
    assert len(shown) <= 200
    shown.encode()
    printable(text).encode()


@pytest.mark.parametrize("most", [50, 51, 200])
def test_what_is_one_too_long_is_shortened_to_what_is_allowed(most: int) -> None:
    assert shortened("0" * most, most) == "0" * most
    assert most - 1 <= len(shortened("0" * (most + 1), most)) <= most


def test_the_middle_of_a_long_text_is_left_out() -> None:
    text = shortened("begin " + "x" * 5000 + " end", 50)
    assert text.startswith("begin x")
    assert text.endswith("x end")
    assert " ... " in text


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "a\\b", "a\0", "a\nb", "\x1b", "é" * 51])
def test_what_is_no_name_of_a_file(name: str) -> None:
    assert not is_file_name(name)


@pytest.mark.parametrize("name", ["flight", "Flug 1", "..a", "é" * 50])
def test_what_is_a_name_of_a_file(name: str) -> None:
    assert is_file_name(name)
