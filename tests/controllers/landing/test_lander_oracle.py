"""The lander's own integration against Newton and Euler in vectors, in the other axes."""

import numpy as np
import pytest
from lander_oracle import MOON_RADIUS, MU, Vehicle, slope_of
from mjspace.controllers.landing.descent import SineDescent
from mjspace.controllers.landing.guidance import BezierDescent
from mjspace.controllers.landing.lander_vectoring import ThrustVectoring

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Trajectory

J = np.diag([90.0, 80.0, 100.0])  # our axes


def state(rng: np.random.Generator) -> Array:
    """Return a state of the oracle: tilted, spinning, off to one side."""
    q = att.from_rotation_vector(rng.uniform(-0.5, 0.5, 3))
    place, speed = rng.uniform(-1e5, 1e5, 3), rng.uniform(-30.0, 30.0, 3)
    engine = [160.0, *rng.uniform(-0.3, 0.3, 2), 0.0]
    return np.array([*place, *speed, *q, *rng.uniform(-0.5, 0.5, 3), *engine])


def ours(y: Array) -> tuple[Array, Array, Array, Array]:
    """Return attitude, rate, position and velocity of a state in our axes."""
    return y[[6, 8, 9, 7]], y[[11, 12, 10]], y[[1, 2, 0]], y[[4, 5, 3]]


@pytest.mark.parametrize("seed", range(4))
def test_slopes(seed: int) -> None:
    y = state(np.random.default_rng(seed))
    q, w, p, v = ours(y)
    dq, dw, dp, dv = ours(slope_of(y))
    b1, b2 = y[14:16]
    nozzle = att.multiply(
        att.from_rotation_vector(np.array([0.0, b2, 0.0])),
        att.from_rotation_vector(np.array([-b1, 0.0, 0.0])),
    )
    thrust = att.rotate(nozzle, np.array([0.0, 0.0, y[13]]))
    away = p + np.array([0.0, 0.0, MOON_RADIUS])
    distance = np.linalg.norm(away)
    down = att.rotate(att.conjugate(q), away / distance)
    gradient = 3.0 * MU / distance**3 * np.cross(down, J @ down)
    torque = np.cross([0.0, 0.0, -1.0], thrust) + gradient - np.cross(w, J @ w)
    np.testing.assert_allclose(dp, v)
    np.testing.assert_allclose(dv, att.rotate(q, thrust) / 100.0 - MU * away / distance**3)
    np.testing.assert_allclose(J @ dw, torque, atol=1e-10)
    np.testing.assert_allclose(dq, 0.5 * att.multiply(q, np.array([0.0, *w])), atol=1e-15)
    without = ours(slope_of(y, Vehicle(gradient=0.0)))[1]
    np.testing.assert_allclose(J @ (dw - without), gradient, atol=1e-12)


def test_vectoring_gets_the_angular_acceleration_that_it_asks_for() -> None:
    """On a spinning vehicle, so that the gyroscopic torque of 0.6 N m counts."""
    law, wanted = ThrustVectoring(control_period=0.02), BezierDescent().at(np.array([30.0]))
    now = Trajectory(*(part[0] for part in wanted))
    tilt = att.from_rotation_vector(np.array([0.05, -0.02, 0.3]))
    q, w = att.multiply(now.attitude, tilt), np.array([0.05, -0.04, 0.8])
    seen = Measurement(
        attitude=q, rate=w, wheel_speed=np.zeros(0), position=now.position, velocity=now.velocity
    )
    _, command, signals = law.step(law.reset(seen, now), 30.0, seen, now)
    paper = [2, 0, 1]  # our z, x, y
    place = [*now.position[paper], *now.velocity[paper], q[0], *q[1:][paper], *w[paper]]
    engine = [command.thrust[0], command.gimbal[1], command.gimbal[0], 0.0]
    found = ours(slope_of(np.array([*place, *engine]), Vehicle(gradient=0.0)))[1]
    assert np.abs(command.gimbal).max() < law.gimbal_limit  # else it does not get it
    to_body = att.conjugate(tilt)
    feedback = law.rate_gain * (
        att.rotate(to_body, now.rate) + law.pointing_gain * np.array([*signals.pointing_error, 0.0])
        - w
    )  # fmt: skip
    asked = att.rotate(to_body, now.acceleration) + feedback
    np.testing.assert_allclose(found[:2], asked[:2], atol=1e-12)


@pytest.mark.parametrize("error", [-200.0, 200.0])
def test_vectoring_asks_for_no_more_than_its_limit(error: float) -> None:
    law, wanted = (
        ThrustVectoring(control_period=0.02),
        SineDescent(azimuth=0.0).at(np.array([200.0])),
    )
    now = Trajectory(*(part[0] for part in wanted))
    upright, still = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)
    place = now.position + np.array([0.0, 0.0, error])
    seen = Measurement(
        attitude=upright, rate=still, wheel_speed=np.zeros(0), position=place, velocity=still
    )
    _, _, signals = law.step(law.reset(seen, now), 200.0, seen, now)
    needed = 100.0 * (MU / (MOON_RADIUS + place[2]) ** 2 + now.linear_acceleration[2])
    assert signals.desired_thrust[0] - needed == pytest.approx(-30.0 * np.sign(error), abs=1e-6)
