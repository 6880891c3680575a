"""The C structs of a law in a shared library: their fields, their header, their layout."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from textwrap import wrap
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import shortened
from mjspace.ranges import numbers
from mjspace.scenario.scenario import Component
from mjspace.simulation.flight_software.interface import Field, Fields, Interface
from mjspace.units import Quantity, to_si

ABI = 1
"""Of the order of the structs and the functions' arguments."""
LAYOUT = "mjspace_law_layout"
"""The text that a library exports: the structs that it was compiled for."""
_ABOUT = {
    "vehicle": "Properties of the vehicle, and periods: constant.",
    "gains": "The other keys of the scenario's [law], in SI: constant.",
    "measurement": "What is measured at the control instant.",
    "reference": "The desired motion at the control instant.",
    "state": "What the law remembers: all of it, so that a flight can go on from any instant.",
    "command": "What the actuators obey until the next control instant.",
    "signals": "What is logged beside the command.",
}
_NONE = {"unused": Field(about="There is none: C has no empty structs")}


@dataclass(frozen=True)
class Structs:
    """The structs of a law for one scenario: plain doubles, in this order."""

    fields: Mapping[str, Fields]
    """Of each struct, by its name."""
    constants: Mapping[str, Mapping[str, Array]]
    """The values of ``vehicle`` and ``gains``."""

    @property
    def in_c(self) -> list[tuple[str, Fields]]:
        """The structs as C can have them, none of them empty."""
        return [(name, fields or _NONE) for name, fields in self.fields.items()]

    @property
    def layout(self) -> str:
        """The text by which mjspace and a library know that they mean the same."""
        groups = [f"{name} {' '.join(_members(fields))}" for name, fields in self.in_c]
        return "; ".join([f"mjspace law {ABI}", *groups])

    def size(self, struct: str) -> int:
        """Return how many doubles a struct has."""
        return sum(prod(field.shape) for field in dict(self.in_c)[struct].values())

    def views(self, memory: Array, structs: Sequence[str]) -> dict[str, dict[str, Array]]:
        """Return the fields of consecutive ``structs`` as views of ``memory``, (doubles,)."""
        found: dict[str, dict[str, Array]] = {}
        at = 0
        for struct in structs:
            found[struct] = {}
            for name, field in dict(self.in_c)[struct].items():
                count = prod(field.shape)
                found[struct][name] = memory[at : at + count].reshape(field.shape)
                at += count
        return found


def structs_of(interface: Interface, law: Component) -> Structs:
    """Return the structs of the scenario's ``law``.

    Raises:
        ValueError: a key of the law's table is no number, or declares no field.
    """
    table = law.gains
    declared = {key: _declared(key, table.pop(key, {})) for key in ("state", "signals")}
    gains = {name: _gain(name, value) for name, value in table.items()}
    fields: dict[str, Fields] = {
        "vehicle": interface.vehicle,
        "gains": {name: Field(array.shape, unit) for name, (array, unit) in gains.items()},
        "measurement": interface.measurement,
        "reference": interface.reference,
        "state": declared["state"],
        "command": interface.command,
        "signals": declared["signals"],
    }
    constants = {
        "vehicle": interface.facts,
        "gains": {name: array for name, (array, _) in gains.items()},
    }
    return Structs({name: _with_numbers(group) for name, group in fields.items()}, constants)


def header(structs: Structs, scenario: str, function: str) -> str:
    """Return the C header of a law for the ``scenario`` of that name, in that ``function``."""
    lines = [
        f"/* Flight software of the scenario {scenario}: written by 'mjspace law-header'.",
        "   All numbers are double, in SI; angles in rad; quaternions scalar first. */",
        "#ifndef MJSPACE_LAW_H",
        "#define MJSPACE_LAW_H",
        "#ifdef __cplusplus",
        'extern "C" {',
        "#endif",
    ]
    for name, fields in structs.in_c:
        lines += ["", f"/* {_ABOUT[name]} */", "typedef struct {"]
        for member, field in zip(_members(fields), fields.values(), strict=True):
            words = [field.about, f"[{field.unit}]" if field.unit else ""]
            if comment := " ".join(filter(None, words)):
                lines += wrap(
                    f"/* {comment} */", 96, initial_indent="  ", subsequent_indent="     "
                )
            lines.append(f"  double {member};")
        lines.append(f"}} mjspace_{name};")
    layout = " \\\n".join(f'  "{part}"' for part in wrap(structs.layout, 90, drop_whitespace=False))
    return "\n".join([*lines, _END.format(layout=layout, function=function)])


_END = """
typedef struct {{
  double time; /* Of the control instant [s]. */
  mjspace_vehicle vehicle;
  mjspace_gains gains;
  mjspace_measurement measurement;
  mjspace_reference reference;
}} mjspace_input;

typedef struct {{
  mjspace_command command;
  mjspace_signals signals;
}} mjspace_output;

/* One source file of the library says for which structs it was compiled:
     const char mjspace_law_layout[] = MJSPACE_LAW_LAYOUT; */
#define MJSPACE_LAW_LAYOUT \\
{layout}
extern const char mjspace_law_layout[];

/* Called at each control instant: fills in output, which is zero before, and changes state, which
   is the one that it left at the instant before. Returns 0; any other number ends the flight. */
int {function}(const mjspace_input *input, mjspace_state *state, mjspace_output *output);

/* Optional: called once before, with the first input, to change state, which is zero. Returns
   likewise. */
int {function}_reset(const mjspace_input *input, mjspace_state *state);

/* Optional: the inner loop, called in each integration step, from the control instant on, to change
   the command that the law returned for this step, and the state. The measurement is what sensors
   report then, the reference that of the control instant. Returns likewise. */
int {function}_inner(const mjspace_input *input, mjspace_state *state, mjspace_command *command);

#ifdef __cplusplus
}}
#endif
#endif
"""


def _members(fields: Fields) -> Iterator[str]:
    """Yield each field as C declares it, ``inertia[3][3]``."""
    for name, field in fields.items():
        yield name + "".join(f"[{size}]" for size in field.shape)


def _with_numbers(fields: Fields) -> Fields:
    """Return the fields that have any number: what a vehicle lacks is no member of a struct."""
    return {name: field for name, field in fields.items() if prod(field.shape)}


def _declared(key: str, table: Any) -> dict[str, Field]:
    """Return the fields that the law's table declares under ``key``."""
    if not isinstance(table, Mapping):
        raise ValueError(f"{key}: got {shortened(repr(table))}, should be a table of its fields")
    found = {}
    for name, entry in table.items():
        _refuse_name(f"{key}.{name}", name)
        if not _is_declaration(entry):
            raise ValueError(
                f"{key}.{name}: got {shortened(repr(entry))}, should be as "
                '{ shape = [3], unit = "rad" }, or {} for a number'
            )
        found[name] = Field(tuple(entry.get("shape", ())), entry.get("unit", ""))
    return found


def _is_declaration(entry: Any) -> bool:
    if not isinstance(entry, Mapping) or not entry.keys() <= {"shape", "unit"}:
        return False
    shape, unit = entry.get("shape", []), entry.get("unit", "")
    sizes = isinstance(shape, list) and all(type(n) is int and 0 < n <= 1000 for n in shape)
    return sizes and isinstance(unit, str) and "*/" not in unit


def _gain(name: str, value: Any) -> tuple[Array, str]:
    """Return a gain in SI, and its unit where it was written with one."""
    _refuse_name(name, name)
    try:
        found = to_si(value, None)
        array = numbers(found)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if not array.size:
        raise ValueError(f"{name}: got {value!r}, should be a number or an array of numbers")
    first = found
    while isinstance(first, list):
        first = first[0]
    return np.array(array), first.unit if isinstance(first, Quantity) else ""


def _refuse_name(key: str, name: str) -> None:
    if not (name.isascii() and name.isidentifier()) or name in ("time", "unused"):
        raise ValueError(f"{key}: should be a name that C has, and neither 'time' nor 'unused'")
