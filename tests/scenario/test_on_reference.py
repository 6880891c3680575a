"""Flights that begin on their reference: its attitude and rate, a trajectory's place too."""

from pathlib import Path

import numpy as np
import pytest

from mjspace.contract import Trajectory
from mjspace.errors import InputError
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

SWEEP = "reference={kind='references:Turning',rate=[0.01,-0.02,0.03],attitude=[0.6,0,0.8,0]}"


def test_attitude_and_rate_are_the_references(tmp_path: Path) -> None:
    changes = [SWEEP, "duration=0.1", "checks=[]", "initial={on_reference=true}"]
    log = run("detumble-wheels", overrides=changes, out=tmp_path / "it").log
    truth, desired = log.read("/truth"), log.read("/reference")
    assert np.allclose(truth["attitude"][0], [0.6, 0.0, 0.8, 0.0], atol=1e-15)
    assert np.array_equal(truth["rate"][0], desired["rate"][0])
    assert truth["attitude_error"][0] < 1e-7
    flown = log.attachment("scenario.toml").decode()
    assert "rate = [\n    0.01,\n    -0.02,\n    0.03,\n]" in flown  # written out
    assert "on_reference = false" in flown


def test_place_and_velocity_are_those_of_a_trajectory() -> None:
    built = assemble(*load("station-keeping", ["initial={on_reference=true}"]))
    start = built.reference.at(np.zeros(1))
    assert isinstance(start, Trajectory)
    assert np.array_equal(built.qpos[:3], start.position[0])
    assert np.array_equal(built.qvel[:3], start.velocity[0])
    assert np.linalg.norm(built.qpos[:3]) > 10.0


def test_what_is_given_as_well_is_refused() -> None:
    with pytest.raises(InputError, match=r"initial\.rate and on_reference are both given"):
        load("detumble-wheels", ["initial={on_reference=true,rate=[0,0,1]}"])
