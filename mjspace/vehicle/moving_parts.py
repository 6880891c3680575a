"""What the kinds of parts that are built by their tables share: geometry, sensors and the log."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import mujoco

from mjspace.contract import Array
from mjspace.scenario.mounted import MovingPart, Report
from mjspace.vehicle.step_effect import State, StepEffect

_SITES = 4  # their group, which no picture shows


def new_part() -> Any:
    """Return an empty ``MjSpec``, whose geoms are drawn and nothing else."""
    part = mujoco.MjSpec()
    drawn = part.default.geom
    drawn.contype = drawn.conaffinity = 0
    drawn.mass, drawn.group = 0.0, 2
    part.default.site.group = _SITES
    return part


def set_inertia(body: Any, mass: float, place: Array, moments: Array) -> None:
    """Set a body's mass [kg], centre (3,) [m] and moments (3,) [kg m^2] about its own axes."""
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, place, moments


def measure_place(part: Any, name: str, body: Any, place: Array) -> None:
    """Add a sensor called ``name``: where ``place`` (3,) of the ``body`` is in the part's axes."""
    part.worldbody.add_site(name=f"{name}_origin")
    body.add_site(name=f"{name}_point", pos=place)
    site = mujoco.mjtObj.mjOBJ_SITE
    part.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_FRAMEPOS,
        objtype=site,
        objname=f"{name}_point",
        reftype=site,
        refname=f"{name}_origin",
    )


def measure_joint(part: Any, name: str) -> None:
    """Add a sensor of the position of the joint of that ``name``."""
    kind, joint = mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtObj.mjOBJ_JOINT
    part.add_sensor(name=name, type=kind, objtype=joint, objname=name)


def reports(parts: Iterable[tuple[str, MovingPart]]) -> list[Report]:
    """Return what the log has of the parts by name, all names with the part's."""
    return [
        report._replace(field=f"{name}_{report.field}", sensor=f"{name}_{report.sensor}")
        for name, part in parts
        for report in part.reports()
    ]


@dataclass(frozen=True)
class LoggedParts(StepEffect):
    """Logs how the parts move, as fields of /truth."""

    name: ClassVar[str] = "the log of the parts"
    not_compiled = ""

    columns: Mapping[str, slice]
    """Of ``sensordata``, by the field."""

    @classmethod
    def of(cls, model: Any, found: Iterable[Report]) -> Self | None:
        """Return the effect for what the log is to have; None for nothing."""
        columns = {}
        for report in found:
            first = int(model.sensor(report.sensor).adr[0])
            columns[report.field] = slice(first + report.numbers.start, first + report.numbers.stop)
        return cls(columns) if columns else None

    def logged(self, memory: State, sensordata: Array) -> dict[str, Array]:
        """Return the fields."""
        return {name: sensordata[..., part] for name, part in self.columns.items()}
