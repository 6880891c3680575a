"""Actuators of two kinds at once: each obeys its own field of the command, and both act."""

from pathlib import Path

import numpy as np
import pytest

from mjspace.assembly import assemble
from mjspace.errors import FlightError
from mjspace.flight import run
from mjspace.loading import load
from mjspace.replay import verify
from mjspace.simulation import fly
from mjspace.start import first_start

LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray
    thruster_torque: np.ndarray

class Both:
    batched = True
    def reset(self, measurement, reference):
        return ()
    def step(self, state, time, measurement, reference):
        one = np.ones_like(measurement.rate)
        return state, Command([0.3, 0.0, 0.0] * one, [0.0, 0.02, 0.01] * one), ()
"""
BOTH = ["plant.ideal_thrusters=true", "environment.torques=[]", "duration=2", "checks=[]"]


@pytest.fixture
def overrides(tmp_path: Path) -> list[str]:
    (tmp_path / "law.py").write_text(LAW)
    return [*BOTH, f"law={{kind='{tmp_path}/law.py:Both'}}"]


def test_wheels_exchange_momentum_and_thrusters_bring_it(
    overrides: list[str], tmp_path: Path
) -> None:
    flown = run("dgvscmg-against-wheels", overrides=overrides, out=tmp_path / "flight")
    truth, command = flown.log.read("/truth"), flown.log.read("/command")
    np.testing.assert_array_equal(command["wheel_torque"][5], [-0.3, 0.0, 0.0])
    np.testing.assert_array_equal(command["thruster_torque"][5], [0.0, 0.02, 0.01])
    brought = truth["momentum"][-1] - truth["momentum"][0]
    # in body axes, which turn by 0.06 rad; no wheel changes it
    np.testing.assert_allclose(brought, [0.0, 0.04, 0.02], atol=2e-3)
    spun = 0.016 * truth["wheel_speed"][-1]
    np.testing.assert_allclose(spun, [-0.6, 0.0, 0.0], atol=0.01)
    assert verify(flown.path) is None


def test_a_batch_is_as_one(overrides: list[str]) -> None:
    built = assemble(*load("dgvscmg-against-wheels", [*overrides, "duration=0.05"]))
    (one,), (many,) = (list(fly(built, first_start(built, range(n)), range(n))) for n in (1, 3))
    for vehicle in range(3):
        alone, beside = one.rows["/state"]["physics"][:, 0], many.rows["/state"]["physics"]
        np.testing.assert_array_equal(beside[:, vehicle], alone)


def test_a_law_that_forgets_one_is_told_so() -> None:
    built = assemble(*load("dgvscmg-against-wheels", BOTH))
    message = r"the law's command has no thruster_torque of shape \(\.\.\., 3\) \[N m\]"
    with pytest.raises(FlightError, match=message):
        list(fly(built, first_start(built, [0])))
