"""Attitude and momentum control of a space station: double-gimbal CMGs and the gravity gradient.

A station that holds an attitude in which the torques of gravity gradient, turning and air do not
cancel fills its CMGs. One whose law feeds back their momentum too settles where they cancel on
average, at the torque-equilibrium attitude, and the momentum stays bounded: B. Wie, K. W. Byun,
V. W. Warren and others, New approach to attitude/momentum control for the Space Station, J.
Guidance, Control, and Dynamics 12(5), 1989. With the small turn p from the reference, which is
fixed in the axes of a circular orbit, the torque u that goes into the CMGs, and at the reference,
in body axes, the nadir c and the orbit's rate o:

    J (p'' + o x p') = 3 n^2 ((c x p) x J c + c x J (c x p)) - d x J o - o x J d - u
    d = p' + o x p,  h' = u - o x h

To p, p', h and the integral of h come filters z'' + f^2 z = y, f the orbit's rate n and twice that,
which the air's torque has: y is then not driven at f. y is the momentum about roll, the attitude
about yaw, and either about pitch. Roll itself cannot be kept from swinging at n: a torque across
the orbit's normal that turns with the station is constant in inertial axes, and only the gravity
gradient on a roll balances it, for it has no torque about the vertical.

There pitch is designed apart from roll and yaw. Here one Riccati equation has all three, with the
products of inertia, in units of 1/n, of J0 = trace(J)/3 and of their products; all poles are left
of -``stability`` n (B. D. O. Anderson and J. B. Moore, Optimal Control, 1990, section 3.5). All
arrays may have leading vehicle axes.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, ClassVar, Literal, NamedTuple, get_args

import numpy as np
from scipy.linalg import solve_continuous_are

from mjspace.algebra import cross, cross_matrix, times
from mjspace.attitude import conjugate, normalize, rotate
from mjspace.contract import Array, Gains, GimbalRateCommand, Measurement, Reference, Unit, gain

from ..attitude.tracking_error import tracking_error
from . import double_gimbal_steering as steering

Rejected = Literal["attitude", "momentum"]
FILTERS = (1.0, 2.0)
"""f, in units of n."""


class State(NamedTuple):
    """Memory of these laws, without units: see the module."""

    integral: Array
    """Of the momentum, in J0, (..., 3)."""
    filters: Array
    """z and z' of roll, pitch, yaw at each f, (..., 12)."""


class NoState(NamedTuple):
    """Memory of ``AttitudeHold``: empty."""


class Signals(NamedTuple):
    """Signals of these laws."""

    angle: Annotated[Array, Unit("rad")]
    """p: from the reference to the body, body axes [rad], (..., 3)."""
    momentum: Annotated[Array, Unit("N m s")]
    """h: of the wheels, relative to the bus, body axes [N m s], (..., 3)."""
    torque: Annotated[Array, Unit("N m")]
    """u: that goes into the CMGs, body axes [N m], (..., 3)."""
    measure: Array
    """Of the outer gimbals: 1 where they are spread, 0 where all are in line, (..., 1)."""


def station_plant(inertia: Array, attitude: Array) -> tuple[Array, Array]:
    """Return A (12, 12) and B (12, 3) of [p, p', h, integral of h] in the units of the module.

    ``inertia`` [kg m^2], body axes; ``attitude`` is the quaternion from body axes to those of the
    orbit (x ahead, z to the nadir), at rest there.
    """
    J = inertia / (np.trace(inertia) / 3.0)
    back = conjugate(normalize(attitude))
    c, o = rotate(back, np.array([0.0, 0.0, 1.0])), rotate(back, np.array([0.0, -1.0, 0.0]))
    across, orbit = cross_matrix(c), cross_matrix(o)
    tilt = 3.0 * (across @ J - cross_matrix(J @ c)) @ across
    turn = cross_matrix(J @ o) - orbit @ J
    A, B = np.zeros((12, 12)), np.zeros((12, 3))
    A[:3, 3:6] = np.eye(3)
    A[3:6, :3] = np.linalg.solve(J, tilt + turn @ orbit)
    A[3:6, 3:6] = np.linalg.solve(J, turn) - orbit
    A[6:9, 6:9] = -orbit
    A[9:, 6:9] = np.eye(3)
    B[3:6], B[6:9] = -np.linalg.inv(J), np.eye(3)
    return A, B


def with_filters(A: Array, B: Array, rejected: tuple[Rejected, ...]) -> tuple[Array, Array]:
    """Return A and B with the filters of roll, pitch and yaw of what is ``rejected`` about each."""
    plant, size = len(A), len(A) + 6 * len(FILTERS)
    filtered, inputs = np.zeros((size, size)), np.zeros((size, 3))
    filtered[:plant, :plant], inputs[:plant] = A, B
    row = plant
    for frequency in FILTERS:
        for axis, what in enumerate(rejected):
            filtered[row, row + 1] = 1.0
            filtered[row + 1, row] = -(frequency**2)
            filtered[row + 1, axis + (0 if what == "attitude" else 6)] = 1.0
            row += 2
    return filtered, inputs


def regulator(A: Array, B: Array, weights: Array, stability: float) -> Array:
    """Return K of u = -K x with the poles left of -``stability``, for the ``weights`` of x^2.

    Raises:
        ValueError: there is none.
    """
    try:
        P = solve_continuous_are(A + stability * np.eye(len(A)), B, np.diag(weights), np.eye(3))
    except (np.linalg.LinAlgError, ValueError):
        raise ValueError("stability and weights: no gains hold the attitude with these") from None
    K: Array = B.T @ P
    return K


@dataclass(frozen=True)
class _StationGains(Gains):
    """What these laws share: the station, its CMGs and their steering."""

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """J: of the whole vehicle, body axes."""
    gimbal_axes: Array = gain(shape=("gimbal", 3), form="unit vector")
    """Unit vectors at angles of zero, body axes, the outer before the inner of each CMG, (2 n, 3).
    All outer ones are parallel."""
    spin_axes: Array = gain(shape=("cmg", 3), form="unit vector")
    """Of the wheels likewise, (n, 3)."""
    wheel_inertia: Array = gain("kg m^2", ("cmg",), above=0.0)
    """Axial inertia of each wheel, (n,)."""
    control_period: float = gain("s", above=0.0)
    """Time from one step to the next; the scenario's when left out."""
    orbit_rate: float = gain("rad/s", above=0.0)
    """n: of a circular orbit."""
    offset: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """The attitude about which the law is linear: from body axes to the orbit's, as the reference's
    ``offset`` of ``pointing:Nadir``; normalized."""
    attitude_weight: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), at_least=0.0)
    """Of the squares of p in the cost; that of u / (n^2 J0) is 1."""
    stability: float = gain(default=0.2, at_least=0.0)
    """The slowest pole decays at more than this times n."""
    gimbal_rate_limit: float = gain("rad/s", default=np.inf, above=0.0, at_most=np.inf)
    """Largest commanded rate; all rates are scaled together, so that the torque keeps its
    direction."""
    equalizing_gain: float = gain("1/s", default=0.01, at_least=0.0)
    """Rate at which the inner gimbals become equal."""
    null_gain: float = gain("1/s", default=0.01, at_least=0.0)
    """Of the null motion that spreads the outer gimbals."""
    measure_wanted: float = gain(default=0.1, above=0.0)
    """m0: below this measure the steering bounds the rates, and the torque is not exact."""
    damping: float = gain(default=0.01, above=0.0)
    """lambda0: of the steering, where the outer gimbals are in line."""

    def __post_init__(self) -> None:
        """Check that the CMGs are parallel and that there are such gains."""
        super().__post_init__()
        _ = self.cluster, self._gains

    @cached_property
    def cluster(self) -> steering.ParallelCluster:
        """The CMGs."""
        return steering.ParallelCluster(self.gimbal_axes, self.spin_axes, self.wheel_inertia)

    @cached_property
    def _gains(self) -> Array:
        raise NotImplementedError

    @property
    def _mean_inertia(self) -> float:
        """J0 [kg m^2]."""
        return float(np.trace(self.inertia)) / 3.0

    def _seen(self, measurement: Measurement, reference: Reference) -> tuple[Array, Array, Array]:
        """Return p [rad], p'/n and h [N m s], each (..., 3)."""
        error = tracking_error(measurement.attitude, measurement.rate, reference)
        h = steering.momentum(self.cluster, measurement.gimbal_angle, measurement.wheel_speed)
        return 2.0 * error.quaternion[..., 1:], error.w_e / self.orbit_rate, h

    def _steered(
        self, x: Array, angle: Array, h: Array, measurement: Measurement
    ) -> tuple[GimbalRateCommand, Signals]:
        """Return the gimbal rates of u = -K x, and the signals."""
        scale = -self._mean_inertia * self.orbit_rate**2
        u = scale * times(self._gains, x)
        rate, measure = steering.steer(
            self.cluster,
            u - cross(measurement.rate, h),
            measurement.gimbal_angle,
            measurement.wheel_speed,
            self._steering_gains,
        )
        fastest = np.max(np.abs(rate), axis=-1, keepdims=True)
        rate = rate / np.maximum(fastest / self.gimbal_rate_limit, 1.0)
        return GimbalRateCommand(rate), Signals(angle, h, u, measure)

    @cached_property
    def _steering_gains(self) -> Array:
        return np.array([self.measure_wanted, self.damping, self.equalizing_gain, self.null_gain])


@dataclass(frozen=True)
class AttitudeMomentum(_StationGains):
    """Attitude and momentum: settles at the torque-equilibrium attitude with bounded momentum."""

    batched: ClassVar[bool] = True

    momentum_weight: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), at_least=0.0)
    """Of the squares of h / (n J0)."""
    integral_weight: Array = gain(shape=(3,), default=(0.1, 0.1, 0.1), above=0.0)
    """Of the squares of the integral of h / J0: it makes the mean momentum vanish."""
    filter_weight: float = gain(default=0.1, above=0.0)
    """Of the squares of the filters' states."""
    pitch_rejects: Rejected = field(default="attitude")
    """What the air's periodic torque does not drive about pitch: the attitude, and the momentum
    swings; or the momentum."""

    def __post_init__(self) -> None:
        """Check what is rejected."""
        if self.pitch_rejects not in get_args(Rejected):
            have = ", ".join(map(repr, get_args(Rejected)))
            raise ValueError(f"pitch_rejects: got {self.pitch_rejects!r}, should be one of {have}")
        super().__post_init__()

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return integrals and filters at rest."""
        none = 0.0 * measurement.rate
        return State(none, np.concatenate([none] * (2 * len(FILTERS)), axis=-1))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, GimbalRateCommand, Signals]:
        """Return the next state, the gimbal rates [rad/s] (..., 2 n), and the signals."""
        angle, rate, h = self._seen(measurement, reference)
        stored = h / (self._mean_inertia * self.orbit_rate)
        seen = np.concatenate([angle, rate, stored, state.integral, state.filters], axis=-1)
        command, signals = self._steered(seen, angle, h, measurement)
        after = times(self._memory, seen)
        return State(after[..., :3], after[..., 3:]), command, signals

    @cached_property
    def _model(self) -> tuple[Array, Array]:
        """A and B with the filters."""
        rejected: tuple[Rejected, ...] = ("momentum", self.pitch_rejects, "attitude")
        return with_filters(*station_plant(self.inertia, self.offset), rejected)

    @cached_property
    def _gains(self) -> Array:
        A, B = self._model
        weights = [self.attitude_weight, np.zeros(3), self.momentum_weight, self.integral_weight]
        filters = np.full(len(A) - 12, self.filter_weight)
        return regulator(A, B, np.concatenate([*weights, filters]), self.stability)

    @cached_property
    def _memory(self) -> Array:
        """What the memory is after a period of all that is seen, which is held; (15, 24)."""
        A, _ = self._model
        period = self.control_period * self.orbit_rate
        after = np.zeros((15, len(A)))
        after[:3, 6:9], after[:3, 9:12] = period * np.eye(3), np.eye(3)
        for row in range(12, len(A), 2):
            driven = A[row + 1, :12]
            f = np.sqrt(-A[row + 1, row])
            c, s = np.cos(f * period), np.sin(f * period)
            after[row - 9, row : row + 2], after[row - 8, row : row + 2] = [c, s / f], [-f * s, c]
            after[row - 9, :12] += (1.0 - c) / f**2 * driven
            after[row - 8, :12] += s / f * driven
        return after


@dataclass(frozen=True)
class AttitudeHold(_StationGains):
    """Attitude alone, by the same design without momentum: what it costs shows in the CMGs."""

    batched: ClassVar[bool] = True

    def reset(self, measurement: Measurement, reference: Reference) -> NoState:
        """Return the empty state."""
        return NoState()

    def step(
        self, state: NoState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[NoState, GimbalRateCommand, Signals]:
        """Return the state, the gimbal rates [rad/s] (..., 2 n), and the signals."""
        angle, rate, h = self._seen(measurement, reference)
        seen = np.concatenate([angle, rate], axis=-1)
        return state, *self._steered(seen, angle, h, measurement)

    @cached_property
    def _gains(self) -> Array:
        A, B = station_plant(self.inertia, self.offset)
        weights = np.concatenate([self.attitude_weight, np.zeros(3)])
        return regulator(A[:6, :6], B[:6], weights, self.stability)
