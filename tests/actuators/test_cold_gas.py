"""Cold-gas thrusters: mass, pressure and impulse of a tank that blows down, in closed form."""

from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from thruster_samples import FORCE, PERIOD, STEP, TRUTH, built, check_batch, fire, layout

from mjspace.actuators.cold_gas import ColdGas, ColdGasThrusters
from mjspace.contract import Array, PulseCommand
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import fly_to_log
from mjspace.scenario.loading import load, validate
from mjspace.simulation.assembly import assemble

ISP, GAS = 70.0, 0.05  # s, kg
SPEED = ISP * STANDARD_GRAVITY


def thrusters(count: int = 1, **keys: Any) -> ColdGasThrusters:
    table = ColdGas(**layout(count), specific_impulse=ISP, gas=GAS, **keys)
    return built(table, "cold_gas_tank", mass=GAS, inertia=2e-4)


@pytest.mark.parametrize("exponent", [1.0, 1.4, 5.0 / 3.0])
def test_mass_and_pressure_after_many_pulses_are_those_of_the_closed_form(exponent: float) -> None:
    pulses, on = 500, 0.0125
    state, impulse, _ = fire(thrusters(exponent=exponent), [on] * pulses)
    left = state["cold_gas"][0, 0] / GAS
    open_for = pulses * on * FORCE / (GAS * SPEED)  # in time constants of the tank
    half = 0.5 * (exponent - 1.0)
    expected = (1.0 + half * open_for) ** (-1.0 / half) if half else np.exp(-open_for)
    assert left == pytest.approx(expected, rel=1e-12)
    assert 0.6 < left < 0.75
    # The next instant's thrust is that of the pressure, p/p0 = x^n.
    opened = PulseCommand(np.full((1, 1), on))
    _, mean, _ = thrusters(exponent=exponent).act(state, opened, TRUTH, 1e-9)
    assert mean[0, 0] == pytest.approx(FORCE * expected**exponent, rel=1e-9)
    # Impulse is what the gas carries away: of an isothermal tank at a constant speed.
    if exponent == 1.0:
        assert impulse.sum() == pytest.approx(SPEED * GAS * (1.0 - left), rel=1e-12)


def test_a_long_burn_follows_the_equations_of_flow_and_thrust() -> None:
    exponent, on = 1.4, 3.0

    def rates(time: float, y: Array) -> Array:
        """Return flow and thrust, p / sqrt(T) and p in units of the full tank's, with p = m T."""
        temperature = y[0] ** (exponent - 1.0)
        pressure = y[0] * temperature
        flow = pressure / np.sqrt(temperature) * FORCE / (GAS * SPEED)
        return np.array([-flow, FORCE * pressure])

    solved = solve_ivp(rates, (0.0, on), [1.0, 0.0], rtol=1e-11, atol=1e-13)
    state, impulse, _ = fire(thrusters(exponent=exponent), [PERIOD] * round(on / PERIOD))
    assert state["cold_gas"][0, 0] / GAS == pytest.approx(solved.y[0, -1], rel=1e-9)
    assert impulse.sum() == pytest.approx(solved.y[1, -1], rel=1e-9)


def test_a_valve_closes_within_a_step_and_the_least_pulse_is_kept() -> None:
    flown = thrusters(minimum_on=0.0075)
    _, impulse, cut = fire(flown, [0.0125, 0.002, 0.0, 0.5])
    part = impulse[:, 0] / FORCE
    # 12.5 ms, then at least 7.5 ms, then nothing, then no more than the period; 0.6 % per step.
    expected = [0.005, 0.005, 0.0025, 0.0, 0.005, 0.0025, *[0.0] * 6, *[0.005] * 4]
    np.testing.assert_allclose(part, expected, rtol=4e-3)
    assert cut[:, 0].tolist() == [0.0] * 4 + [1.0] * 4 + [0.0] * 4 + [1.0] * 4
    with pytest.raises(ValueError, match=r"plant\.cold_gas\.minimum_on: 0\.03 s is longer than"):
        thrusters(minimum_on=0.03)


def test_valves_share_one_tank_and_a_batch_is_its_vehicles() -> None:
    flown = thrusters(3, exponent=1.4)
    check_batch(flown)
    # Three valves together empty the tank as one does that is open three times as long.
    together, _, _ = fire(flown, [[0.02, 0.02, 0.02]] * 2)
    one_by_one, _, _ = fire(flown, [[0.02, 0.0, 0.0]] * 6)
    np.testing.assert_allclose(together["cold_gas"], one_by_one["cold_gas"], rtol=1e-14)


def test_a_burn_goes_on_to_its_end_and_can_be_shut() -> None:
    flown = thrusters(2, burns="to_the_end", minimum_on=0.0075)
    shut = [[0.0, -1.0], [0.0, 0.0], [0.0, 0.002]]
    state, impulse, cut = fire(flown, [[0.1234, 0.05], [0.03, 0.05], *shut, *[[0.0, 0.0]] * 5])
    # Without regulator, but of so little gas that it hardly matters: 0.6 % in a step.
    edges = STEP * np.arange(41)
    expected = [
        np.diff(np.clip(edges, 0.0, 0.1234)),
        np.diff(np.clip(edges, 0.0, 0.04) + np.clip(edges, 0.08, 0.0875)),
    ]
    np.testing.assert_allclose(impulse.T / FORCE, expected, rtol=0.1, atol=1e-15)
    # The closed form of the isothermal tank, by the time for which valves were open.
    open_for = 0.1234 + 0.04 + 0.0075
    left = np.exp(-open_for * FORCE / (GAS * SPEED))
    assert state["cold_gas"][0, 0] / GAS == pytest.approx(left, rel=1e-13)
    assert impulse.sum() == pytest.approx(SPEED * GAS * (1.0 - left), rel=1e-11)
    assert cut[:, 1].tolist() == [0.0] * 16 + [1.0] * 4 + [0.0] * 20
    assert not cut[:, 0].any()
    check_batch(thrusters(3, burns="to_the_end"))


def test_unlike_valves_follow_the_equations_of_flow_and_thrust() -> None:
    exponent, on = 1.4, 3.0
    thrust, impulse = np.array([2.0, 0.5, 1.0]), np.array([70.0, 55.0, 60.0])
    table = ColdGas(
        **layout(3, thrust.tolist()), specific_impulse=impulse.tolist(), gas=GAS, exponent=exponent
    )
    flown = built(table, "cold_gas_tank", mass=GAS, inertia=2e-4)
    flow = np.sum(thrust / (impulse * STANDARD_GRAVITY)) / GAS

    def rates(time: float, y: Array) -> Array:
        return np.array([-flow * y[0] ** (0.5 * (exponent + 1.0)), y[0] ** exponent])

    solved = solve_ivp(rates, (0.0, on), [1.0, 0.0], rtol=1e-11, atol=1e-13)
    state, given, _ = fire(flown, [[PERIOD] * 3] * round(on / PERIOD))
    assert state["cold_gas"][0, 0] / GAS == pytest.approx(solved.y[0, -1], rel=1e-9)
    np.testing.assert_allclose(given.sum(axis=0), thrust * solved.y[1, -1], rtol=1e-9)
    # What a stuck valve spends leaves by its own nozzle.
    after, _ = flown.account(flown.reset(1), np.zeros((1, 3)), np.eye(3)[1:2], STEP)
    spent = STEP / (impulse[1] * STANDARD_GRAVITY)
    assert GAS - after["cold_gas"][0, 0] == pytest.approx(spent, rel=1e-9)


def test_what_a_stuck_valve_spends_leaves_the_tank_at_its_exhaust_speed() -> None:
    flown, applied, stuck = thrusters(2, exponent=1.4), np.zeros((1, 2)), np.array([[0.0, 0.5]])
    half = flown.reset(1) | {"cold_gas": np.full((1, 1), 0.5 * GAS)}
    after, thrust = flown.account(half, applied, stuck, STEP)
    np.testing.assert_array_equal(thrust, stuck)
    speed = SPEED * 0.5**0.2  # it falls with the root of the temperature, (1/2)^(n - 1)
    assert 0.5 * GAS - after["cold_gas"][0, 0] == pytest.approx(0.5 * STEP / speed, rel=1e-9)
    empty = {"cold_gas": np.zeros((1, 1)), "cold_gas_step": np.zeros((1, 1))}
    after, thrust = flown.account(empty, applied, stuck, STEP)
    assert not thrust.any()


def test_the_tank_has_the_mass_of_the_middle_of_the_step_and_keeps_its_shape() -> None:
    flown = thrusters()
    before, after = ({"cold_gas": np.full((1, 1), gas)} for gas in (0.04, 0.02))
    masses = flown.masses(before, after)
    assert {body for body, _ in masses.values()} == {1}
    np.testing.assert_allclose(masses["body_mass"][1], [0.03])
    np.testing.assert_allclose(masses["body_inertia"][1], [[1.2e-4] * 3])


def test_a_satellite_is_turned_by_gas_and_its_log_is_flown_again(tmp_path: Path) -> None:
    folder = Path(str(resources.files("mjspace.scenarios")))
    table = load("rcs-three-axis", ["duration=2", "checks=[]"])[0].model_dump(exclude_none=True)
    rcs = table["plant"].pop("rcs")
    where = {key: rcs[key] for key in ("positions", "directions", "thrust")}
    table["plant"]["cold_gas"] = {**where, "specific_impulse": ISP, "gas": GAS, "exponent": 1.4}
    assembly = assemble(validate(table, "cold gas"), folder)
    flown = fly_to_log(assembly, tmp_path / "flight.mcap")
    truth, command = flown.log.read("/truth"), flown.log.read("/command")
    assert np.linalg.norm(truth["rate"][-1]) > 3e-4  # it turns
    used = truth["propellant"][0, 0] - truth["propellant"][-1, 0]
    assert 1e-6 < used < 0.1 * GAS
    assert command["thruster_thrust"].max() <= rcs["thrust"]
    assert flown.log.units["/command"]["thruster_thrust"] == "N"
    assert verify(flown.path) is None
    table["plant"]["rcs"] = rcs
    with pytest.raises(InputError, match="cold_gas and rcs are both given: give one"):
        validate(table, "both")


def test_an_unphysical_polytrope_is_refused_in_one_line() -> None:
    table = load("rcs-three-axis")[0].model_dump(exclude_none=True)
    rcs = table["plant"].pop("rcs")
    where = {key: rcs[key] for key in ("positions", "directions", "thrust")}
    table["plant"]["cold_gas"] = {**where, "exponent": 0.9}
    with pytest.raises(InputError, match=r"plant\.cold_gas\.exponent: got 0\.9, should be greater"):
        validate(table, "file.toml")
