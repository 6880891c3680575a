"""Landings from everywhere: a batch of landers, each started elsewhere and of another mass.

``python benchmarks/lander_dispersed.py [scenario] [count] [seed]``: how many land, and how hard.
Of each lander, evenly drawn: place +-20 m, velocity +-2 m/s, attitude +-3 deg and rate +-0.5 deg/s
on every axis, mass +-5 %, principal moments of inertia +-20 %.
"""

import sys
import warnings

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.loop import fly
from mjspace.terminal.reporting import progress_bar

FIELDS = ("body_mass", "body_ipos", "body_inertia", "body_iquat")
# Ten times as quick as RK4 at 2 ms, and lands alike, to 8 mm/s and 0.9 mm
# (tests/simulation/test_lander_flight.py).
RATES = ["rates.physics='5 ms'", "rates.integrator=implicitfast"]
LANDED = {"speed": 1.0, "tilt": np.radians(3.0)}  # m/s, rad


def overrides(random: np.random.Generator) -> list[str]:
    """Return what differs for one lander."""

    def around(middle: Array, spread: float) -> str:
        return str((middle + random.uniform(-spread, spread, 3)).tolist())

    inertia = np.array([90.0, 80.0, 100.0]) * random.uniform(0.8, 1.2, 3)
    return [
        f"initial.position={around(np.array([2000.0, 1500.0, 1003.8]), 20.0)}",
        f"initial.velocity={around(np.array([-15.0, -20.0, -10.0]), 2.0)}",
        f"initial.euler={around(np.array([0.0, 0.0, 0.6435]), np.radians(3.0))}",
        f"initial.rate={around(np.zeros(3), np.radians(0.5))}",
        f"plant.vehicle_mass={random.uniform(95.0, 105.0)}",
        f"plant.vehicle_inertia={np.diag(inertia).tolist()}",
    ]


def dispersed(scenario: str, count: int, seed: int) -> tuple[Assembly, Start]:
    """Return the scenario's assembly and where ``count`` landers of it start."""
    random = np.random.default_rng(seed)
    nominal = assemble(*load(scenario, RATES))
    each = [assemble(*load(scenario, [*RATES, *overrides(random)])) for _ in range(count)]
    starts = [first_start(one, [0]) for one in each]
    physics = np.concatenate([start.physics for start in starts])
    model = {name: np.array([getattr(a.vehicle.model, name) for a in each]) for name in FIELDS}
    actuators = nominal.actuators.reset(count)
    return nominal, Start(0, physics, {}, None, actuators, model)


def touchdowns(scenario: str, count: int, seed: int) -> tuple[dict[str, Array], Array]:
    """Return what each lander had when it touched down, and its tilt at the end [rad]."""
    assembly, start = dispersed(scenario, count, seed)
    found = {
        name: np.full(count, np.nan) for name in ("time", "down", "aside", "tilt", "miss", "burnt")
    }
    with progress_bar(assembly.scenario.duration, scenario) as progress:
        for block in fly(assembly, start, range(count), threads=2):
            truth = block.rows["/truth"]
            for i in np.flatnonzero(np.isnan(found["time"])):
                touching = truth["contact"][:, i, 0] > 0.5
                if touching.any():
                    k = int(np.argmax(touching))
                    before = max(k - 1, 0)
                    velocity, place = truth["velocity"][before, i], truth["position"][before, i]
                    found["time"][i] = block.time[k]
                    found["down"][i], found["aside"][i] = -velocity[2], np.linalg.norm(velocity[:2])
                    found["tilt"][i] = truth["tilt"][before, i, 0]
                    found["miss"][i] = np.linalg.norm(place[:2])
                    found["burnt"][i] = 20.0 - truth["propellant"][before, i, 0]
            progress(float(block.time[-1]))
    return found, truth["tilt"][-1, :, 0]


def main() -> None:
    """Fly them and print the table."""
    scenario = sys.argv[1] if len(sys.argv) > 1 else "lander-cubic"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 20190606
    found, tilt_at_rest = touchdowns(scenario, count, seed)
    speed = np.hypot(found["down"], found["aside"])
    soft = (speed <= LANDED["speed"]) & (found["tilt"] <= LANDED["tilt"])
    stands = tilt_at_rest < np.radians(1.0)
    print(
        f"{scenario}: of {count}, {np.count_nonzero(soft)} touch down with at most 1 m/s and 3 deg,"
    )
    print(f"and {np.count_nonzero(stands)} stand upright in the end")
    found["tilt"] = np.degrees(found["tilt"])
    units = ("s", "m/s", "m/s", "deg", "m", "kg")
    for (name, values), unit in zip(found.items(), units, strict=True):
        least, median, most = np.nanquantile(values, [0.0, 0.5, 1.0])
        print(f"{name:>6} {least:9.3f} {median:9.3f} {most:9.3f} {unit}  (least, median, most)")


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        main()
