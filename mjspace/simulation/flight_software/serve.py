"""The Python end of a socket: a law that flies in a process of its own."""

import json
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Measurement, Reference, Trajectory
from mjspace.errors import FlightError
from mjspace.scenario.construct import construct
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust
from mjspace.simulation.assembly import METHODS
from mjspace.simulation.flight_software.interface import Field, Fields
from mjspace.simulation.flight_software.messages import (
    CLASSES,
    PROTOCOL,
    VERSION,
    ClosedError,
    Connection,
    Numbers,
    PeerError,
    declared,
    fields_in,
)
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.simulation.user_code import read_only, sealed
from mjspace.units import units_of

BEGINS_WITHIN = 10.0
"""Seconds that what has connected may take to say what it is."""


def serve(
    law: Component, host: str, port: int, *, folder: Path, tell: Callable[[str], None]
) -> None:
    """Fly a ``law`` for every flight that connects to ``host`` and ``port``, each in a thread.

    Gains of the ``law`` come before those that a flight sends. ``tell`` is told in a line where it
    listens, and of a flight that did not end well. Port 0 is any that is free. It ends with an
    exception, as that of Ctrl-C.

    Raises:
        ValueError: no such law, or it has an inner loop.
        OSError: it cannot listen there.
    """
    kind = Trust(folder, everything=True).load_class(law.kind, METHODS["law"])
    if hasattr(kind, "inner"):
        raise ValueError(f"{law.kind} has an inner loop, which flies in the flight's process alone")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.create_server((host, port), family=family) as listener:
        place = f"[{host}]" if ":" in host else host
        tell(f"{law.kind} listens at tcp://{place}:{listener.getsockname()[1]}; Ctrl-C ends it")
        while True:
            opened, _ = listener.accept()
            arguments = Connection(opened), law, kind, Trust(folder), tell
            Thread(target=_serve_flight, args=arguments, daemon=True).start()


def _serve_flight(
    connection: Connection,
    law: Component,
    kind: type,
    trust: Trust,
    tell: Callable[[str], None],
) -> None:
    """Serve one flight, with a law of its own, until it closes the connection."""
    with connection:
        try:
            _answer(connection, law, kind, trust)
        except PeerError as error:
            tell(f"a flight {error}")


def _answer(connection: Connection, law: Component, kind: type, trust: Trust) -> None:
    """Answer all that a flight calls.

    What it sends as gains names no code and no file beyond what ``trust`` allows.

    Raises:
        PeerError: it says what it must not.
    """
    connection.send(CLASSES["Greeting"](protocol=PROTOCOL, version=VERSION))
    begin = connection.receive("Begin", BEGINS_WITHIN)
    try:
        vehicle = Numbers("Vehicle", fields_in(begin.vehicle_fields))
        values = [a if a.ndim else float(a) for a in vehicle.decode(begin.vehicle)]
        constants = dict(zip(vehicle.fields, values, strict=True))
        gains = json.loads(begin.gains or "{}") | law.gains
        built, _ = construct(Component(kind=law.kind, **gains), kind, constants, trust)
    except (ValueError, TypeError) as error:
        connection.send(CLASSES["Answer"](error=str(error)))
        return
    connection.send(CLASSES["Answer"]())
    served = _ServedLaw(built, begin)
    with suppress(ClosedError):
        while True:
            call = connection.receive("Call")
            try:
                answer = served.answer(call)
            except FlightError as error:
                answer = CLASSES["Answer"](error=str(error))
            connection.send(answer)


class _ServedLaw:
    """A law that answers the calls of one flight; arrays have a vehicle axis of one."""

    def __init__(self, law: Any, begin: Any) -> None:
        self._law = FlownLaw(law if getattr(law, "batched", False) else UnbatchedLaw(law), None, 1)
        measured = fields_in(begin.measurement_fields)
        self._measurement = Numbers("Measurement", measured)
        of_sensors = {name: field.measures for name, field in measured.items()}
        self._measured = Measurement._with_sensors(of_sensors)
        desired = fields_in(begin.reference_fields)
        self._reference = Numbers("Reference", desired)
        self._desired = _kind_of_reference(desired)
        self._kind_of_state: Any = None
        self._numbers: dict[str, Numbers] = {}

    def answer(self, call: Any) -> Any:
        """Return the answer to a call.

        Raises:
            FlightError: the law raised, or returned what it must not.
            PeerError: the call is damaged.
        """
        measured = self._measurement.decode(call.measurement)
        arrays = dict(zip(self._measurement.fields, (a[None] for a in measured), strict=True))
        measurement = sealed(self._measured(**arrays))
        reference = read_only(self._desired(*self._reference.decode(call.reference)))
        answer = CLASSES["Answer"]()
        if call.reset or self._kind_of_state is None:
            self._law.reset(measurement, reference)
            self._kind_of_state = type(self._law.state)
            self._put(answer, "state", self._law.state)
        if not call.reset:
            state = [array[None] for array in self._numbers["state"].decode(call.state)]
            self._law.state = read_only(self._kind_of_state(*state)) if state else ()
            _, command, signals = self._law.step(call.time, measurement, reference)
            self._put(answer, "command", command)
            self._put(answer, "signals", signals)
        self._put(answer, "state", self._law.state)
        return answer

    def _put(self, answer: Any, name: str, arrays: Any) -> None:
        """Put a named tuple of the law into the answer; with its fields, in the first that has."""
        if name not in self._numbers:
            self._numbers[name] = _numbers(name.capitalize(), arrays)
            getattr(answer, f"{name}_fields").extend(declared(self._numbers[name].fields))
        setattr(answer, name, self._numbers[name].encode([array[0] for array in arrays]))


def _numbers(message: str, arrays: Any) -> Numbers:
    """Return the message of a law's named tuple, whose arrays have a vehicle axis."""
    units = units_of(type(arrays))
    fields = {
        name: Field(np.shape(array)[1:], units[name].si if name in units else "")
        for name, array in zip(getattr(arrays, "_fields", ()), arrays, strict=True)
    }
    try:
        return Numbers(message, fields)
    except ValueError as error:
        raise FlightError(f"the law's {message.lower()}: {error}") from error


def _kind_of_reference(fields: Fields) -> Any:
    """Return the class of named tuples of the reference, the contract's own where it is that."""
    for kind in (Reference, Trajectory):
        if kind._fields == tuple(fields):
            return kind
    return NamedTuple("Reference", [(name, np.ndarray) for name in fields])
