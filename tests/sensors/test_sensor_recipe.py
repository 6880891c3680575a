"""The recipe for a sensor in docs/extending.md, followed."""

import importlib
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from mjspace.runner.flight_log import units_of
from mjspace.scenario import sensors
from mjspace.scenario.loading import load, to_toml, validate
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.units import Unit

PAGE = (Path(__file__).parents[2] / "docs/extending.md").read_text()
RECIPE = PAGE.split("\n## A sensor\n")[1].split("\n## ")[0]
LAW = """
from mjspace.contract import TorqueCommand

class Leveller:
    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        return None, TorqueCommand(-0.1 * measurement.rate * measurement.spare), None
"""


def block(file: str) -> str:
    found = re.search(rf'^```\w+ title="\S*{file}"\n(.*?)^```$', RECIPE, re.M | re.S)
    assert found is not None, file
    return found[1]


def test_a_sensor_is_one_file_and_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "inclinometer.py").write_text(block("inclinometer.py"))
    (tmp_path / "law.py").write_text(LAW)
    monkeypatch.syspath_prepend(str(tmp_path))
    line = re.search(r'^    "(\w+)": "mjspace\.sensors\.(\w+:\w+)",$', RECIPE, re.M)
    assert line is not None
    monkeypatch.setitem(sensors.KINDS, line[1], line[2])
    flight = 'base = "detumble-wheels"\nduration = 1\nchecks = []\nevents = []\n'
    own = tmp_path / "own.toml"
    own.write_text(f'{flight}[law]\nkind = "law.py:Leveller"\n{block("sensors.toml")}')
    scenario, folder = load(own)
    built = assemble(scenario, folder)
    flown = list(fly(built, first_start(built, [0])))
    rows = {
        topic: {n: np.concatenate([b.rows[topic][n][:, 0] for b in flown]) for n in names}
        for topic, names in (
            ("/truth", ["inclination", "attitude"]),
            ("/measurement", ["inclination", "spare"]),
        )
    }
    true = rows["/truth"]["inclination"]
    quaternion = rows["/truth"]["attitude"]
    lean = 2.0 * np.arcsin(np.hypot(quaternion[:, 1], quaternion[:, 2]))
    np.testing.assert_allclose(true[:, 0], lean, atol=1e-7)  # arccos near 1
    noise = rows["/measurement"]["inclination"] - true
    assert np.std(noise) == pytest.approx(np.radians(0.1), rel=0.25)
    late = rows["/measurement"]["spare"][4:] - true[:-4]  # 20 ms are four periods
    assert np.ptp(late) < 1e-12
    assert abs(late[0, 0]) > 1e-4
    for topic in ("/truth", "/measurement"):
        assert units_of(built)[topic]["inclination"] == Unit("rad")
    assert units_of(built)["/measurement"]["spare"] == Unit("rad")
    assert validate(tomllib.loads(to_toml(scenario)), "again") == scenario
    importlib.invalidate_caches()
