"""The protobuf file of a law in another process: the messages of one scenario, for any language."""

from collections.abc import Iterator
from textwrap import wrap

from mjspace.simulation.flight_software.interface import Fields, Interface
from mjspace.simulation.flight_software.messages import ENVELOPES

_HEAD = """// Flight software of the scenario {scenario}: written by 'mjspace law-header'.
// Each message comes after its length in four bytes, the least significant first. Numbers are SI,
// angles in rad, quaternions scalar first; matrices row by row.
syntax = "proto3";
package mjspace.law;
"""
_ABOUT = {
    "Field": "An array of a message of doubles: the i-th that is declared is its field i.",
    "Greeting": "The law speaks first, so that nothing is sent to what is no law.",
    "Begin": "The flight's answer. gains are the other keys of [law] in JSON, as they are written.",
    "Call": "At each control instant; with reset once at the start, for the state alone.",
    "Answer": "To Begin, with an error or empty, and to each Call. state and signals are messages "
    "of doubles of your own, declared in the first answer that has them.",
    "Vehicle": "Properties of the vehicle, and periods: constant.",
    "Measurement": "What is measured at the control instant.",
    "Reference": "The desired motion at the control instant.",
    "Command": "What the actuators obey until the next control instant.",
}


def proto_file(interface: Interface, scenario: str) -> str:
    """Return the text of the .proto file for the ``scenario`` of that name."""
    lines = [_HEAD.format(scenario=scenario)]
    for name, fields in ENVELOPES.items():
        lines += _message(name, [("", f"{kind} {field}") for field, kind in fields.items()])
    for group in ("vehicle", "measurement", "reference", "command"):
        lines += _message(group.capitalize(), _doubles(getattr(interface, group)))
    return "\n".join(lines)


def _message(name: str, fields: Iterator[tuple[str, str]] | list[tuple[str, str]]) -> list[str]:
    lines = [*_comment(_ABOUT[name], ""), f"message {name} {{"]
    for number, (about, declared) in enumerate(fields, start=1):
        lines += _comment(about, "  ")
        lines.append(f"  {declared} = {number};")
    return [*lines, "}", ""]


def _doubles(fields: Fields) -> Iterator[tuple[str, str]]:
    """Yield what each field is, and how it is declared."""
    for name, field in fields.items():
        unit = f"[{field.unit}]" if field.unit else ""
        size = f"({' x '.join(map(str, field.shape))})" if field.shape else ""
        label = "repeated double" if field.shape else "double"
        yield " ".join(filter(None, (field.about, unit, size))), f"{label} {name}"


def _comment(text: str, indent: str) -> list[str]:
    return wrap(text, 99, initial_indent=f"{indent}// ", subsequent_indent=f"{indent}// ")
