"""Models and parts in assets/: complete; satellites massless to look at, sound to fly, whole."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from mjspace import attitude
from mjspace.actuators.reaction_wheels import Wheels
from mjspace.contract import Array
from mjspace.errors import NoRendererError
from mjspace.rendering.offscreen import Canvas
from mjspace.scenario.plant import Initial, Part, PlantTable, Rates
from mjspace.vehicle import vehicle as plant

ASSETS = Path(__file__).parents[2] / "assets"
MODELS = sorted(path.parent.name for path in ASSETS.glob("*/scene.xml"))
SATELLITES = [name for name in MODELS if name.startswith("satellite")]
CMG = ["cmg_outer", "cmg_inner", "cmg_wheel"]
WHEELED = ["satellite_3rw"]  # by reaction wheels on the hull; any other by a CMG in its middle
FILES = sorted(ASSETS.rglob("*.xml"))
ORDER = ["compiler", "option", "statistic", "visual", "include", "default", "asset", "worldbody"]
ORDER += ["tendon", "equality", "actuator", "sensor", "keyframe"]


def vehicle(model: str, wheels: Wheels | None = None) -> plant.Vehicle:
    if model in WHEELED:
        return plant.build(PlantTable(model=model, wheels=wheels or Wheels()), Rates(), userdata=0)
    cmg = {"cmg": Part(part="dgvscmg")}
    table = PlantTable(model=model, wheels=wheels or Wheels(axes=[]), parts=cmg)
    return plant.build(table, Rates(physics=1e-4), userdata=0)


def test_there_is_something_to_test() -> None:
    assert set(MODELS) >= {"lander", "satellite_3rw", "satellite_dgvscmg"}
    assert {path.parent.name for path in FILES} >= {"bus", "reaction_wheel", "dgvscmg", "space"}


@pytest.mark.parametrize("name", MODELS)
def test_models_have_their_files(name: str) -> None:
    for file in (f"{name}.xml", "README.md", f"{name}.png"):
        assert (ASSETS / name / file).is_file(), file
    assert (ASSETS / name / f"{name}.png").stat().st_size < 400_000


@pytest.mark.parametrize("part", sorted((ASSETS / "parts").iterdir()), ids=lambda path: path.name)
def test_parts_say_where_their_numbers_are_from(part: Path) -> None:
    assert (part / "README.md").is_file()


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.name)
def test_no_armature_no_balanced_inertia_and_sections_in_order(file: Path) -> None:
    root = ElementTree.parse(file).getroot()
    for element in root.iter():
        assert not {"armature", "balanceinertia"} & set(element.attrib), element.tag
    places = [ORDER.index(section.tag) for section in root]
    assert places == sorted(places)


@pytest.mark.parametrize("name", SATELLITES)
def test_nothing_drawn_has_mass_or_touches(name: str) -> None:
    model = vehicle(name).model
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    spec = mujoco.MjSpec.from_file(str(ASSETS / name / "scene.xml"))
    part = "reaction_wheel" if name in WHEELED else "dgvscmg"
    bolted_on = mujoco.MjSpec.from_file(str(ASSETS / f"parts/{part}/{part}.xml"))
    for geom in [*spec.geoms, *bolted_on.geoms]:
        assert geom.mass == 0.0, geom.name
    # The planet weighs nothing: there are the bus and three wheels of 2 kg, or gimbals and a wheel.
    total = 106.0 if name in WHEELED else 100.0 + 0.1 + 0.1 + 1.6
    assert mujoco.mj_getTotalmass(model) == pytest.approx(total, rel=1e-15)


@pytest.mark.parametrize("name", WHEELED)
@pytest.mark.parametrize("count", [1, 3, 4])
def test_models_fly_under_random_control_without_a_warning(name: str, count: int) -> None:
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]][:count]
    fly_at_random(vehicle(name, Wheels(axes=axes, viscous_friction=1e-3, torque_limit=0.5)), count)


def test_a_cmg_flies_under_random_control_without_a_warning() -> None:
    fly_at_random(vehicle("satellite_dgvscmg"), 3)


def fly_at_random(flown: plant.Vehicle, motors: int) -> None:
    data = mujoco.MjData(flown.model)
    random = np.random.default_rng(motors)
    data.qpos[:], data.qvel[:] = plant.initial_state(flown, Initial(rate=[0.3, -0.2, 0.1]))
    for _ in range(300):
        data.ctrl[:] = random.uniform(-1.0, 1.0, motors)
        mujoco.mj_step(flown.model, data)
    assert np.isfinite(data.qpos).all()
    assert [warning.number for warning in data.warning] == [0] * len(data.warning)
    # A reset would start it again.
    assert data.time == pytest.approx(300 * flown.model.opt.timestep, rel=1e-12)
    assert data.ncon == data.nefc == 0


@pytest.mark.parametrize("name", SATELLITES)
def test_models_have_the_names_that_others_look_up(name: str) -> None:
    model = vehicle(name).model
    assert model.joint("bus").qposadr[0] == model.joint("bus").dofadr[0] == 0
    assert model.body("bus").jntadr[0] == model.joint("bus").id
    moved = ["wheel_0", "wheel_1", "wheel_2"] if name in WHEELED else CMG
    for index, body in enumerate(moved):
        assert model.joint(body).bodyid[0] == model.body(body).id
        assert model.actuator(body).trnid[0] == model.joint(body).id
        assert model.actuator(body).id == index
    for camera in ("chase", "close", "wide"):
        model.camera(camera)
    assert model.geom("planet").bodyid[0] == 0


def test_a_cmg_is_the_sources() -> None:
    model = vehicle("satellite_dgvscmg").model
    data = mujoco.MjData(model)
    # Servín 2022, Table 2.1. The bus, then each body's inertia, alike about every axis [kg m^2].
    wanted = [[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]]
    bus = attitude.to_matrix(model.body("bus").iquat)
    inertia = bus @ np.diag(model.body("bus").inertia) @ bus.T
    np.testing.assert_allclose(inertia, wanted, rtol=0.0, atol=1e-12)  # measured 1.2e-13
    for name, moment in zip(CMG, [0.001, 0.001, 0.016], strict=True):
        np.testing.assert_array_equal(model.body(name).inertia, moment)
    assert not model.dof_damping.any()
    assert not model.actuator_ctrllimited.any()
    # Swung to any angles, axes meet at the origin: R = Rz(outer) Ry(inner) Rx(wheel).
    outer, inner = 0.7, -0.4
    data.qpos[7:] = outer, inner, 1.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    first = model.joint("cmg_outer").id
    axes = [
        [0.0, 0.0, 1.0],
        [-np.sin(outer), np.cos(outer), 0.0],
        [np.cos(outer) * np.cos(inner), np.sin(outer) * np.cos(inner), -np.sin(inner)],
    ]
    np.testing.assert_allclose(data.xaxis[first:], axes, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(data.xanchor[first:], 0.0)
    np.testing.assert_array_equal(data.subtree_com[model.body("bus").id], 0.0)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, -1, 0], [1, 1, 1], [-2, 1, 3]])
def test_wheels_are_drawn_on_their_axis_outside_the_hull(axis: list[float]) -> None:
    flown = vehicle("satellite_3rw", Wheels(axes=[axis]))
    model, data = flown.model, mujoco.MjData(flown.model)
    mujoco.mj_forward(model, data)
    rim = data.geom("wheel_0_rim").xpos
    unit = np.array(axis) / np.linalg.norm(axis)
    np.testing.assert_allclose(np.cross(rim, unit), 0.0, atol=1e-6)  # the mesh's own rounding
    assert np.dot(rim, unit) > 0.0
    assert np.max(np.abs(rim) / model.geom("bus_hull").size) > 1.0
    np.testing.assert_allclose(data.body("wheel_0").xipos, 0.0, atol=1e-15)  # where its mass is


def test_wheels_with_a_place_are_drawn_there() -> None:
    place = [0.1, 0.2, 0.3]
    flown = vehicle("satellite_3rw", Wheels(axes=[[0, 1, 0]], positions=[place]))
    data = mujoco.MjData(flown.model)
    mujoco.mj_forward(flown.model, data)
    np.testing.assert_allclose(data.geom("wheel_0_rim").xpos, place, atol=1e-6)  # as above
    np.testing.assert_allclose(data.body("wheel_0").xipos, place, atol=1e-15)


def frame(model: Any, data: Any, camera: str) -> Array:
    scene = mujoco.MjvScene(model, maxgeom=500)
    view = mujoco.MjvCamera()
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED.value, model.camera(camera).id
    every = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, view, every, scene)
    try:
        with Canvas(model, (320, 180)) as canvas:
            return canvas.draw(scene).astype(float)
    except NoRendererError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("name", SATELLITES)
def test_a_frame_shows_stars_planet_and_a_wheel_that_turns(name: str) -> None:
    flown = vehicle(name)
    data = mujoco.MjData(flown.model)
    mujoco.mj_forward(flown.model, data)
    chase, still = frame(flown.model, data, "chase"), frame(flown.model, data, "close")
    sky, below = chase[:60], chase[-20:]
    assert (sky.max(axis=2) > 60).sum() > 5  # stars
    assert np.median(sky) < 5  # on black
    assert (below.max(axis=2) > 30).mean() > 0.95  # the planet fills the lower edge
    moved = [slice(7, None)] if name in WHEELED else [slice(7, 8), slice(8, 9), slice(9, 10)]
    for joints in moved:
        data.qpos[7:] = 0.0
        data.qpos[joints] = np.pi / 2
        mujoco.mj_forward(flown.model, data)
        turned = np.abs(frame(flown.model, data, "close") - still).max(axis=2) > 40
        assert turned.sum() > 20  # the orange spoke has moved, or a gimbal
