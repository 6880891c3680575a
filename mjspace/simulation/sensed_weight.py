"""What gravity changes in a model's own accelerometers and sensors of force and torque.

MuJoCo counts its model's uniform gravity into them. A scenario's gravity differs from place to
place, and acts as a force on each body: what it would change is added here, as of a field that is
uniform over what the sensor carries.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
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
    """Of all that [kg], as the flight begins."""
    masses: Mapping[int, float]
    """Of each of its bodies [kg], likewise."""
    gravity: Callable[[Array], Array]
    """Returns it [m/s^2] at positions [m], both (..., 3)."""

    def felt(self, sensordata: Array, burning: Mapping[int, Array]) -> Array:
        """Return what gravity has in the reading, (N, 3), of rows (N, k) of MuJoCo's sensors.

        ``burning`` are the present masses [kg], (N,), of the bodies that lose propellant.
        """
        place = sensordata[:, self.place]
        if self.kind == "framelinacc":
            return self.gravity(place)
        if self.kind == "accelerometer":
            felt = self.gravity(place)
        else:
            centre = sensordata[:, self.centre]
            felt = self._mass(burning) * self.gravity(centre)
            if self.kind == "torque":
                felt = algebra.cross(centre - place, felt)
        return attitude.rotate(attitude.conjugate(sensordata[:, self.axes]), felt)

    def _mass(self, burning: Mapping[int, Array]) -> Any:
        """Return the mass [kg] that is carried: a number, or (N, 1) where some of it burns."""
        mass: Any = self.mass
        for body in sorted(burning.keys() & self.masses.keys()):
            mass = mass + (burning[body][:, None] - self.masses[body])
        return mass


def weights_of(
    model: Any, sensors: Sequence[ModelSensor], gravity: Callable[[Array], Array]
) -> Iterator[SensedWeight]:
    """Yield the part of ``gravity`` in each of the ``sensors`` that feels it."""
    for each in sensors:
        if each.kind in FEELS_GRAVITY:
            mass, masses, centre = 0.0, {}, slice(0, 0)
            if each.kind in CARRIES:
                carrier = int(model.site_bodyid[model.sensor(each.name).objid[0]])
                mass, masses = float(model.body_subtreemass[carrier]), _carried(model, carrier)
                centre = columns_of(model, each.name + CENTRE)
            place, axes = (columns_of(model, each.name + what) for what in (PLACE, AXES))
            yield SensedWeight(each.field, each.kind, place, axes, centre, mass, masses, gravity)


def _carried(model: Any, first: int) -> dict[int, float]:
    """Return the mass [kg] of the body ``first`` and of each that hangs on it."""
    carried: dict[int, float] = {}
    for body in range(first, model.nbody):  # a body comes after its parent
        if body == first or int(model.body_parentid[body]) in carried:
            carried[body] = float(model.body_mass[body])
    return carried
