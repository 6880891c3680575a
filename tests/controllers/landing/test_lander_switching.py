"""The switching term of the landing law, and the gain that (35) asks for."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.landing.descent import SineDescent
from mjspace.controllers.landing.lander import VariableStructure
from mjspace.controllers.landing.lander_switching import State, Switching

from mjspace import attitude as att
from mjspace.contract import Array, Measurement

TURNED = att.from_euler_zyx(np.array([0.02, -0.01, 0.6435]))
NOW: Any = SineDescent().at(np.array([50.0]))
DESIRED: Any = type(NOW)(*(part[0] for part in NOW))


def seen(rate: Array) -> Measurement:
    return Measurement(
        attitude=TURNED,
        rate=rate,
        position=DESIRED.position + np.array([3.0, -2.0, 1.0]),
        velocity=DESIRED.velocity,
        propellant=np.zeros(0),
        contact=np.zeros(0),
    )


RATE = np.array([0.01, -0.02, 0.0])


def test_with_tanh_it_is_the_law_of_the_paper() -> None:
    law, own = VariableStructure(robust_gain=0.3), Switching(robust_gain=0.3, switching="tanh")
    _, command, signals = law.step(law.reset(seen(RATE), DESIRED), 50.0, seen(RATE), DESIRED)
    _, same, more = own.step(own.reset(seen(RATE), DESIRED), 50.0, seen(RATE), DESIRED)
    assert np.array_equal(command.thrust, same.thrust)
    assert np.array_equal(command.gimbal, same.gimbal)
    assert np.array_equal(signals.S, more.S)
    assert not more.required_gain.any()


def test_sgn_adds_rho_in_the_sense_of_s() -> None:
    plain, own = Switching(robust_gain=0.0), Switching(robust_gain=0.05)
    before, after = (
        law.step(law.reset(seen(RATE), DESIRED), 50.0, seen(RATE), DESIRED)[2]
        for law in (plain, own)
    )
    # desired_gimbal is (b2, b1), and b2 is the third control.
    assert after.desired_gimbal - before.desired_gimbal == pytest.approx(
        -0.05 * np.sign(before.S[[2, 1]])
    )


@pytest.mark.parametrize("torque", [np.zeros(2), np.array([5.0, -3.0])])
def test_the_required_gain_is_the_control_that_holds_s(torque: Array) -> None:
    # S depends on the rate by Ka share w alone, and the rate changes by the gimbals and a torque.
    law = Switching(robust_gain=0.05, switching="tanh", loop_share=np.array([1.0, 0.35, 1.0]))
    U, thrust, period = np.array([0.1, 0.02, -0.03]), 160.0, law.control_period
    first = law.step(law.reset(seen(RATE), DESIRED), 50.0, seen(RATE), DESIRED)[2]
    turns = (thrust * U[1:] * [1.0, -1.0] + torque) / [90.0, 80.0]
    later = RATE + period * np.append(turns, 0.0)
    state = State(np.zeros(1), first.S, U, np.array([thrust]))
    signals = law.step(state, 50.02, seen(later), DESIRED)[2]
    # U less what the torque of U did leaves the torque from outside, over the thrust's lever.
    assert signals.required_gain[1:] == pytest.approx(np.abs(torque) / thrust, abs=1e-9)
    assert signals.required_gain[0] == pytest.approx(0.1)


def test_another_switching_is_refused() -> None:
    with pytest.raises(ValueError, match="switching: got 'sat', should be one of sgn, tanh"):
        Switching(switching="sat")
