"""Models as a user may bring them, and scenarios that fly them."""

from pathlib import Path

from mjspace.scenario.loading import load
from mjspace.scenario.model_source import ModelSource
from mjspace.simulation.assembly import Assembly, assemble

SENSED = """
<mujoco model="sensed">
  <option timestep="0.004"/>
  <worldbody>
    <body name="hub">
      <freejoint/>
      <geom type="box" size="0.1 0.1 0.15" mass="8"/>
      <site name="imu" pos="0.05 0 0" euler="0 0 30"/>
      <site name="jet" pos="0 0.02 -0.15" euler="0 90 0"/>
      <body name="rw1" pos="0.05 0 0">
        <joint name="rw1" axis="1 0 0"/>
        <geom type="cylinder" size="0.03 0.01" euler="0 90 0" mass="0.2"/>
      </body>
      <body name="rw2" pos="0 0.05 0">
        <joint name="rw2" axis="0 1 0"/>
        <geom type="cylinder" size="0.03 0.01" euler="90 0 0" mass="0.2"/>
      </body>
      <body name="arm" pos="0 0 0.2">
        <joint name="elbow" axis="0 1 0" damping="0.01"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.01" mass="0.5"/>
      </body>
      <body pos="0 0 0.05">
        <joint name="rw3" axis="0 0 1"/>
        <geom type="cylinder" size="0.03 0.01" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="rw1" gear="-0.01" ctrlrange="-1 1"/>
    <position name="elbow_servo" joint="elbow" kp="0.5" kv="0.1" ctrlrange="-1 1"/>
    <motor name="m2" joint="rw2" forcerange="-0.02 0.03"/>
    <general name="jet" site="jet" gear="0 0 2 0 0 0" ctrlrange="0 1"/>
    <motor joint="rw3"/>
  </actuator>
  <sensor>
    <gyro name="imu_rate" site="imu"/>
    <framequat name="star-tracker" objtype="site" objname="imu"/>
    <accelerometer name="acceleration" site="imu"/>
    <jointpos name="elbow_angle" joint="elbow"/>
    <gyro name="rate" site="imu"/>
  </sensor>
</mujoco>
"""
"""Wheels between other motors, a jet, an arm on a servo, sensors; one wheel has no names."""

LAW = """
from typing import NamedTuple
import numpy as np
class Command(NamedTuple):
    torque: np.ndarray
    thruster_force: np.ndarray
    control: np.ndarray
class Signals(NamedTuple):
    seen: np.ndarray
class Law:
    batched = True
    def reset(self, measurement, reference):
        return None
    def step(self, state, time, measurement, reference):
        rows = measurement.rate.shape[:-1]
        torque = -0.05 * measurement.imu_rate
        force = np.full((*rows, 1), 3.0)
        control = 0.3 - measurement.elbow_angle
        return None, Command(torque, force, control), Signals(measurement.star_tracker)
"""
HOLD = """
description = "a model of one's own"
duration = "2 s"
[rates]
physics = "4 ms"
control = "20 ms"
[plant]
model = "sensed.xml"
[initial]
rate = [0.1, -0.2, 0.3]
[reference]
kind = "references:Hold"
[law]
kind = "law.py:Law"
"""


def source(text: str, name: str = "model.xml") -> ModelSource:
    """Return a model that refers to no file."""
    return ModelSource(name, {name: text.encode()})


def write(folder: Path, model: str = SENSED) -> Path:
    """Write the scenario, its law and its model; return the scenario's path."""
    (folder / "sensed.xml").write_text(model)
    (folder / "law.py").write_text(LAW)
    path = folder / "hold.toml"
    path.write_text(HOLD)
    return path


def built(folder: Path, *overrides: str, model: str = SENSED) -> Assembly:
    """Return the assembly of that scenario."""
    return assemble(*load(write(folder, model), overrides))
