"""Where a vehicle's motion stands in a row of MuJoCo's integration state."""

from typing import Any

import mujoco
import numpy as np

from mjspace.actuators.base import DIPOLE
from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement, Truth
from mjspace.environment.magnetic_field import MOMENT
from mjspace.scenario.sensors import ALWAYS, kind_of
from mjspace.sensors.base import Motion
from mjspace.sensors.magnetometer import Magnetometer
from mjspace.sensors.velocimeter import Velocimeter
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.boresights import angles_at
from mjspace.simulation.sunlight import Sunlight, sunlight_at
from mjspace.simulation.whereabouts import Whereabouts, whereabouts_at

_TRANSLATION = ("position", "velocity", "altitude")
"""Quantities that the truth has wherever a sensor measures the bus's translation."""
_BEFORE_USERDATA = mujoco.mjtState.mjSTATE_INTEGRATION & (mujoco.mjtState.mjSTATE_USERDATA - 1)
"""MuJoCo's parts of a row before the environment's parameters."""
_VELOCIMETER, _MAGNETOMETER = Velocimeter(), Magnetometer()


class StateLayout:
    """Where things stand in a row of MuJoCo's integration state."""

    def __init__(self, assembly: Assembly) -> None:
        model = assembly.vehicle.model
        before_qpos = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_TIME)
        before_qvel = before_qpos + model.nq
        self.moving = slice(before_qpos, before_qvel + model.nv)
        # The free joint comes first; its angular velocity is in body axes, its linear in inertial.
        self.position = slice(before_qpos, before_qpos + 3)
        self.attitude = slice(before_qpos + 3, before_qpos + 7)
        self.velocity = slice(before_qvel, before_qvel + 3)
        self.rate = slice(before_qvel + 3, before_qvel + 6)
        vehicle = assembly.vehicle
        self.wheel_speed = _columns(before_qvel + vehicle.wheel_dof)
        self.gimbal_angle = _columns(before_qpos + vehicle.gimbal_qpos)
        self.gimbal_rate = _columns(before_qvel + vehicle.gimbal_dof)
        self.wheel_angle = _columns(before_qpos + vehicle.wheel_qpos)
        self.struts = _columns(before_qpos + vehicle.strut_qpos)
        self.feet = len(vehicle.strut_qpos)
        sensors = assembly.scenario.sensors
        kinds = {sensor.quantity(name): sensor for name, sensor in sensors.items()}
        if any(sensor.of_translation for sensor in kinds.values()):
            kinds = {name: kind_of(name)() for name in _TRANSLATION} | kinds
        if any(sensor.measures == "magnetic_field" for sensor in kinds.values()):
            kinds["magnetic_field"] = _MAGNETOMETER  # whatever the coils add at a sensor
        self.surroundings = assembly.surroundings
        self.measured = {
            quantity: sensor
            for quantity, sensor in kinds.items()
            if sensor.measures not in (*ALWAYS, "model") and not sensor.integrates
        }
        self.environment = assembly.scenario.environment
        self.boresights = assembly.scenario.plant.boresights
        self.validated = {
            f"{name}_valid": sensor for name, sensor in sensors.items() if not sensor.always_valid
        }
        drives = [kind.drives for kind in assembly.actuators.kinds]
        userdata = mujoco.mj_stateSize(model, _BEFORE_USERDATA)
        moment = slice(userdata + MOMENT.start, userdata + MOMENT.stop)
        self.dipole = moment if DIPOLE in drives else None

    def truth(self, physics: Array) -> Measurement:
        """Return what ideal sensors report, as views of the state rows where that is possible.

        Nothing touches the ground: that is in the memory of the step effect of the contacts.
        """
        truth = self.motion(physics)
        if self.feet:
            none = np.zeros((*physics.shape[:-1], self.feet))
            one = none[..., :1]
            truth = truth._replace(contact=one, foot_contact=none, hull_contact=one)
        if self.measured or self.validated:
            motion = self.moving_bus(physics)
            measured = {name: sensor.true_value(motion) for name, sensor in self.measured.items()}
            validity = {name: sensor.validity(motion) for name, sensor in self.validated.items()}
            truth = truth._replace(**measured, **validity)
        return truth

    def with_surroundings(self, physics: Array, truth: Measurement) -> Truth:
        """Return all of the ``truth`` at ``physics``, (N, nstate), whatever sensors there are."""
        motion = self.moving_bus(physics)
        known = truth._asdict() | {
            "position": motion.position,
            "velocity": motion.velocity,
            "altitude": self.surroundings.height(motion.position),
            "ground_velocity": _VELOCIMETER.true_value(motion),
            "magnetic_field": _MAGNETOMETER.true_value(motion),
        }
        none, around = np.empty((len(physics), 0)), motion.surroundings
        for name in ("orbit_position", "orbit_velocity"):
            at = getattr(around, name)
            known[name] = none if at is None else at(motion.time)
        known |= (sunlight_at(motion) or Sunlight(none, none))._asdict()
        known |= (whereabouts_at(motion, self.environment) or Whereabouts(*[none] * 4))._asdict()
        return Truth(**{name: known[name] for name in Truth._fields})

    def in_orbit(self, physics: Array) -> dict[str, Array]:
        """Return where Sun and Moon are, where above the Earth, and where boresights look.

        Nothing where that is not known.
        """
        motion = self.moving_bus(physics)
        sun, where = sunlight_at(motion), whereabouts_at(motion, self.environment)
        found = {n: a for one in (sun, where) if one is not None for n, a in one._asdict().items()}
        return found | angles_at(motion, found, self.boresights)

    def moving_bus(self, physics: Array) -> Motion:
        """Return the bus's motion, as views of the state rows."""
        return Motion(
            physics[..., 0],  # the row begins with the time
            physics[..., self.attitude],
            physics[..., self.rate],
            physics[..., self.wheel_speed],
            physics[..., self.position],
            physics[..., self.velocity],
            self.surroundings,
            None if self.dipole is None else physics[..., self.dipole],
        )

    def motion(self, physics: Array) -> Measurement:
        """Return the truth of what turns alone: all that acts on the motors."""
        arrays = dict.fromkeys(REPORTED_BY_PLANT, physics[..., :0])
        arrays |= {
            "attitude": physics[..., self.attitude],
            "rate": physics[..., self.rate],
            "wheel_speed": physics[..., self.wheel_speed],
            "gimbal_angle": physics[..., self.gimbal_angle],
            "gimbal_rate": physics[..., self.gimbal_rate],
            "wheel_angle": physics[..., self.wheel_angle],
        }
        return Measurement(**arrays)


def _columns(indices: Any) -> Any:
    """Return consecutive indices as a slice, which views where a list of them would copy."""
    if np.all(np.diff(indices) == 1):
        return slice(indices[0], indices[-1] + 1) if len(indices) else slice(0, 0)
    return indices
