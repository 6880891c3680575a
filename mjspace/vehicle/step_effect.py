"""Step effects: what acts on the vehicles in flight besides actuators and environment."""

import math
from abc import ABC
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Event, Measurement

State = dict[str, Array]
"""Named arrays that are remembered from step to step, vehicle axis first."""


Topics = Mapping[str, Any]
"""Named tuples of arrays by the topic that they are logged in."""


class Instant(NamedTuple):
    """The beginning of an integration step, as every effect receives it; arrays are read-only."""

    time: float
    """Simulation time [s]."""
    physics: Array
    """MuJoCo's integration state, (N, nstate)."""
    truth: Measurement
    """Between control instants only attitude, rate, wheels and gimbals, unless an effect of the
    flight ``needs_truth``; fields (N, ...)."""
    measurement: Measurement
    """The sensors' latest report; between control instants, where none is due, the truth."""
    command: Any
    """The law's command, a named tuple; None between control instants."""
    signals: Any
    """The law's signals, a named tuple, which may be empty; None between control instants."""
    memory: State
    """What actuators and effects remembered before the actuators acted."""
    events: list[Event]
    """What has happened in this control period; an effect appends what it reports."""

    @property
    def is_control(self) -> bool:
        """Whether it is a control instant: the law has just stepped."""
        return self.command is not None


class Write(NamedTuple):
    """Numbers for one of MuJoCo's arrays."""

    array: str
    """Its name."""
    first: int
    """How many numbers of a vehicle's stand before them."""
    values: Array
    """(N, k)."""


class StepEffect(ABC):
    """Base of an effect on a batch of vehicles: override what it does, the rest does nothing.

    ``memory`` is what the actuators and all effects remember. An effect returns it with changes to
    its own names, never changed in place; what it holds is logged in /state, under
    ``actuator_<name>``, and a replay starts from it. An effect remembers nothing elsewhere.

    In a control period the order is: ``weigh``; ``observe``; the sensors and the law;
    ``at_control``; then for each integration step the actuators, ``change``, ``before_step``,
    MuJoCo, ``after_step``.

    Where an effect is compiled, its methods of array code (``look``, ``add_to_truth``, ``alarm``,
    ``change``, ``follow``, ``prepare``, ``masses``) are taken down. They stand for all that it does
    in each period but those that are ``due`` and those in which they report an event: Python flies
    these.
    """

    name: ClassVar[str]
    """As error messages name it, with its article: "the disturbance"."""
    every_step: ClassVar[bool] = False
    """Whether it acts in every integration step; else only in the first of a control period."""
    needs_truth: ClassVar[bool] = False
    """Whether it needs the whole truth in every integration step, and not turning alone."""
    not_compiled: str = "it is called in Python"
    """Why a flight with it is flown in Python; "" where it is compiled."""
    looks: ClassVar[bool] = False
    """Whether it has a ``look``, at each control instant and, if it acts in them, each integration
    step."""
    of_forces: bool = False
    """Whether what it looks at at control instants depends on forces, which are then evaluated."""
    waits: bool = False
    """Whether it has an ``alarm``, at each control instant."""
    fields: ClassVar[tuple[str, ...]] = ()
    """Of MuJoCo's model, those that it changes with an event."""
    wrench: Array | None = None
    """Force [N], inertial axes, and torque [N m], body axes, on the bus during the step that
    ``before_step`` has prepared, (N, 6). Those of all effects are added up, applied and logged in
    /disturbance. None for an effect that never applies any."""

    def bind(self, batch: Any) -> None:  # noqa: B027
        """Take from the flight's ``mujoco.batch.Batch`` what is needed to act on it."""

    def reset(self, physics: Array) -> State:
        """Return what it remembers at the start of a flight, at ``physics`` (N, nstate)."""
        return {}

    def weigh(self, memory: State) -> None:  # noqa: B027
        """Set the masses of a control instant, before any effect observes it."""

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        """Return the memory at a control instant, before the truth is computed from it."""
        return memory

    def add_to_truth(self, memory: State, truth: Measurement) -> Measurement:
        """Return the truth with what it adds; arrays may have a period axis before the vehicles'.

        ``truth`` fields and ``memory`` are (N, ...), or (n, N, ...) for the rows of a log.
        """
        return truth

    def at_control(self, memory: State, instant: Instant) -> State:
        """Return the memory at a control instant, after the law and before the actuators."""
        return memory

    def change(
        self, memory: State, applied: tuple[Array, ...], instant: Instant
    ) -> tuple[State, tuple[Array, ...]]:
        """Return (memory, what the actuators apply instead of ``applied``), whenever they act."""
        return memory, applied

    def before_step(self, memory: State, instant: Instant) -> State:
        """Act on the batch for the integration step that begins; return the memory."""
        return memory

    def after_step(self, memory: State, instant: Instant) -> State:
        """Return the memory after the step that began at ``instant``.

        MuJoCo's derived fields, such as ``sensordata``, describe ``instant`` then, and the batch's
        state the end of the step.
        """
        return memory

    def look(self, memory: State, physics: Array, sensordata: Array) -> tuple[State, Array]:
        """Return (memory, report) from the state ``physics`` (N, nstate) and its sensors (N, k).

        Of a compiled effect. The report (N, 1) is True where there is an event to be told.
        """
        return memory, np.zeros((len(physics), 1), bool)

    def alarm(self, memory: State, topics: Topics) -> Array:
        """Return where there is an event to be told at a control instant, True or False (N, 1).

        Of a compiled effect, after the law's step. ``topics`` has the named tuples "truth",
        "measurement", "command" and "law".
        """
        return np.zeros((1, 1), bool)

    def follow(self, memory: State, physics: Array, known: Array) -> State:
        """Return the memory for the step that begins at ``physics`` (N, nstate).

        Of a compiled effect, before any is asked to ``prepare``; ``known`` as there.
        """
        return memory

    def prepare(
        self, memory: State, physics: Array, time: Array, known: Array
    ) -> tuple[list[Write], Array | None]:
        """Return (what it writes into MuJoCo's data, report) for the step that begins at ``time``.

        Of a compiled effect. The report is as that of ``look``, or None; ``known`` (k,) is of the
        control instant before.
        """
        return [], None

    def due(self, after: float) -> float:
        """Return the first instant from ``after`` on at which it is sure to have an event [s].

        Of a compiled effect; infinite where there is none.
        """
        return math.inf

    def known(self, times: Array) -> Array:
        """Return what is known beforehand of control instants at ``times`` (n,) [s], (n, k)."""
        return np.zeros((len(times), 0))

    def around(self, surroundings: Any, known: Array) -> Any:
        """Return the ``sensors.base.Surroundings`` with what of them is ``known`` beforehand."""
        return surroundings

    def masses(self, before: State, after: State) -> list[tuple[str, int, Array]]:
        """Return masses and inertias for the step that leads from ``before`` to ``after``.

        Of a compiled effect: the field of MuJoCo's model, its body, and the values (N, ...). They
        are those of a control instant where ``before`` and ``after`` are what is remembered then.
        """
        return []

    def logged(self, memory: State, sensordata: Array) -> dict[str, Array]:
        """Return fields of /truth that it adds to the log, (n, N, k), from rows of a flight."""
        return {}
