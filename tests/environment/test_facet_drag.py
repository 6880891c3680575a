"""Drag on flat facets: the closed form of one plate, the atmosphere, and fourth order in flight."""

from typing import Any

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment import kepler
from mjspace.environment.constants import RADIUS
from mjspace.environment.earth_rotation import EARTH_ROTATION
from mjspace.environment.facet_drag import ATMOSPHERE, FacetDrag
from mjspace.environment.facets import Facet
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.environment.orbit import Orbit
from mjspace.scenario.environment import Environment

BODY = """<mujoco><option integrator="RK4" gravity="0 0 0">
  <flag contact="disable" constraint="disable" autoreset="disable"/></option>
<worldbody><body name="bus"><freejoint/>
  <inertial pos="0 0 0" mass="50" diaginertia="12 14 5"/>
</body></worldbody></mujoco>"""
ORBIT = Orbit(semi_major_axis=6.778e6, eccentricity=0.01, inclination=0.9, true_anomaly=0.4)
PLATE = Facet(area=3.0, normal=[-2.0, 2.0, 0.0], position=[0.3, -0.8, 0.5], drag_coefficient=2.4)
TUMBLING = np.array([0.8, -0.2, 0.4, 0.4])  # a unit quaternion


@pytest.fixture(autouse=True, scope="module")
def _installed() -> None:
    install_callbacks()


def compiled(drag: FacetDrag | None, orbit: Orbit, step: float = 1.0) -> tuple[Any, Any]:
    """Return the model of ``BODY`` and its data, with this drag in this orbit."""
    outside = Environment(orbit=orbit, facet_drag=drag)
    spec = mujoco.MjSpec.from_string(BODY)
    spec.option.timestep = step
    spec.nuserdata = userdata_size(outside)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, outside)
    return model, data


def wrench(drag: FacetDrag, orbit: Orbit, time: float, qpos: Array, qvel: Array) -> Array:
    """Return the force [N], inertial axes, and torque [N m], body axes, of the drag alone."""
    both = []
    for term in (drag, None):
        model, data = compiled(term, orbit)
        data.time, data.qpos[:], data.qvel[:] = time, qpos, qvel
        mujoco.mj_forward(model, data)
        both.append(data.qfrc_passive.copy())
    difference: Array = both[0] - both[1]
    return difference


@pytest.mark.parametrize("corotating", [True, False])
def test_one_plate_feels_the_closed_form(corotating: bool) -> None:
    altitude, density, scale_height = 350e3, 1e-7, 50e3
    drag = FacetDrag(
        facets=[PLATE],
        density=density,
        reference_altitude=altitude,
        scale_height=scale_height,
        corotating=corotating,
    )
    offset, drift, rate = np.array([3e3, -1e3, 2e3]), np.array([3.0, -20.0, 9.0]), [0.4, -5.0, 7.0]
    elements = ORBIT.elements()
    place = np.array(kepler.position(elements, 700.0)) + offset
    spin = [0.0, 0.0, EARTH_ROTATION if corotating else 0.0]
    air = np.cross(spin, place)
    body = attitude.conjugate(TUMBLING)
    flow = attitude.rotate(body, np.array(kepler.velocity(elements, 700.0)) + drift - air)
    flow = flow + np.cross(rate, PLATE.position)
    normal = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0)
    assert normal @ flow > 1e3
    here = density * np.exp(-(np.linalg.norm(place) - RADIUS["earth"] - altitude) / scale_height)
    force = -0.5 * here * 2.4 * 3.0 * (normal @ flow) * flow
    found = wrench(drag, ORBIT, 700.0, np.concatenate([offset, TUMBLING]), [*drift, *rate])
    # rounding of the altitude, 1e-9 m of 50 km, and of gravity, 1e-2 N, that is subtracted
    np.testing.assert_allclose(found[:3], attitude.rotate(TUMBLING, force), rtol=1e-12)
    np.testing.assert_allclose(found[3:], np.cross(PLATE.position, force), rtol=1e-12)


def test_facets_add_up_and_a_rear_side_feels_nothing() -> None:
    turned = Facet(area=1.0, normal=[-1.0, 0.0, 0.2], position=[0.0, 1.0, 0.0])
    rear = PLATE.model_copy(update={"normal": [2.0, -2.0, 0.0]})
    state = np.concatenate([np.zeros(3), TUMBLING]), np.zeros(6)
    one, other, behind, all_three = (
        wrench(FacetDrag(facets=facets, density=1e-9), ORBIT, 0.0, *state)
        for facets in ([PLATE], [turned], [rear], [rear, PLATE, turned])
    )
    np.testing.assert_array_equal(behind, 0.0)
    assert np.linalg.norm(one) > 0.1
    assert np.linalg.norm(other) > 0.01
    np.testing.assert_allclose(all_three, one + other, rtol=1e-12, atol=1e-16)


def test_fourth_order_in_the_step() -> None:
    # A plate behind the centre of mass, as the feathers of an arrow, swings like a pendulum of
    # 300 s within 60 deg of the flow.
    plate = Facet(area=10.0, normal=[1.0, 0.0, 0.0], position=[-1.0, 0.1, 0.2])
    drag = FacetDrag(facets=[plate], density=1e-11, reference_altitude=4e5, scale_height=5e4)
    elements = ORBIT.elements()
    ahead = np.array(kepler.velocity(elements, 0.0))
    half = np.array([np.linalg.norm(ahead) + ahead[0], 0.0, -ahead[2], ahead[1]])
    ends = []
    for step in (4.0, 2.0, 1.0, 0.5):
        model, data = compiled(drag, ORBIT, step)
        data.qpos[3:7], data.qvel[3:6] = half / np.linalg.norm(half), [0.0, 0.008, -0.004]
        smallest = 1.0
        for k in range(round(640.0 / step)):
            mujoco.mj_step(model, data)
            flow = np.array(kepler.velocity(elements, (k + 1) * step))
            nose = attitude.rotate(data.qpos[3:7], np.array([1.0, 0.0, 0.0]))
            smallest = min(smallest, nose @ flow / np.linalg.norm(flow))
        assert 0.0 < smallest < 0.9  # it swings, and the flow never reaches the rear side
        ends.append(np.concatenate([1e-3 * data.qpos[:3], data.qpos[3:7]]))
    changes = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    orders = -np.diff(np.log2(changes))
    # a force held over the step gives 1
    assert np.all(np.abs(orders - 4.0) < 0.2), orders


def density_of(drag: FacetDrag, altitude: float) -> float:
    """Return the density [kg/m^3] by the drag on a plate that faces the flow, in still air."""
    orbit = Orbit(semi_major_axis=RADIUS["earth"] + altitude)
    state = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), np.zeros(6)
    force = wrench(drag, orbit, 0.0, *state)[1]
    speed = kepler.velocity(orbit.elements(), 0.0)[1]
    return -2.0 * force / (2.2 * speed**2)


@pytest.mark.parametrize("row", range(len(ATMOSPHERE)))
def test_default_atmosphere_is_the_table(row: int) -> None:
    plate = Facet(area=1.0, normal=[0.0, 1.0, 0.0], position=[0.0, 0.0, 0.0])
    drag = FacetDrag(facets=[plate], corotating=False)
    altitude, density, scale_height = ATMOSPHERE[row]
    found = density_of(drag, 1e3 * altitude + 1e3)
    # to 1e-9 m of altitude
    assert found == pytest.approx(density * np.exp(-1.0 / scale_height), rel=1e-10)


def test_the_tables_rows_join() -> None:
    rise = np.diff(ATMOSPHERE[:, 0])
    above = ATMOSPHERE[:-1, 1] * np.exp(-rise / ATMOSPHERE[:-1, 2])
    # rounding of five digits; 2e-5 measured
    np.testing.assert_allclose(above, ATMOSPHERE[1:, 1], rtol=5e-5)


FACETS = {"facets": [{"area": 1.0, "normal": [1.0, 0.0, 0.0], "position": [0.0, 0.0, 0.0]}]}
HIGH = {"semi_major_axis": 7e6}


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        ({"facet_drag": FACETS}, "facet_drag: needs an orbit"),
        (
            {"facet_drag": FACETS, "orbit": {"body": "moon", "semi_major_axis": 3e6}},
            "facet_drag.density: none is known of the moon: give one",
        ),
        (
            {"facet_drag": FACETS, "orbit": {"semi_major_axis": 6.5e6}},
            r"lowest altitude, 121\.863 km, is below 150 km, .* begins: give a density",
        ),
        (
            {"facet_drag": FACETS | {"density": 1e-12, "scale_height": 5e4}, "orbit": HIGH},
            "reference_altitude and scale_height: give both or neither",
        ),
        (
            {
                "facet_drag": FACETS | {"reference_altitude": 4e5, "scale_height": 5e4},
                "orbit": HIGH,
            },
            "scale_height: needs the density at reference_altitude",
        ),
        (
            {"facet_drag": {"facets": []}, "orbit": HIGH},
            r"facet_drag: needs \[\[environment.facets\]\], or facets of its own, not both",
        ),
    ],
)
def test_drag_without_air_is_refused(environment: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Environment.model_validate(environment)
