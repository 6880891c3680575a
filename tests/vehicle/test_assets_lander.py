"""The lander's model and the Moon's grounds: what touches, what is level, how it all looks."""

from copy import copy
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.actuators.reaction_wheels import Wheels
from mjspace.contract import Array
from mjspace.errors import NoRendererError
from mjspace.rendering import plume
from mjspace.rendering.offscreen import Canvas
from mjspace.scenario.plant import PlantTable
from mjspace.vehicle import composition
from mjspace.vehicle.ground import Ground

ASSETS = Path(__file__).parents[2] / "assets"
GROUNDS = ["moon_plain", "moon_craters"]
PADS = {f"leg_{i}_pad" for i in range(4)}
SHELL = {"shell", "shell_top", "engine_shell", *(f"knee_{i}" for i in range(4))}
HALF = 100.0  # m, half the edge of the ground that is landed on
HIDDEN = 5  # geom group
WEIGHT = 1.62  # m/s^2


def landscape(ground: str, **table: float) -> Any:
    place = Ground(part=ground, **table)
    plant = PlantTable(model="lander", wheels=Wheels(axes=[]), ground=place)
    return composition.compose(plant).spec.compile()


def height(model: Any, x: float, y: float) -> float:
    """Return the height [m] of what lies under a place, the lander being elsewhere."""
    data, hit = mujoco.MjData(model), np.zeros(1, np.int32)
    data.qpos[:3] = 0.0, 0.0, 1e4
    mujoco.mj_kinematics(model, data)
    down = np.array([0.0, 0.0, -1.0])
    start = np.array([x, y, 100.0])
    return 100.0 - mujoco.mj_ray(model, data, start, down, None, 1, -1, hit)


@pytest.mark.parametrize("ground", GROUNDS)
def test_pads_and_shell_touch_the_ground_and_nothing_else_does(ground: str) -> None:
    model = landscape(ground)
    names = [model.geom(i).name for i in range(model.ngeom)]
    assert {names[i] for i in np.flatnonzero(model.geom_contype)} == PADS | SHELL
    assert {names[i] for i in np.flatnonzero(model.geom_conaffinity)} == {"site_ground"}
    assert {names[i] for i in np.flatnonzero(model.geom_group == HIDDEN)} == SHELL
    for file in ("lander/scene.xml", f"parts/{ground}/{ground}.xml"):
        for geom in mujoco.MjSpec.from_file(str(ASSETS / file)).geoms:
            assert geom.mass == 0.0, geom.name


def test_the_site_is_level_and_the_ground_meets_what_is_around_it() -> None:
    model = landscape("moon_craters")
    heights = [height(model, x, y) for x in np.linspace(-8, 8, 9) for y in np.linspace(-8, 8, 9)]
    assert height(model, 0.0, 0.0) == pytest.approx(0.0, abs=1e-6)  # single precision
    assert 0.1 < np.ptp(heights) < 1.0  # m; 0.6 measured: level, but not perfectly
    across = [height(model, x, 0.0) for x in np.linspace(-90.0, 90.0, 91)]
    assert np.ptp(across) > 2.0  # m: craters
    for along in np.linspace(-90.0, 90.0, 7):
        for edge in (-HALF, HALF):
            assert abs(height(model, along, 0.999 * edge)) < 0.02
            assert abs(height(model, 1.001 * edge, along)) < 0.02


@pytest.mark.parametrize("ground", GROUNDS)
def test_it_stands_where_it_comes_down(ground: str) -> None:
    model = landscape(ground)
    data = mujoco.MjData(model)
    model.opt.gravity[2] = -WEIGHT
    data.qpos[2] += 0.2
    hinges = [model.joint("engine_outer"), model.joint("engine_inner")]
    angle = [hinge.qposadr[0] for hinge in hinges]
    rate = [hinge.dofadr[0] for hinge in hinges]
    for _ in range(5000):
        data.ctrl[:2] = -300.0 * data.qpos[angle] - 7.3 * data.qvel[rate]
        mujoco.mj_step(model, data)
    assert data.time == pytest.approx(10.0)  # a reset would start it again
    assert [warning.number for warning in data.warning] == [0] * len(data.warning)
    # At rest: 1e-13 m/s measured on the plain, 1e-6 in the craters.
    assert np.abs(data.qvel).max() < 1e-5
    tilt = np.degrees(np.arccos(data.body("bus").xmat[8]))
    assert tilt < (1e-6 if ground == "moon_plain" else 5.0)  # deg; 2 measured in the craters
    # Each strut carries a quarter of the weight but its own foot's: 24.25 kg 1.62 / 2500 N/m.
    sunk = [data.joint(f"leg_{i}_strut").qpos[0] for i in range(4)]
    assert np.mean(sunk) == pytest.approx(24.25 * WEIGHT / 2500.0, rel=0.01)


def test_the_plume_leaves_the_nozzle_at_any_length() -> None:
    model = landscape("moon_plain")
    nozzle = model.body("engine_nozzle").id
    for name in ("engine_plume_core", "engine_plume", "engine_plume_veil"):
        geom = model.geom(name)
        assert geom.bodyid[0] == nozzle
        assert geom.group[0] == plume.PLUME
        # Its upper end lies at the throat, whatever its half length is scaled to.
        assert geom.pos[2] + geom.size[2] == pytest.approx(-0.22, abs=1e-12)
    assert not model.light("engine_glow").active[0]


def test_a_plume_is_as_long_as_the_thrust_and_keeps_its_root() -> None:
    model, option = landscape("moon_plain"), mujoco.MjvOption()
    engine, full = plume.Plume(model), model.geom("engine_plume").size[2]
    opacity = model.material("engine_plume").rgba[3]
    for share in (0.25, 1.0, 0.25):  # nothing of what was drawn before is left
        engine.burn(share, option)
        geom = model.geom("engine_plume")
        assert option.geomgroup[plume.PLUME]
        assert model.light("engine_glow").active[0]
        assert geom.size[2] == pytest.approx(share * full)
        assert geom.pos[2] + geom.size[2] == pytest.approx(-0.22, abs=1e-12)
        assert model.material("engine_plume").rgba[3] == pytest.approx(np.sqrt(share) * opacity)
    engine.burn(0.0, option)
    assert not option.geomgroup[plume.PLUME]
    assert not model.light("engine_glow").active[0]


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("tilt", [60.0, 120.0, 180.0])
def test_a_crash_does_not_sink(ground: str, tilt: float) -> None:
    model = landscape(ground)
    data = mujoco.MjData(model)
    model.opt.gravity[2] = -WEIGHT
    data.qpos[2] = 3.0
    data.qpos[3:7] = np.cos(np.radians(tilt / 2.0)), np.sin(np.radians(tilt / 2.0)), 0.0, 0.0
    data.qvel[2] = -10.0
    deepest = 0.0
    for _ in range(4000):
        mujoco.mj_step(model, data)
        deepest = min(deepest, data.contact.dist[: data.ncon].min(initial=0.0))
    assert [warning.number for warning in data.warning] == [0] * len(data.warning)
    assert deepest > -0.05  # m; 1.5 to 3.2 cm measured, on impact at 10 m/s
    lying = [data.geom(name).xpos for name in PADS | SHELL]
    assert min(z - height(model, x, y) for x, y, z in lying) > 0.0


def picture(model: Any, burning: float = 0.0) -> Array:
    """Return what the camera ``chase`` sees of a model that has not burnt before."""
    model, data = copy(model), mujoco.MjData(model)
    scene, view, option = mujoco.MjvScene(model, 500), mujoco.MjvCamera(), mujoco.MjvOption()
    engine = plume.Plume(model)
    engine.burn(burning, option)
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED.value, model.camera("chase").id
    mujoco.mj_forward(model, data)
    every = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, option, None, view, every, scene)
    engine.lift_shadow(scene)
    try:
        with Canvas(model, (320, 180)) as canvas:
            return canvas.draw(scene).astype(float)
    except NoRendererError as error:
        pytest.skip(str(error))


def test_a_picture_shows_sky_ground_shadow_and_plume() -> None:
    model = landscape("moon_plain")
    chase = picture(model)
    sky = chase[:25]
    assert np.median(sky) < 5.0
    assert (sky.max(axis=2) > 60.0).sum() > 5  # stars
    assert (sky[..., 2] > sky[..., 0] + 40.0).sum() > 20  # the Earth, blue
    ground = chase[-30:].mean(axis=2)
    assert 80.0 < np.median(ground) < 180.0
    model.light_castshadow[:] = False
    assert (picture(model).sum(axis=2) - chase.sum(axis=2) > 90.0).sum() > 400
    dark = picture(model).sum(axis=2)
    flame = [(picture(model, share).sum(axis=2) - dark > 60.0).sum() for share in (0.3, 1.0)]
    assert flame[0] > 20  # pixels; 40 and 64 measured
    assert flame[1] > 1.4 * flame[0]


def test_the_wide_camera_sees_the_whole_descent() -> None:
    model = landscape("moon_plain")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    eye, axes = data.camera("wide").xpos, data.camera("wide").xmat.reshape(3, 3)
    half = np.tan(np.radians(model.camera("wide").fovy[0]) / 2.0)
    for share in (1.0, 0.3, 0.05, 0.01, 0.0):  # along the paper's path, straight to the site
        x, y, z = (share * np.array([2000.0, 1500.0, 1000.0]) + [0.0, 0.0, 1.8] - eye) @ axes
        assert abs(y) < -0.9 * half * z
        assert abs(x) < -0.9 * half * 16.0 / 9.0 * z
