"""Each guard on a model with its one defect, and on the same model without it."""

import warnings
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.vehicle import model_checks, stability

SOUND = """
<mujoco>
  <option timestep="{step}" integrator="{integrator}" gravity="{gravity}">
    <flag contact="{contact}" constraint="{constraint}" autoreset="{autoreset}" {flag}/>
  </option>
  <worldbody>
    <body name="bus">
      {free}
      <inertial pos="0 0 0" mass="100" diaginertia="0.6 0.5 0.7"/>
      <geom name="hull" type="box" size="1 1 1"/>
      <body name="rotor">
        <joint name="spin" axis="0 0 1" {joint}/>
        <geom name="rotor" size="0.1"/>
        <inertial pos="{offset} 0 0" mass="2" diaginertia="0.025 0.025 0.05" euler="0 {tilt} 0"/>
      </body>
    </body>
  </worldbody>
  <tendon>{tendon}</tendon>
  <actuator>{actuator}</actuator>
</mujoco>
"""
DEFAULTS = {
    "step": "0.001",
    "integrator": "RK4",
    "gravity": "0 0 0",
    "contact": "disable",
    "constraint": "disable",
    "autoreset": "disable",
    "free": '<freejoint name="bus"/>',
    "joint": "",
    "offset": "0",
    "tilt": "0",
    "actuator": '<motor name="motor" joint="spin"/>',
    "tendon": "",
    "flag": "",
}
SHARE = 1.0 / (1.0 / 0.05 + 1.0 / 0.7)  # kg m^2: what the motor turns, rotor against bus


def model(**defect: str) -> Any:
    return mujoco.MjModel.from_xml_string(SOUND.format(**DEFAULTS | defect))


def test_a_sound_model_passes_in_silence() -> None:
    model_checks.check(model())
    model_checks.check_imbalance(model(), fastest=1e5)


@pytest.mark.parametrize(
    ("defect", "message"),
    [
        ({"autoreset": "enable"}, 'set <flag autoreset="disable"/>'),
        ({"joint": 'armature="0.01"'}, r"joint 'spin' has armature 0\.01: 16\.7% of its momentum"),
        (
            {"actuator": '<motor joint="spin" gear="2" armature="0.0025"/>'},
            r"joint 'spin' has armature 0\.01: 16\.7%",
        ),
        ({"gravity": "0 0 -9.81"}, r"gravity is \[ 0\. +0\. +-9\.81\] m/s\^2"),
        ({"free": '<joint name="bus" type="free" damping="1"/>'}, "'bus' has damping 1: the world"),
        (
            {"free": '<joint name="bus" type="free" stiffness="2"/>'},
            "free joint 'bus' has stiffn.* 2:",
        ),
        (
            {"free": '<joint type="free" frictionloss="3"/>'},
            r"free joint 0 \(unnamed, of body 'bus'\)",
        ),
        ({"flag": 'sleep="enable"'}, "sleep is enabled: below 0.001 rad/s or m/s MuJoCo stops a"),
    ],
)
def test_defects_are_refused(defect: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        model_checks.check(model(**defect))


def test_every_defect_is_named_at_once() -> None:
    with pytest.raises(ValueError, match=r"(?s)automatic reset.*gravity"):
        model_checks.check(model(autoreset="enable", gravity="0 0 -1"))


@pytest.mark.parametrize(
    ("defect", "message"),
    [
        ({"integrator": "Euler"}, r"integrator is EULER, first order.*RK4"),
        ({"integrator": "implicitfast"}, "integrator is IMPLICITFAST"),
        ({"contact": "enable", "constraint": "enable"}, "2 geoms may collide"),
        ({"joint": 'frictionloss="0.1"'}, "1 friction losses"),
        ({"joint": 'limited="true" range="-1 1"'}, "1 joint limits"),
        (
            {"joint": 'limited="false" range="-90 90"'},
            r"'spin' has a range, -90 to 90, that",
        ),
        ({"actuator": '<velocity joint="spin" kv="-2"/>'}, "'spin' has damping -2: .* wrong sign"),
    ],
)
def test_doubts_are_warned_of(defect: dict[str, str], message: str) -> None:
    with pytest.warns(model_checks.ModelWarning, match=message):
        model_checks.check(model(**defect))


LAG = '<general name="slow" joint="spin" dyntype="{}" dynprm="{}"/>'


@pytest.mark.parametrize(("factor", "grows"), [(0.99, False), (1.01, True)])
def test_the_shortest_lag_is_where_rk4_really_diverges(factor: float, grows: bool) -> None:
    lagging = model(actuator=LAG.format("filter", 1e-3 / (factor * 2.785294)))
    data = mujoco.MjData(lagging)
    data.act[0] = 1.0
    mujoco.mj_step(lagging, data, 1000)
    assert (abs(data.act[0]) > 1.0) == grows
    if grows:
        with pytest.raises(ValueError, match=r"'slow' lags by .* s: RK4 makes its activation grow"):
            model_checks.check(lagging)
    else:
        model_checks.check(lagging)


@pytest.mark.parametrize("lag", [0.1, 0.005])
def test_a_lag_that_mujoco_integrates_is_longer_with_rk4(lag: float) -> None:
    """As long as the warning says: 0.5 % for a step of a hundredth, 11 % for one of a fifth."""
    exact = model(actuator=LAG.format("filterexact", lag))
    data = mujoco.MjData(exact)
    data.act[0] = 1.0
    mujoco.mj_step(exact, data, 10)
    flown = f"{-0.01 / np.log(data.act[0]):.4g}"
    assert float(flown) > 1.004 * lag
    with pytest.warns(model_checks.ModelWarning, match=f"its lag of {lag:g} s becomes {flown} s"):
        model_checks.check(exact)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model_checks.check(model(actuator=LAG.format("filter", lag)))


def test_a_world_with_a_floor_may_have_gravity_and_contacts() -> None:
    model_checks.check(
        model(gravity="0 0 -9.81", contact="enable", constraint="enable", free="", joint="")
    )


@pytest.mark.parametrize(
    "servo",
    [
        {"joint": 'damping="{kv}"', "actuator": ""},
        {"actuator": '<velocity joint="spin" kv="{kv}"/>'},
        {"actuator": '<position joint="spin" kp="1e-9" kv="{kv}"/>'},
        {"actuator": '<motor joint="spin" gear="2" damping="{quarter}"/>'},
        {"tendon": '<fixed damping="{kv}"><joint joint="spin" coef="1"/></fixed>'},
        {
            "tendon": '<fixed name="cord"><joint joint="spin" coef="2"/></fixed>',
            "actuator": '<velocity tendon="cord" kv="{quarter}"/>',
        },
        # What a motor can give at most does not make its slope less steep.
        {"actuator": '<velocity joint="spin" kv="{kv}" forcerange="-1e9 1e9"/>'},
    ],
)
def test_servo_bound_is_where_rk4_really_diverges(servo: dict[str, str]) -> None:
    """RK4 needs dt < 2.78 I / kv: refused just above, flown just below, as MuJoCo itself does."""
    for factor, stable in ((0.99, True), (1.01, False)):
        kv = factor * 2.785294 * SHARE / 1e-3  # the real root of RK4's stability polynomial
        fill = {"kv": repr(kv), "quarter": repr(kv / 4.0)}
        servoed = model(**{key: text.format(**fill) for key, text in servo.items()})
        data = mujoco.MjData(servoed)
        data.qvel[6] = 1.0
        mujoco.mj_step(servoed, data, 200)
        assert (abs(data.qvel[6]) < 1.0) == stable
        if stable:
            model_checks.check(servoed)
        else:
            with pytest.raises(
                ValueError, match=r"'spin' has damping.*use a step below 0\.00099 s"
            ):
                model_checks.check(servoed)


@pytest.mark.parametrize(("factor", "stable"), [(0.99, True), (1.01, False)])
def test_spring_bound_is_where_rk4_really_diverges(factor: float, stable: bool) -> None:
    """An undamped spring needs dt < 2.83 / sqrt(k/I), the imaginary end of RK4's region."""
    stiffness = SHARE * (factor / 1e-3) ** 2 * 8.0
    sprung = model(joint=f'stiffness="{stiffness!r}"')
    data = mujoco.MjData(sprung)
    data.qvel[6] = 1.0
    mujoco.mj_step(sprung, data, 200)
    assert (abs(data.qvel[6]) < 1.0) == stable
    if stable:
        model_checks.check(sprung)
    else:
        with pytest.raises(ValueError, match="'spin' has damping 0, stiffness"):
            model_checks.check(sprung)


@pytest.mark.parametrize("defect", [{"offset": "1e-6"}, {"tilt": "0.001"}])
def test_imbalance_needs_ten_steps_a_revolution(defect: dict[str, str]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model_checks.check_imbalance(model(**defect), fastest=600.0)  # 10.5 steps
    # 8.4 steps: (10.5/8.4)^4 times the measured 1.4e-4.
    with pytest.warns(
        model_checks.ModelWarning, match=r"8\.38 steps .* off by 0\.0003 .* 0\.00084 s"
    ):
        model_checks.check_imbalance(model(**defect), fastest=750.0)


def test_the_wobble_error_is_as_large_as_the_warning_says() -> None:
    """The figure behind the warning: 10.5 steps a revolution cost 1.4e-4 of the wobble."""
    imbalanced = model(offset="1e-5")
    data = mujoco.MjData(imbalanced)
    speed = 600.0
    data.qvel[6] = speed
    # The bus's centre circles the common one at radius m e / M; so its speed is W times that.
    radius = 2.0 * 1e-5 / 102.0
    data.qvel[1] = -speed * radius
    xs = []
    for _ in range(2000):
        mujoco.mj_step(imbalanced, data)
        xs.append(data.qpos[0])
    amplitude = np.ptp(xs) / 2.0
    # Measured 1.38e-4 here; the sampling of the circle's extremes adds 1e-6.
    assert amplitude / radius - 1.0 == pytest.approx(-1.4e-4, rel=0.05)


FOUR_BAR = """
<mujoco>
  <option timestep="{step}" integrator="RK4" gravity="0 0 0"><flag autoreset="disable"/></option>
  <worldbody>
    <body><joint name="a" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 2"/></body>
    <body><joint name="b" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
  </worldbody>
  <tendon><fixed name="belt" stiffness="{stiffness}" springlength="0">
    <joint joint="a" coef="1"/><joint joint="b" coef="-1"/></fixed></tendon>
</mujoco>
"""


@pytest.mark.parametrize(("factor", "stable"), [(0.99, True), (1.01, False)])
def test_joints_that_a_tendon_couples_are_judged_together(factor: float, stable: bool) -> None:
    """Two rotors on a belt swing at sqrt(k (1/2 + 1/1)): RK4's bound is 2.83 over that."""
    step = factor * np.sqrt(8.0) / np.sqrt(300.0 * 1.5)
    belted = mujoco.MjModel.from_xml_string(FOUR_BAR.format(step=step, stiffness=300.0))
    data = mujoco.MjData(belted)
    data.qvel[:] = 1.0, -2.0
    mujoco.mj_step(belted, data, 400)
    assert (np.abs(data.qvel).max() < 3.0) == stable
    if stable:
        model_checks.check(belted)
    else:
        # the lighter one has most of the motion
        with pytest.raises(ValueError, match="joint 'b' has damping 0, stiffness 300"):
            model_checks.check(belted)


def test_a_model_without_joints_or_of_very_many_is_not_linearized() -> None:
    assert stability.linearized(mujoco.MjModel.from_xml_string("<mujoco/>")) is None
    balls = '<body><joint type="ball"/><geom size="1"/></body>' * (stability.LARGEST // 3 + 1)
    many = f"<mujoco><worldbody>{balls}</worldbody></mujoco>"
    assert stability.linearized(mujoco.MjModel.from_xml_string(many)) is None
