"""What is told of a flight while it flies: a few words about where the vehicle is."""

import numpy as np

from mjspace.simulation.assembly import Assembly
from mjspace.simulation.recording import Block


def figures(assembly: Assembly, block: Block) -> str:
    """Return attitude error, and altitude or momentum, of one vehicle at the end of a ``block``.

    The altitude where there is a ground; else the momentum of the wheel that has most of it,
    relative to what carries it, and of a vehicle without wheels the total.
    """
    truth = {name: rows[-1, 0] for name, rows in block.rows["/truth"].items()}
    told = [f"error {np.degrees(truth['attitude_error'][0]):.3g} deg"]
    wheels = assembly.vehicle.wheel_inertia
    if assembly.scenario.plant.ground is not None:
        told.append(f"altitude {truth['altitude'][0]:.3g} m")
    elif len(wheels):
        largest = np.abs(wheels * truth["wheel_speed"]).max()
        told.append(f"wheel {largest:.3g} N m s")
    else:
        told.append(f"momentum {np.linalg.norm(truth['momentum']):.3g} N m s")
    return ", ".join(told)
