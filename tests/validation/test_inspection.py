"""What is recognized in a model file, beside what ``mjspace inspect`` shows (tests/cli)."""

from pathlib import Path

import numpy as np
import pytest

from mjspace.validation.inspection import inspect_file


def test_other_free_bodies_are_spacecraft_beside_the_vehicle(tmp_path: Path) -> None:
    path = tmp_path / "two.xml"
    free = '<body name="{}" pos="0 0 {}"><freejoint/><geom size="0.3" density="100"/></body>'
    bodies = free.format("chaser", 0) + free.format("target", 2)
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    _, found = inspect_file(path, {})
    assert found.vehicle is not None
    assert (found.vehicle.bus, found.vehicle.beside) == ("chaser", ["target"])
    assert found.vehicle.mass == pytest.approx(100.0 * 4.0 / 3.0 * np.pi * 0.3**3)
