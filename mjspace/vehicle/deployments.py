"""Parts that are deployed in flight: booms driven out on their slides, yo-yos that despin."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import mujoco
import numpy as np

from mjspace.contract import TICK, Array, Event
from mjspace.scenario.fields import Positive, Si, Table, Time
from mjspace.vehicle.step_effect import Instant, State, StepEffect

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

    def check(self, part: str) -> None:
        """Refuse a deployment that does not fit that part.

        Raises:
            ValueError: the part is not deployed, or needs other keys.
        """
        if part not in KINDS:
            raise ValueError(f"deployment: a {part} has none, a {' or a '.join(KINDS)} has")
        for kind, deployed in KINDS.items():
            present = [getattr(self, key) is not None for key in deployed.needs]
            fits = all(present) if kind == part else not any(present)
            if not fits:
                keys = " and ".join(deployed.needs)
                raise ValueError(f"deployment: {keys} are a {kind}'s, and it needs them")


class Deployable(NamedTuple):
    """What of a batch of vehicles a deployment acts on."""

    batch: Any
    """The ``mujoco.batch.Batch``."""
    ctrl: Array
    active: Array
    """``eq_active``."""
    qpos: Array
    qvel: Array


class Deployed(ABC):
    """Base of a kind of part that is deployed; what it remembers is in MuJoCo's state alone."""

    needs: ClassVar[tuple[str, ...]] = ()
    """Keys of the table that it needs, and no other kind takes."""

    @staticmethod
    @abstractmethod
    def prepare(part: Any, table: Deployment) -> None:
        """Change the part's ``MjSpec``, before it is attached, so that it is held until then."""

    @staticmethod  # noqa: B027
    def stow(model: Any, qpos: Array, name: str, table: Deployment) -> None:
        """Set the joints of the part of that name in ``qpos`` (nq,) to where it is held."""

    @classmethod
    @abstractmethod
    def of(cls, model: Any, qpos: Array, name: str, table: Deployment) -> Self:
        """Return the part of that name on a vehicle that begins at ``qpos`` (nq,)."""

    def bind(self, on: Deployable) -> None:  # noqa: B027
        """Bring the model of a batch up to what has been deployed already."""

    @abstractmethod
    def act(self, on: Deployable, now: float, step: float) -> list[Event]:
        """Act on the integration step of ``step`` [s] that begins at ``now`` [s]; report events."""


@dataclass(frozen=True)
class Boom(Deployed):
    """A boom's drive: its position loop is commanded the tip's desired distance."""

    needs: ClassVar[tuple[str, ...]] = ("length", "rate")

    name: str
    table: Deployment
    stowed: float
    """Distance of the tip at the start [m]."""
    motor: int
    """In ``ctrl``."""
    lead: float
    """Time by which the loop's command leads the desired distance, against its lag [s]."""

    @staticmethod
    def prepare(part: Any, table: Deployment) -> None:
        """Make the boom's motor a position loop, which MuJoCo closes in every stage."""
        drive, tip, w = part.actuator("drive"), part.body("tip"), table.bandwidth
        drive.gainprm[0] = tip.mass * w**2
        drive.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        drive.biasprm[:3] = [0.0, -tip.mass * w**2, -2.0 * tip.mass * w]

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
        """When the tip is commanded to rest [s]."""
        return self.table.at + abs(self._way) / (self.table.rate or 1.0) + self.table.ramp

    def desired(self, time: float) -> tuple[float, float]:
        """Return the tip's desired distance [m] and rate [m/s] at ``time`` [s]."""
        since = time - self.table.at
        cruise = self.end - self.table.ramp - self.table.at
        rate = np.copysign(self.table.rate or 0.0, self._way)
        begun, ended = self._ramp(since), self._ramp(since - cruise)
        return self.stowed + rate * (begun[0] - ended[0]), rate * (begun[1] - ended[1])

    def act(self, on: Deployable, now: float, step: float) -> list[Event]:
        """Command the drive for the middle of the step."""
        place, rate = self.desired(now + 0.5 * step)
        on.ctrl[:, self.motor] = place + self.lead * rate
        events: list[Event] = []
        for moment, what in ((self.table.at, "sets out"), (self.end, "is out")):
            if now - TICK <= moment < now + step - TICK:
                events += _events(now, np.arange(len(on.ctrl)), f"{self.name} {what}")
        return events

    def _ramp(self, since: float) -> tuple[float, float]:
        """Return the integral of what grows from 0 to 1 during the ramp, and that itself."""
        ramp = self.table.ramp
        if since >= ramp:
            return since - 0.5 * ramp, float(since > 0.0)
        return (0.5 * since**2 / ramp, since / ramp) if since > 0.0 else (0.0, 0.0)


@dataclass(frozen=True)
class YoYo(Deployed):
    """A weight on its cord: held, then unwinding, then gone.

    It is let go in the step that begins nearest to where its cord is off the drum; its mass is then
    removed from the model, so that the bus no longer carries it.
    """

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

    @staticmethod
    def prepare(part: Any, table: Deployment) -> None:
        """Hold the weight where little of its cord is off the drum."""
        held = part.equality("held")
        held.active = True
        held.data[0] = table.unwound - part.joint("unwind").ref

    @staticmethod
    def stow(model: Any, qpos: Array, name: str, table: Deployment) -> None:
        """Set the joints to where the weight is held."""
        unwind, pay_out = (model.joint(f"{name}_{what}") for what in ("unwind", "pay_out"))
        cord = pay_out.qpos0[0] / unwind.qpos0[0] * table.unwound
        qpos[[unwind.qposadr[0], pay_out.qposadr[0]]] = table.unwound, cord

    @classmethod
    def of(cls, model: Any, qpos: Array, name: str, table: Deployment) -> Self:
        """Return the yo-yo of that name."""
        held, wound = (model.equality(f"{name}_{what}").id for what in ("held", "wound"))
        joint = model.joint(f"{name}_unwind")
        place, speed = int(joint.qposadr[0]), int(joint.dofadr[0])
        weight = model.body(f"{name}_weight").id
        return cls(name, table.at, held, wound, weight, place, speed, float(joint.qpos0[0]))

    def bind(self, on: Deployable) -> None:
        """Remove weights that are gone already."""
        self._remove(on, on.active[:, [self.held, self.wound]].max(axis=1) == 0.0)

    def act(self, on: Deployable, now: float, step: float) -> list[Event]:
        """Release the weight, or let it go."""
        held, wound = on.active[:, self.held], on.active[:, self.wound]
        released = (held > 0.0) & (now >= self.at - TICK)
        held[released] = 0.0
        # The angle half a step from now.
        angle = on.qpos[:, self.place] + 0.5 * step * on.qvel[:, self.speed]
        off = (held == 0.0) & (wound > 0.0) & (angle >= self.all_off)
        wound[off] = 0.0
        self._remove(on, off)
        return _events(now, np.flatnonzero(released), f"{self.name} is released") + _events(
            now, np.flatnonzero(off), f"{self.name} is let go"
        )

    def _remove(self, on: Deployable, gone: Any) -> None:
        if gone.any():
            on.batch.expand("body_mass")[gone, self.weight] = GONE
            on.batch.set_const()


KINDS: dict[str, type[Deployed]] = {"boom": Boom, "yo_yo": YoYo}
"""The parts that are deployed, by their folder in assets/parts/. A line registers each."""


class Deployments(StepEffect):
    """What is deployed on a batch of vehicles; memory is in MuJoCo's state alone."""

    name: ClassVar[str] = "the deployment"
    every_step: ClassVar[bool] = True

    def __init__(self, deployed: list[Deployed], step: float) -> None:
        """Keep what is ``deployed``; ``step`` [s] is the integration's."""
        self._deployed, self._step = deployed, step
        self._on: Any = None

    def bind(self, batch: Any) -> None:
        """Take motors, equalities and joints."""
        arrays = (batch.bind(name) for name in ("ctrl", "eq_active", "qpos", "qvel"))
        self._on = Deployable(batch, *arrays)
        for each in self._deployed:
            each.bind(self._on)

    def before_step(self, memory: State, instant: Instant) -> State:
        """Let each act, and report it."""
        for each in self._deployed:
            instant.events.extend(each.act(self._on, instant.time, self._step))
        return memory


def of(model: Any, qpos: Array, parts: dict[str, Any], step: float) -> Deployments | None:
    """Return the deployments of the plant's ``parts``; None where there are none.

    ``qpos`` (nq,) is the vehicle's at the start, ``step`` [s] the integration's.
    """
    found = _deployed(parts)
    if not found:
        return None
    return Deployments([k.of(model, qpos, name, part.deployment) for k, name, part in found], step)


def stow(model: Any, qpos: Array, parts: dict[str, Any]) -> None:
    """Set in ``qpos`` the joints of those among ``parts`` that are held until they are deployed."""
    for kind, name, part in _deployed(parts):
        kind.stow(model, qpos, name, part.deployment)


def prepare(spec: Any, part: Any) -> None:
    """Prepare the ``MjSpec`` of a ``part`` for its deployment, if it has one."""
    if part.deployment is not None:
        KINDS[part.part].prepare(spec, part.deployment)


def _deployed(parts: dict[str, Any]) -> list[tuple[type[Deployed], str, Any]]:
    """Return kind, name and table of all that is deployed, those of one kind together."""
    return [
        (kind, name, part)
        for folder, kind in KINDS.items()
        for name, part in parts.items()
        if part.part == folder and part.deployment is not None
    ]


def _events(now: float, vehicles: Any, what: str) -> list[Event]:
    return [Event(now, int(vehicle), "INFO", f"deployment: {what}") for vehicle in vehicles]
