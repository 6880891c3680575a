"""Linear-quadratic attitude control with reaction wheels, infinite and finite horizon.

R. Vazquez, "Tema 8: Control activo de la actitud", Universidad de Sevilla 2016 (paper 004). The
state is x = [delta, a]: the measured less the desired rate, and a = 2 dq_v / dq_0 of the error
quaternion dq = conj(q_ref) q. a is equal for q and -q and undefined at an error of 180 deg. The
torque u acts on a bus of inertia I, without the wheels' axial inertia: I w' + w x I w = u. The
wheels' absolute momentum h = sum a Jw (a.w + Omega) follows h' = -u + h x w, and -h' is the torque
of the wheels on the bus. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.linalg import solve_continuous_are

from mjspace.algebra import cross, cross_matrix, times
from mjspace.attitude import conjugate, multiply
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from ..references.references import Regulation
from . import riccati
from .gain_table import GainTable
from .wheel_momentum import wheel_momentum

_TABLE_STEP = 0.1  # [s] between tabulated gains; 2e-9 of the largest, interpolated
_MOST_STEPS = 6_000  # of a table, 2 s to compute; longer ones in a turn that takes more than 10 min


class State(NamedTuple):
    """Memory of these laws: empty."""


class Signals(NamedTuple):
    """Signals of these laws."""

    a: Array
    """Attitude error 2 dq_v / dq_0 [rad], (..., 3)."""
    delta: Array
    """Measured less desired rate, component by component [rad/s], (..., 3)."""
    u: Array
    """Commanded torque on the bus without h x w [N m], body axes, (..., 3)."""
    h: Array
    """Absolute momentum of the wheels [N m s], body axes, (..., 3)."""


class Weights(NamedTuple):
    """Weights of the cost: the integral of x^T Q x + u^T R u, without a factor of 1/2."""

    Q: Array
    """(6, 6); positive semidefinite, positive definite in the angles (erratum 2)."""
    R: Array
    """(3, 3); positive definite (erratum 2)."""


def axis_gains(
    inertia: Array, rate_weight: Array, angle_weight: Array, torque_weight: Array
) -> tuple[Array, Array]:
    """Return (kw [N m s/rad], ka [N m/rad]) of u = -kw w - ka a on one principal axis, (...).

    Closed form of the Riccati equation for ``inertia`` a'' = u [kg m^2], with the weights of
    ``Regulator``. A constant torque M leaves an angle of M / ka.
    """
    ka = np.sqrt(angle_weight / torque_weight)
    kw = np.sqrt((rate_weight + 2.0 * inertia * torque_weight * ka) / torque_weight)
    return kw, ka


def steady_cost(inertia: Array, weights: Weights) -> Array:
    """Return P (6, 6) of the algebraic Riccati equation: the cost from a state x on is x^T P x."""
    A, B = linearized(inertia, np.zeros(3))
    cost: Array = solve_continuous_are(A, B, *weights)
    return cost


def linearized(inertia: Array, rate: Array) -> tuple[Array, Array]:
    """Return A (..., 6, 6) and B (6, 3) of x' = A x + B du about a motion.

    The motion has the ``rate`` (..., 3) [rad/s].
    """
    solve = np.linalg.inv(inertia)
    A, B = np.zeros((*rate.shape[:-1], 6, 6)), np.zeros((6, 3))
    A[..., :3, :3] = solve @ (cross_matrix(rate @ inertia) - cross_matrix(rate) @ inertia)
    A[..., 3:, :3] = np.eye(3)
    A[..., 3:, 3:] = -cross_matrix(rate)
    B[:3] = solve
    return A, B


def feedback(inertia: Array, weights: Weights, cost: Array) -> Array:
    """Return K = -R^-1 B^T P (..., 3, 6) of u = K x, from the ``cost`` P (..., 6, 6)."""
    _, B = linearized(inertia, np.zeros(3))
    K: Array = -np.linalg.solve(weights.R, B.T) @ cost
    return K


def cost_to_go(
    inertia: Array, weights: Weights, motion: Regulation, final: Array, time: Array
) -> Array:
    """Return P (n, 6, 6) at each ``time`` (n,) [s] by the Riccati differential equation.

    The times increase; P is ``final`` (6, 6) at the last, and is integrated backwards from there,
    in one step from each time to the one before.
    """
    (Q, R), (_, B) = weights, linearized(inertia, np.zeros(3))
    S = B @ np.linalg.solve(R, B.T)
    early, late = (linearized(inertia, motion.at(node).rate)[0] for node in riccati.nodes(time))
    return riccati.backwards(early, late, S, Q, final, time)


@dataclass(frozen=True)
class Regulator(Gains):
    """Infinite horizon: u = u_ref + K x with constant K, from the algebraic Riccati equation.

    Meant for a reference at rest, for which u_ref = I w_ref' + w_ref x I w_ref is zero.
    """

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """I: of the vehicle less its wheels' axial inertia, about its centre of mass, body axes."""
    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    rate_weight: Array = gain("s^2", (3,), default=(10.0, 10.0, 10.0), at_least=0.0)
    """Of each squared rate in the cost."""
    angle_weight: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), above=0.0)
    """Of each squared component of a."""
    torque_weight: Array = gain("1/(N^2 m^2)", (3,), default=(1.0, 1.0, 1.0), above=0.0)
    """Of each squared torque."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the torque on the bus, -h', and the signals."""
        M, w_ref = self.inertia, reference.rate
        error = multiply(conjugate(reference.attitude), measurement.attitude)
        a = 2.0 * error[..., 1:] / error[..., :1]
        delta = measurement.rate - w_ref
        u_ref = times(M, reference.acceleration) + cross(w_ref, times(M, w_ref))
        u = u_ref + times(self.gain_at(time), np.concatenate([delta, a], axis=-1))
        h = wheel_momentum(self, measurement)
        torque = u - cross(h, self._turning(measurement.rate, delta))  # -h' = u - h x w
        return state, TorqueCommand(torque), Signals(a, delta, u, h)

    def gain_at(self, time: float) -> Array:
        """Return K (3, 6) of u = u_ref + K [delta, a] at ``time`` [s]."""
        return self._steady

    @property
    def weights(self) -> Weights:
        """Q and R."""
        state = np.concatenate([self.rate_weight, self.angle_weight])
        return Weights(np.diag(state), np.diag(self.torque_weight))

    @staticmethod
    def _turning(rate: Array, delta: Array) -> Array:
        """Return the rate at which the wheels' momentum is turned."""
        return rate

    @cached_property
    def _steady(self) -> Array:
        return feedback(self.inertia, self.weights, steady_cost(self.inertia, self.weights))


@dataclass(frozen=True)
class Tracker(Regulator):
    """Finite horizon, for one rest-to-rest turn: u = u_ref + K(t) x with h' = -u + h x w.

    The Riccati differential equation is integrated once, backwards from the end of the turn, and
    the gains are tabulated. The final P is that of the regulator, whose gain applies afterwards.
    ``angle``, ``duration`` and ``axis`` must equal those of the scenario's
    ``references:Regulation``. The lecture prints h' = -u + h x delta (erratum 1), which leaves the
    torque h x w_ref to the feedback.
    """

    angle: float = gain("rad", default=0.5 * np.pi)
    """Of the whole turn."""
    duration: float = gain("s", default=60.0, above=0.0)
    """From rest to rest: the horizon."""
    axis: Array = gain(shape=(3,), default=(1.0, -2.0, 1.5), form="direction")
    """Of the turn; normalized."""

    def gain_at(self, time: float) -> Array:
        """Return K (3, 6) at ``time`` [s]; after the turn it is the regulator's."""
        return self._table.at(time)

    @cached_property
    def _table(self) -> GainTable:
        motion = Regulation(self.angle, self.duration, self.axis)
        final = steady_cost(self.inertia, self.weights)
        steps = int(np.ceil(min(self.duration / _TABLE_STEP, _MOST_STEPS)))
        time = np.linspace(0.0, self.duration, 1 + steps)
        P = cost_to_go(self.inertia, self.weights, motion, final, time)
        return GainTable(time, feedback(self.inertia, self.weights, P))


@dataclass(frozen=True)
class PrintedTracker(Tracker):
    """``Tracker`` with h' = -u + h x delta as printed (erratum 1): errors of 10 deg or more."""

    @staticmethod
    def _turning(rate: Array, delta: Array) -> Array:
        return delta
