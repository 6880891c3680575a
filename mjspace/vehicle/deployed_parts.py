"""Booms and yo-yos in flight: what each does in an integration step."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import mujoco
import numpy as np

from mjspace.contract import TICK, Array, Event
from mjspace.vehicle.step_effect import Write

if TYPE_CHECKING:
    from mjspace.vehicle.deployments import Deployment

GONE = 1e-12
"""kg left of a weight that was let go: it flies on without being felt."""


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
    def prepare(part: Any, table: "Deployment") -> None:
        """Change the part's ``MjSpec``, before it is attached, so that it is held until then."""

    @staticmethod  # noqa: B027
    def stow(model: Any, qpos: Array, name: str, table: "Deployment") -> None:
        """Set the joints of the part of that name in ``qpos`` (nq,) to where it is held."""

    @classmethod
    @abstractmethod
    def of(cls, model: Any, qpos: Array, name: str, table: "Deployment") -> Self:
        """Return the part of that name on a vehicle that begins at ``qpos`` (nq,)."""

    def bind(self, on: Deployable) -> None:  # noqa: B027
        """Bring the model of a batch up to what has been deployed already."""

    @abstractmethod
    def act(self, on: Deployable, now: float, step: float) -> list[Event]:
        """Act on the integration step of ``step`` [s] that begins at ``now`` [s]; report events."""

    @property
    @abstractmethod
    def moments(self) -> tuple[float, ...]:
        """When it is sure to have an event [s]."""

    @abstractmethod
    def write(self, physics: Array, time: Any, step: float) -> tuple[list[Write], Array | None]:
        """Return what it writes in a step without an event, and whether there is one.

        Array code, as ``StepEffect.prepare``.
        """


@dataclass(frozen=True)
class Boom(Deployed):
    """A boom's drive: its position loop is commanded the tip's desired distance."""

    needs: ClassVar[tuple[str, ...]] = ("length", "rate")

    name: str
    table: "Deployment"
    stowed: float
    """Distance of the tip at the start [m]."""
    motor: int
    """In ``ctrl``."""
    lead: float
    """Time by which the loop's command leads the desired distance, against its lag [s]."""

    @staticmethod
    def prepare(part: Any, table: "Deployment") -> None:
        """Make the boom's motor a position loop, which MuJoCo closes in every stage."""
        drive, tip, w = part.actuator("drive"), part.body("tip"), table.bandwidth
        drive.gainprm[0] = tip.mass * w**2
        drive.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        drive.biasprm[:3] = [0.0, -tip.mass * w**2, -2.0 * tip.mass * w]

    @classmethod
    def of(cls, model: Any, qpos: Array, name: str, table: "Deployment") -> Self:
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

    def desired(self, time: Any) -> tuple[Any, Any]:
        """Return the tip's desired distance [m] and rate [m/s] at ``time`` [s]."""
        since = time - self.table.at
        cruise = self.end - self.table.ramp - self.table.at
        rate = np.copysign(self.table.rate or 0.0, self._way)
        begun, ended = self._ramp(since), self._ramp(since - cruise)
        return self.stowed + rate * (begun[0] - ended[0]), rate * (begun[1] - ended[1])

    def act(self, on: Deployable, now: float, step: float) -> list[Event]:
        """Command the drive for the middle of the step."""
        on.ctrl[:, self.motor] = self._commanded(now, step)
        events: list[Event] = []
        for moment, what in zip(self.moments, ("sets out", "is out"), strict=True):
            if now - TICK <= moment < now + step - TICK:
                events += _events(now, np.arange(len(on.ctrl)), f"{self.name} {what}")
        return events

    @property
    def moments(self) -> tuple[float, ...]:
        """When it sets out, and when it is out."""
        return self.table.at, self.end

    def write(self, physics: Array, time: Any, step: float) -> tuple[list[Write], Array | None]:
        """Return the drive's command."""
        commanded = self._commanded(time, step)
        return [Write("ctrl", self.motor, np.reshape(commanded, (1, 1)))], None

    def _commanded(self, now: Any, step: float) -> Any:
        place, rate = self.desired(now + 0.5 * step)
        return place + self.lead * rate

    def _ramp(self, since: Any) -> tuple[Any, Any]:
        """Return the integral of what grows from 0 to 1 during the ramp, and that itself."""
        ramp = self.table.ramp
        area, height = (0.5 * since**2 / ramp, since / ramp) if ramp else (0.0, 0.0)
        begun, grown = since > 0.0, since >= ramp
        area = np.where(grown, since - 0.5 * ramp, np.where(begun, area, 0.0))
        return area, np.where(begun, np.where(grown, 1.0, height), 0.0)


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
    columns: tuple[int, int, int, int]
    """Of these four in a row of the integration state."""
    all_off: float
    """The angle at which no cord is left on the drum [rad]."""

    @staticmethod
    def prepare(part: Any, table: "Deployment") -> None:
        """Hold the weight where little of its cord is off the drum."""
        held = part.equality("held")
        held.active = True
        held.data[0] = table.unwound - part.joint("unwind").ref

    @staticmethod
    def stow(model: Any, qpos: Array, name: str, table: "Deployment") -> None:
        """Set the joints to where the weight is held."""
        unwind, pay_out = (model.joint(f"{name}_{what}") for what in ("unwind", "pay_out"))
        cord = pay_out.qpos0[0] / unwind.qpos0[0] * table.unwound
        qpos[[unwind.qposadr[0], pay_out.qposadr[0]]] = table.unwound, cord

    @classmethod
    def of(cls, model: Any, qpos: Array, name: str, table: "Deployment") -> Self:
        """Return the yo-yo of that name."""
        held, wound = (model.equality(f"{name}_{what}").id for what in ("held", "wound"))
        joint = model.joint(f"{name}_unwind")
        place, speed = int(joint.qposadr[0]), int(joint.dofadr[0])
        weight = model.body(f"{name}_weight").id
        of_state = int(mujoco.mjtState.mjSTATE_INTEGRATION)
        active, qpos, qvel = (
            mujoco.mj_stateSize(model, of_state & (int(component) - 1))
            for component in (
                mujoco.mjtState.mjSTATE_EQ_ACTIVE,
                mujoco.mjtState.mjSTATE_QPOS,
                mujoco.mjtState.mjSTATE_QVEL,
            )
        )
        columns = int(active + held), int(active + wound), int(qpos + place), int(qvel + speed)
        all_off = float(joint.qpos0[0])
        return cls(name, table.at, held, wound, weight, place, speed, columns, all_off)

    def bind(self, on: Deployable) -> None:
        """Remove weights that are gone already."""
        self._remove(on, on.active[:, [self.held, self.wound]].max(axis=1) == 0.0)

    def act(self, on: Deployable, now: float, step: float) -> list[Event]:
        """Release the weight, or let it go."""
        held, wound = on.active[:, self.held], on.active[:, self.wound]
        released = (held > 0.0) & (now >= self.at - TICK)
        held[released] = 0.0
        off = self._is_off(held, wound, on.qpos[:, self.place], on.qvel[:, self.speed], step)
        wound[off] = 0.0
        self._remove(on, off)
        return _events(now, np.flatnonzero(released), f"{self.name} is released") + _events(
            now, np.flatnonzero(off), f"{self.name} is let go"
        )

    @property
    def moments(self) -> tuple[float, ...]:
        """When it is released."""
        return (self.at,)

    def write(self, physics: Array, time: Any, step: float) -> tuple[list[Write], Array | None]:
        """Return nothing to write, and where the weight is let go."""
        held, wound, angle, rate = (physics[:, column] for column in self.columns)
        return [], self._is_off(held, wound, angle, rate, step)[:, None]

    def _is_off(self, held: Any, wound: Any, angle: Any, rate: Any, step: float) -> Any:
        """Return whether no cord is left on the drum half a ``step`` from now."""
        return (held == 0.0) & (wound > 0.0) & (angle + 0.5 * step * rate >= self.all_off)

    def _remove(self, on: Deployable, gone: Any) -> None:
        if gone.any():
            on.batch.expand("body_mass")[gone, self.weight] = GONE
            on.batch.set_const()


def _events(now: float, vehicles: Any, what: str) -> list[Event]:
    return [Event(now, int(vehicle), "INFO", f"deployment: {what}") for vehicle in vehicles]
