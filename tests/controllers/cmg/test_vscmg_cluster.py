"""Variable-speed CMGs: torque and power by gimbals and wheels, and the law that tracks both."""

from operator import itemgetter
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.cmg.cmg_steering import Cluster, momentum
from mjspace.controllers.cmg.vscmg_cluster import PowerTracking
from mjspace.controllers.cmg.vscmg_steering import share
from mjspace.controllers.references.powered import PoweredTurn

from mjspace import attitude as att
from mjspace.contract import Array, Measurement
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

SKEW = np.arccos(1.0 / np.sqrt(3.0))
ROUND = 0.5 * np.pi * np.arange(4)
OUT = np.stack([np.cos(ROUND), np.sin(ROUND), 0.0 * ROUND], axis=-1)
INERTIA = np.full(4, 0.004)
PYRAMID = Cluster(
    np.sin(SKEW) * OUT + np.cos(SKEW) * np.array([0.0, 0.0, 1.0]),
    np.cross([0.0, 0.0, 1.0], OUT),
    INERTIA,
)
SCALES = np.array([1.0, 0.1])
NONE = np.zeros(4)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(26)


def matrix(angle: Array, speed: Array) -> Array:
    """Return what (gimbal rates, wheel torques) give: torque and power, (4, 8).

    By central differences of the momentum: with no gimbal turning, u is Jw W'.
    """
    h = 1e-5
    by_angle = [
        momentum(PYRAMID, angle + h * e, speed) - momentum(PYRAMID, angle - h * e, speed)
        for e in np.eye(4)
    ]
    by_speed = [momentum(PYRAMID, angle, e) / INERTIA[0] for e in np.eye(4)]
    torque = -np.concatenate([np.array(by_angle) / (2.0 * h), by_speed]).T
    return np.vstack([torque, np.concatenate([NONE, speed])])


def drawn(rng: np.random.Generator) -> tuple[Array, Array]:
    return rng.uniform(-np.pi, np.pi, 4), 500.0 + 100.0 * rng.normal(size=4)


def test_torque_and_power_are_the_commanded_ones_at_the_least_cost(
    rng: np.random.Generator,
) -> None:
    for _ in range(30):
        angle, speed = drawn(rng)
        torque, power = rng.normal(size=3), 100.0 * rng.normal(size=1)
        found = np.concatenate(share(PYRAMID, torque, power, angle, speed, NONE, SCALES))
        per = np.repeat(SCALES, 4)
        least = per * (np.linalg.pinv(matrix(angle, speed) * per) @ [*torque, *power])
        # The differences are good to 1e-10, of momenta of 2 N m s.
        np.testing.assert_allclose(found, least, atol=1e-8)


def test_what_is_added_gives_neither_torque_nor_power(rng: np.random.Generator) -> None:
    for _ in range(30):
        angle, speed = drawn(rng)
        own = rng.normal(size=4)
        rate, applied = share(PYRAMID, np.zeros(3), np.zeros(1), angle, speed, own, SCALES)
        given = matrix(angle, speed) @ np.concatenate([rate, applied])
        np.testing.assert_allclose(given, 0.0, atol=1e-7)
        assert own @ applied > 0.0  # a projection


def test_through_the_elliptic_singularity_the_wheels_give_the_torque() -> None:
    angle, speed = np.radians([90.0, 0.0, -90.0, 0.0]), np.full(4, 500.0)
    torque = np.array([0.5, 0.0, 0.0])
    rate, applied = share(PYRAMID, torque, np.zeros(1), angle, speed, NONE, SCALES)
    # The matrix is by differences.
    given = matrix(angle, speed) @ np.concatenate([rate, applied])
    np.testing.assert_allclose(given, [*torque, 0.0], atol=1e-7)
    assert np.abs(rate).max() < 0.1
    assert np.abs(applied).max() > 0.1


def measured(count: int, rng: np.random.Generator) -> Measurement:
    return Measurement(
        attitude=att.normalize(rng.normal(size=(count, 4))),
        rate=0.2 * rng.normal(size=(count, 3)),
        wheel_speed=500.0 + rng.normal(size=(count, 4)),
        gimbal_angle=rng.uniform(-3.0, 3.0, (count, 4)),
        gimbal_rate=np.zeros((count, 4)),
    )


def test_alone_and_in_a_batch_the_same_bits(rng: np.random.Generator) -> None:
    law = PowerTracking(inertia=np.diag([10.0, 12.0, 14.0]), **PYRAMID._asdict())
    many = measured(8, rng)
    row = PoweredTurn(power=80.0, period=20.0).at(np.array([3.0]))
    reference = row._replace(**{k: v[0] for k, v in row._asdict().items()})
    _, command, _ = law.step(law.reset(many, reference), 3.0, many, reference)
    for i in range(8):
        one = many._map(itemgetter(i))
        _, alone, _ = law.step(law.reset(one, reference), 3.0, one, reference)
        np.testing.assert_array_equal(alone.gimbal_rate, command.gimbal_rate[i])
        np.testing.assert_array_equal(alone.wheel_torque, command.wheel_torque[i])


def test_the_energy_of_a_profile_is_the_integral_of_its_power() -> None:
    time = np.linspace(0.0, 7.0, 7001)
    row = PoweredTurn(power=80.0, period=20.0).at(time)
    power, energy = row.power[:, 0], row.energy[:, 0]
    summed = np.sum(0.5 * (power[1:] + power[:-1])) * 1e-3
    assert summed == pytest.approx(energy[-1], rel=1e-7)  # the trapezoids' h^2 w^2 / 12
    assert energy[0] == 0.0


def flown(overrides: list[str]) -> Any:
    built = assemble(*load("vscmg-power", ["checks=[]", "duration=1", *overrides]))
    blocks = list(fly(built, first_start(built, [0])))

    def rows(topic: str, field: str) -> Array:
        return np.concatenate([block.rows[topic][field][:, 0] for block in blocks])

    return rows


def test_the_motors_deliver_the_power_of_the_profile() -> None:
    rows = flown(["reference.period=2", "reference.angle=0", "law.energy_gain=0"])
    torque, speed = rows("/command", "motor_torque")[:, 1::2], rows("/truth", "wheel_speed")
    delivered = np.sum(torque * speed, axis=1)
    profile = 100.0 * np.sin(np.pi * 0.01 * np.arange(len(delivered)))
    np.testing.assert_allclose(delivered, profile, atol=1e-9)
    energy = rows("/truth", "energy")[:, 0]
    assert energy[-1] - energy[0] == pytest.approx(200.0 / np.pi, abs=0.02)  # held torques
