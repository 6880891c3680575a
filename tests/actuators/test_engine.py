"""An engine on two gimbals: throttle, valves, servos and tank, against closed forms."""

from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.actuators.base import Context
from mjspace.actuators.engine import Engine, GimballedEngine
from mjspace.contract import Array, Measurement, ThrustCommand
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.scenario.equipment import Driven
from mjspace.scenario.plant import Initial, Rates

STEP = 0.002  # s
TANK = """<mujoco><worldbody><body name="tank">
  <inertial pos="0 0 0" mass="20" diaginertia="0.72 0.72 0.72"/></body></worldbody></mujoco>"""
MODEL = mujoco.MjModel.from_xml_string(TANK)


def engine(*, gravity: float = 0.0, thrust: float | None = None, **table: Any) -> GimballedEngine:
    vehicle: Any = SimpleNamespace(model=MODEL)
    numbers = {"thrust_max": 320.0, "thrust_min": 50.0} | table
    context = Context(vehicle, Driven(), Rates(), Initial(thrust=thrust), gravity)
    return Engine(**numbers).actuator(context)


def seen(angle: Any = ((0.0, 0.0),), rate: Any = ((0.0, 0.0),)) -> Measurement:
    one = np.zeros((len(angle), 0))
    return Measurement(
        attitude=one,
        rate=one,
        wheel_speed=one,
        gimbal_angle=np.array(angle, float),
        gimbal_rate=np.array(rate, float),
    )


def burn(
    flown: GimballedEngine, thrusts: list[float], gimbal: Any = (0.0, 0.0), state: Any = None
) -> tuple[Any, Array]:
    """Return the state after these commands, and what acted in each step."""
    state, acted = state or flown.reset(1), []
    for thrust in thrusts:
        command = ThrustCommand(np.array([[thrust]]), np.array([gimbal]))
        state, acting, _ = flown.act(state, command, seen(), STEP)
        acted.append(acting[0])
    return state, np.array(acted)


def test_thrust_follows_its_command_with_the_lag_and_its_mean_acts() -> None:
    state, acted = burn(engine(thrust_lag=0.1), [200.0] * 50)
    time = STEP * np.arange(51)
    exact = 200.0 * (1.0 - np.exp(-time / 0.1))
    assert state["thrust"][0, 0] == pytest.approx(exact[-1], rel=1e-13)
    impulse = 200.0 * (time - 0.1 * (1.0 - np.exp(-time / 0.1)))
    np.testing.assert_allclose(acted[:, 2] * STEP, np.diff(impulse), rtol=1e-10)


def test_a_throttle_has_its_range_and_says_when_it_is_cut() -> None:
    flown = engine()
    for wanted, given, is_cut in ((20.0, 50.0, 1.0), (200.0, 200.0, 0.0), (900.0, 320.0, 1.0)):
        command = ThrustCommand(np.array([[wanted]]), np.zeros((1, 2)))
        _, acting, cut = flown.act(flown.reset(1), command, seen(), STEP)
        assert acting[0, 2] == given
        assert cut[0, 2] == is_cut


def test_an_engine_that_is_put_out_stays_out() -> None:
    state, _ = burn(engine(thrust_lag=0.1), [200.0] * 9 + [0.0])
    assert state["thrust"][0, 0] == 0.0
    _, acted = burn(engine(thrust_lag=0.1), [200.0] * 5, state=state)
    assert not acted[:, 2].any()


def test_an_engine_fails_at_its_time() -> None:
    _, acted = burn(engine(fails_at=10 * STEP - 1e-9), [200.0] * 20)
    assert (acted[:10, 2] == 200.0).all()
    assert not acted[10:, 2].any()


def test_propellant_goes_with_thrust_over_exhaust_speed() -> None:
    flown = engine(specific_impulse=320.0, thrust_lag=0.1)
    state, acted = burn(flown, [162.0] * 500)
    used = np.sum(acted[:, 2]) * STEP / (320.0 * STANDARD_GRAVITY)
    assert 20.0 - state["propellant"][0, 0] == pytest.approx(used, rel=1e-10)

    body, left = flown.masses(state, state)["body_mass"]
    assert MODEL.body(body).name == "tank"
    assert left == state["propellant"][0]
    # the tank shrinks in mass, not in size
    np.testing.assert_allclose(flown.masses(state, state)["body_inertia"][1], 0.036 * left[0])


def test_an_empty_tank_ends_it() -> None:
    flown = engine(specific_impulse=320.0, propellant=0.01)
    state, acted = burn(flown, [320.0] * 200)
    # 0.01 kg last 0.098 s
    assert np.count_nonzero(acted[:, 2]) == pytest.approx(
        0.01 * 320.0 * 9.80665 / 320.0 / STEP, abs=1
    )
    assert state["propellant"][0, 0] == 0.0
    assert flown.masses(state, state)["body_mass"][1] > 0.0  # a body without any mass would not fly


def test_what_burns_nothing_weighs_the_same() -> None:
    assert engine().masses(engine().reset(1), engine().reset(1)) == {}


@pytest.mark.parametrize(
    ("wanted", "angle", "rate", "torque"),
    [
        (0.01, 0.0, 0.0, 8.0 * 0.01 / 0.05),  # within all limits: position loop, rate loop
        (0.01, 0.01, 0.2, -8.0 * 0.2),  # there, but moving
        (0.30, 0.0, 0.0, 8.0 * 0.35),  # as fast as the limit lets it
        (-0.30, 0.0, 0.0, -8.0 * 0.35),
        (0.90, 0.345, 0.0, 8.0 * 0.005 / 0.05),  # to its limit and not farther
    ],
)
def test_a_gimbal_is_brought_where_it_is_wanted(
    wanted: float, angle: float, rate: float, torque: float
) -> None:
    flown = engine(gimbal_lag=0.05, gimbal_rate_gain=8.0, gimbal_rate_limit=0.35, gimbal_limit=0.35)
    command = ThrustCommand(np.array([[100.0]]), np.array([[0.0, wanted]]))
    truth = seen([[0.0, angle]], [[0.0, rate]])
    _, acting, cut = flown.act(flown.reset(1), command, truth, STEP)
    np.testing.assert_allclose(acting[0, :2], [0.0, torque], rtol=1e-12)
    assert cut[0, 1] == float(abs(wanted) > 0.35)


def test_a_batch_is_its_vehicles() -> None:
    flown = engine(specific_impulse=300.0, thrust_lag=0.05)
    random = np.random.default_rng(1)
    state = flown.reset(4)
    angle, rate, gimbal = random.normal(size=(3, 4, 2))
    command = ThrustCommand(random.uniform(0.0, 400.0, (4, 1)), gimbal)
    after, acting, _ = flown.act(state, command, seen(angle, rate), STEP)
    for i in range(4):
        one = {name: values[i : i + 1] for name, values in state.items()}
        alone = ThrustCommand(*(part[i : i + 1] for part in command))
        after_one, acting_one, _ = flown.act(
            one, alone, seen(angle[i : i + 1], rate[i : i + 1]), STEP
        )
        np.testing.assert_array_equal(acting[i], acting_one[0])
        for name, values in after.items():
            np.testing.assert_array_equal(values[i], after_one[name][0])


def test_a_gimbals_motor_has_a_largest_torque_and_says_when_it_is_reached() -> None:
    flown = engine(gimbal_lag=0.05, gimbal_rate_gain=100.0, gimbal_torque_limit=12.0)
    command = ThrustCommand(np.array([[100.0]]), np.array([[0.3, -0.3]]))
    _, acting, cut = flown.act(flown.reset(1), command, seen(), STEP)
    np.testing.assert_array_equal(acting[0, :2], [12.0, -12.0])
    np.testing.assert_array_equal(cut[0], [1.0, 1.0, 0.0])
    small = ThrustCommand(np.array([[100.0]]), np.array([[0.005, 0.0]]))
    _, acting, cut = flown.act(flown.reset(1), small, seen(), STEP)
    assert acting[0, 0] == pytest.approx(10.0)
    assert not cut.any()
    assert Engine(thrust_max=1.0).gimbal_torque_limit == 10.0


@pytest.mark.parametrize(
    ("propellant", "thrust", "starts"),
    [(None, None, 20.0 * 1.6), (40.0, None, 64.0), (2.0, None, 10.0), (None, 7.0, 7.0)],
)
def test_it_starts_at_trim_or_as_it_is_told(
    propellant: float | None, thrust: float | None, starts: float
) -> None:
    """The vehicle is the tank alone, in 1.6 m/s^2; the throttle's range is 10 to 80 N."""
    table = {"thrust_max": 80.0, "thrust_min": 10.0, "propellant": propellant}
    flown = engine(gravity=1.6, thrust=thrust, **table)
    assert flown.reset(3)["thrust"] == pytest.approx(np.full((3, 1), starts))
    assert engine(**table).reset(1)["thrust"] == 0.0
