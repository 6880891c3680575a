"""Solar pressure on facets: a plate, a cube and a sphere, distance and shadow."""

from datetime import datetime
from typing import Any

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment import sun
from mjspace.environment.facets import Facet
from mjspace.environment.install import (
    install_callbacks,
    places_read,
    userdata,
    userdata_size,
)
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.environment.solar_pressure import SolarPressure
from mjspace.scenario.environment import Environment
from mjspace.scenario.plant import PlantTable

BODY = """<mujoco><option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/></option>
<worldbody><body name="bus"><freejoint/>
  <inertial pos="0 0 0" mass="50" diaginertia="10 10 10"/>
</body></worldbody></mujoco>"""
TUMBLING = np.array([0.8, -0.2, 0.4, 0.4])
EPOCH = datetime(2026, 7, 1, 6)
DAYSIDE = Orbit(semi_major_axis=7e6, ascending_node=1.7)  # the Sun is at 100 deg
AU, PRESSURE = 149597870700.0, 4.56e-6


@pytest.fixture(autouse=True, scope="module")
def _installed() -> None:
    install_callbacks()


def wrench(
    facets: list[Facet], orbit: Orbit = DAYSIDE, epoch: datetime = EPOCH, offset: Any = (0, 0, 0)
) -> Array:
    """Return the force [N] and torque [N m] of the Sun, body axes."""
    outside = Environment(epoch=epoch, orbit=orbit, facets=facets, solar_pressure=SolarPressure())
    spec = mujoco.MjSpec.from_string(BODY)
    spec.nuserdata = userdata_size(outside)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, outside)
    (place,) = places_read("sun_position", outside, PlantTable())
    cubic = sun.along(epoch, 1.0, 100.0).rows(0.0)
    both = []
    for acts in (True, False):
        data.userdata[place : place + 13] = cubic
        if not acts:
            data.userdata[place + 15] = 0.0  # the pressure
        data.qpos[:] = [*offset, *TUMBLING]
        mujoco.mj_forward(model, data)
        both.append(data.qfrc_passive.copy())
    force = attitude.rotate(attitude.conjugate(TUMBLING), both[0][:3] - both[1][:3])
    return np.concatenate([force, both[0][3:] - both[1][3:]])


def to_sun(orbit: Orbit = DAYSIDE, epoch: datetime = EPOCH) -> tuple[Array, float]:
    """Return the unit vector to the Sun, body axes, and the pressure there [N/m^2]."""
    sight = sun.position(epoch, np.zeros(1))[0] - orbit_position(orbit, 0.0)
    distance = float(np.linalg.norm(sight))
    body = attitude.rotate(attitude.conjugate(TUMBLING), sight / distance)
    return body, PRESSURE * (AU / distance) ** 2


def momentum_of_light(facet: Facet, sight: Array, pressure: float) -> Array:
    """Return the force [N] on a plate by what comes and what is reflected, each by itself."""
    n, cosine = facet.outward, facet.outward @ sight
    if cosine <= 0.0:
        return np.zeros(3)
    power = pressure * facet.area * cosine
    mirrored = 2.0 * cosine * n - sight
    comes = -power * sight
    mirror = -power * facet.specular * mirrored
    lambert = -power * facet.diffuse * 2.0 / 3.0 * n
    return comes + mirror + lambert


@pytest.mark.parametrize(
    ("specular", "diffuse"), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.35, 0.25)]
)
def test_a_plate_takes_the_momentum_of_light(specular: float, diffuse: float) -> None:
    sight, pressure = to_sun()
    plate = Facet(
        area=3.0,
        normal=(sight + np.array([0.5, -0.2, 0.4])).tolist(),
        position=[0.3, -0.8, 0.5],
        specular=specular,
        diffuse=diffuse,
    )
    force = momentum_of_light(plate, sight, pressure)
    found = wrench([plate])
    np.testing.assert_allclose(found[:3], force, rtol=0, atol=1e-12 * float(np.linalg.norm(force)))
    torque = np.cross(plate.position, force)
    np.testing.assert_allclose(
        found[3:], torque, rtol=0, atol=1e-12 * float(np.linalg.norm(torque))
    )
    away = plate.model_copy(update={"normal": (-np.array(plate.normal)).tolist()})
    np.testing.assert_array_equal(wrench([away]), 0.0)


def test_a_plate_that_faces_the_sun() -> None:
    # 1, 2 and 5/3 of p A
    sight, pressure = to_sun()
    for specular, diffuse, factor in ((0.0, 0.0, 1.0), (1.0, 0.0, 2.0), (0.0, 1.0, 5.0 / 3.0)):
        plate = Facet(
            area=2.0, normal=sight.tolist(), position=[0, 0, 0], specular=specular, diffuse=diffuse
        )
        expected = -factor * pressure * 2.0 * sight
        np.testing.assert_allclose(wrench([plate])[:3], expected, rtol=0, atol=1e-17)


def test_a_cube() -> None:
    # absorbing: the force is along the light and of the shadow's area, |s_x| + |s_y| + |s_z|
    sight, pressure = to_sun()
    sides = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    black = [Facet(area=1.0, normal=n.tolist(), position=(0.5 * n).tolist()) for n in sides]
    found = wrench(black)
    expected = -pressure * np.abs(sight).sum() * sight
    np.testing.assert_allclose(found[:3], expected, rtol=0, atol=1e-12 * pressure)
    np.testing.assert_allclose(found[3:], 0.0, atol=1e-12 * pressure)
    # mirrors: each side takes twice its share, -2 p s |s|
    mirrors = [side.model_copy(update={"specular": 1.0}) for side in black]
    expected = -2.0 * pressure * sight * np.abs(sight)
    np.testing.assert_allclose(wrench(mirrors)[:3], expected, rtol=0, atol=1e-12 * pressure)


def test_a_sphere() -> None:
    # pi r^2 p (1 + 4/9 diffuse), whatever is reflected as by a mirror
    sight, pressure = to_sun()
    rings = 24
    facets = []
    for i in range(rings):
        low, high = np.cos(np.pi * i / rings), np.cos(np.pi * (i + 1) / rings)
        z = 0.5 * (low + high)
        for k in range(2 * rings):
            angle = np.pi * (k + 0.5) / rings
            n = [np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z]
            area = np.pi / rings * (low - high)
            facets.append(Facet(area=area, normal=n, position=n, specular=0.4, diffuse=0.3))
    found = wrench(facets)
    expected = -np.pi * pressure * (1.0 + 4.0 / 9.0 * 0.3) * sight
    near = 3e-3 * float(np.linalg.norm(expected))
    # facets of 7 deg: second order, 1e-3 measured
    np.testing.assert_allclose(found[:3], expected, rtol=0, atol=near)
    np.testing.assert_allclose(found[3:], 0.0, atol=near)


def test_nearer_to_the_sun_it_is_stronger() -> None:
    # perihelion on 3 January and aphelion on 6 July: (1.01671 / 0.98330)^2 = 1.0691
    plates = [
        Facet(area=1.0, normal=n.tolist(), position=[0, 0, 0])
        for axis in np.eye(3)
        for n in (axis, -axis)
    ]
    forces = []
    for epoch, node in ((datetime(2026, 1, 3, 17), 4.9), (datetime(2026, 7, 6, 17), 1.8)):
        orbit = Orbit(semi_major_axis=7e6, ascending_node=node)
        sight, _ = to_sun(orbit, epoch)
        force = np.linalg.norm(wrench(plates, orbit, epoch)[:3])
        forces.append(force / np.abs(sight).sum())
    # the distances to five digits
    assert forces[0] / forces[1] == pytest.approx((1.01664 / 0.98330) ** 2, rel=2e-4)


def test_the_shadow_takes_it_away() -> None:
    behind = Orbit(semi_major_axis=7e6, ascending_node=1.7 + np.pi)
    side = Facet(area=1.0, normal=[1, 0, 0], position=[0, 1, 0])
    other = side.model_copy(update={"normal": [-1.0, 0.0, 0.0]})
    np.testing.assert_array_equal(wrench([side, other], behind), 0.0)
    # the bus itself is what is in the shadow, not the frame's origin
    out = wrench([side, other], behind, offset=(0.0, 0.0, 7e6))
    assert np.linalg.norm(out[:3]) > 1e-7


SIDE = {"area": 1.0, "normal": [1.0, 0.0, 0.0], "position": [0.0, 0.0, 0.0]}
ORBIT = {"semi_major_axis": 7e6}


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        ({"epoch": EPOCH, "orbit": ORBIT}, r"solar_pressure: needs \[\[environment.facets\]\]"),
        ({"orbit": ORBIT, "facets": [SIDE]}, "solar_pressure: needs an epoch and an orbit"),
        (
            {"epoch": EPOCH, "orbit": ORBIT, "facets": [SIDE | {"specular": 0.7, "diffuse": 0.4}]},
            "specular and diffuse: their sum is 1.1, should be at most 1",
        ),
        ({"epoch": "2100-01-01", "orbit": ORBIT}, "2100-01-01: the Sun's place is known from 1900"),
        ({"epoch": 7, "orbit": ORBIT}, "epoch: got 7|got 7, should be a date"),
    ],
)
def test_what_is_refused(environment: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Environment.model_validate(environment | {"solar_pressure": {}})
