"""Reaction-control thrusters: pulses, lag, tank and composition, against closed forms."""

from typing import Any

import mujoco
import numpy as np
import pytest
import thruster_samples
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from thruster_samples import FORCE, PERIOD, STEP, TRUTH, built, check_batch, layout

from mjspace.actuators.thrusters import Rcs, Thrusters
from mjspace.contract import Array
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.scenario.plant import PlantTable, Rates
from mjspace.vehicle.vehicle import build, on_model


def thrusters(count: int = 1, **keys: Any) -> Thrusters:
    return built(Rcs(**layout(count), **keys), "rcs_tank", mass=0.5, inertia=0.01)


def fire(flown: Thrusters, on_times: list[float], periods: int) -> tuple[Any, Array, Array]:
    """Return (state, impulse of each step [N s], whether cut) for pulses and then nothing."""
    pulses = [*on_times, *[0.0] * (periods - len(on_times))]
    state, impulse, cut = thruster_samples.fire(flown, pulses)
    return state, impulse[:, 0], cut[:, 0]


def test_a_valve_that_closes_within_a_step_gives_that_part_of_its_thrust() -> None:
    state, impulse, cut = fire(thrusters(), [0.0125], 2)
    np.testing.assert_allclose(impulse / FORCE, [0.005, 0.005, 0.0025, *[0.0] * 5], atol=1e-15)
    assert state["rcs_on_time"][0, 0] == pytest.approx(0.0125, rel=1e-12)
    assert not cut.any()


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.0125, 0.02, 0.033, 0.05])
def test_a_pulse_comes_late_by_the_delay_and_whole(delay: float) -> None:
    _, impulse, _ = fire(thrusters(delay=delay), [0.0125, 0.0, 0.004], 7)
    edges = STEP * np.arange(len(impulse) + 1)
    expected = sum(
        np.diff(np.clip(edges - begin - delay, 0.0, on))
        for begin, on in ((0.0, 0.0125), (0.04, 0.004))
    )
    np.testing.assert_allclose(impulse / FORCE, expected, atol=1e-14)


def test_whole_periods_join_into_one_pulse() -> None:
    # seen by the least pulse: it counts from the first of them
    flown = thrusters(delay=0.0033, minimum_on=0.05)
    state, impulse, _ = fire(flown, [PERIOD] * 3, 6)
    assert impulse.sum() / FORCE == pytest.approx(3 * PERIOD, rel=1e-12)
    assert state["rcs_open"][0, 0] == 0.0


def test_a_short_pulse_is_lengthened_even_over_the_next_period() -> None:
    state, impulse, cut = fire(thrusters(minimum_on=0.033), [0.002], 4)
    np.testing.assert_allclose(impulse / FORCE, [*[0.005] * 6, 0.003, *[0.0] * 9], atol=1e-15)
    assert cut[:4].all()
    assert not cut[4:].any()
    assert state["rcs_on_time"][0, 0] == pytest.approx(0.033, rel=1e-12)


def test_thrust_follows_its_valve_with_the_lag_and_no_impulse_is_lost() -> None:
    lag, on = 0.01, 0.0125
    state, impulse, _ = fire(thrusters(rise=lag), [on], 30)
    time = STEP * np.arange(121)
    # the impulse of a step response, less that of one that begins when the valve closes
    response = [
        np.where(t > 0.0, t - lag * (1.0 - np.exp(-np.maximum(t, 0.0) / lag)), 0.0)
        for t in (time, time - on)
    ]
    np.testing.assert_allclose(impulse / FORCE, np.diff(response[0] - response[1]), atol=1e-14)
    assert impulse.sum() == pytest.approx(FORCE * on, rel=1e-12)
    assert state["rcs_thrust"][0, 0] < 1e-20


def test_propellant_goes_with_impulse_over_exhaust_speed() -> None:
    flown = thrusters(specific_impulse=220.0, propellant=0.5, rise=0.004)
    state, impulse, _ = fire(flown, [0.0125, 0.02, 0.003], 20)
    used = 0.5 - state["rcs_propellant"][0, 0]
    assert used == pytest.approx(impulse.sum() / (220.0 * STANDARD_GRAVITY), rel=1e-9)
    assert flown.masses(state, state)["body_mass"][1] == state["rcs_propellant"][0]
    np.testing.assert_allclose(
        flown.masses(state, state)["body_inertia"][1], 0.02 * state["rcs_propellant"] * np.ones(3)
    )
    assert flown.measured(state, TRUTH).propellant == state["rcs_propellant"]


def test_an_empty_tank_ends_it_with_its_last_gram() -> None:
    flown = thrusters(specific_impulse=220.0, propellant=1e-5)
    state, impulse, cut = fire(flown, [PERIOD] * 3, 4)
    assert impulse.sum() == pytest.approx(1e-5 * 220.0 * STANDARD_GRAVITY, rel=1e-12)
    assert state["rcs_propellant"][0, 0] == 0.0
    assert state["rcs_thrust"][0, 0] == 0.0
    assert cut[8]  # 0.0108 s of thrust were in it


def test_what_burns_nothing_weighs_the_same() -> None:
    flown = thrusters()
    assert flown.masses(flown.reset(1), flown.reset(1)) == {}
    assert flown.measured(flown.reset(1), TRUTH).propellant.size == 0


def test_what_no_period_holds_is_cut() -> None:
    _, impulse, cut = fire(thrusters(), [-0.01, 0.5], 3)
    np.testing.assert_allclose(impulse / FORCE, [*[0.0] * 4, *[STEP] * 4, *[0.0] * 4])
    assert cut.tolist() == [1.0] * 8 + [0.0] * 4


def test_a_batch_is_its_vehicles() -> None:
    flown = thrusters(
        3, specific_impulse=220.0, propellant=2e-5, rise=0.01, delay=0.013, minimum_on=0.007
    )
    every = check_batch(flown)
    assert (every["rcs_propellant"] == 0.0).any()


def burns(on_times: Any) -> Array:
    """Return when a valve opens and shuts [s], (n, 2), of on-times that are burnt to the end."""
    found = list[list[float]]()
    for number, on in enumerate(on_times):
        now = number * PERIOD
        if on < 0.0:
            if found:
                found[-1][1] = min(found[-1][1], now)
        elif on > 0.0:
            if not found or found[-1][1] < now:
                found.append([now, now])
            found[-1][1] = max(found[-1][1], now + on)
    return np.array(found).reshape(-1, 2)


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.0125, 0.033])
@pytest.mark.parametrize(
    ("on_times", "spans"),
    [
        ([0.1234], [(0.0, 0.1234)]),
        ([0.05, 0.0, 0.0501], [(0.0, 0.0901)]),  # lengthened
        ([0.0, 0.1, 0.03, 0.001], [(0.02, 0.12)]),  # what is shorter does not cut it
        ([0.1, 0.0, -1.0, 0.0, 0.01], [(0.0, 0.04), (0.08, 0.09)]),  # shut, and opened again
        ([0.04, 0.0, 0.03], [(0.0, 0.07)]),  # one ends where the next begins
    ],
    ids=["long", "lengthened", "shorter", "shut", "joined"],
)
def test_a_burn_goes_on_to_its_end(
    on_times: list[float], spans: list[tuple[float, float]], delay: float
) -> None:
    state, impulse, cut = fire(thrusters(burns="to_the_end", delay=delay), on_times, 12)
    edges = STEP * np.arange(len(impulse) + 1)
    expected = sum(
        np.diff(np.clip(edges - begin - delay, 0.0, end - begin)) for begin, end in spans
    )
    np.testing.assert_allclose(impulse / FORCE, expected, atol=1e-14)
    total = sum(end - begin for begin, end in spans)
    assert state["rcs_on_time"][0, 0] == pytest.approx(total, rel=1e-12)
    assert not cut.any()


def test_a_valve_that_is_shut_stays_open_for_its_least_pulse() -> None:
    flown = thrusters(burns="to_the_end", minimum_on=0.033, rise=0.004)
    state, impulse, cut = fire(flown, [0.1, -1.0], 20)
    assert state["rcs_on_time"][0, 0] == pytest.approx(0.033, rel=1e-12)
    assert impulse.sum() == pytest.approx(FORCE * 0.033, rel=1e-9)  # the lag loses nothing
    assert not cut.any()
    # Too short by itself is told; within a burn it has no effect, and there is nothing to tell.
    _, _, cut = fire(flown, [0.01, 0.0, 0.1, 0.01], 10)
    assert cut.tolist() == [1.0] * 4 + [0.0] * 36


@given(
    on_times=st.lists(
        st.sampled_from([0.0, 0.0, -1.0, 0.004, 0.013, 0.02, 0.05, 0.071]), max_size=12
    ),
    delay=st.sampled_from([0.0, 0.0071, 0.02, 0.05]),
)
@settings(max_examples=60, deadline=None)
def test_the_time_that_a_valve_is_open_is_that_of_its_burns(
    on_times: list[float], delay: float
) -> None:
    flown = thrusters(burns="to_the_end", delay=delay)
    state, impulse, _ = fire(flown, on_times, len(on_times) + 8)
    spans = burns(on_times)
    np.testing.assert_allclose(state["rcs_on_time"][0, 0], np.diff(spans).sum(), atol=1e-12)
    assert impulse.sum() == pytest.approx(FORCE * np.diff(spans).sum(), abs=1e-12)


UNLIKE = {
    "thrust": [1.0, 2.0, 3.0],
    "specific_impulse": [150.0, 220.0, 290.0],
    "minimum_on": [0.0, 0.009, 0.0],
    "delay": [0.0, 0.003, 0.031],
    "rise": [0.004, 0.0, 0.0],
}


def test_each_of_unlike_thrusters_flies_as_it_does_alone() -> None:
    table = Rcs(**layout(3) | UNLIKE, propellant=0.5)
    flown = built(table, "rcs_tank", mass=0.5, inertia=0.01)
    pulses = [[0.0125, 0.002, 0.02], [0.0, 0.02, 0.004], *[[0.0] * 3] * 30]
    state, impulse, cut = thruster_samples.fire(flown, pulses)
    used = 0.0
    for i in range(3):
        keys = {key: values[i] for key, values in UNLIKE.items()}
        one = built(Rcs(**layout(1) | keys, propellant=0.5), "rcs_tank", mass=0.5, inertia=0.01)
        alone, its_impulse, its_cut = thruster_samples.fire(one, [p[i] for p in pulses])
        np.testing.assert_array_equal(impulse[:, i], its_impulse[:, 0])
        np.testing.assert_array_equal(cut[:, i], its_cut[:, 0])
        used += 0.5 - alone["rcs_propellant"][0, 0]
        assert impulse[:, i].sum() == pytest.approx(keys["thrust"] * [0.0125, 0.029, 0.024][i])
    assert 0.5 - state["rcs_propellant"][0, 0] == pytest.approx(used, rel=1e-9)
    by_hand = impulse.sum(axis=0) / (np.array(UNLIKE["specific_impulse"]) * STANDARD_GRAVITY)
    assert used == pytest.approx(by_hand.sum(), rel=1e-9)


def test_what_a_fault_adds_is_burnt_by_the_flow_of_its_own_thruster() -> None:
    table = Rcs(**layout(3) | UNLIKE, propellant=0.5)
    flown = built(table, "rcs_tank", mass=0.5, inertia=0.01)
    applied, instead = np.array([[1.0, 0.0, 3.0]]), np.array([[1.0, 2.0, 0.0]])
    after, thrust = flown.account(flown.reset(1), applied, instead, STEP)
    np.testing.assert_array_equal(thrust, instead)
    burnt = STEP * (2.0 / 220.0 - 3.0 / 290.0) / STANDARD_GRAVITY
    assert 0.5 - after["rcs_propellant"][0, 0] == pytest.approx(burnt, abs=1e-15)


def test_a_list_of_equal_numbers_is_one_number_for_all() -> None:
    keys = {"minimum_on": 0.007, "delay": 0.013, "rise": 0.01, "specific_impulse": 220.0}
    lists = {key: [value] * 3 for key, value in keys.items()}
    pulses = np.random.default_rng(4).uniform(-0.01, 0.025, (8, 3))
    one, other = (
        built(Rcs(**layout(3) | table, propellant=2e-5), "rcs_tank", mass=0.5, inertia=0.01)
        for table in (keys, lists | {"thrust": [FORCE] * 3})
    )
    np.testing.assert_equal(
        thruster_samples.fire(one, pulses), thruster_samples.fire(other, pulses)
    )


RCS = Rcs(
    positions=[[0.4, 0.0, 0.5], [0.0, -0.4, 0.1]],
    directions=[[2.0, 0.0, 0.0], [0.0, 3.0, 4.0]],
    thrust=FORCE,
    specific_impulse=220.0,
    propellant=0.7,
)


@pytest.mark.parametrize("axes", [[], [[1, 0, 0], [0, 0, 1]]], ids=["alone", "beside wheels"])
def test_a_thruster_pushes_where_it_is_and_along_its_direction(axes: Any) -> None:
    table = PlantTable(wheels={"axes": axes}, rcs=RCS, bus_inertia=np.diag([15.0, 12.0, 18.0]))
    vehicle = build(table, Rates(), userdata=0)
    assert vehicle.motors == (*(f"wheel_{i}" for i in range(len(axes))), "thruster_0", "thruster_1")
    assert on_model(vehicle, vehicle.model).motors == vehicle.motors
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    data.qpos[3:7] = np.array([1.0, 2.0, -1.0, 0.5]) / 2.5
    data.ctrl[-2:] = 0.5, 1.5
    mujoco.mj_forward(model, data)
    force = np.array([0.5, 0.9, 1.2])
    torque = np.cross([0.4, 0.0, 0.5], [0.5, 0.0, 0.0]) + np.cross([0.0, -0.4, 0.1], [0, 0.9, 1.2])
    to_inertial = data.body("bus").xmat.reshape(3, 3)
    np.testing.assert_allclose(data.qfrc_actuator[:3], to_inertial @ force, rtol=1e-13)
    np.testing.assert_allclose(data.qfrc_actuator[3:6], torque, atol=1e-14)
    # hydrazine at 1010 kg/m^3: a sphere of radius 54.9 mm
    assert model.body("rcs_tank").mass[0] == 0.7
    np.testing.assert_allclose(model.body("rcs_tank").inertia, 0.4 * 0.7 * 0.05490**2, rtol=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"directions": [[1, 0, 0]]}, "1 rows for 2 positions"),
        ({"directions": [[1, 0, 0], [0, 0, 0]]}, "which has no direction"),
        ({"propellant": None}, "give both or neither"),
        ({"thrust": [1.0]}, "thrust: 1 numbers for 2 positions: give one, or as many"),
        ({"specific_impulse": [220.0] * 3}, "specific_impulse: 3 numbers for 2 positions"),
        ({"delay": [0.0, -1.0]}, "greater than or equal to 0"),
        ({"thrust": [1.0, 0.0]}, "greater than 0"),
    ],
)
def test_what_makes_no_sense_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Rcs(**(RCS.model_dump() | change))
