"""Booms and yo-yos deployed in flight: against independent integrations and closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.actuators.reaction_wheels import Wheels
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.log.reader import Log
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.scenario.plant import Part, PlantTable, Rates
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.vehicle import indices
from mjspace.vehicle import vehicle as plant
from mjspace.vehicle.deployed_parts import Boom
from mjspace.vehicle.deployments import Deployment

RATE = 2.0 * np.pi / 5600.0  # rad/s, of the orbit
REDUCED = 2.0 * 100.0 / 102.0  # kg, of the tip against the bus
C, BEGUN, SPIN = 16.99, 0.1, 5.886686099096139  # of yo-yo-despin


def profile(at: float = 10.0, length: float = 6.0, ramp: float = 10.0) -> Boom:
    table = Deployment(at=at, length=length, rate=0.05, ramp=ramp)
    return Boom("boom", table, stowed=0.5, motor=0, lead=1.0)


@pytest.mark.parametrize(("length", "ramp"), [(6.0, 10.0), (6.0, 0.0), (0.3, 10.0), (0.3, 1.0)])
def test_a_boom_is_commanded_to_its_end_and_no_faster(length: float, ramp: float) -> None:
    boom = profile(length=length, ramp=ramp)
    times = np.linspace(0.0, boom.end + 10.0, 4_001)
    place, rate = np.array([boom.desired(time) for time in times]).T
    assert place[0] == 0.5
    assert place[-1] == pytest.approx(length, abs=1e-12)
    assert np.abs(rate).max() <= 0.05 + 1e-12
    assert (np.abs(rate) > 0).argmax() == pytest.approx(np.searchsorted(times, 10.0), abs=1)
    travelled = np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times))
    np.testing.assert_allclose(place[1:] - 0.5, travelled, atol=1e-3)  # half a step of rate


def test_a_boom_in_orbit_swings_as_its_growing_inertia_says(tmp_path: Path) -> None:
    flown = run("gravity-gradient-boom", overrides=["duration=1500", "checks=[]"], out=tmp_path)
    truth, wanted = flown.log.read("/truth"), flown.log.read("/reference")
    error = attitude.multiply(attitude.conjugate(wanted["attitude"]), truth["attitude"])
    pitch = 2.0 * np.arctan2(error[:, 3], error[:, 0])
    boom = profile()

    # (I (n + pitch'))' = -3/2 n^2 (Ir - Iy) sin 2 pitch, the tip where its drive is told to be
    def slope(time: float, state: Array) -> list[float]:
        far = REDUCED * boom.desired(time)[0] ** 2
        torque = -1.5 * RATE**2 * (10.01 + far - 8.01) * np.sin(2.0 * state[0])
        return [state[1] / (12.01 + far) - RATE, torque]

    begin = [np.radians(-27.0), 0.0086 * (12.01 + REDUCED * 0.25)]
    times = truth["time"]
    solved = solve_ivp(slope, (0.0, 1500.0), begin, "DOP853", t_eval=times, rtol=1e-10, max_step=5)
    # The loop of 0.3 rad/s lets the tip lag by 6 mm while it is sped up; 6e-4 rad measured.
    assert np.abs(pitch - solved.y[0]).max() < 1e-3
    assert np.abs(pitch[-1]) > np.radians(5.0)
    told = [(event.time, event.message) for event in flown.log.events()]
    assert (10.0, "deployment: boom sets out") in told
    assert (130.0, "deployment: boom is out") in told


AT_ONCE = [
    "duration=0.8",
    "plant.parts.east.deployment.at=0",
    "plant.parts.west.deployment.at=0",
]


def test_a_booms_motor_is_nobody_elses() -> None:
    boom = Part(part="boom", deployment=Deployment(at=1.0, length=2.0, rate=0.1))
    parts = {"boom": boom, "cmg": Part(part="dgvscmg")}
    table = PlantTable(model="satellite_dgvscmg", wheels=Wheels(axes=[]), parts=parts)
    model = plant.build(table, Rates(physics=1e-4), userdata=0).model
    motors = [model.actuator(i).name for i in range(model.nu)]
    assert motors == [*indices.turned(model, ()), "boom_drive"]
    assert len(motors) == 4


def despun(overrides: list[str], out: Path) -> Log:
    return run("yo-yo-despin", overrides=["checks=[]", *overrides], out=out).log


def test_a_yo_yo_takes_the_spin_along_its_closed_form(tmp_path: Path) -> None:
    log = despun(["duration=1.71"], tmp_path)
    truth = log.read("/truth")
    since = np.maximum(truth["time"] - 1.0, 0.0)
    # phi phi' = w0 sqrt(1 + phi0^2 / c) sqrt(phi^2 - phi0^2), from momentum and energy
    square = BEGUN**2 + SPIN**2 * (1.0 + BEGUN**2 / C) * since**2
    gained = square - BEGUN**2
    root = np.sqrt(SPIN**2 * gained * square * (1.0 + BEGUN**2 / C))
    exact = SPIN - (SPIN * gained + root) / (C + square)
    off = np.abs(truth["rate"][:, 2] - exact)[since <= 0.7]
    assert off.max() < 5e-6  # 5e-7 measured: the softness of the cord at 1 ms
    assert np.abs(truth["rate"][-1]).max() < 5e-6
    times = {event.message: event.time for event in log.events()}
    assert times["deployment: east is released"] == 1.0
    assert times["deployment: west is let go"] == pytest.approx(1.7, abs=1e-9)


def test_weights_that_are_gone_are_not_felt(tmp_path: Path) -> None:
    # Let go with spin left (the bus is heavier than the cords are for), it spins on evenly, and
    # without the momentum that the weights have taken.
    heavy = "plant.gyrostat_inertia=[[3,0,0],[0,3,0],[0,0,4]]"
    truth = despun([*AT_ONCE, "duration=1.5", heavy], tmp_path).read("/truth")
    after = truth["time"] > 1.0
    rate = truth["rate"][after, 2]
    assert 1.0 < rate[0] < SPIN
    assert np.abs(rate - rate[0]).max() < 1e-9
    np.testing.assert_allclose(truth["momentum"][after, 2], 4.0 * rate, rtol=1e-7)


def test_a_deployment_is_replayed_bit_for_bit_from_anywhere(tmp_path: Path) -> None:
    log = despun([*AT_ONCE, "rates.physics=0.005", "rates.control=0.01"], tmp_path)
    for start in (0.0, 0.3, 0.75):
        assert verify(log.path, start=start) is None


def test_a_batch_deploys_as_one() -> None:
    slow = ["rates.physics=0.005", "rates.control=0.005"]
    built = assemble(*load("yo-yo-despin", [*AT_ONCE, *slow, "checks=[]"]))
    one, many = (
        np.concatenate(
            [
                block.rows["/state"]["physics"]
                for block in fly(built, first_start(built, range(n)), range(n))
            ]
        )
        for n in (1, 3)
    )
    for vehicle in range(3):
        np.testing.assert_array_equal(many[:, vehicle], one[:, 0])


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"part": "ring_damper", "deployment": {"at": 1}}, "a ring_damper has none, a boom or a y"),
        ({"part": "boom", "deployment": {"at": 1, "rate": 1}}, "length and rate are a boom's"),
        ({"part": "yo_yo", "deployment": {"at": 1, "length": 1}}, "length and rate are a boom's"),
    ],
)
def test_what_cannot_be_deployed_is_refused(part: dict[str, Any], message: str) -> None:
    fields = ",".join(
        f"{key}={value!r}"
        if not isinstance(value, dict)
        else f"{key}={{" + ",".join(f"{k}={v}" for k, v in value.items()) + "}"
        for key, value in part.items()
    )
    with pytest.raises(InputError, match=message):
        load("yo-yo-despin", [f"plant.parts.east={{{fields}}}"])
