"""Parts that are deployed in flight: booms driven out on their slides, yo-yos that despin."""

from typing import Annotated, Any, ClassVar

import numpy as np

from mjspace.contract import TICK, Array
from mjspace.scenario.fields import Positive, Si, Table, Time
from mjspace.vehicle.deployed_parts import Boom, Deployable, Deployed, YoYo
from mjspace.vehicle.step_effect import Instant, State, StepEffect, Write


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


KINDS: dict[str, type[Deployed]] = {"boom": Boom, "yo_yo": YoYo}
"""The parts that are deployed, by their folder in assets/parts/. A line registers each."""


class Deployments(StepEffect):
    """What is deployed on a batch of vehicles; memory is in MuJoCo's state alone."""

    name: ClassVar[str] = "the deployment"
    every_step: ClassVar[bool] = True
    not_compiled = ""
    fields: ClassVar[tuple[str, ...]] = ("body_mass",)

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

    def prepare(
        self, memory: State, physics: Array, time: Array, known: Array
    ) -> tuple[list[Write], Array | None]:
        """Return what each writes, and where one has an event."""
        writes, reports = list[Write](), []
        for each in self._deployed:
            written, report = each.write(physics, time, self._step)
            writes += written
            reports += [] if report is None else [report]
        return writes, np.concatenate(reports, axis=-1) if reports else None

    def due(self, after: float) -> float:
        """Return when the next of them sets out, is released or is out."""
        moments = [moment for each in self._deployed for moment in each.moments]
        return min((moment for moment in moments if moment >= after - TICK), default=np.inf)


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
