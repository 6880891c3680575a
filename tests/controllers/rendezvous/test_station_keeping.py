"""Station keeping: the force of a place, of an error, and the velocity that is commanded."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.references.relative_orbit import RelativeOrbit
from mjspace.controllers.rendezvous.station_keeping import Signals, State, StationKeeping

from mjspace.contract import Array, Measurement

RATE = 1.1219973762820691e-3
PLACES = np.array([
    [-0.4, -0.4, 0], [-0.4, 0.4, 0], [0.4, -0.4, 0], [0.4, 0.4, 0],
    [0, -0.4, -0.5], [0, -0.4, 0.5], [0, 0.4, -0.5], [0, 0.4, 0.5],
    [-0.4, 0, -0.5], [0.4, 0, -0.5], [-0.4, 0, 0.5], [0.4, 0, 0.5],
])  # fmt: skip
WAYS = np.repeat([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], 2, axis=0)
LAW = StationKeeping(
    inertia=np.diag([15.0, 12.0, 18.0]),
    thruster_positions=PLACES,
    thruster_directions=WAYS.astype(float),
    thruster_force=np.ones(12),
    control_period=1.0,
    attitude_gain=0.5,
    rate_gain=4.0,
    mass=100.0,
)


def stepped(
    center: Array, off: Array, slip: Array, time: float = 700.0
) -> tuple[State, Any, Signals]:
    rows = RelativeOrbit(RATE, center).at(np.array([time]))
    desired: Any = type(rows)(*(part[0] for part in rows))
    seen = Measurement(
        attitude=desired.attitude,
        rate=desired.rate,
        position=desired.position + off,
        velocity=desired.velocity + slip,
    )
    return LAW.step(LAW.reset(seen, desired), time, seen, desired)


def test_a_place_above_is_held_by_a_push_down_and_no_other() -> None:
    after, command, signals = stepped(np.array([100.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
    down = 100.0 * 3.0 * RATE**2 * 100.0
    assert signals.force == pytest.approx([-down, 0.0, 0.0], abs=1e-12)
    assert WAYS.T @ command.on_time == pytest.approx([-down, 0.0, 0.0], abs=1e-12)
    assert np.cross(PLACES, WAYS).T @ command.on_time == pytest.approx(np.zeros(3), abs=1e-6)
    assert after.delta_v == pytest.approx([down / 100.0])


def test_an_error_is_pushed_back_and_a_slip_braked() -> None:
    # A quarter of an orbit on, Hill's axes are turned by n t about z.
    turned = RATE * 700.0
    off = np.array([np.cos(turned), np.sin(turned), 0.0])
    _, _, signals = stepped(np.zeros(3), off, np.zeros(3))
    assert signals.position_error == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    # A metre up, the tide pulls by 2 n^2 up.
    assert signals.force == pytest.approx([-100.0 * (0.02**2 + 2.0 * RATE**2), 0, 0], abs=1e-12)
    _, _, braked = stepped(np.zeros(3), np.zeros(3), 0.01 * off)
    assert braked.force == pytest.approx([-100.0 * 2 * 0.8 * 0.02 * 0.01, 0.0, 0.0], abs=1e-9)
