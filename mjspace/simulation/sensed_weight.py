"""What gravity changes in a model's own accelerometers and sensors of force and torque.

MuJoCo counts its model's uniform gravity into them. A scenario's gravity differs from place to
place, and acts as a force on each body: what it would change is added here, as of a field that is
uniform over what the sensor carries.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from mjspace import algebra, attitude
from mjspace.contract import Array
from mjspace.vehicle.indices import columns_of
from mjspace.vehicle.model_sensors import AXES, CARRIES, CENTRE, FEELS_GRAVITY, PLACE, ModelSensor


@dataclass(frozen=True)
class SensedWeight:
    """The part of gravity in what a sensor reports."""

    field: str
    """Of the measurement."""
    kind: str
    """MuJoCo's: "accelerometer", "framelinacc", "force" or "torque"."""
    place: slice
    """In ``sensordata``: where the sensor is, inertial axes [m]."""
    axes: slice
    """Likewise: its quaternion, scalar first."""
    centre: slice
    """Likewise: the centre of mass of all that is carried through it [m]; else empty."""
    mass: float
    """Of all that [kg]."""
    gravity: Callable[[Array], Array]
    """Returns it [m/s^2] at positions [m], both (..., 3)."""

    def felt(self, sensordata: Array) -> Array:
        """Return what gravity has in the reading, (N, 3), of rows (N, k) of MuJoCo's sensors."""
        place = sensordata[:, self.place]
        if self.kind == "framelinacc":
            return self.gravity(place)
        if self.kind == "accelerometer":
            felt = self.gravity(place)
        else:
            centre = sensordata[:, self.centre]
            felt = self.mass * self.gravity(centre)
            if self.kind == "torque":
                felt = algebra.cross(centre - place, felt)
        return attitude.rotate(attitude.conjugate(sensordata[:, self.axes]), felt)


def weights_of(
    model: Any, sensors: Sequence[ModelSensor], gravity: Callable[[Array], Array]
) -> Iterator[SensedWeight]:
    """Yield the part of ``gravity`` in each of the ``sensors`` that feels it."""
    for each in sensors:
        if each.kind in FEELS_GRAVITY:
            site, mass, centre = model.sensor(each.name).objid[0], 0.0, slice(0, 0)
            if each.kind in CARRIES:
                mass = float(model.body_subtreemass[model.site_bodyid[site]])
                centre = columns_of(model, each.name + CENTRE)
            place, axes = (columns_of(model, each.name + what) for what in (PLACE, AXES))
            yield SensedWeight(each.field, each.kind, place, axes, centre, mass, gravity)
