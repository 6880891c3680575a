"""Writes docs/disturbance_torques.png and prints the table of docs/environment.md beneath it.

Usage: python tools/disturbance_torques.py

The torques that the environment's own terms exert on the satellite of the scenario
leo-disturbances, by altitude: the largest of a circular orbit and of many attitudes.
"""

from pathlib import Path
from typing import Any

import matplotlib
import mujoco
import numpy as np
from matplotlib.figure import Figure

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment import geomagnetism, nrlmsis, sun
from mjspace.environment.constants import RADIUS
from mjspace.environment.facet_drag import FacetDrag, Nrlmsis
from mjspace.environment.install import install_callbacks, places_read, userdata, userdata_size
from mjspace.environment.magnetic_field import MagneticField
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.plotting.style import COLORS, STYLE
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.vehicle import vehicle

PICTURE = Path(__file__).parents[1] / "docs/disturbance_torques.png"
ALTITUDES = 1e3 * np.geomspace(200.0, 40000.0, 40)  # m
LISTED = 1e3 * np.array([200.0, 400.0, 600.0, 800.0, 1000.0, 20200.0, 35786.0])
TICKS = (200, 500, 1000, 2000, 5000, 10000, 20000, 40000)  # km
HIGHEST_AIR = 1500e3  # m: above, NRLMSIS has little to say
FLUXES = {"drag, quiet Sun": 70.0, "drag, active Sun": 230.0}
PLACES, ATTITUDES = 24, 48
NAMES = ("gravity gradient", *FLUXES, "sunlight", "residual dipole")


def torques(altitude: float) -> dict[str, float]:
    """Return the largest torque [N m] of each disturbance at that ``altitude`` [m]."""
    scenario, _ = load("leo-disturbances")
    outside = scenario.environment
    orbit = Orbit(semi_major_axis=RADIUS["earth"] + altitude, inclination=outside.orbit.inclination)
    common = {"orbit": orbit, "epoch": outside.epoch}
    lit = common | {"facets": outside.facets}
    found = {"gravity gradient": largest(scenario, Environment(**common), None)}
    for name, flux in FLUXES.items():
        drag = FacetDrag(nrlmsis=Nrlmsis(f107=flux))
        if altitude <= HIGHEST_AIR:
            air = Environment(**lit, facet_drag=drag)
            found[name] = largest(scenario, air, Environment(**common))
    light = Environment(**lit, solar_pressure=outside.solar_pressure)
    found["sunlight"] = largest(scenario, light, Environment(**common))
    field = MagneticField(model="igrf")
    magnetic = Environment(**common, magnetic_field=field, residual_dipole=outside.residual_dipole)
    found["residual dipole"] = largest(scenario, magnetic, Environment(**common))
    return found


def largest(scenario: Any, acting: Environment, without: Environment | None) -> float:
    """Return the largest norm of the torque [N m] of what is ``acting``, less that ``without``."""
    first = on_bus(scenario, acting)
    rest = 0.0 if without is None else on_bus(scenario, without)
    return float(np.linalg.norm(first - rest, axis=-1).max())


def on_bus(scenario: Any, outside: Environment) -> Array:
    """Return the torque on the bus [N m], (places, attitudes, 3)."""
    model = vehicle.build(scenario.plant, scenario.rates, userdata=userdata_size(outside)).model
    data, packed = mujoco.MjData(model), userdata(model, outside)
    orbit: Any = outside.orbit
    time = np.arange(PLACES) * 2.0 * np.pi / orbit.elements()[1] / PLACES
    rng = np.random.default_rng(1)
    turned = attitude.normalize(rng.normal(size=(ATTITUDES, 4)))
    known = vectors(outside, time)
    found = np.empty((PLACES, ATTITUDES, 3))
    for i, now in enumerate(time):
        for name, rows in known.items():
            for place in places_read(name, outside, scenario.plant):
                packed[place : place + 13] = [0.0, *np.zeros(9), *rows[i]]
        for k, quaternion in enumerate(turned):
            data.userdata[:], data.time, data.qpos[3:7] = packed, now, quaternion
            mujoco.mj_forward(model, data)
            found[i, k] = data.qfrc_passive[3:6]
    return found


def vectors(outside: Environment, time: Array) -> dict[str, Array]:
    """Return what terms read of the environment at each ``time`` [s], (n, 3) each."""
    epoch: Any = outside.epoch
    places = orbit_position(outside.orbit, time)
    known = {"sun_position": sun.position(epoch, time)}
    if outside.magnetic_field is not None:
        field = geomagnetism.field_at(outside.magnetic_field, epoch, places, time)
        known["magnetic_field"] = field
    if outside.facet_drag is not None:
        indices = outside.facet_drag.nrlmsis
        density, falling = nrlmsis.density_at(epoch, indices, places, time)
        radius = np.linalg.norm(places, axis=1)
        known["air_density"] = np.column_stack([np.log(density), radius, falling])
    return known


def table() -> str:
    """Return the table in Markdown."""
    lines = ["| altitude [km] | " + " | ".join(NAMES) + " |", "|---|" + "---|" * len(NAMES)]
    for altitude in LISTED:
        found = torques(altitude)
        cells = [f"{found[name]:.1e}" if name in found else "" for name in NAMES]
        lines.append(f"| {1e-3 * altitude:.0f} | {' | '.join(cells)} |")
    return "\n".join(lines)


def draw(path: Path) -> None:
    """Draw the torques over the altitude."""
    rows = [torques(altitude) for altitude in ALTITUDES]
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(7.5, 4.5), layout="constrained")
        panel = page.subplots()
        for name, color in zip(NAMES, COLORS, strict=False):
            values = [row.get(name, np.nan) for row in rows]
            panel.loglog(1e-3 * ALTITUDES, values, color=color, label=name)
        panel.set_xlabel("altitude [km]")
        panel.set_ylabel("largest torque [N m]")
        panel.set_xticks(TICKS, [f"{tick:,}" for tick in TICKS])
        panel.set_ylim(1e-8, 0.2)
        panel.legend(frameon=False)
        page.savefig(path, dpi=150)


if __name__ == "__main__":
    install_callbacks()
    draw(PICTURE)
    print(table())
