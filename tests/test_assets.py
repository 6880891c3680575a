"""Every model and part in assets/: complete, massless to look at, sound to fly, whole to see."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from mjspace import plant
from mjspace.contract import Array
from mjspace.errors import NoRendererError
from mjspace.offscreen import Canvas
from mjspace.tables import Initial, PlantTable, Rates, Wheels

ASSETS = Path(__file__).parent.parent / "assets"
MODELS = sorted(path.parent.name for path in ASSETS.glob("*/scene.xml"))
FILES = sorted(ASSETS.rglob("*.xml"))
ORDER = ["compiler", "option", "statistic", "visual", "include", "default", "asset", "worldbody"]
ORDER += ["tendon", "equality", "actuator", "sensor", "keyframe"]


def vehicle(model: str, wheels: Wheels | None = None) -> plant.Vehicle:
    return plant.build(PlantTable(model=model, wheels=wheels or Wheels()), Rates(), userdata=0)


def test_there_is_something_to_test() -> None:
    assert "satellite_3rw" in MODELS
    assert {path.parent.name for path in FILES} >= {"bus", "reaction_wheel", "space"}


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


@pytest.mark.parametrize("name", MODELS)
def test_nothing_drawn_has_mass_or_touches(name: str) -> None:
    model = vehicle(name).model
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    spec = mujoco.MjSpec.from_file(str(ASSETS / name / "scene.xml"))
    wheel = mujoco.MjSpec.from_file(str(ASSETS / "parts/reaction_wheel/reaction_wheel.xml"))
    for geom in [*spec.geoms, *wheel.geoms]:
        assert geom.mass == 0.0, geom.name
    # The planet weighs nothing, and the bus and three wheels of 2 kg are all there is.
    assert mujoco.mj_getTotalmass(model) == pytest.approx(106.0, rel=1e-15)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("count", [1, 3, 4])
def test_models_fly_under_random_control_without_a_warning(name: str, count: int) -> None:
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]][:count]
    flown = vehicle(name, Wheels(axes=axes, viscous_friction=1e-3, torque_limit=0.5))
    data = mujoco.MjData(flown.model)
    random = np.random.default_rng(count)
    data.qpos[:], data.qvel[:] = plant.initial_state(flown, Initial(rate=[0.3, -0.2, 0.1]))
    for _ in range(300):
        data.ctrl[:] = random.uniform(-1.0, 1.0, count)
        mujoco.mj_step(flown.model, data)
    assert np.isfinite(data.qpos).all()
    assert [warning.number for warning in data.warning] == [0] * len(data.warning)
    assert data.time == pytest.approx(0.3, rel=1e-12)  # a reset would start it again
    assert data.ncon == data.nefc == 0


@pytest.mark.parametrize("name", MODELS)
def test_models_have_the_names_that_others_look_up(name: str) -> None:
    model = vehicle(name).model
    assert model.joint("bus").qposadr[0] == model.joint("bus").dofadr[0] == 0
    assert model.body("bus").jntadr[0] == model.joint("bus").id
    for index in range(3):
        wheel = f"wheel_{index}"
        assert model.joint(wheel).bodyid[0] == model.body(wheel).id
        assert model.actuator(wheel).trnid[0] == model.joint(wheel).id
        assert model.actuator(wheel).id == index
    for camera in ("chase", "close", "wide"):
        model.camera(camera)
    assert model.geom("planet").bodyid[0] == 0


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


@pytest.mark.parametrize("name", MODELS)
def test_a_frame_shows_stars_planet_and_a_wheel_that_turns(name: str) -> None:
    flown = vehicle(name)
    data = mujoco.MjData(flown.model)
    mujoco.mj_forward(flown.model, data)
    chase, still = frame(flown.model, data, "chase"), frame(flown.model, data, "close")
    sky, below = chase[:60], chase[-20:]
    assert (sky.max(axis=2) > 60).sum() > 5  # stars
    assert np.median(sky) < 5  # on black
    assert (below.max(axis=2) > 30).mean() > 0.95  # the planet fills the lower edge
    data.qpos[7:] = np.pi / 2
    mujoco.mj_forward(flown.model, data)
    turned = np.abs(frame(flown.model, data, "close") - still).max(axis=2) > 40
    assert turned.sum() > 20  # the orange spoke has moved
