"""The residual dipole: moment x field, beside the coils' moment."""

from datetime import datetime

import numpy as np
import pytest
from pydantic import ValidationError

from mjspace import attitude
from mjspace.environment.geomagnetism import field_at
from mjspace.environment.orbit import orbit_position
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

MOMENT = np.array([0.3, -0.2, 0.5])
ALONE = ["duration=2", "checks=[]", f"environment.residual_dipole.moment={MOMENT.tolist()}"]


@pytest.mark.usefixtures("one_block")
def test_moment_times_field() -> None:
    torques = []
    for overrides in (ALONE, ALONE[:2]):
        built = assemble(*load("cubesat-6u", overrides))
        (block,) = fly(built, first_start(built, [0]))
        torques.append(block.rows["/disturbance"]["torque"][:, 0])
    # /disturbance is of the step that ends; the first row is before the field is known
    table, orbit = built.scenario.environment.magnetic_field, built.scenario.environment.orbit
    step = built.scenario.rates.control
    time = np.array([step])
    place = orbit_position(orbit, time)
    (field,) = field_at(table, datetime(2025, 1, 1), place, time)
    body = attitude.rotate(attitude.conjugate(block.rows["/truth"]["attitude"][1, 0]), field)
    # the coils and the gravity gradient are the same in both, but for the turn in a period: 1e-3
    np.testing.assert_allclose(torques[0][1] - torques[1][1], np.cross(MOMENT, body), rtol=2e-3)


def test_it_needs_a_field() -> None:
    with pytest.raises(ValidationError, match=r"residual_dipole: needs an \[environment.magnetic"):
        Environment.model_validate(
            {"orbit": {"semi_major_axis": 7e6}, "residual_dipole": {"moment": [0.0, 0.0, 1.0]}}
        )
