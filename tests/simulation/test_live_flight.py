"""A flight that a person interferes with is the scenario's own until then."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace import attitude
from mjspace.errors import FlightError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import INTEGRATION, first_start
from mjspace.simulation.live_flight import LiveFlight
from mjspace.simulation.live_gains import gains_of
from mjspace.simulation.loop import fly


@cache
def flown(scenario: str = "wheel-failure", *overrides: str) -> Assembly:
    return assemble(*load(scenario, ["duration=4", "checks=[]", *overrides]))


def momentum(flight: LiveFlight) -> np.ndarray:
    """Return the angular momentum about the centre of mass, inertial axes [N m s]."""
    model, data = flight.assembly.vehicle.model, state(flight)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_subtreeVel(model, data)
    return data.subtree_angmom[0].copy()


def state(flight: LiveFlight) -> Any:
    data = mujoco.MjData(flight.assembly.vehicle.model)
    mujoco.mj_setState(flight.assembly.vehicle.model, data, flight.period.physics[0], INTEGRATION)
    return data


@pytest.mark.parametrize("scenario", ["wheel-failure", "estimated-attitude", "dgvscmg-ideal"])
def test_without_interference_it_is_the_flight_bit_for_bit(scenario: str) -> None:
    assembly = flown(scenario, "duration=0.4")
    (states,) = (
        np.concatenate([block.rows["/state"]["physics"] for block in blocks])
        for blocks in [list(fly(assembly, first_start(assembly, [0])))]
    )
    flight, seen = LiveFlight(assembly), []
    while not flight.over:
        seen.append(flight.period.physics[0])
        flight.fly(1)
    seen.append(flight.period.physics[0])
    np.testing.assert_array_equal(np.array(seen), states[:, 0])


def test_a_push_gives_its_impulse_and_ends() -> None:
    flight = LiveFlight(flown())
    flight.fly(10)
    before = momentum(flight)
    turned = flight.period.truth.attitude[0]
    torque, seconds = np.array([0.0, 0.02, 0.0]), 0.4
    flight.push(np.zeros(3), torque, seconds)
    flight.fly(round(seconds / flight.assembly.scenario.rates.control))
    flight.fly(1)
    pushed = momentum(flight)
    # It hardly turns in 0.4 s.
    expected = attitude.rotate(turned, seconds * torque)
    np.testing.assert_allclose(pushed - before, expected, atol=0.02 * 0.4 * 0.02)
    flight.fly(20)
    np.testing.assert_allclose(momentum(flight), pushed, atol=1e-9)


def test_a_force_moves_it_and_is_in_inertial_axes() -> None:
    flight = LiveFlight(flown())
    flight.push(np.array([3.0, 0.0, 0.0]), np.zeros(3), 0.2)
    flight.fly(30)
    mass = flight.assembly.vehicle.model.body_mass.sum()
    np.testing.assert_allclose(
        state(flight).qvel[:3], [0.6 / mass, 0.0, 0.0], rtol=0.02, atol=1e-3 / mass
    )


def test_a_gain_acts_from_the_next_instant_on() -> None:
    flight, other = LiveFlight(flown()), LiveFlight(flown())
    for each in (flight, other):
        each.fly(5)
    name = "rate_gain"
    value = float(gains_of(flight.assembly.law)[name][0])
    flight.set_gain(name, 2.0 * value)
    for each in (flight, other):
        each.fly(1)
    torque, usual = (each.period.command.torque[0] for each in (flight, other))
    np.testing.assert_array_equal(flight.period.physics, other.period.physics)
    rate = other.period.measurement.rate[0]
    np.testing.assert_allclose(torque - usual, -value * rate, atol=1e-12)


@pytest.mark.parametrize("value", [-1.0, float("nan"), [1.0, 2.0], "x"])
def test_a_gain_out_of_its_range_is_refused_and_changes_nothing(value: object) -> None:
    flight = LiveFlight(flown())
    before = flight.assembly.law
    with pytest.raises(ValueError, match="rate_gain"):
        flight.set_gain("rate_gain", value)
    assert flight.assembly.law is before


def test_a_broken_wheel_gives_no_torque_until_it_is_repaired() -> None:
    flight = LiveFlight(flown())
    flight.break_motor("wheel_1", "dead")
    flight.fly(1)
    applied = flight.period.applied[0][0]
    assert applied[1] == 0.0
    assert np.abs(applied[[0, 2]]).min() > 0.0
    flight.break_motor("wheel_0", "stuck")
    flight.fly(1)
    stuck = flight.period.applied[0][0, 0]
    flight.fly(10)
    assert flight.period.applied[0][0, 0] == stuck
    flight.repair()
    flight.fly(1)
    assert flight.period.applied[0][0, 1] != 0.0
    assert flight.events[0].message == "fault: wheel_1 is dead"


def test_it_ends_with_the_scenario_and_a_law_that_raises_ends_it(
    failing_law: Callable[..., Path],
) -> None:
    flight = LiveFlight(flown())
    flight.fly(10**6)
    assert flight.over
    assert flight.period.time == pytest.approx(4.0)
    failing = LiveFlight(assemble(*load(failing_law(0.05))))
    with pytest.raises(FlightError, match=r"stopped at t = .*no way on"):
        failing.fly(10**6)
