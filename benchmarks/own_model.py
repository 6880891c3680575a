"""What a flight of a model of one's own costs over one of the same size composed of our parts.

``cubesat-6u`` is plain MJCF with four wheels, and a gyro of its own, which is read at each control
instant; the other vehicle has the same bus, wheels and coils.
"""

import warnings

import numpy as np
from flights import built, flight, steps_of
from timing import head, paired, row

LONG = ("checks=[]", "duration=1500", "rates.control='100 ms'")
HEIGHT = 2.0**0.5
WHEELS = f"""{{inertia=2.8e-5,transverse_inertia=1.5e-5,mass=0.12,torque_limit="4 mN m",
    axes=[[2,0,{HEIGHT}],[0,2,{HEIGHT}],[-2,0,{HEIGHT}],[0,-2,{HEIGHT}]],
    positions=[[0.03,0,-0.08],[0,0.03,-0.08],[-0.03,0,-0.08],[0,-0.03,-0.08]]}}"""
PARTS = f"""plant={{model="satellite_3rw",mass=9.6,wheels={WHEELS},
    bus_inertia=[[0.128,0,0],[0,0.104,0],[0,0,0.057]],magnetorquers={{dipole_limit=0.2}}}}"""


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    vehicles = [built("cubesat-6u", *LONG), built("cubesat-6u", *LONG, " ".join(PARTS.split()))]
    steps = steps_of(vehicles[0])
    times = paired(*map(flight, vehicles))
    head("a 6U CubeSat, law at 10 Hz", "us a period", "ratio")
    for number, name in enumerate(("one's own model", "composed of our parts")):
        us = 1e6 * np.median(times[:, number]) / steps
        row(name, f"{us:.1f}", f"{np.median(times[:, number] / times[:, 1]):.2f}")


if __name__ == "__main__":
    main()
