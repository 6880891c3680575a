"""The oracle itself: what a free gyrostat conserves, and the order of its integration."""

from typing import NamedTuple

import numpy as np
from mjspace.controllers.references.references import Hold
from oracle import Flight, fly, total_momentum

from mjspace.contract import Measurement, Reference

H = np.array([[15.0, 2.5, 2.5], [2.5, 10.0, 3.5], [2.5, 3.5, 20.0]])
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
JW = np.array([0.05, 0.06, 0.07, 0.08])


class Asked(NamedTuple):
    torque: np.ndarray


class Steady:
    """The same torque for ever."""

    def __init__(self, torque: list[float]) -> None:
        self.torque = np.array([torque])

    def reset(self, measurement: Measurement, reference: Reference) -> Asked:
        return Asked(self.torque)

    def step(
        self, state: Asked, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Asked, Asked, Asked]:
        return state, state, state


def tumble(torque: list[float], period: float, substeps: int = 1) -> Flight:
    return fly(
        Steady(torque), Hold(), H=H, wheel_axes=AXES, Jw=JW,
        q0=np.array([1.0, 0.0, 0.0, 0.0]), w0=np.array([0.5, -0.8, 0.3]),
        Omega0=np.array([100.0, -200.0, 50.0, 30.0]),
        duration=2.0, period=period, substeps=substeps,
    )  # fmt: skip


def test_motors_change_no_total_momentum() -> None:
    flight = tumble([4.0, -3.0, 2.0], 0.01)
    momentum = total_momentum(flight, H, AXES, JW)
    # RK4, rate x step = 0.02: (0.02)^5/120 a step, 200 steps, of 20 N m s.
    assert np.abs(momentum - momentum[0]).max() < 1e-7


def test_free_gyrostat_keeps_its_energy() -> None:
    flight = tumble([0.0, 0.0, 0.0], 0.01)
    w, spin = flight.rate, flight.rate @ AXES.T + flight.wheel_speed
    energy = 0.5 * np.einsum("ni,ij,nj->n", w, H, w) + 0.5 * (JW * spin**2).sum(axis=-1)
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-9
    np.testing.assert_allclose(spin, np.broadcast_to(spin[0], spin.shape), rtol=1e-12)


def test_torque_on_the_bus_is_the_torque_asked_for() -> None:
    flight = tumble([4.0, -3.0, 2.0], 1e-4)
    spin = JW * (flight.rate @ AXES.T + flight.wheel_speed)
    # hw' = -tau for the wheels' whole axial momentum, whatever the bus does.
    change = (spin[-1] - spin[0]) @ AXES / 2.0
    np.testing.assert_allclose(change, [-4.0, 3.0, -2.0], rtol=1e-9)


def test_integration_is_fourth_order() -> None:
    best = tumble([4.0, -3.0, 2.0], 0.2, 128)
    errors = [
        np.abs(tumble([4.0, -3.0, 2.0], 0.2, n).attitude - best.attitude).max() for n in (2, 4, 8)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (np.abs(orders - 4.0) < 0.3).all(), orders
