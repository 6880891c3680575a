"""Minimum-time slews: against Bilimoria and Wie, within their limits, and flown as planned."""

import sys
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.attitude.minimum_time import Slew, eigenaxis_time, minimum_time_slew
from mjspace.controllers.attitude.planned_slew import PlannedSlew
from mjspace.controllers.references.planned import Planned

from mjspace import attitude as att
from mjspace.contract import Array, Measurement

HALF_TURN = np.array([0.0, 0.0, 0.0, 1.0])
INERTIA = np.diag([15.0, 12.0, 18.0])
LIMIT = np.array([0.36, 0.45, 0.36])
PERIOD = 0.02
# Of the fastest half turn about z, in units of sqrt(I/M), by minimum_time_slew.
HALF = Slew(
    np.array([0.0, 0.4454389947, 1.1761026439, 1.6215416386,
              2.0669806333, 2.7976442825, 3.2430832772]),
    np.array([[1.0, 1, 1], [-1, 1, 1], [-1, -1, 1], [-1, -1, -1], [1, -1, -1], [1, 1, -1]]),
)  # fmt: skip


def reached(slew: Slew, inertia: Array) -> tuple[Array, Array]:
    """Return attitude and rate at the slew's end, by the reference's integration."""
    planned = Planned(inertia, PERIOD, slew.time, slew.torque)
    motion, _ = planned._arcs[-1]
    end = motion(slew.time[-1])
    return end[:4], end[4:]


def test_the_half_turn_is_as_fast_as_in_the_paper() -> None:
    slew = minimum_time_slew(np.eye(3), np.ones(3), HALF_TURN, starts=1)
    # Bilimoria and Wie print 3.2430 and 3.5449; five switches.
    assert slew.time[-1] == pytest.approx(3.2430, abs=1.5e-4)
    assert eigenaxis_time(np.eye(3), np.ones(3), HALF_TURN) == pytest.approx(3.5449, abs=5e-5)
    assert np.sum(np.any(np.diff(slew.torque, axis=0) != 0.0, axis=1)) == 5
    assert (np.abs(slew.torque) == 1.0).all()
    attitude, rate = reached(slew, np.eye(3))
    assert att.rotation_angle(attitude, HALF_TURN) < 1e-8
    assert np.abs(rate).max() < 1e-8


@pytest.mark.long
def test_an_asymmetric_body_arrives_within_its_limits() -> None:
    target = att.from_rotation_vector(np.radians(120.0) * att.normalize(np.array([1.0, -2.0, 1.5])))
    slew = minimum_time_slew(INERTIA, LIMIT, target)
    attitude, rate = reached(slew, INERTIA)
    assert att.rotation_angle(attitude, target) < 1e-8
    assert np.abs(rate).max() < 1e-8
    assert np.allclose(np.abs(slew.torque), LIMIT, rtol=1e-12)
    assert slew.time[-1] == pytest.approx(13.8991, abs=1e-3)
    assert slew.time[-1] < 0.85 * eigenaxis_time(INERTIA, LIMIT, target)
    # -q is the same attitude: the shorter way to it.
    other = minimum_time_slew(INERTIA, LIMIT, -target, starts=3)
    assert other.time[-1] < eigenaxis_time(INERTIA, LIMIT, target)


def test_the_eigenaxis_turn_is_within_the_limits_and_at_one_of_them() -> None:
    vector = np.radians(120.0) * att.normalize(np.array([1.0, -2.0, 1.5]))
    duration = eigenaxis_time(INERTIA, LIMIT, att.from_rotation_vector(vector))
    spin = 4.0 * vector / duration**2
    rate = 2.0 * vector / duration  # at half time
    used = [sign * INERTIA @ spin + np.cross(rate, INERTIA @ rate) for sign in (1.0, -1.0)]
    assert np.max(np.abs(used) / LIMIT) == pytest.approx(1.0, rel=1e-9)


def test_the_reference_is_a_motion_and_its_torque_has_the_planned_impulse() -> None:
    planned = Planned(INERTIA, PERIOD, 15.0 * HALF.time, 0.1 * HALF.torque)
    time, h = np.array([2.0, 9.0, 20.0, 30.0, 45.0]), 1e-4
    before, now, after = (planned.at(time + dt) for dt in (-h, 0.0, h))
    turned = att.to_rotation_vector(att.multiply(att.conjugate(before.attitude), after.attitude))
    assert np.allclose(turned / (2.0 * h), now.rate, atol=1e-9)
    assert np.allclose((after.rate - before.rate) / (2.0 * h), now.acceleration, atol=1e-8)
    every = PERIOD * np.arange(3000)
    found = planned.at(every)
    torque = found.acceleration @ INERTIA + np.cross(found.rate, found.rate @ INERTIA)
    impulse = np.diff(15.0 * HALF.time) @ (0.1 * HALF.torque)
    inside = every + PERIOD < 15.0 * HALF.time[-1]
    assert np.allclose(PERIOD * torque[inside].sum(axis=0), impulse, atol=0.1 * PERIOD)
    assert np.abs(torque[inside]).max() < 0.1 + 1e-12
    assert not found.rate[~inside][1:].any()


def test_the_law_adds_feedback_within_the_limits() -> None:
    law = PlannedSlew(INERTIA, LIMIT, attitude_gain=2.0, rate_gain=5.0)
    planned = Planned(INERTIA, PERIOD, 15.0 * HALF.time, 0.1 * HALF.torque)
    now: Any = type(planned.at(np.zeros(1)))(*(part[0] for part in planned.at(np.array([3.0]))))
    off = np.array([0.01, -0.02, 0.3])
    seen = Measurement(
        attitude=att.multiply(now.attitude, att.from_rotation_vector(off)), rate=now.rate
    )
    _, command, signals = law.step(law.reset(seen, now), 3.0, seen, now)
    assert signals.angle == pytest.approx(off)
    assert signals.feedback[0] == pytest.approx(-0.02 - 5.0 * signals.angle_rate[0])
    assert command.torque[:2] == pytest.approx(0.1 + signals.feedback[:2])
    assert command.torque[2] == -LIMIT[2]


def test_unfit_tables_and_a_missing_solver_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="time: got 7 rows, should be 6, one more than of torque"):
        Planned(INERTIA, PERIOD, HALF.time, HALF.torque[1:])
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'mjspace\[planning\]'"):
        minimum_time_slew(INERTIA, LIMIT, HALF_TURN)
