"""mjspace's environment against Basilisk's: equal satellites in orbit under one disturbance each.

mjspace flies a scenario from file to log, as for anybody; Basilisk flies what that scenario says.
"""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment import geomagnetism, sun
from mjspace.environment.constants import GM, RADIUS
from mjspace.environment.earth_rotation import EARTH_ROTATION, sidereal_angle
from mjspace.environment.orbit import orbit_position, orbit_velocity
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.scenario.scenario import Scenario
from mjspace.validation.basilisk_call import call
from mjspace.validation.benchmark import Bound, Picture
from mjspace.validation.results import Injected, Line, Row, Section

EVERY = 5.0  # s, between compared rows
SCENARIO = """
description = "A satellite that tumbles in low Earth orbit, with no control"
duration = "600 s"

[rates]
physics = "20 ms"
control = "20 ms"

[log]
default = "5 s"

[plant]
mass = "80 kg"
gyrostat_inertia = [[10, 0.3, 0.2], [0.3, 12, -0.4], [0.2, -0.4, 7]]

[plant.wheels]
axes = []

[initial]
attitude = [0.6, 0.48, -0.48, 0.424264068711929]
rate = [0.004, -0.003, 0.002]

[environment]
epoch = 2026-03-20T12:00:00

[environment.orbit]
semi_major_axis = "6778 km"
eccentricity = 0.002
inclination = "51.6 deg"
ascending_node = "20 deg"
true_anomaly = "-70 deg"

[reference]
kind = "references:Hold"

[law]
kind = "coast:Coast"
"""
# A plate on one side of the centre of mass, both of its faces, and a smaller one across.
_PLATES = (
    ("3.0", "[1, 0.2, 0]", "[0, 1.5, 0.3]"),
    ("3.0", "[-1, -0.2, 0]", "[0, 1.5, 0.3]"),
    ("1.0", "[0, 0.6, 0.8]", "[0.5, 0, 0.4]"),
)
_FACETS = ",".join(
    f"{{area={area},normal={normal},position={position},specular=0.3,diffuse=0.2}}"
    for area, normal, position in _PLATES
)
_MIRRORED = _FACETS.replace("[0, 1.5, 0.3]", "[0, -1.5, -0.3]").replace(
    "[0.5, 0, 0.4]", "[-0.5, 0, -0.4]"
)
_AT_ORIGIN = Bound("position", "m", 1e-6, "Basilisk rounds 7000 km; 4e-8 measured")
_FLUX = 1368.0 / 299792458.0  # N/m^2 at 1 au: what facetSRPDynamicEffector has compiled in


@dataclass(frozen=True)
class Case:
    """A disturbance, what it is set by, and how well both must agree under it."""

    name: str
    title: str
    shows: str
    settings: tuple[str, ...]
    """Overrides of ``SCENARIO``."""
    spoiled: tuple[str, ...]
    """Overrides beside these with which a bound must be left."""
    meaning: str
    """Of these."""
    bounds: tuple[Bound, Bound, Bound]
    """Of attitude, rate and position."""


CASES = (
    Case(
        name="basilisk-gravity-gradient",
        title="Gravity gradient",
        shows="A tensor of inertia with products turns under the gravity gradient alone.",
        settings=(),
        spoiled=("plant.gyrostat_inertia=[[10,0.3,0.2],[0.3,12,0.4],[0.2,0.4,7]]",),
        meaning="one product of inertia with the other sign",
        bounds=(
            Bound("attitude", "rad", 1e-11, "both are RK4 at one step: rounding; 3e-14 measured"),
            Bound("rate", "rad/s", 1e-14, "as the attitude; 5e-18 measured"),
            _AT_ORIGIN,
        ),
    ),
    Case(
        name="basilisk-drag",
        title="Drag",
        shows="Air that is exponential in altitude and does not turn brakes plates.",
        settings=(
            f"environment.facets=[{_FACETS}]",
            'environment.facet_drag={density="3.7e-12 kg/m^3",reference_altitude="400 km",'
            'scale_height="58.5 km",corotating=false}',
        ),
        spoiled=(f"environment.facets=[{_MIRRORED}]",),
        meaning="plates on the other side of the centre of mass",
        bounds=(
            Bound(
                "attitude",
                "rad",
                1e-5,
                "of a turn of 1.8 rad: Basilisk leaves out the plates' own motion, 1e-6 of the "
                "torque, and holds the density for a step; 2e-6 measured",
            ),
            Bound("rate", "rad/s", 1e-7, "of 7e-3 rad/s, as the attitude; 1.5e-8 measured"),
            Bound("position", "m", 5e-6, "of 0.5 m, as the attitude; 8e-7 measured"),
        ),
    ),
    Case(
        name="basilisk-sunlight",
        title="Pressure of sunlight",
        shows="Sunlight presses on plates that absorb, mirror and scatter it.",
        settings=(
            f"environment.facets=[{_FACETS}]",
            f"environment.solar_pressure.pressure={_FLUX!r}",
        ),
        spoiled=(f"environment.facets=[{_MIRRORED}]",),
        meaning="plates on the other side of the centre of mass",
        bounds=(
            Bound(
                "attitude",
                "rad",
                2e-9,
                "of a turn of 0.04 rad: the Sun goes straight in Basilisk, 2e-9 rad off; 1.6e-10 "
                "measured",
            ),
            Bound("rate", "rad/s", 2e-11, "of 1e-4 rad/s, as the attitude; 1.5e-12 measured"),
            Bound("position", "m", 1e-6, "of 7e-3 m: Basilisk rounds 7000 km; 5e-8 measured"),
        ),
    ),
    Case(
        name="basilisk-dipole",
        title="Residual dipole in the magnetic field",
        shows="The Earth's tilted dipole, which turns with the Earth, acts on a constant moment.",
        settings=(
            'environment.magnetic_field.model="dipole"',
            "environment.residual_dipole.moment=[0.5,-0.3,0.8]",
        ),
        spoiled=("environment.residual_dipole.moment=[-0.5,0.3,-0.8]",),
        meaning="the moment with the other sign",
        bounds=(
            Bound(
                "attitude",
                "rad",
                2e-5,
                "of a turn of 0.19 rad: Basilisk holds the field for a step; 8e-6 measured, and "
                "4e-6 at half the step",
            ),
            Bound("rate", "rad/s", 1e-7, "of 7e-4 rad/s, as the attitude; 3e-8 measured"),
            _AT_ORIGIN,
        ),
    ),
)


def compare(python: str) -> list[Section]:
    """Fly each case here and in the Basilisk of the interpreter ``python``.

    Raises:
        BasiliskMissingError: the interpreter cannot be run, or has no bsk.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "orbit.toml"
        path.write_text(SCENARIO, encoding="utf-8")
        loaded = [load(path, case.settings)[0] for case in CASES]
        request = {"vehicles": [describe(scenario) for scenario in loaded]}
        answer = call(python, "basilisk_orbit_flight.py", request)
        return [
            _section(case, path, scenario, answer["version"], flight)
            for case, scenario, flight in zip(CASES, loaded, answer["flights"], strict=True)
        ]


def describe(scenario: Scenario) -> dict[str, Any]:
    """Return the satellite of ``scenario`` as ``basilisk_orbit_flight`` reads it, in SI units."""
    environment: Any = scenario.environment
    orbit, epoch, zero = environment.orbit, environment.time_zero, np.zeros(1)
    found = {
        "step": scenario.rates.physics,
        "duration": scenario.duration,
        "every": EVERY,
        "mass": scenario.plant.mass,
        "inertia": scenario.plant.gyrostat_inertia,
        "gm": GM["earth"],
        "position": orbit_position(orbit, zero)[0].tolist(),
        "velocity": orbit_velocity(orbit, zero)[0].tolist(),
        "mrp": attitude.to_mrp(attitude.normalize(np.array(scenario.initial.attitude))).tolist(),
        "rate": scenario.initial.rate,
        "sun": sun.position(epoch, np.array([0.0, scenario.duration])).tolist(),
        "earth_angle": sidereal_angle(epoch),
        "earth_rate": EARTH_ROTATION,
    }
    facets = [
        facet.model_dump() | {"normal": facet.outward.tolist()} for facet in environment.facets
    ]
    if (drag := environment.facet_drag) is not None:
        found["drag"] = {
            "radius": RADIUS["earth"],
            "density": drag.density * np.exp(drag.reference_altitude / drag.scale_height),
            "scale_height": drag.scale_height,
            "facets": facets,
        }
    if environment.solar_pressure is not None:
        found["sunlight"] = {"facets": facets}
    if environment.residual_dipole is not None:
        dipole = geomagnetism.dipole_of(epoch)
        axial, level = (dipole.strength * f(dipole.tilt) for f in (np.cos, np.sin))
        along = level * np.cos(dipole.longitude), level * np.sin(dipole.longitude), axial
        # g11, h11 and g10 of a field that points down at the northern pole
        found["dipole"] = {
            "coefficients": [-float(part) for part in along],
            "moment": environment.residual_dipole.moment,
        }
    return found


def _section(
    case: Case, path: Path, scenario: Scenario, version: str, theirs: Mapping[str, Any]
) -> Section:
    ours = _flown(path, case.settings)
    differences = _differences(scenario, ours, theirs)
    spoiled = _differences(scenario, _flown(path, (*case.settings, *case.spoiled)), theirs)
    motion = Picture.of(
        "rate [rad/s]", ours["time"], "x y z", np.array(theirs["rate"]), ours["rate"]
    )
    return Section(
        name=case.name,
        title=f"{case.title}, against Basilisk {version}",
        shows=case.shows,
        source="Basilisk's spacecraft in Earth orbit under its own RK4; the lines are Basilisk's",
        step=scenario.rates.physics,
        rows=[Row.judged(b, float(d.max())) for b, d in zip(case.bounds, differences, strict=True)],
        faults=[
            Injected(
                fault="sign",
                meaning=case.meaning,
                expected=True,
                broken=[
                    bound.quantity
                    for bound, off in zip(case.bounds, spoiled, strict=True)
                    if not bound.admits(float(off.max()))
                ],
            )
        ],
        x_label=motion.x_label,
        y_label=motion.y_label,
        motion=[Line.of(curve) for curve in motion.curves],
        error_label="attitude error [rad]",
        errors={"RK4": Line(label="attitude error", x=list(ours["time"]), y=list(differences[0]))},
    )


def _flown(path: Path, settings: tuple[str, ...]) -> Mapping[str, Array]:
    with tempfile.TemporaryDirectory() as folder:
        log = run(path, overrides=settings, out=folder).log
        return log.read("/truth", ["attitude", "rate", "position"])


def _differences(
    scenario: Scenario, ours: Mapping[str, Array], theirs: Mapping[str, Any]
) -> tuple[Array, Array, Array]:
    """Return how far attitude [rad], rate [rad/s] and position [m] are apart, (n,) each."""
    quaternions = attitude.from_mrp(np.array(theirs["mrp"]))
    place = ours["position"] + orbit_position(scenario.environment.orbit, ours["time"])
    return (
        attitude.rotation_angle(ours["attitude"], quaternions),
        np.linalg.norm(ours["rate"] - theirs["rate"], axis=1),
        np.linalg.norm(place - theirs["position"], axis=1),
    )
