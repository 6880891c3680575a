"""Parts that are deployed in flight: booms driven out on their slides, yo-yos that despin."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np

from mjspace.contract import TICK, Array, Event
from mjspace.scenario.fields import Positive, Si, Table, Time

GONE = 1e-12
"""kg left of a weight that was let go: it flies on without being felt."""


class Deployment(Table):
    """When a boom or a yo-yo goes out, and how."""

    at: Time
    """When it begins; until then it is held."""
    length: Annotated[Positive, Si("m")] | None = None
    """Of a boom: where its tip goes, from the part's origin."""
    rate: Annotated[Positive, Si("m/s")] | None = None
    """Of a boom: how fast."""
    ramp: Time = 0.0
    """Of a boom: for how long the rate grows evenly, and falls again at the end."""
    bandwidth: Annotated[Positive, Si("rad/s")] = 1.0
    """Of the boom's position loop, critically damped: well above the spin, or the pull on the tip
    wins; well below one over the integration step."""
    unwound: Annotated[Positive, Si("rad")] = 0.1
    """Of a yo-yo: cord off the drum while it is held. With none, turning and sliding would be one
    motion."""


@dataclass(frozen=True)
class Boom:
    """A boom's drive: its position loop is commanded where the tip is to be."""

    name: str
    table: Deployment
    stowed: float
    """Distance of the tip at the start [m]."""
    motor: int
    """In ``ctrl``."""
    lead: float
    """By which the loop's command leads the desired place, against its lag [s]."""

    @classmethod
    def of(cls, model: Any, qpos: Array, name: str, table: Deployment) -> Self:
        """Return the drive of the boom of that name, which begins at ``qpos`` (nq,)."""
        drive, joint = model.actuator(f"{name}_drive"), model.joint(f"{name}_deploy")
        stowed = float(qpos[joint.qposadr[0]])
        return cls(name, table, stowed, drive.id, float(drive.biasprm[2] / drive.biasprm[1]))

    @property
    def _way(self) -> float:
        return (self.table.length or 0.0) - self.stowed

    @property
    def end(self) -> float:
        """When the desired tip comes to rest [s]."""
        return self.table.at + abs(self._way) / (self.table.rate or 1.0) + self.table.ramp

    def desired(self, time: float) -> tuple[float, float]:
        """Return where the tip is to be [m], and how fast [m/s]."""
        since = time - self.table.at
        cruise = self.end - self.table.ramp - self.table.at
        rate = np.copysign(self.table.rate or 0.0, self._way)
        begun, ended = self._ramp(since), self._ramp(since - cruise)
        return self.stowed + rate * (begun[0] - ended[0]), rate * (begun[1] - ended[1])

    def _ramp(self, since: float) -> tuple[float, float]:
        """Return the integral of what grows from 0 to 1 during the ramp, and that itself."""
        ramp = self.table.ramp
        if since >= ramp:
            return since - 0.5 * ramp, float(since > 0.0)
        return (0.5 * since**2 / ramp, since / ramp) if since > 0.0 else (0.0, 0.0)


@dataclass(frozen=True)
class YoYo:
    """A weight on its cord: held, then unwinding, then gone."""

    name: str
    at: float
    """When it is released [s]."""
    held: int
    """The equality that holds the weight, in ``eq_active``."""
    wound: int
    """The equality that is its cord."""
    weight: int
    """Its body."""
    place: int
    """Of the unwound angle, in ``qpos``."""
    speed: int
    """Of its rate, in ``qvel``."""
    all_off: float
    """The angle at which no cord is left on the drum [rad]."""

    @classmethod
    def of(cls, model: Any, name: str, table: Deployment) -> Self:
        """Return the yo-yo of that name."""
        held, wound = (model.equality(f"{name}_{what}").id for what in ("held", "wound"))
        joint = model.joint(f"{name}_unwind")
        place, speed = int(joint.qposadr[0]), int(joint.dofadr[0])
        weight = model.body(f"{name}_weight").id
        return cls(name, table.at, held, wound, weight, place, speed, float(joint.qpos0[0]))


class Deployments:
    """What is deployed on a batch of vehicles; memory is in MuJoCo's state alone.

    To be called at the beginning of every integration step. A weight is let go in the step that
    begins nearest to where its cord is off the drum; of what is let go no mass is left, so that
    the bus is rid of it.
    """

    def __init__(self, booms: list[Boom], yo_yos: list[YoYo], batch: Any, step: float) -> None:
        """Bind the ``batch`` (``mujoco.batch.Batch``); ``step`` [s] is the integration's."""
        self._booms, self._yo_yos, self._step, self._batch = booms, yo_yos, step, batch
        self._ctrl, self._active = batch.bind("ctrl"), batch.bind("eq_active")
        self._qpos, self._qvel = batch.bind("qpos"), batch.bind("qvel")
        for yo_yo in yo_yos:
            self._forget(yo_yo, self._active[:, [yo_yo.held, yo_yo.wound]].max(axis=1) == 0.0)

    def __call__(self, now: float) -> list[Event]:
        """Act for the step that begins at ``now`` [s] and return what happens."""
        events: list[Event] = []
        for boom in self._booms:
            place, rate = boom.desired(now + 0.5 * self._step)
            self._ctrl[:, boom.motor] = place + boom.lead * rate
            for moment, what in ((boom.table.at, "sets out"), (boom.end, "is out")):
                if now - TICK <= moment < now + self._step - TICK:
                    everyone = np.arange(len(self._ctrl))
                    events += _events(now, everyone, f"{boom.name} {what}")
        for yo_yo in self._yo_yos:
            events += self._unwind(yo_yo, now)
        return events

    def _unwind(self, yo_yo: YoYo, now: float) -> list[Event]:
        held, wound = self._active[:, yo_yo.held], self._active[:, yo_yo.wound]
        released = (held > 0.0) & (now >= yo_yo.at - TICK)
        held[released] = 0.0
        # Where it will be half a step from now.
        angle = self._qpos[:, yo_yo.place] + 0.5 * self._step * self._qvel[:, yo_yo.speed]
        off = (held == 0.0) & (wound > 0.0) & (angle >= yo_yo.all_off)
        wound[off] = 0.0
        self._forget(yo_yo, off)
        return _events(now, np.flatnonzero(released), f"{yo_yo.name} is released") + _events(
            now, np.flatnonzero(off), f"{yo_yo.name} is let go"
        )

    def _forget(self, yo_yo: YoYo, gone: Any) -> None:
        if gone.any():
            self._batch.expand("body_mass")[gone, yo_yo.weight] = GONE
            self._batch.set_const()


def of(
    model: Any, qpos: Array, parts: dict[str, Any], step: float
) -> Callable[[Any], Deployments] | None:
    """Return what makes a batch's ``Deployments`` of the plant's ``parts``; None where none is.

    ``qpos`` (nq,) is where the vehicle starts, ``step`` [s] the integration's.
    """
    deployed = {name: part for name, part in parts.items() if part.deployment is not None}
    if not deployed:
        return None
    booms = [
        Boom.of(model, qpos, name, part.deployment)
        for name, part in deployed.items()
        if part.part == "boom"
    ]
    yo_yos = [
        YoYo.of(model, name, part.deployment)
        for name, part in deployed.items()
        if part.part == "yo_yo"
    ]
    return lambda batch: Deployments(booms, yo_yos, batch, step)


def stow(model: Any, qpos: Array, parts: dict[str, Any]) -> None:
    """Put the weights of the yo-yos among the plant's ``parts`` where they are held."""
    for name, part in parts.items():
        if part.part == "yo_yo" and part.deployment is not None:
            angle = part.deployment.unwound
            unwind, pay_out = (model.joint(f"{name}_{what}") for what in ("unwind", "pay_out"))
            cord = pay_out.qpos0[0] / unwind.qpos0[0] * angle
            qpos[[unwind.qposadr[0], pay_out.qposadr[0]]] = angle, cord


def _events(now: float, vehicles: Any, what: str) -> list[Event]:
    return [Event(now, int(vehicle), "INFO", f"deployment: {what}") for vehicle in vehicles]
