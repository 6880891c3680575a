"""A law in a shared library with a C interface, compiled from any language."""

import ctypes
import tempfile
from dataclasses import replace
from itertools import zip_longest
from typing import Any, ClassVar

import numpy as np

from mjspace.contract import DesiredMotion, Measurement
from mjspace.errors import input_error_at, shortened
from mjspace.scenario.construct import plain
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust
from mjspace.simulation.assembly import Assembly, under_inner_loop
from mjspace.simulation.flight_software.interface import interface_of, named_tuple
from mjspace.simulation.flight_software.structs import LAYOUT, Structs, structs_of
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.simulation.user_code import ReturnError

_INPUT = ("vehicle", "gains", "measurement", "reference")  # after the time
_OUTPUT = ("command", "signals")


def fly_under(assembly: Assembly, law: Component, trust: Trust) -> Assembly:
    """Return the ``assembly``, which has no law yet, under one in a shared library.

    Raises:
        InputError: no such library or function, or one that was compiled for other structs.
    """
    with input_error_at("law"):
        path, function = trust.library(law.kind)
        structs = structs_of(interface_of(assembly), law)
        content = path.read_bytes()
        flown = LibraryLaw(path.name, content, function, structs)
    if flown.has_inner:
        assembly = under_inner_loop(assembly)
    gains = law.gains | {name: plain(a) for name, a in structs.constants["gains"].items()}
    table = Component(kind=f"law.so:{function}", **gains)
    return replace(
        assembly,
        scenario=assembly.scenario.model_copy(update={"law": table}),
        law=UnbatchedLaw(flown),
        sources=assembly.sources | {"law.so": content},
    )


class LibraryLaw:
    """A law of one vehicle that calls a C function; all memory of a flight is in its state."""

    compiled: ClassVar[bool] = False

    def __init__(self, name: str, content: bytes, function: str, structs: Structs) -> None:
        """Load the library of that ``content``, whose file is called ``name``.

        Raises:
            ValueError: it is no library, lacks the function, or was compiled for other structs.
        """
        library = _loaded(name, content)
        _refuse_layout(name, library, structs)
        self._function = function
        self._step = _function(name, library, function, 3)
        self._reset = _function(name, library, f"{function}_reset", 2, optional=True)
        self._inner = _function(name, library, f"{function}_inner", 3, optional=True)
        sizes = {struct: structs.size(struct) for struct in structs.fields}
        self._input = np.zeros(1 + sum(sizes[struct] for struct in _INPUT))
        self._state = np.zeros(sizes["state"])
        self._output = np.zeros(sum(sizes[struct] for struct in _OUTPUT))
        self._pointers = [memory.ctypes.data for memory in (self._input, self._state, self._output)]
        given = structs.views(self._input[1:], _INPUT)
        for struct, constants in structs.constants.items():
            for field in structs.fields[struct]:
                given[struct][field][...] = constants[field]
        self._measured = [(f, given["measurement"][f]) for f in structs.fields["measurement"]]
        self._desired = [(f, given["reference"][f]) for f in structs.fields["reference"]]
        returned = structs.views(self._state, ["state"]) | structs.views(self._output, _OUTPUT)
        self._returned = {
            struct: (
                named_tuple(struct.capitalize(), structs.fields[struct]),
                [returned[struct][f] for f in structs.fields[struct]],
            )
            for struct in returned
        }

    @property
    def has_inner(self) -> bool:
        """Whether the library has an inner loop."""
        return self._inner is not None

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the state at the start of a flight: zero, or what ``<function>_reset`` makes.

        Raises:
            ReturnError: that returned anything but 0.
        """
        self._state[:] = 0.0
        if self._reset is not None:
            self._tell(0.0, measurement, reference)
            self._refuse(self._reset(*self._pointers[:2]), f"{self._function}_reset")
        return self._copy("state")

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return (state, command, signals) as the function fills them in.

        Raises:
            ReturnError: it returned anything but 0.
        """
        self._tell(time, measurement, reference)
        self._give("state", state)
        self._output[:] = 0.0
        self._refuse(self._step(*self._pointers), self._function)
        return self._copy("state"), self._copy("command"), self._copy("signals")

    def inner(
        self, state: Any, time: float, command: Any, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return (state, command) as the inner loop changes those of the step before.

        Its reference is that of the step, the last call before for any vehicle.

        Raises:
            ReturnError: it returned anything but 0.
        """
        self._tell(time, measurement)
        self._give("state", state)
        self._give("command", command)
        self._refuse(self._inner(*self._pointers), f"{self._function}_inner")
        return self._copy("state"), self._copy("command")

    def _tell(
        self, time: float, measurement: Measurement, reference: DesiredMotion | None = None
    ) -> None:
        """Fill in the input, where there is a ``reference`` that as well."""
        self._input[0] = time
        for name, view in self._measured:
            view[...] = getattr(measurement, name)
        for name, view in self._desired if reference is not None else ():
            view[...] = getattr(reference, name)

    def _give(self, struct: str, arrays: Any) -> None:
        """Fill in what the function changes; the command is the beginning of the output."""
        for view, values in zip(self._returned[struct][1], arrays, strict=True):
            view[...] = values

    def _refuse(self, status: int, function: str) -> None:
        if status:
            raise ReturnError(f"the law's {function} returned {status}, which is not 0")

    def _copy(self, struct: str) -> Any:
        kind, views = self._returned[struct]
        return kind(*[view.copy() for view in views]) if views else ()


def _loaded(name: str, content: bytes) -> ctypes.CDLL:
    """Return the library of that content, from a file of its own.

    A library of the same path is loaded once in a process: what was compiled anew, between two
    flights, would not be flown.
    """
    with tempfile.NamedTemporaryFile(suffix=".so") as file:
        file.write(content)
        file.flush()
        try:
            return ctypes.CDLL(file.name)
        except OSError as error:
            said = str(error).replace(f"{file.name}: ", "")
            raise ValueError(f"{name} is no shared library that loads here: {said}") from None


def _refuse_layout(name: str, library: ctypes.CDLL, structs: Structs) -> None:
    """Refuse a library that was compiled for other structs."""
    try:
        text = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(library, LAYOUT)))
    except ValueError:
        raise ValueError(
            f"{name} does not say for which structs it was compiled: write const char {LAYOUT}[] = "
            f"{LAYOUT.upper()}; in one of its files, with the header of 'mjspace law-header'"
        ) from None
    found, right = text.decode(errors="replace").split("; "), structs.layout.split("; ")
    for had, has in zip_longest(found, right, fillvalue="nothing"):
        if had != has:
            raise ValueError(
                f"{name} was compiled for {shortened(had)!r}, the scenario has {shortened(has)!r}: "
                "write the header again ('mjspace law-header') and compile"
            )


def _function(
    name: str, library: ctypes.CDLL, function: str, arguments: int, *, optional: bool = False
) -> Any:
    """Return a function of so many pointers; None where it is ``optional`` and not there."""
    try:
        found = library[function]
    except AttributeError:
        if optional:
            return None
        raise ValueError(f"{name} has no function {function!r}") from None
    found.argtypes = [ctypes.c_void_p] * arguments
    return found
