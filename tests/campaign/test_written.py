"""A scenario written as a folder of its own flies without the folder that it came from."""

from pathlib import Path

import pytest

from mjspace.campaign.written import write_scenario
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

OWN = {
    "law": "from mjspace.controllers.attitude.pd_plus import Modified as Own\n",
    "estimator": "from mjspace.controllers.determination.mekf import MEKF as Own\n",
    "reference": "from mjspace.controllers.references.references import Hold as Own\n",
}
KEYS = {
    "estimator": 'gyro_noise = "20 deg/h"\ngyro_bias = "0.1 deg/s"\nattitude_noise = "1 mrad"\n',
    "reference": "attitude = [1, 0, 0, 0]\n",
}


@pytest.mark.parametrize("role", list(OWN))
def test_the_users_files_go_with_it(tmp_path: Path, role: str) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    (here / "mine.py").write_text(OWN[role] + "\n\nclass Mine(Own):\n    pass\n")
    path = here / "own.toml"
    base = 'base = "estimated-attitude"\n'
    path.write_text(f'{base}[{role}]\nkind = "mine.py:Mine"\n{KEYS.get(role, "")}')
    written = write_scenario(assemble(*load(path)), there)
    (here / "mine.py").unlink()
    built = assemble(*load(written))
    assert built.scenario.kinds[role] == f"{role}.py:Mine"
