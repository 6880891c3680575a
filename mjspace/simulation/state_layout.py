"""Where a vehicle's motion stands in a row of MuJoCo's integration state."""

from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import Array, Measurement, Truth
from mjspace.environment import kepler
from mjspace.sensors.suite import NAVIGATION
from mjspace.simulation.assembly import Assembly
from mjspace.vehicle import ground_contact


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
        self.ground = ground_contact.of(model, self.struts, self.velocity)
        sensors = assembly.scenario.sensors
        self.navigates = any(getattr(sensors, name) is not None for name in NAVIGATION)
        self.has_velocimeter = sensors.ground_velocity is not None
        self.has_magnetometer = sensors.magnetic_field is not None
        self.field = assembly.field
        orbit = assembly.scenario.environment.orbit
        self.orbit = None if orbit is None else orbit.elements()

    def truth(self, physics: Array) -> Measurement:
        """Return what ideal sensors see, as views of the state rows where that is possible.

        Nothing touches the ground: that is in the actuators' state, which ``ground`` keeps.
        """
        seen = self.motion(physics)
        if self.feet:
            none = np.zeros((*physics.shape[:-1], self.feet))
            one = none[..., :1]
            seen = seen._replace(contact=one, foot_contact=none, hull_contact=one)
        if self.navigates:
            position, velocity = physics[..., self.position], physics[..., self.velocity]
            seen = seen._replace(position=position, velocity=velocity, altitude=position[..., 2:])
        if self.has_velocimeter:
            seen = seen._replace(ground_velocity=self.velocity_in_body_axes(physics))
        if self.has_magnetometer:
            seen = seen._replace(magnetic_field=self.magnetic_field(physics))
        return seen

    def with_surroundings(self, physics: Array, truth: Measurement) -> Truth:
        """Return all of the ``truth`` at ``physics``, (N, nstate), whatever sensors there are."""
        position = physics[..., self.position]
        known = truth._asdict() | {
            "position": position,
            "velocity": physics[..., self.velocity],
            "altitude": position[..., 2:],
            "ground_velocity": self.velocity_in_body_axes(physics),
            "magnetic_field": self.magnetic_field(physics),
        }
        del known["specific_force"]  # a mean since an accelerometer's last sample
        vehicles, time = len(physics), float(physics[0, 0])
        place = np.empty(0) if self.orbit is None else kepler.position(self.orbit, time)
        motion = np.empty(0) if self.orbit is None else kepler.velocity(self.orbit, time)
        return Truth(
            **known,
            orbit_position=np.tile(place, (vehicles, 1)),
            orbit_velocity=np.tile(motion, (vehicles, 1)),
        )

    def velocity_in_body_axes(self, physics: Array) -> Array:
        """Return the bus's velocity, body axes [m/s]."""
        to_body = attitude.conjugate(physics[..., self.attitude])
        return attitude.rotate(to_body, physics[..., self.velocity])

    def magnetic_field(self, physics: Array) -> Array:
        """Return the Earth's magnetic field, body axes [T]; empty where there is none."""
        if self.field is None:
            return physics[..., :0]
        field = self.field.at(physics[..., 0])  # the row begins with the time
        return attitude.rotate(attitude.conjugate(physics[..., self.attitude]), field)

    def motion(self, physics: Array) -> Measurement:
        """Return the truth of what turns alone: all that motors feel."""
        absent = dict.fromkeys(Measurement._fields, physics[..., :0])
        turning = {
            "attitude": physics[..., self.attitude],
            "rate": physics[..., self.rate],
            "wheel_speed": physics[..., self.wheel_speed],
            "gimbal_angle": physics[..., self.gimbal_angle],
            "gimbal_rate": physics[..., self.gimbal_rate],
            "wheel_angle": physics[..., self.wheel_angle],
        }
        return Measurement(**absent | turning)


def _columns(indices: Any) -> Any:
    """Return consecutive indices as a slice, which views where a list of them would copy."""
    if np.all(np.diff(indices) == 1):
        return slice(indices[0], indices[-1] + 1) if len(indices) else slice(0, 0)
    return indices
