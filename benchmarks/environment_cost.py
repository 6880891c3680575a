"""What the environment costs: mj_step with it over mj_step without, on a bus with three wheels.

    python benchmarks/environment_cost.py

Blocks of steps without, with the orbit and with the environment are timed in turn, by the time of
the processor; ratios are medians over these. The aim is 1.3 with all, and 1.05 for a term.
"""

import time
from datetime import datetime
from typing import Any

import mujoco
import numpy as np

from mjspace.environment import geomagnetism, nrlmsis, sun
from mjspace.environment.disturbance_torque import DisturbanceTorque, Sine
from mjspace.environment.facet_drag import FacetDrag, Nrlmsis
from mjspace.environment.facets import Facet
from mjspace.environment.hysteresis_rod import HysteresisRod
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
AIR = FacetDrag(nrlmsis=Nrlmsis(f107=150.0))
RODS = [
    HysteresisRod(axis=axis, volume=4.48e-7, coercivity=12.0, remanence=0.004, saturation=0.025)
    for axis in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
]
KNOWN: dict[str, Any] = {
    "sun_position": lambda outside: sun.along(EPOCH, 1.0, 1e4),
    "magnetic_field": lambda outside: geomagnetism.along(outside, 1.0, 1e2),
    "air_density": lambda outside: nrlmsis.along(outside, 1.0, 1e2),
}
"""What is known beforehand of an environment, by the name that terms read it under."""
CASES = {
    "installed, nothing acts": Environment(),
    "torque of three sines": Environment(torques=[TORQUE]),
    "orbit": Environment(orbit=ORBIT),
    "orbit and torque": Environment(orbit=ORBIT, torques=[TORQUE]),
    "orbit and drag": Environment(orbit=ORBIT, facets=BOX, facet_drag=FacetDrag()),
    "orbit and drag, nrlmsis": Environment(orbit=ORBIT, epoch=EPOCH, facets=BOX, facet_drag=AIR),
    "orbit and sunlight": Environment(
        orbit=ORBIT, epoch=EPOCH, facets=BOX, solar_pressure=SolarPressure()
    ),
    "orbit and light, cylinder": Environment(
        orbit=ORBIT, epoch=EPOCH, shadow="cylinder", facets=BOX, solar_pressure=SolarPressure()
    ),
    "orbit and field": Environment(orbit=ORBIT, epoch=EPOCH, magnetic_field=MagneticField()),
    "orbit, field and dipole": Environment(
        orbit=ORBIT, epoch=EPOCH, magnetic_field=MagneticField(), residual_dipole=DIPOLE
    ),
    "orbit, field and two rods": Environment(
        orbit=ORBIT, epoch=EPOCH, magnetic_field=MagneticField(), hysteresis_rods=RODS
    ),
    "all of orbit but rods": Environment(
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
        for name, along in KNOWN.items():
            for place in places_read(name, outside, PlantTable()):
                row = along(outside).rows(0.0)
                data.userdata[place : place + row.size] = row
    return data


def microseconds_per_step(model: Any, data: Any) -> float:
    start = time.thread_time()
    mujoco.mj_step(model, data, STEPS)
    return (time.thread_time() - start) / STEPS * 1e6


def main() -> None:
    size = max(userdata_size(outside) for outside in CASES.values())
    model = vehicle.build(PlantTable(), Rates(), userdata=size).model
    print(f"mujoco {mujoco.__version__}, RK4, {PAIRS} pairs of {STEPS} steps of 1 ms")
    print(f"{'environment':<27}{'bare':>7}{'with':>7}{'ratio':>8}{'beside orbit':>14}  us, medians")
    bare, orbit = vehicle_state(model, None), vehicle_state(model, CASES["orbit"])
    for name, outside in CASES.items():
        acted_on, times = vehicle_state(model, outside), []
        for _ in range(PAIRS):
            mujoco.set_mjcb_passive(None)
            mujoco.set_mjcb_sensor(None)
            without = microseconds_per_step(model, bare)
            install_callbacks()
            beside = microseconds_per_step(model, orbit)
            times.append((without, beside, microseconds_per_step(model, acted_on)))
        without, beside, acted = np.array(times).T
        shown = [np.median(each) for each in (without, acted, acted / without)]
        more = 1.0 + np.median((acted - beside) / without)
        own = f"{more:>14.3f}" if outside.orbit is not None and name != "orbit" else ""
        print(f"{name:<27}{shown[0]:>7.2f}{shown[1]:>7.2f}{shown[2]:>8.3f}{own}")


if __name__ == "__main__":
    main()
