"""The map of the ground that flight software is given, against rays shot down on MuJoCo's field."""

import mujoco
import numpy as np
import pytest

from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.vehicle.ground import map_of

DOWN = np.array([0.0, 0.0, -1.0])


def model_of(*overrides: str) -> mujoco.MjModel:
    scenario, folder = load("lander-craters", list(overrides))
    return assemble(scenario, folder).vehicle.model


def test_its_heights_are_those_that_rays_find() -> None:
    model = model_of()
    ground = map_of(model)
    heights, spacing = ground["ground_heights"], ground["ground_spacing"]
    assert heights.shape == (257, 257)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    field = model.geom("site_ground").id
    for row, column in np.random.default_rng(0).integers(1, 256, (50, 2)):
        x, y = (column - 128) * spacing, (row - 128) * spacing
        way = mujoco.mj_rayHfield(model, data, field, np.array([x, y, 100.0]), DOWN)
        # a centimetre of the map
        assert 100.0 - way == pytest.approx(heights[row, column], abs=0.0051)


@pytest.mark.parametrize("override", ["plant.ground.part=moon_plain", "plant.ground.slope=0.1"])
def test_a_plane_and_a_turned_field_have_none(override: str) -> None:
    assert map_of(model_of(override)) == {}
