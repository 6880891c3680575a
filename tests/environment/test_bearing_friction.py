"""Dry friction of bearings: whatever the step, it takes energy, keeps momentum and ends at rest."""

import warnings
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from mjspace.contract import Array
from mjspace.environment.bearing_friction import BearingFriction
from mjspace.environment.install import install_callbacks, userdata, userdata_size
from mjspace.scenario.environment import Environment
from mjspace.scenario.hinges import Bearing, Friction, Hinge
from mjspace.scenario.plant import PlantTable
from mjspace.vehicle.model_checks import ModelWarning

WHEEL = """<mujoco><option gravity="0 0 0" integrator="{integrator}" timestep="{step}">
<flag autoreset="disable"/></option><worldbody>
<body name="bus"><freejoint/><inertial pos="0 0 0" mass="9" diaginertia="{bus} {bus} {bus}"/>
{wheels}</body></worldbody></mujoco>"""
ROTOR = """<body><joint name="wheel_{i}" axis="{axis}" damping="{damping}"/>
<inertial pos="0 0 0" mass="1" diaginertia="{J} {J} {J}"/></body>"""


@pytest.fixture(autouse=True, scope="module")
def _installed() -> None:
    install_callbacks()


def spun(
    friction: Friction,
    speeds: list[float],
    *,
    step: float,
    rotor: float = 1.0,
    bus: float = 100.0,
    damping: float = 0.0,
    axis: str = "0 0 1",
    integrator: str = "RK4",
) -> tuple[Any, Any]:
    """Return (model, data) of a bus with a wheel for each of ``speeds`` [rad/s]."""
    names = [f"wheel_{i}" for i in range(len(speeds))]
    wheels = "".join(
        ROTOR.format(i=i, axis=axis, damping=damping, J=rotor) for i in range(len(speeds))
    )
    text = WHEEL.format(integrator=integrator, step=step, bus=bus, wheels=wheels)
    spec = mujoco.MjSpec.from_string(text)
    hinge = Hinge(
        coulomb_friction=friction.coulomb,
        breakaway_friction=friction.breakaway,
        stribeck_speed=friction.stribeck_speed,
    )
    plant = PlantTable(hinges=dict.fromkeys(names, hinge))
    spec.nuserdata = userdata_size(Environment(), plant)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.userdata[:] = userdata(model, Environment(), plant)
    data.qvel[6:] = speeds
    return model, data


def energy_and_momentum(model: Any, data: Any) -> tuple[float, float]:
    """Return the kinetic energy [J] and the momentum about z [N m s], which is the axis of all."""
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, matrix)
    return 0.5 * data.qvel @ matrix @ data.qvel, (matrix @ data.qvel)[5]


powers = st.floats(-2.0, 2.0).map(lambda power: 10.0**power)


@given(
    step=powers,  # by c h / J, where the formula without widening ends to be stable at 0.278
    steps=st.floats(0.0, 40.0),  # to rest, of Coulomb's friction alone
    bus=st.floats(0.05, 1e3),
    breakaway=st.none() | st.floats(1.0, 3.0),
    stribeck=powers,
)
@settings(max_examples=60, deadline=None)
def test_it_comes_to_rest_with_any_step(
    step: float, steps: float, bus: float, breakaway: float | None, stribeck: float
) -> None:
    friction = Friction(1.0, breakaway, stribeck if breakaway else None)
    inertia = bus / (1.0 + bus)  # of the rotor, 1 kg m^2, against the bus
    start = steps * step / inertia
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        model, data = spun(friction, [start], step=step, bus=bus)
        term = BearingFriction(frictions={"wheel_0": friction})
        smoothing = term.pack(model, Environment())[4]
    energy, momentum = energy_and_momentum(model, data)
    # Near zero it decays as exp(-c t / (J smoothing)), by RK4's 1/3 and not 1/e^2 in a step of two
    # of these times: 25 of them are 1e-6 of the smoothing speed.
    due = start * inertia + 25.0 * smoothing * inertia
    for _ in range(int(due / step) + 1):
        mujoco.mj_step(model, data)
        before, (energy, now) = energy, energy_and_momentum(model, data)
        assert energy <= before * (1.0 + 1e-12) + 1e-30  # rounding
        assert now == pytest.approx(momentum, rel=1e-12, abs=1e-15)
        assert data.qvel[6] >= -1e-300  # it does not turn back; denormals round
    assert data.qvel[6] < 1e-5 * smoothing


@pytest.mark.parametrize("integrator", ["RK4", "Euler", "implicitfast"])
@pytest.mark.parametrize("damping", [0.0, 0.5, 1.3])
def test_wheels_that_share_a_light_bus_come_to_rest(integrator: str, damping: float) -> None:
    # Each alone has 0.68 of its inertia against the bus; three together are stiffer by 1.9.
    speeds = [30.0, 50.0, 40.0]
    model, data = spun(
        Friction(10.0), speeds, step=0.5, bus=2.0, damping=damping, integrator=integrator
    )
    energy, _ = energy_and_momentum(model, data)
    for _ in range(100):
        mujoco.mj_step(model, data)
        before, (energy, _) = energy, energy_and_momentum(model, data)
        assert energy <= before * (1.0 + 1e-12) + 1e-30
    np.testing.assert_allclose(data.qvel[6:], 0.0, atol=1e-4)


def torque(speeds: Array, friction: Friction, step: float) -> Array:
    model, data = spun(friction, [0.0], step=step)
    braking = []
    for speed in speeds:
        data.qvel[6] = speed
        mujoco.mj_forward(model, data)
        braking.append(-data.qfrc_passive[6])
    return np.array(braking)


def test_where_the_step_is_short_it_is_c_tanh() -> None:
    speeds = np.array([-20.0, -0.05, 0.0, 0.02, 0.3])
    np.testing.assert_array_equal(
        torque(speeds, Friction(0.3), step=0.5), 0.3 * np.tanh(speeds / 0.1)
    )


def test_breakaway_is_the_largest_torque_and_falls_to_coulombs() -> None:
    speeds = np.linspace(0.0, 8.0, 4001)
    friction = torque(speeds, Friction(0.2, 0.5, 2.0), step=1e-3)
    assert friction.max() == pytest.approx(0.5, rel=0.015)  # smoothed over v/30
    assert speeds[friction.argmax()] == pytest.approx(0.113 * 2.0, rel=0.01)
    # at Stribeck's speed the excess has fallen to 1/e
    assert friction[1000] == pytest.approx(0.2 + 0.3 / np.e, rel=1e-12)
    assert friction[-1] == pytest.approx(0.2, rel=1e-6)


def test_a_torque_below_breakaway_creeps_and_one_above_runs_away() -> None:
    for push, runs in ((0.45, False), (0.55, True)):
        model, data = spun(Friction(0.2, 0.5, 2.0), [0.0], step=1e-3)
        data.qfrc_applied[6] = push
        mujoco.mj_step(model, data, 20_000)
        # tanh(w/smoothing) = 0.9 at 1.5 of it, 0.1 rad/s; 20 s of 0.05 N m at least are 1 rad/s
        assert (data.qvel[6] > 1.0) if runs else (data.qvel[6] < 0.11)


def test_a_step_that_hides_the_breakaway_is_warned_of() -> None:
    message = r"'wheel_0': a step of 1 s .* too wide for a stribeck_speed of 0.5 rad/s: under 93 %"
    with pytest.warns(ModelWarning, match=message) as caught:
        spun(Friction(0.2, 0.5, 0.5), [0.0], step=1.0)
    step = float(str(caught[0].message).split("below ")[1].removesuffix(" s"))
    assert step == pytest.approx(0.2, rel=0.05)
    spun(Friction(0.2, 0.5, 0.5), [0.0], step=0.99 * step)  # says nothing


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"breakaway_friction": 0.1}, "give both or neither"),
        ({"stribeck_speed": 0.1}, "give both or neither"),
        (
            {"coulomb_friction": 0.2, "breakaway_friction": 0.1, "stribeck_speed": 1.0},
            r"breakaway_friction 0.1 N m is below coulomb_friction 0.2 N m",
        ),
        ({"coulomb_friction": -0.2}, "greater than or equal to 0"),
    ],
)
def test_friction_that_makes_no_sense_is_refused(table: dict[str, float], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Bearing(**table)
