"""The passport of what is no plain free flyer: judged rightly, or said to be beyond judgement."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjspace.validation import conservation, convergence, passport
from mjspace.validation.conservation import CONSERVED
from mjspace.validation.passport import Passport

OPTION = """<option gravity="0 0 0" integrator="RK4" timestep="{step}" {option}>
  <flag contact="disable" autoreset="disable"/></option>"""
BODY = '<inertial pos="0 0 0" mass="10" diaginertia="1 1.2 1.5"/>'
WHEEL = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/>'
TREE = """<worldbody>{world}
  <body name="bus"><freejoint/>{bus}
    <body name="rotor"><joint name="spin" axis="0 0 1" {joint}/>{rotor}</body></body></worldbody>"""


def issued(
    folder: Path,
    *,
    option: str = "",
    step: str = "0.01",
    head: str = "",
    tail: str = "",
    tree: str = TREE,
    name: str = "model.xml",
    **filled: str,
) -> Passport:
    parts = {"world": "", "bus": BODY, "joint": "", "rotor": WHEEL} | filled
    path = folder / name
    text = head + OPTION.format(option=option, step=step) + tree.format(**parts) + tail
    path.write_text(f"<mujoco>{text}</mujoco>")
    return passport.issue(path)


def quantities(found: Passport) -> list[str]:
    return [row.quantity for row in found.rows]


def told(found: Passport) -> str:
    return "\n".join(finding.text for finding in found.findings)


def drift(found: Passport) -> float:
    return next(row.measured for row in found.rows if row.quantity == "angular momentum")


def test_dry_friction_is_judged_but_for_order_and_step(tmp_path: Path) -> None:
    found = issued(tmp_path, joint='frictionloss="0.001"', option='tolerance="0"')
    assert found.passed
    assert quantities(found)[2:] == ["energy gained", "order of convergence"]
    assert found.rows[2].reason == "friction can only dissipate energy"
    assert found.rows[3].measured == pytest.approx(4.0, abs=0.1)
    assert found.unjudged == [
        "order and step with dry friction: discontinuous forces have no order; both are judged "
        "without"
    ]
    assert "keeps the attitude within" in found.advice[-1]


def test_a_lax_constraint_solver_is_told_and_not_flown(tmp_path: Path) -> None:
    small = '<inertial pos="0 0 0" mass="0.2" diaginertia="2e-5 2e-5 3.3e-5"/>'
    bus = BODY.replace("1 1.2 1.5", "0.2 0.22 0.25")
    case = {"joint": 'frictionloss="0.0005"', "rotor": small, "bus": bus, "step": "0.002"}
    found = issued(tmp_path, **case)
    assert found.passed
    assert drift(found) < 1e-12
    told = found.advice[0]
    assert told.startswith("the constraint solver's tolerance is 0 here, as in a scenario's flight")
    # 3e-5 measured: a rest of the bearing's torque that nothing takes up
    assert float(told.split("drifts by ")[1].split(" instead")[0]) > 100 * CONSERVED
    exact = issued(tmp_path, option='tolerance="0"', **case)
    assert drift(exact) == drift(found)
    assert not exact.advice[0].startswith("the constraint solver")


@pytest.mark.parametrize("beyond", ["", "80"])
def test_stops_count_where_they_are_reached(tmp_path: Path, beyond: str) -> None:
    joint = f'range="-{beyond}1 {beyond}1"'  # 1 or 801 degrees: 0.13 rad/s for a minute are 447
    found = issued(tmp_path, joint=joint, option='tolerance="0"')
    hidden = "energy: that of stops that are reached is not in MuJoCo's sum"
    assert (hidden in found.unjudged) == (not beyond)
    assert ("energy" in quantities(found)) == bool(beyond)
    assert found.rows[-1].measured == pytest.approx(4.0, abs=0.1)
    assert drift(found) < CONSERVED


def test_a_stop_that_is_hit_is_no_fault_of_the_model(tmp_path: Path) -> None:
    """Panels of unlike stops, one a hair beyond its own: thrown back in the first steps."""
    panel = """<body name="{name}" pos="{x} 0 -1"><joint name="{name}" axis="0 {y} 0" range="0 90"/>
      <geom type="box" pos="0 0 1" size="0.05 1 1"/></body>"""
    tree = f"""<worldbody><body name="hub"><freejoint/>
      <geom type="box" size="1 1 1" density="200"/>{panel.format(name="p", x=1, y=1)}
      {panel.format(name="n", x=-1, y=-1)}</body></worldbody>"""
    key = '<keyframe><key qpos="0 0 0 1 0 0 0 1.571 1.571"/></keyframe>'
    found = issued(tmp_path, tree=tree, tail=key, step="0.002")
    assert found.passed
    assert drift(found) > 1e-9  # 8e-9: in a step with an impact RK4 has no order
    assert "or of the steps in which a stop is hit" in found.rows[0].reason


def test_no_step_is_told_from_errors_that_do_not_fall_as_rk4s(tmp_path: Path) -> None:
    # a belt that pulls only when it is stretched: the force has a corner in each turn
    belt = """<tendon><fixed name="belt" stiffness="1" springlength="-0.01 0.02">
      <joint joint="spin" coef="1"/></fixed></tendon>"""
    found = issued(tmp_path, tail=belt)
    assert quantities(found)[-1] == "order of convergence"
    assert not found.rows[-1].passed
    assert found.advice[-1].startswith("no step can be advised: over steps of ")


@pytest.mark.parametrize("order", [-2.0, -0.1, 0.1, 1.0])
def test_an_error_that_does_not_fall_gives_no_step_beyond_what_was_flown(order: float) -> None:
    """What ended in a complex number, and in a step of 1.1e-37 s."""
    steps = [0.4, 0.2, 0.1]
    found = [(step, 1e-5 * step**order) for step in steps]
    assert convergence.slope(found) == pytest.approx(order)
    assert next(iter(passport.step_advice(found, "attitude"))).startswith("no step can be advised")


def test_a_soft_weld_is_no_rigid_one(tmp_path: Path) -> None:
    pair = """<worldbody><body name="a"><freejoint/>{bus}</body>
      <body name="b" pos="1 0 0"><freejoint/>{bus}</body></worldbody>"""
    tail = '<equality><weld name="dock" body1="a" body2="b"/></equality>'
    found = issued(tmp_path, tree=pair, tail=tail)
    assert "2 free joints, of body 'a', body 'b'" in told(found)
    assert "energy: that of soft constraints (equality 'dock')" in found.unjudged[0]
    assert "order and step with soft constraints (equality 'dock')" in found.unjudged[1]
    assert quantities(found) == ["angular momentum", "centre of mass"]
    assert found.passed  # both begin as one: apart, they would turn 5e-5 of their momentum around
    assert found.advice == []


@pytest.mark.parametrize(
    ("filled", "tail", "by"),
    [
        (
            {"world": '<body mocap="true" name="hand"/>'},
            '<equality><weld name="grip" body1="hand" body2="bus"/></equality>',
            "equality 'grip'",
        ),
        ({}, '<equality><connect name="pin" body1="bus" anchor="0 0 0"/></equality>', "'pin'"),
        (
            {"world": '<site name="hook"/>', "bus": BODY + '<site name="eye" pos="0 0 1"/>'},
            '<tendon><spatial name="cord" damping="1"><site site="hook"/><site site="eye"/>'
            "</spatial></tendon>",
            "tendon 'cord'",
        ),
        (
            {
                "world": '<geom name="drum" type="cylinder" size="0.1 1" pos="0.5 0.5 0"/>',
                "bus": BODY + '<site name="eye" pos="0 1 0"/><site name="ear" pos="1 0 0"/>',
            },
            '<tendon><spatial name="band" stiffness="1"><site site="eye"/><geom geom="drum"/>'
            '<site site="ear"/></spatial></tendon>',
            "tendon 'band'",
        ),
        ({"world": f'<body><joint name="arm" stiffness="1"/>{BODY}</body>'}, "", "joint 'arm'"),
    ],
)
def test_what_the_world_can_push_keeps_no_momentum(
    tmp_path: Path, filled: dict[str, str], tail: str, by: str
) -> None:
    found = issued(tmp_path, tail=tail, **filled)
    assert "angular momentum" not in quantities(found)
    assert any(text.startswith("momentum: the world acts on") for text in found.unjudged)
    assert by in next(text for text in found.unjudged if text.startswith("momentum"))


def test_without_a_free_joint_that_is_said(tmp_path: Path) -> None:
    tree = """<worldbody><body name="base"><joint name="x" type="slide" damping="0.5"/>{bus}
      <body><joint name="wheel"/>{rotor}</body></body></worldbody>"""
    found = issued(tmp_path, tree=tree)
    assert "no free joint: the vehicle is attached to the world by joint 'x', and" in told(found)
    assert quantities(found) == ["energy gained", "order of convergence"]
    fixed = issued(tmp_path, tree=tree.replace('<joint name="x" type="slide" damping="0.5"/>', ""))
    assert "by joint 'wheel'" in told(fixed)
    assert "fixed to the world, without effect on the motion: body 'base' 10 kg" in told(fixed)


URDF = """<robot name="flyer">{root}
  <link name="bus"><inertial><mass value="12"/><origin xyz="0 0 0"/>
    <inertia ixx="0.25" iyy="0.27" izz="0.20" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tank"><inertial><mass value="2"/><origin xyz="0 0 0"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="rotor"><inertial><mass value="0.4"/><origin xyz="0 0 0"/>
    <inertia ixx="0.0004" iyy="0.0004" izz="0.0007" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="feed" type="fixed"><parent link="bus"/><child link="tank"/></joint>
  <joint name="spin" type="continuous"><parent link="bus"/><child link="rotor"/>
    <axis xyz="0 0 1"/></joint>{joint}
</robot>"""


@pytest.mark.parametrize("name", ["flyer.urdf", "flyer.xml"])
def test_a_urdf_base_welded_to_the_world_is_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(URDF.format(root="", joint=""))
    found = told(passport.issue(path))
    assert "fusestatic: body 'bus' was merged with the world" in found
    assert "its 12 kg have no effect" in found
    assert "fusestatic: body 'tank' was merged with the world" in found
    joint = '<joint name="fly" type="floating"><parent link="root"/><child link="bus"/></joint>'
    path.write_text(URDF.format(root='<link name="root"/>', joint=joint))
    cured = passport.issue(path)
    assert "no free joint" not in told(cured)
    assert "fusestatic: body 'tank', 2 kg, was merged with 'bus': 12 kg became 14 kg" in told(cured)
    assert "angular momentum" in quantities(cured)


@pytest.mark.parametrize(
    ("compiler", "bus", "finding"),
    [
        (
            'boundmass="0.5"',
            BODY,
            "boundmass=0.5: the mass of body 'rotor' is 0.5 kg instead of 0.1",
        ),
        (
            'boundinertia="0.3"',
            BODY,
            "boundinertia=0.3: the inertia of body 'rotor' is 0.3, 0.3, 0.3",
        ),
        ('settotalmass="20"', BODY, "settotalmass=20: the total mass is 20 kg instead of 10.1 kg"),
        (
            'balanceinertia="true"',
            BODY.replace("1.5", "3"),
            "body 'bus' gets the principal moments 1.73333, 1.73333, 1.73333 kg m^2 "
            "instead of 1, 1.2, 3,",
        ),
        (  # 1, 1.2 and 3 in axes turned by 45 deg about x
            'balanceinertia="true"',
            '<inertial pos="0 0 0" mass="10" fullinertia="1.2 2 2 0 0 1"/>',
            "1.73333, 1.73333, 1.73333 kg m^2 instead of 1, 1.2, 3",
        ),
        (
            'inertiafromgeom="true"',
            BODY + '<geom size="0.5" density="1000"/>',
            "inertiafromgeom=true: the mass of body 'bus' is 523.599 kg instead of 10 kg",
        ),
        (
            'inertiagrouprange="0 2"',
            '<geom size="0.5" mass="10"/><geom size="0.5" mass="3" group="3"/>',
            "inertiagrouprange=0 2: the mass of body 'bus' is 10 kg instead of 13 kg",
        ),
    ],
)
def test_settings_that_change_the_mass_are_found(
    tmp_path: Path, compiler: str, bus: str, finding: str
) -> None:
    light = '<inertial pos="0 0 0" mass="0.1" diaginertia="0.01 0.01 0.02"/><geom size="0.1"/>'
    head = f"<compiler {compiler}/>"
    found = issued(tmp_path, head=head, bus=bus, rotor=light)
    assert finding in told(found)
    assert not any(f.refused for f in found.findings)
    plain = issued(tmp_path, bus=BODY, rotor=light)
    assert plain.findings == []


def test_a_bound_that_alone_gives_a_mass_is_told(tmp_path: Path) -> None:
    found = issued(tmp_path, head='<compiler boundmass="0.5" boundinertia="0.1"/>', rotor="")
    assert "boundmass=0.5: the mass of body 'rotor' is 0.5 kg instead of 0 kg" in told(found)


def test_a_warning_of_the_compiler_is_a_finding(tmp_path: Path) -> None:
    with np.testing.assert_no_warnings():
        found = issued(tmp_path, head='<compiler settotalmass="20"/>')
    assert "'settotalmass' is deprecated" in told(found)


def test_a_flight_that_breaks_off_is_refused_and_nothing_measured(tmp_path: Path) -> None:
    found = issued(tmp_path, joint='stiffness="1e12"')
    assert not found.passed
    assert "flown free, its state is no longer finite after 0.3 s of 60 s" in told(found)
    assert found.rows == []


def test_a_short_step_is_watched_for_less_than_a_minute(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(conservation, "MOST_STEPS", 3400)
    # with seven degrees of freedom, 3400 / 1.7 of 10 ms
    assert issued(tmp_path).unjudged == [
        "conservation beyond 20 s: a minute would be more than 2000 steps of 0.01 s"
    ]


def test_what_the_flights_are_without_is_said(tmp_path: Path) -> None:
    hull = BODY + '<geom size="1"/>'
    motor = '<actuator><motor joint="spin"/></actuator>'
    found = issued(tmp_path, bus=hull, tail=motor)
    assert found.unjudged == [
        "1 actuators: every flight here is without control, their stiffness and damping about "
        "rest apart"
    ]
    path = tmp_path / "model.xml"
    path.write_text(path.read_text().replace('contact="disable"', ""))
    assert "contacts: every flight here is without them" in passport.issue(path).unjudged


def test_a_compiled_model_does_not_say_how_it_was_made(tmp_path: Path) -> None:
    issued(tmp_path)
    compiled = tmp_path / "model.mjb"
    mujoco.mj_saveModel(mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml")), str(compiled))
    assert passport.issue(compiled).unjudged == [
        "the compiler's settings: a compiled model does not say how it was made"
    ]


def test_springs_that_yield_have_neither_energy_nor_order(tmp_path: Path) -> None:
    found = issued(tmp_path, joint='stiffness="5" springyield="1"')
    assert quantities(found) == ["angular momentum", "centre of mass"]
    assert [text.split(":")[0] for text in found.unjudged] == [
        "energy",
        "order and step with springs that yield",
    ]


def test_a_tendons_spring_is_counted(tmp_path: Path) -> None:
    sprung = """<tendon><fixed stiffness="0.1" damping="{}"><joint joint="spin" coef="1"/></fixed>
      </tendon>"""
    for damping, quantity in (("0", "energy"), ("0.001", "energy gained")):
        found = issued(tmp_path, tail=sprung.format(damping), option="")
        row = next(row for row in found.rows if row.quantity == quantity)
        assert row.measured < CONSERVED


def test_mocap_bodies_are_no_part_of_what_flies(tmp_path: Path) -> None:
    found = issued(tmp_path, world='<body mocap="true" pos="5 0 0"><geom size="1"/></body>')
    assert found.passed
    assert found.findings == []
    assert "centre of mass" in quantities(found)
