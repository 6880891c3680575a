"""Spacecraft that are connected and parted in flight: when, and as closed forms have it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, assembly, assert_same, flown
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.simulation.initial_state import first_start

pytestmark = SHORT_BLOCKS

COAST = "law={kind='coast:Coast'}"
MET = [
    *("events=[]", "duration=6", "initial.velocity=[0.1,0,0]", COAST),
    "plant.spacecraft.target.position=[1.2,0,0]",
    "plant.spacecraft.target.euler=['10 deg',0,0]",
    "plant.spacecraft.target.rate=[0,0,0]",
    "plant.connections.dock.closes={distance='3 cm'}",
]
"""The ports meet at 2 s, at 0.1 m/s: 3 cm apart from 1.7 s on, and again until 2.3 s."""


def closed(*overrides: str) -> tuple[Array, list[str]]:
    """Return at which control instants the latch is closed, and what is told."""
    flight = flown(assembly("tumbling-target-capture", *MET, *overrides))
    assert not flight.trouble
    times = flight.rows["time"][:, 0][flight.rows["/truth.dock_closed"][:, 0, 0] > 0.5]
    return times, [event.message for event in flight.told if "satur" not in event.message]


def test_it_closes_once_the_ports_are_near() -> None:
    times, told = closed()
    np.testing.assert_allclose(times[[0, -1]], [1.7, 6.0])
    assert told == ["dock closes: the ports are 30 mm and 10 deg apart, at 100 mm/s"]


@pytest.mark.parametrize(
    "closes",
    ["distance=0.03,angle='9 deg'", "distance=0.03,speed='9 cm/s'", "distance=0.03,after=3"],
)
def test_it_does_not_close_while_one_condition_fails(closes: str) -> None:
    times, told = closed(f"plant.connections.dock.closes={{{closes}}}")
    assert not len(times)
    assert told == []


def test_it_closes_after_its_time_if_the_ports_are_near_then() -> None:
    times, _ = closed("plant.connections.dock.closes={distance=0.03,after=2.2}")
    assert times[0] == pytest.approx(2.2)


def test_it_opens_for_good() -> None:
    times, told = closed("plant.connections.dock.opens_at=2")
    np.testing.assert_allclose(times, [1.7, 1.8, 1.9])
    assert told[1:] == ["dock opens"]


def test_unlike_springs_turn_the_cubesat_as_the_planar_equations_have_it() -> None:
    law = [COAST, "duration=12", "rates.physics='0.5 ms'", "rates.control='10 ms'"]
    built = assembly("cubesat-deployment", *law)
    rows = flown(built).rows
    found = rows["/truth.cubesat_position"][-1, 0], rows["/truth.cubesat_rate"][-1, 0]
    springs = built.scenario.plant.connections["door"].springs.rows()
    masses, turning = np.array([106.0, 10.0]), np.array([built.vehicle.inertia[2, 2], 0.113])
    wheels = built.vehicle.inertia[2, 2]
    assert wheels > 0.0

    def rates(_: float, state: Array) -> Array:
        """The satellite's and the CubeSat's x, y and angle, and their derivatives."""
        (x, y, turn), speeds = (state[6 * k : 6 * k + 6].reshape(2, 3).T for k in (0, 1))
        force, torque = np.zeros((2, 2)), np.zeros(2)
        ports = np.array([[0.42, 0.02], [-0.17, 0.0]])
        for stiffness, stroke, *foot in springs:
            places, ways = [], []
            for k in (0, 1):
                c, s = np.cos(turn[k]), np.sin(turn[k])
                turned = np.array([[c, -s], [s, c]])
                places.append(np.array([x[k], y[k]]) + turned @ (ports[k] + foot[:2]))
                ways.append(turned[:, 0])
            push = max(stiffness * (stroke - (places[1] - places[0]) @ ways[0]), 0.0) * ways[0]
            for k, sign in ((0, -1.0), (1, 1.0)):
                arm = places[1] - [x[k], y[k]]
                force[k] += sign * push
                torque[k] += sign * (arm[0] * push[1] - arm[1] * push[0])
        accelerations = np.column_stack([force / masses[:, None], torque / turning])
        return np.concatenate([speeds.T.ravel(), accelerations.ravel()])

    start = np.zeros(12)
    start[3:6] = 0.59, 0.02, 0.0
    end = solve_ivp(rates, (0.0, 2.0), start, rtol=1e-10, atol=1e-12, max_step=1e-3).y[:, -1]
    (x, y, turn), (_, _, speed) = end[:6].reshape(2, 3).T, end[6:].reshape(2, 3).T
    c, s = np.cos(turn[0]), np.sin(turn[0])
    apart = np.array([[c, s], [-s, c]]) @ [x[1] - x[0], y[1] - y[0]]
    # The push begins and ends within half a millisecond of when it should: 1e-3 of its 0.15 s.
    np.testing.assert_allclose(found[0][:2], apart, atol=1e-3)
    assert found[1][2] == pytest.approx(speed[1] - speed[0], rel=2e-3)
    assert found[1][2] < -0.05


def test_vehicles_of_a_batch_are_caught_by_themselves() -> None:
    built = assembly("tumbling-target-capture", *MET)
    start = first_start(built, (0, 1))
    physics = start.physics.copy()
    physics[1, 1] -= 0.05  # the second is behind
    both = flown(built, (0, 1), start=dataclasses.replace(start, physics=physics))
    assert [round(event.time, 6) for event in both.told] == [1.7, 2.2]
    alone = flown(built, (0,))
    for name, values in both.rows.items():
        if name != "time" and not name.startswith("/state.sensor"):
            assert np.array_equal(values[:, :1], alone.rows[name]), name


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("tumbling-target-capture", ["duration=20"]),
        ("cubesat-deployment", ["duration=11"]),
    ],
)
def test_compiled_is_pythons_and_the_log_flies_again(
    name: str, overrides: list[str], tmp_path: Path
) -> None:
    built = assembly(name, *overrides)
    compiled = flown(built)
    assert compiled.compiled == (
        "compiled: sensors, law, actuators and step effects (the model's own sensors, the "
        "connection)"
    )
    assert_same(compiled, flown(built, compiled=False))
    result = run(name, overrides=[*overrides, "checks=[]"], out=tmp_path / "out")
    assert verify(result.path) is None
    middle = next(
        e.time for e in result.log.events() if "closes" in e.message or "opens" in e.message
    )
    for start in (middle, middle + 0.2):
        assert verify(result.path, start=start) is None


def test_a_law_sees_the_other_spacecraft(tmp_path: Path) -> None:
    log = run("cubesat-deployment", overrides=["duration=12", "checks=[]"], out=tmp_path / "a").log
    measured, truth = log.read("/measurement"), log.read("/truth")
    for field, unit in (("cubesat_position", "m"), ("cubesat_rate", "rad/s"), ("door_closed", "")):
        assert np.array_equal(measured[field], truth[field])
        assert log.units["/truth"].get(field, "") == unit
    assert truth["cubesat_position"][-1, 0] > 2.0
