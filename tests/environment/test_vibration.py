"""A vibration that depends on time: its torque, its reaction, and what it does to a wheel."""

import mujoco
import numpy as np
import pytest

from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.environment.vibration import Vibration
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.scenario.plant import PlantTable
from mjspace.simulation.assembly import assemble

XML = """<mujoco><option gravity="0 0 0" integrator="RK4"><flag contact="disable"/></option>
  <worldbody><body name="bus"><freejoint/>
    <inertial pos="0 0 0" mass="9" diaginertia="3 4 5"/>
    <body><joint name="wheel" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.2"/></body></body>
  </worldbody></mujoco>"""
AMPLITUDE, FREQUENCY, PHASE = 0.3, 7.0, 2.0
BUS, WHEEL = 5.0, 0.2  # kg m^2 about the axis


@pytest.fixture
def plant() -> PlantTable:
    vibration = Vibration(amplitude=AMPLITUDE, frequency=FREQUENCY, phase=PHASE)
    return PlantTable(vibration={"wheel": vibration})


@pytest.mark.parametrize("step", [0.02, 0.01])
def test_wheel_and_bus_oscillate_against_each_other(plant: PlantTable, step: float) -> None:
    spec = mujoco.MjSpec.from_string(XML)
    spec.nuserdata = userdata_size(Environment(), plant)
    spec.option.timestep = step
    model = spec.compile()
    data = mujoco.MjData(model)
    install_callbacks()
    data.userdata[:] = userdata(model, Environment(), plant)
    for _ in range(round(1.0 / step)):
        mujoco.mj_step(model, data)
    # The integral of A cos(w t + phase): momentum of the wheel, and the opposite of the bus.
    gained = AMPLITUDE / FREQUENCY * (np.sin(FREQUENCY + PHASE) - np.sin(PHASE))
    # RK4, a pure function of time: Simpson's rule, step^4 w^4 A / 2880 = 4e-8 at 20 ms.
    within = 4.1e-8 * (step / 0.02) ** 4
    assert data.qvel[5] == pytest.approx(-gained / BUS, abs=within / BUS)
    relative = 1.0 / WHEEL + 1.0 / BUS
    assert data.qvel[6] == pytest.approx(relative * gained, abs=relative * within)
    assert abs(gained) > 0.02


def test_a_hinge_that_is_not_there_is_refused() -> None:
    overrides = ["plant.vibration.door={amplitude=1, frequency=1}"]
    with pytest.raises(ValueError, match="vibration: no hinge 'door' in the model"):
        assemble(*load("pmsm-speed-timed", overrides))
