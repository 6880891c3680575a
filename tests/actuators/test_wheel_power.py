"""Electrical power and energy of reaction wheels: closed forms, limits, the energy's balance."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjspace.actuators.wheel_power import PowerKeys, PowerModel
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load, validate
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

INERTIA, STEP = np.array([0.05, 0.02, 0.01]), 0.01
LOSSLESS = ["plant.wheels.efficiency=1", "plant.wheels.regenerates=true"]
SLEW = ["checks=[]", "duration=12", "reference.duration=10"]
torques = arrays(float, 3, elements=st.floats(-0.5, 0.5))
speeds = arrays(float, 3, elements=st.floats(-300.0, 300.0))


def model(**keys: Any) -> PowerModel:
    built = PowerKeys(**{"efficiency": 0.8} | keys).power_model(INERTIA)
    assert built is not None
    return built


def flown(overrides: list[str], scenario: str = "wheel-pyramid") -> dict[str, dict[str, Array]]:
    built = assemble(*load(scenario, [*SLEW, *overrides]))
    blocks = list(fly(built, first_start(built, [0])))
    return {
        topic: {
            name: np.concatenate([b.rows[topic][name][:, 0] for b in blocks]) for name in fields
        }
        for topic, fields in blocks[0].rows.items()
    }


def test_power_is_the_motors_and_what_is_lost() -> None:
    torque, speed = np.array([0.1, -0.1, 0.1]), np.array([100.0, 100.0, 0.0])
    np.testing.assert_allclose(model().power(torque, speed), [12.5, 0.0, 0.0])
    np.testing.assert_allclose(model(regenerates=True).power(torque, speed), [12.5, -8.0, 0.0])
    each = model(efficiency=[0.8, 0.5, 1.0], standby_power=[1.0, 2.0, 3.0], regenerates=True)
    np.testing.assert_allclose(each.power(torque, speed), [13.5, -3.0, 3.0])
    # 2 A through 0.5 ohm
    copper = model(torque_constant="50 mN m/A", winding_resistance="0.5 ohm")
    np.testing.assert_allclose(copper.power(torque, speed), [14.5, 2.0, 2.0])


@pytest.mark.parametrize("regenerates", [False, True])
def test_energy_is_the_integral_of_power_also_where_a_rotor_reverses(regenerates: bool) -> None:
    flown = model(regenerates=regenerates, standby_power=0.3)
    torque, before = np.array([0.3, -0.2, 0.1]), np.array([-20.0, 5.0, 40.0])
    after = np.array([70.0, -1.0, 50.0])
    share = np.linspace(0.0, 1.0, 200001)[:, None]
    power = flown.power(torque, before + share * (after - before))
    integral = 2.0 * np.trapezoid(power, share, axis=0)
    np.testing.assert_allclose(flown.energy(torque, before, after, 2.0), integral, rtol=1e-8)


@given(torque=torques, speed=speeds, regenerates=st.booleans(), heats=st.booleans())
@settings(max_examples=100, deadline=None)
def test_no_wheel_takes_more_than_its_limit(
    torque: Array, speed: Array, regenerates: bool, heats: bool
) -> None:
    winding = {"torque_constant": 0.05, "winding_resistance": 0.5} if heats else {}
    limit = np.array([20.0, 5.0, 10.0])
    flown = model(regenerates=regenerates, power_limit=limit.tolist(), standby_power=1.0, **winding)
    within = flown.within_limits(torque, speed, STEP)
    assert (np.abs(within) <= np.abs(torque)).all()
    assert (within * torque >= 0.0).all()
    ends = [flown.power(within, speed), flown.power(within, speed + within * STEP / INERTIA)]
    assert (np.max(ends, axis=0) <= limit * (1.0 + 1e-12)).all()
    # What is cut is at the limit when the step ends.
    cut = within != torque
    np.testing.assert_allclose(ends[1][cut], limit[cut], rtol=1e-9)


@given(torque=torques, speed=speeds, regenerates=st.booleans())
@settings(max_examples=100, deadline=None)
def test_all_together_take_no_more_than_theirs_and_their_torque_keeps_its_direction(
    torque: Array, speed: Array, regenerates: bool
) -> None:
    flown = model(regenerates=regenerates, total_power_limit=15.0, standby_power=1.0)
    within = flown.within_limits(torque, speed, STEP)
    largest = np.max(np.abs(torque))
    share = np.max(np.abs(within)) / largest if largest else 1.0
    assert share <= 1.0
    np.testing.assert_allclose(within, share * torque, rtol=1e-12, atol=1e-300)
    ends = [flown.power(within, speed), flown.power(within, speed + within * STEP / INERTIA)]
    assert np.sum(ends, axis=-1).max() <= 15.0 * (1.0 + 1e-12)
    if share < 1.0 and not (within * speed < 0.0).any():
        assert ends[1].sum() == pytest.approx(15.0, rel=1e-9)


def test_with_no_losses_electrical_energy_is_kinetic_energy() -> None:
    rows = flown([*LOSSLESS, "plant.wheels.coulomb_friction=0", "plant.wheels.viscous_friction=0"])
    truth = rows["/truth"]
    used, kinetic = truth["wheel_energy"].sum(axis=-1), truth["energy"][:, 0]
    gained = kinetic - kinetic[0]
    assert np.ptp(gained) > 10.0  # J
    # Rounding, 2.7e-14 measured: at constant torques the speeds of this slew are linear in a step.
    np.testing.assert_allclose(used, gained, atol=1e-12 * np.ptp(gained))


def test_with_friction_the_difference_is_its_heat() -> None:
    viscous = 2e-3
    rows = flown(
        [*LOSSLESS, "plant.wheels.coulomb_friction=0", f"plant.wheels.viscous_friction={viscous}"]
    )
    truth = rows["/truth"]
    heat = viscous * np.trapezoid(np.sum(truth["wheel_speed"] ** 2, axis=-1), dx=0.01)
    used = truth["wheel_energy"][-1].sum()
    assert heat > 10.0
    balance = truth["energy"][-1, 0] - truth["energy"][0, 0] + heat
    # The trapezoidal rule of this sum and of the energy, in steps of 10 ms: 5e-7 measured.
    assert used == pytest.approx(balance, abs=1e-6 * heat)


def test_a_slew_takes_the_power_of_a_calculation_by_hand(tmp_path: Path) -> None:
    """A turn by A in T about x, of I = 10 kg m^2 by one wheel of J = 0.05 kg m^2 from rest.

    The quintic has a rate r and acceleration a; the wheel turns at -I r / J relative to inertial
    axes with the torque -I a, so that it drives at I a (I / J + 1) r at most until half-time.
    """
    turn, duration = np.deg2rad(60.0), 30.0
    s = np.linspace(0.0, 1.0, 2001)
    rate = turn / duration * 30.0 * s**2 * (1.0 - s) ** 2
    acceleration = turn / duration**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    by_hand = np.max(10.0 * acceleration * (10.0 / 0.05 + 1.0) * rate) / 0.7
    slew = [
        *("checks=[]", "duration=30", "reference.angle='60 deg'", "reference.duration=30"),
        *("reference.axis=[1,0,0]", "law.angle='60 deg'", "law.duration=30", "law.axis=[1,0,0]"),
        *("initial={}", "plant.wheels={inertia=0.05,efficiency=0.7}"),
    ]
    truth = run("lqr-tracking", overrides=slew, out=tmp_path).log.read("/truth")
    assert 0.5 < by_hand < 50.0  # W
    assert truth["wheel_power"][:, 0].max() == pytest.approx(by_hand, rel=1e-3)  # 5e-4
    assert np.abs(truth["wheel_power"][:, 1:]).max() < 1e-6
    # It brakes into nothing: what it took is the kinetic energy of half-time, over the efficiency.
    top = np.max(rate)
    kinetic = 0.5 * 0.05 * (10.0 / 0.05 * top) ** 2 + 0.5 * 10.0 * top**2
    assert truth["wheel_energy"][-1, 0] == pytest.approx(kinetic / 0.7, rel=1e-3)


@pytest.mark.parametrize("key", ["power_limit", "total_power_limit"])
def test_a_limit_holds_in_flight_and_is_told(key: str, tmp_path: Path) -> None:
    limit = {"power_limit": 4.0, "total_power_limit": 12.0}[key]
    keys = [f"plant.wheels.{key}={limit}", "plant.wheels.efficiency=0.8"]
    flight = run("wheel-pyramid", overrides=[*SLEW, *keys], out=tmp_path)
    power = flight.log.read("/truth")["wheel_power"]
    taken = power if key == "power_limit" else power.sum(axis=-1)
    # Friction and the other motors make speeds differ from what each motor makes of its own: 3e-5.
    assert taken.max() == pytest.approx(limit, rel=1e-4)
    assert any("saturated" in event.message for event in flight.log.events())
    assert verify(flight.path) is None
    assert verify(flight.path, start=3.0) is None
    assert flight.log.units["/truth"]["wheel_power"] == "W"
    assert flight.log.units["/truth"]["wheel_energy"] == "J"


def test_a_dead_motor_takes_its_standby_power() -> None:
    keys = ["plant.wheels.efficiency=0.8", "plant.wheels.standby_power='500 mW'"]
    dead = "faults=[{motor='wheel_1',kind='dead',at=2.0}]"
    power = flown([*keys, dead])["/truth"]["wheel_power"]
    assert power[0].tolist() == [0.5] * 4
    assert power[: len(power) // 6, 1].max() > 0.6
    np.testing.assert_array_equal(power[len(power) // 5 :, 1], 0.5)


def test_the_margin_of_momentum_is_logged_where_it_is_asked_for() -> None:
    plain = flown([])
    assert not {"wheel_power", "wheel_energy", "wheel_momentum_margin"} & plain["/truth"].keys()
    assert not [name for name in plain["/state"] if "wheel" in name]
    margin = flown(["plant.wheels.momentum_margin=true"])
    truth = margin["/truth"]
    expected = (200.0 - np.abs(truth["wheel_speed"])) * 0.05
    np.testing.assert_array_equal(truth["wheel_momentum_margin"], expected)
    np.testing.assert_array_equal(margin["/state"]["physics"], plain["/state"]["physics"])


@pytest.mark.usefixtures("one_block")
def test_alone_or_in_a_batch_the_same_bits() -> None:
    keys = ["plant.wheels.efficiency=0.8", "plant.wheels.total_power_limit=5"]
    built = assemble(*load("wheel-pyramid", ["checks=[]", "duration=0.5", *keys]))
    (one,), (many,) = (list(fly(built, first_start(built, range(n)), range(n))) for n in (1, 3))
    for topic in ("/state", "/truth"):
        for name, alone in one.rows[topic].items():
            for vehicle in range(3):
                np.testing.assert_array_equal(many.rows[topic][name][:, vehicle], alone[:, 0])


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"efficiency": -0.5}, r"plant\.wheels\.efficiency: got -0\.5, should be greater than 0"),
        ({"efficiency": 1.2}, r"plant\.wheels\.efficiency: got 1\.2, should be less than or equal"),
        ({"efficiency": [0.8, 0.8]}, "efficiency: 2 numbers for 4 axes: give one, or as many"),
        ({"power_limit": 5.0}, "power_limit: goes with efficiency, which is missing"),
        ({"regenerates": True}, "regenerates: goes with efficiency, which is missing"),
        ({"efficiency": 0.8, "torque_constant": 0.05}, "give both or neither"),
        (
            {"efficiency": 0.8, "standby_power": 3.0, "power_limit": 3.0},
            r"plant\.wheels: power_limit: 3 W is not above the 3 W of standby_power: give more",
        ),
        (
            {"efficiency": 0.8, "standby_power": 3.0, "total_power_limit": 10.0},
            r"total_power_limit: 10 W is not above the 12 W of standby_power",
        ),
        (
            {"speed_limit": None, "momentum_margin": True},
            "momentum_margin: needs speed_limit, which is missing",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(keys: dict[str, Any], message: str) -> None:
    table = load("wheel-pyramid")[0].model_dump(exclude_none=True)
    table["plant"]["wheels"] |= keys
    if keys.get("speed_limit", 0) is None:
        del table["plant"]["wheels"]["speed_limit"]
    with pytest.raises(InputError, match=message) as refused:
        assemble(validate(table, "file.toml"), Path())
    assert "\n" not in str(refused.value)
