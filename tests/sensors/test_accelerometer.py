"""Accelerometers against the integral of what they feel, while the vehicle turns and falls."""

from collections.abc import Callable

import numpy as np
import pytest

from mjspace import attitude
from mjspace.contract import Array, Measurement
from mjspace.sensors.accelerometer import Accelerometer
from mjspace.sensors.base import Surroundings

FELT = np.array([1.0, -2.0, 3.0])  # m/s^2, body axes
START = attitude.from_rotation_vector(np.array([0.4, -0.2, 0.9]))
STEP, PERIOD = 0.002, 5


def truth(turned: Array, position: Array, velocity: Array) -> Measurement:
    return Measurement(attitude=turned[None], position=position[None], velocity=velocity[None])


class Strapdown:
    """Accelerometers by the name of their quantity, in some gravity, PERIOD steps a sample."""

    def __init__(self, gravity: Callable[[Array], Array]) -> None:
        self.sensor, self.surroundings = Accelerometer(), Surroundings(gravity=gravity)

    def reset(self, state: dict[str, Array], start: Measurement) -> Array:
        return self.sensor.begin(state, "specific_force", start)

    def take(self, state: dict[str, Array], end: Measurement) -> Array:
        span = PERIOD * STEP
        return self.sensor.mean(state, "specific_force", end, span, self.surroundings)


def turning(time: float, rate: Array, sign: float = 1.0) -> Array:
    return sign * attitude.multiply(START, attitude.from_rotation_vector(rate * time))


def velocity_at(time: float, rate: Array, gravity: Array) -> Array:
    """Integrate what is felt, turned into inertial axes, by Gauss on short intervals."""
    points, weights = np.polynomial.legendre.leggauss(8)
    instants = 0.5 * time * (points + 1.0)
    felt = [attitude.rotate(turning(t, rate), FELT) for t in instants]
    return np.asarray(0.5 * time * weights @ np.array(felt) + gravity * time)


@pytest.mark.parametrize("axis", [[2.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.5, 1.0, -2.0]])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_specific_force_while_turning(axis: list[float], sign: float) -> None:
    rate, gravity = np.array(axis), np.array([0.0, 0.3, -9.0])
    span = PERIOD * STEP
    strapdown = Strapdown(lambda place: np.broadcast_to(gravity, place.shape))
    state: dict[str, Array] = {}
    nowhere = np.zeros(3)
    first = strapdown.reset(state, truth(START, nowhere, velocity_at(0.0, rate, gravity)))
    assert first.tolist() == [[0.0, 0.0, 0.0]]
    before = velocity_at(0.0, rate, gravity)
    for k in (1, 2):
        time = k * span
        velocity = velocity_at(time, rate, gravity)
        # a quaternion of either sign is the same attitude, from one sample to the next too
        turned = turning(time, rate, sign if k == 2 else 1.0)
        felt = strapdown.take(state, truth(turned, nowhere, velocity))[0]
        # Turning within the interval about its middle leaves (rate span)^2 / 24, 5e-5 of it; in the
        # axes of its end it would be rate span / 2, 1.5e-2.
        assert np.abs(felt - FELT).max() < 1e-4 * np.linalg.norm(FELT)
        mean = (velocity - before) / span - gravity
        middle = turning((k - 0.5) * span, rate)
        exact = attitude.rotate(attitude.conjugate(middle), mean)
        np.testing.assert_allclose(felt, exact, atol=1e-12)
        before = velocity
        np.testing.assert_array_equal(state["strapdown_velocity"], [velocity])
        np.testing.assert_array_equal(state["strapdown_attitude"], [turned])


def test_gravity_is_that_of_the_place_halfway() -> None:
    strapdown = Strapdown(lambda place: 2.0 * place)
    span = PERIOD * STEP
    state: dict[str, Array] = {}
    level = attitude.from_rotation_vector(np.zeros(3))
    speed, faster = np.array([10.0, 20.0, -30.0]), np.array([14.0, 20.0, -30.0])
    strapdown.reset(state, truth(level, np.zeros(3), speed))
    end = 0.5 * span * (speed + faster)
    felt = strapdown.take(state, truth(level, end, faster))[0]
    np.testing.assert_allclose(felt, [4.0 / span, 0.0, 0.0] - 2.0 * 0.5 * end, rtol=1e-12)


def test_the_sample_of_the_start_is_none_and_shares_no_memory() -> None:
    strapdown = Strapdown(np.ones_like)
    state: dict[str, Array] = {}
    level = attitude.from_rotation_vector(np.zeros(3))
    start = truth(level, np.zeros(3), np.ones(3))
    assert strapdown.reset(state, start).tolist() == [[0.0, 0.0, 0.0]]
    assert not np.shares_memory(state["strapdown_velocity"], start.velocity)
    assert not np.shares_memory(state["strapdown_attitude"], start.attitude)
    # at rest in gravity of 1 m/s^2 along each axis
    felt = strapdown.take(state, start)
    np.testing.assert_allclose(felt, [[-1.0, -1.0, -1.0]], rtol=1e-12)


def test_a_batch_feels_what_each_feels_alone() -> None:
    rng = np.random.default_rng(3)
    turned = [attitude.normalize(START + 0.05 * rng.normal(size=(3, 4))) for _ in range(2)]
    turned[1][1] *= -1.0  # the same attitude
    moved = [rng.normal(size=(3, 3)) for _ in range(2)]

    def many(k: int, rows: slice) -> Measurement:
        return Measurement(
            attitude=turned[k][rows], position=moved[k][rows], velocity=2.0 * moved[k][rows]
        )

    strapdown = Strapdown(lambda place: -place)

    def felt(rows: slice) -> Array:
        state: dict[str, Array] = {}
        strapdown.reset(state, many(0, rows))
        return strapdown.take(state, many(1, rows))

    alone = np.concatenate([felt(slice(i, i + 1)) for i in range(3)])
    np.testing.assert_array_equal(felt(slice(0, 3)), alone)
