"""A law in another process, at the other end of a socket, in lockstep with the flight."""

import json
import socket
import time as clock
import weakref
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from mjspace.contract import DesiredMotion, Measurement
from mjspace.errors import input_error_at, shortened
from mjspace.ranges import numbers
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.flight_software.interface import (
    Field,
    Fields,
    Interface,
    interface_of,
    named_tuple,
)
from mjspace.simulation.flight_software.messages import (
    CLASSES,
    PROTOCOL,
    VERSION,
    Connection,
    Numbers,
    PeerError,
    declared,
    descriptors,
    fields_in,
)
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.simulation.user_code import ReturnError
from mjspace.units import to_si

ROUND_TRIP = "round_trip"
"""The signal that has the wall time from a call to its answer [s]: it differs in each flight."""
_TIMEOUT, _LONGEST = 10.0, 86400.0  # seconds


def fly_under(assembly: Assembly, law: Component, trust: Trust) -> Assembly:
    """Return the ``assembly``, which has no law yet, under the one that listens at an address.

    Raises:
        InputError: no law listens there; or it refuses its gains.
    """
    with input_error_at("law"):
        host, port = trust.address(law.kind)
        gains = law.gains
        timeout = _seconds(gains.pop("timeout", _TIMEOUT))
        interface = interface_of(assembly)
        try:
            flown = SocketLaw(str(law.kind), (host, port), timeout, gains, interface)
        except PeerError as error:
            raise ValueError(f"what listens at {law.kind} {error}") from error
    table = Component(kind=str(law.kind), **(law.gains | {"timeout": timeout}))
    return replace(
        assembly,
        scenario=assembly.scenario.model_copy(update={"law": table}),
        law=UnbatchedLaw(flown),
    )


class SocketLaw:
    """A law of one vehicle that asks another process; all memory of a flight is in its state."""

    compiled: ClassVar[bool] = False

    def __init__(
        self,
        name: str,
        address: tuple[str, int],
        timeout: float,
        gains: dict[str, Any],
        interface: Interface,
    ) -> None:
        """Connect, and tell the law its ``gains`` and what it will receive.

        Raises:
            PeerError: what listens is no law, or is late.
            ValueError: nothing listens, or the law refuses its gains.
        """
        self._name, self._timeout = name, timeout
        self._measurement = Numbers("Measurement", interface.measurement)
        self._reference = Numbers("Reference", interface.reference)
        self._declared: dict[str, tuple[Numbers, type]] = {}
        self._command = interface.command
        try:
            opened = socket.create_connection(address, timeout)
        except OSError as error:
            said = error.strerror or str(error)
            raise ValueError(
                f"no law listens at {name}: {said} (mjspace serve-law my_law.py:Law)"
            ) from error
        self._connection = Connection(opened)
        weakref.finalize(self, opened.close)
        greeting = self._connection.receive("Greeting", timeout)
        if (greeting.protocol, greeting.version) != (PROTOCOL, VERSION):
            spoken = shortened(f"{greeting.protocol!r} {greeting.version}")
            raise PeerError(f"speaks {spoken}, should be {PROTOCOL!r} {VERSION}")
        vehicle = Numbers("Vehicle", interface.vehicle)
        groups = [vehicle, self._measurement, self._reference, Numbers("Command", self._command)]
        begin = CLASSES["Begin"](
            gains=_in_json(gains),
            vehicle_fields=declared(interface.vehicle),
            measurement_fields=declared(interface.measurement),
            reference_fields=declared(interface.reference),
            command_fields=declared(interface.command),
            descriptors=descriptors(groups),
            vehicle=vehicle.encode(list(interface.facts.values())),
        )
        self._connection.send(begin)
        if refusal := self._connection.receive("Answer", timeout).error:
            raise ValueError(shortened(refusal, 1000))

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the law's state at the start of a flight.

        Raises:
            ReturnError: as ``step``.
        """
        answer = self._asked(self._call(0.0, measurement, reference, reset=True))
        return self._part("state", answer)

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return (state, command, signals) as the law answers; signals with ``ROUND_TRIP``.

        Raises:
            ReturnError: it is gone, late, or answers what it must not; or it says what went wrong.
        """
        call = self._call(time, measurement, reference)
        if state:
            call.state = self._declared["state"][0].encode(state)
        began = clock.perf_counter()
        answer = self._asked(call)
        taken = clock.perf_counter() - began
        return (
            self._part("state", answer),
            self._part("command", answer),
            self._part("signals", answer, np.array([taken])),
        )

    def _call(
        self,
        time: float,
        measurement: Measurement,
        reference: DesiredMotion,
        *,
        reset: bool = False,
    ) -> Any:
        measured = [getattr(measurement, name) for name in self._measurement.fields]
        return CLASSES["Call"](
            reset=reset,
            time=time,
            measurement=self._measurement.encode(measured),
            reference=self._reference.encode(reference),
        )

    def _asked(self, call: Any) -> Any:
        """Return the answer to a call."""
        try:
            self._connection.send(call)
            answer = self._connection.receive("Answer", self._timeout)
        except PeerError as error:
            raise ReturnError(f"the law at {self._name} {error}") from error
        if answer.error:
            raise ReturnError(shortened(answer.error, 1000))
        return answer

    def _part(self, name: str, answer: Any, *own: Any) -> Any:
        """Return the state, the command or the signals of an answer, and arrays of our ``own``."""
        try:
            if name not in self._declared:
                self._declared[name] = self._declaration(name, answer)
            message, kind = self._declared[name]
            arrays = [*message.decode(getattr(answer, name)), *own]
        except (PeerError, ValueError) as error:
            raise ReturnError(f"the law at {self._name} {error}") from error
        return kind(*arrays) if arrays else ()

    def _declaration(self, name: str, answer: Any) -> tuple[Numbers, type]:
        """Return what the first answer that may have such a part declares of it.

        Raises:
            PeerError: a signal has the name of the flight's own.
            ValueError: a field's name cannot be logged.
        """
        fields: Fields = fields_in(getattr(answer, f"{name}_fields"))
        if not fields and name == "command":
            fields = self._command
        everything = dict(fields)
        if name == "signals":
            if ROUND_TRIP in fields:
                raise PeerError(f"has a signal {ROUND_TRIP!r}, which the flight measures itself")
            everything[ROUND_TRIP] = Field((1,), "s")
        return Numbers(name.capitalize(), fields), named_tuple(name.capitalize(), everything)


def _in_json(gains: dict[str, Any]) -> str:
    """Return the gains in JSON; ValueError for a kind of value that it does not have, a date."""
    try:
        return json.dumps(gains)
    except TypeError:
        raise ValueError(
            f"gains: got {shortened(str(gains))}, should be numbers, texts, lists and tables"
        ) from None


def _seconds(value: Any) -> float:
    """Return the time within which the law has to answer [s]."""
    try:
        found = float(numbers(to_si(value, "s")))
    except (TypeError, ValueError) as error:
        raise ValueError(f"timeout: {error}") from None
    if not 0.0 < found <= _LONGEST:
        raise ValueError(f"timeout: got {value!r}, should be above 0 and at most {_LONGEST:g} s")
    return found
