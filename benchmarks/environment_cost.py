"""What the environment costs: mj_step with it over mj_step without, on a bus with three wheels.

    python benchmarks/environment_cost.py

Blocks of steps with and without are timed in turn, by the time of the processor;
the ratio is the median over pairs. The aim is at most 1.3.
"""

import time
from datetime import datetime
from typing import Any

import mujoco
import numpy as np

from mjspace.environment import cubics, sun
from mjspace.environment.disturbance_torque import DisturbanceTorque, Sine
from mjspace.environment.facet_drag import FacetDrag
from mjspace.environment.facets import Facet
from mjspace.environment.install import install_callbacks, places_read, userdata, userdata_size
from mjspace.environment.magnetic_field import MagneticField
from mjspace.environment.orbit import Orbit
from mjspace.environment.residual_dipole import ResidualDipole
from mjspace.environment.solar_pressure import SolarPressure
from mjspace.scenario.environment import Environment
from mjspace.scenario.plant import PlantTable, Rates
from mjspace.vehicle import vehicle

ORBIT = Orbit(semi_major_axis=7.0e6, eccentricity=0.01, inclination=0.9)
TORQUE = DisturbanceTorque(
    bias=[1e-4, 2e-4, -1e-4],
    sines=[
        Sine(amplitude=[1e-3, 2e-3, 1e-3], frequency=f, phase=[0.1, 0.2, 0.3]) for f in (1, 2, 3)
    ],
)
EPOCH = datetime(2026, 3, 20)
BOX = [
    Facet(area=1.0, normal=(sign * axis).tolist(), position=(0.5 * sign * axis).tolist())
    for axis in np.eye(3)
    for sign in (1.0, -1.0)
]
DIPOLE = ResidualDipole(moment=[0.1, 0.2, 0.3])
CASES = {
    "installed, nothing acts": Environment(),
    "torque of three sines": Environment(torques=[TORQUE]),
    "orbit": Environment(orbit=ORBIT),
    "orbit and torque": Environment(orbit=ORBIT, torques=[TORQUE]),
    "orbit and drag": Environment(orbit=ORBIT, facets=BOX, facet_drag=FacetDrag()),
    "orbit and sunlight": Environment(
        orbit=ORBIT, epoch=EPOCH, facets=BOX, solar_pressure=SolarPressure()
    ),
    "orbit and field": Environment(orbit=ORBIT, magnetic_field=MagneticField()),
    "orbit, field and dipole": Environment(
        orbit=ORBIT, magnetic_field=MagneticField(), residual_dipole=DIPOLE
    ),
    "all of orbit": Environment(
        orbit=ORBIT,
        epoch=EPOCH,
        facets=BOX,
        facet_drag=FacetDrag(),
        solar_pressure=SolarPressure(),
        magnetic_field=MagneticField(),
        residual_dipole=DIPOLE,
    ),
}
PAIRS, STEPS = 200, 250


def vehicle_state(model: Any, outside: Environment | None) -> Any:
    data = mujoco.MjData(model)
    data.qpos[3:7], data.qvel[3:6], data.qvel[6:] = [0.8, -0.2, 0.4, 0.4], [0.01, 0.02, 0.03], 50.0
    if outside is not None:
        packed = userdata(model, outside)
        data.userdata[: packed.size] = packed
        if outside.has_sun:
            (place,) = places_read("sun_position", outside, PlantTable())
            data.userdata[place : place + cubics.SIZE] = sun.along(EPOCH, 1.0, 1e4).rows(0.0)
    return data


def microseconds_per_step(model: Any, data: Any) -> float:
    start = time.thread_time()
    mujoco.mj_step(model, data, STEPS)
    return (time.thread_time() - start) / STEPS * 1e6


def main() -> None:
    size = max(userdata_size(outside) for outside in CASES.values())
    model = vehicle.build(PlantTable(), Rates(), userdata=size).model
    print(f"mujoco {mujoco.__version__}, RK4, {PAIRS} pairs of {STEPS} steps of 1 ms")
    print(f"{'environment':<26}{'bare':>9}{'with':>9}{'ratio':>8}   (us per step, medians)")
    for name, outside in CASES.items():
        bare, acted_on = vehicle_state(model, None), vehicle_state(model, outside)
        times = []
        for _ in range(PAIRS):
            mujoco.set_mjcb_passive(None)
            mujoco.set_mjcb_sensor(None)
            without = microseconds_per_step(model, bare)
            install_callbacks()
            times.append((without, microseconds_per_step(model, acted_on)))
        pairs = np.array(times)
        without, acted = np.median(pairs, axis=0)
        ratio = np.median(pairs[:, 1] / pairs[:, 0])
        print(f"{name:<26}{without:>9.2f}{acted:>9.2f}{ratio:>8.3f}")


if __name__ == "__main__":
    main()
