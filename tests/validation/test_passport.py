"""The passport of any model: what it finds, and that its advice is good."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjspace.attitude import rotation_angle
from mjspace.validation import passport, stand
from mjspace.validation.benchmark import Conditions
from mjspace.validation.passport import Passport

WHEEL = """
<mujoco>
  <option integrator="RK4" timestep="0.01" gravity="0 0 0">
    <flag contact="disable" autoreset="disable"/>
  </option>
  <worldbody>
    <body name="bus"><freejoint/>
      <inertial pos="0 0 0" mass="100" diaginertia="10 12 14"/>
      <body><joint name="wheel" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="2" diaginertia="0.006 0.006 0.01"/></body>
    </body>
  </worldbody>
  <keyframe><key qpos="0 0 0 1 0 0 0 0" qvel="0 0 0 0.02 -0.015 0.03 600"/></keyframe>
</mujoco>
"""


def issued(xml: str, folder: Path) -> Passport:
    path = folder / "model.xml"
    path.write_text(xml)
    return passport.issue(path)


def test_a_sound_model_passes(tmp_path: Path) -> None:
    found = issued(WHEEL, tmp_path)
    assert found.passed
    assert found.findings == []
    assert [row.quantity for row in found.rows] == [
        "angular momentum",
        "centre of mass",
        "energy",
        "order of convergence",
    ]
    assert found.rows[-1].measured == pytest.approx(4.0, abs=0.1)


def test_eulers_model_fails_where_momentum_shows_it(tmp_path: Path) -> None:
    found = issued(WHEEL.replace("RK4", "Euler"), tmp_path)
    assert not found.passed
    assert "first order" in found.findings[0].text
    rows = {row.quantity: row for row in found.rows}
    # 10 % of the bus rate within 100 s at 10 ms, seen against the bus and not the wheel
    assert rows["angular momentum"].measured > 1e-3
    assert not rows["angular momentum"].passed
    assert not rows["energy"].passed
    assert rows["order of convergence"].measured == pytest.approx(1.0, abs=0.1)


def test_armature_is_refused(tmp_path: Path) -> None:
    found = issued(WHEEL.replace('name="wheel"', 'name="wheel" armature="0.01"'), tmp_path)
    assert not found.passed
    assert found.findings[0].refused
    assert "armature" in found.findings[0].text


def test_a_damper_may_take_energy_and_not_give_any(tmp_path: Path) -> None:
    damped = WHEEL.replace('name="wheel"', 'name="wheel" damping="0.001" stiffness="0.01"')
    found = issued(damped.replace("600", "3"), tmp_path)
    assert "energy gained" in [row.quantity for row in found.rows]
    assert found.passed


def test_a_fixed_base_has_no_momentum_to_keep(tmp_path: Path) -> None:
    arm = WHEEL.replace("<freejoint/>", '<joint axis="1 0 0" stiffness="5"/>').replace(
        'qpos="0 0 0 1 0 0 0 0" qvel="0 0 0 0.02 -0.015 0.03 600"', 'qpos="0 0" qvel="0.3 20"'
    )
    found = issued(arm, tmp_path)
    assert [row.quantity for row in found.rows] == ["energy", "order of convergence"]


@pytest.mark.parametrize("goal", range(2))
def test_the_advised_step_errs_by_what_was_said(tmp_path: Path, goal: int) -> None:
    advised = float(issued(WHEEL, tmp_path).advice[goal].split()[3])
    duration = np.floor(60.0 / advised) * advised
    ends = []
    for step in (advised, advised / 4.0):
        model = mujoco.MjModel.from_xml_string(WHEEL)
        model.opt.timestep = step
        data = stand.start(model)
        data.qvel[:] = model.key_qvel[0]
        ends.append(stand.fly(Conditions(step), model, data, duration).qpos[-1, 3:7])
    error = rotation_angle(*ends)
    # it is found on ten seconds of the motion, and rounded to two digits
    assert 0.1 * passport.GOALS[goal] < error < 4.0 * passport.GOALS[goal]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("model.txt", WHEEL, r"MJCF \(.xml\), URDF \(.urdf or .xml\) or compiled \(.mjb\) file"),
        (
            "model.xml",
            "<mujoco><worldbody></mujoco>",
            "XML parse error 14, Error=.* name=worldbody$",
        ),
        ("model.xml", "<mujoco/>", "it has no joints"),
        ("model.xml", "", "empty file"),
        ("model.xml", "\0\1", "XML parse error"),
        ("model.xml", "<svg/>", "'svg'"),
        (
            "model.xml",
            WHEEL.replace('"0.01"', '"0"', 1),
            "its timestep is 0 s: it must be positive",
        ),
        ("model.xml", WHEEL.replace('"0.01"', '"-1"', 1), "its timestep is -1 s"),
        ("model.xml", WHEEL.replace("10 12 14", "1 1 3"), r"A \+ B >= C"),
        ("model.xml", '<mujoco><include file="nowhere.xml"/></mujoco>', "'nowhere.xml'"),
        ("model.urdf", "<robot/>", "it has no joints"),
        ("model.mjb", "<mujoco/>", "no compiled model of MuJoCo 4"),
        ("model.mjb", "", "no compiled model of MuJoCo 4"),
    ],
)
def test_models_that_will_not_do(tmp_path: Path, name: str, text: str, message: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as told:
        passport.issue(path)
    assert "\n" not in str(told.value)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere\.xml"):
        passport.issue(Path("nowhere.xml"))
