"""Desired motions: attitude, rate and acceleration as pure functions of time.

The quaternion's path is continuous, so that a law can choose q or -q once, at the start.
"""

from dataclasses import dataclass

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Reference, gain


@dataclass(frozen=True)
class Hold(Gains):
    """One attitude, at rest."""

    attitude: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """Quaternion, scalar first, body to inertial; normalized."""

    def at(self, time: Array) -> Reference:
        """Return the same row for each ``time`` [s]."""
        still = np.zeros_like(time)
        return turned(att.normalize(self.attitude), np.zeros(3), (still, still, still))


@dataclass(frozen=True)
class Turning(Gains):
    """A rotation at a constant rate, as of nadir-pointing axes in a circular orbit."""

    rate: Array = gain("rad/s", (3,))
    """In the rotating axes."""
    attitude: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """At time zero: quaternion, scalar first, body to inertial; normalized."""

    def at(self, time: Array) -> Reference:
        """Return the turn at each ``time`` [s]."""
        steady = time, np.ones_like(time), np.zeros_like(time)
        return turned(att.normalize(self.attitude), self.rate, steady)


@dataclass(frozen=True)
class Slew(Gains):
    """A rest-to-rest turn about the eigenaxis, the shorter way, with a quintic angle."""

    attitude: Array = gain(shape=(4,), form="quaternion")
    """Final attitude: quaternion, scalar first, body to inertial; normalized."""
    duration: float = gain("s", above=0.0)
    """From rest to rest."""
    start_time: float = gain("s", default=0.0)
    """Start of the slew; until then ``start_attitude`` is held."""
    start_attitude: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """Initial attitude: quaternion, scalar first, body to inertial; normalized."""

    def at(self, time: Array) -> Reference:
        """Return the slew at each ``time`` [s]; held before it starts and after it ends."""
        start, end = att.normalize(self.start_attitude), att.normalize(self.attitude)
        vector = att.to_rotation_vector(att.multiply(att.conjugate(start), end))
        return turned(start, vector, _quintic(time - self.start_time, self.duration))


@dataclass(frozen=True)
class Regulation(Gains):
    """A rest-to-rest turn from the identity about one axis, of any angle, with a quintic angle.

    Reconstructed from Servín 2022 (paper 002), figures 4.9 and 4.10: "120 deg, acceleration lasting
    2 s".
    """

    angle: float = gain("rad", default=2.0 * np.pi / 3.0)
    """Of the whole turn."""
    duration: float = gain("s", default=2.0, above=0.0)
    """From rest to rest."""
    axis: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), form="direction")
    """Of the turn; normalized."""

    def at(self, time: Array) -> Reference:
        """Return the turn at each ``time`` [s]; held after it ends."""
        vector = self.angle * att.normalize(self.axis)
        return turned(_IDENTITY, vector, _quintic(time, self.duration))


@dataclass(frozen=True)
class Sweep(Gains):
    """A turn from the identity about one axis: speed up, cruise, slow down, hold.

    Reconstructed from Servín 2022 (paper 002), figures 3.1 and 3.2; the ramps are cubic in rate.
    """

    peak_rate: float = gain("rad/s", default=np.pi / 6.0)
    """While cruising."""
    ramp: float = gain("s", default=2.0, above=0.0)
    """Duration of the acceleration to the peak rate, and of the deceleration to rest."""
    cruise_end: float = gain("s", default=4.0, above=0.0)
    """Start of the deceleration; the whole angle is peak_rate times this."""
    axis: Array = gain(shape=(3,), default=(1.0, 1.0, 1.0), form="direction")
    """Of the turn; normalized."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cruise_end < self.ramp:
            raise ValueError(
                f"cruise_end: got {self.cruise_end:g} s, should not be before the ramp's end, "
                f"{self.ramp:g} s"
            )

    def at(self, time: Array) -> Reference:
        """Return the sweep at each ``time`` [s]."""
        # The difference of two equal ramps, shifted by cruise_end.
        up, down = (self._ramp(time - start) for start in (0.0, self.cruise_end))
        vector = self.peak_rate * att.normalize(self.axis)
        return turned(_IDENTITY, vector, (up[0] - down[0], up[1] - down[1], up[2] - down[2]))

    def _ramp(self, time: Array) -> tuple[Array, Array, Array]:
        """Return the integral of the smooth step s^2 (3 - 2 s), the step, and its derivative."""
        s = np.clip(time / self.ramp, 0.0, 1.0)
        turned = self.ramp * (s**3 - 0.5 * s**4) + np.maximum(time - self.ramp, 0.0)
        return turned, 3.0 * s**2 - 2.0 * s**3, 6.0 * s * (1.0 - s) / self.ramp


@dataclass(frozen=True)
class MultiAxis(Gains):
    """Roll, pitch and yaw A (1 - cos w t): from rest at the identity, about changing axes.

    Not from Servín 2022 (paper 002), whose motions about a fixed axis leave its nine parameters
    unobservable.
    """

    amplitude: Array = gain("rad", (3,), default=(0.4, 0.3, 0.5))
    """Of roll, pitch, yaw."""
    frequency: Array = gain("rad/s", (3,), default=(0.9, 0.7, 0.5))
    """Of roll, pitch, yaw."""

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_regular(2.0 * self.amplitude)

    def at(self, time: Array) -> Reference:
        """Return the motion at each ``time`` [s]."""
        a, w, phase = self.amplitude, self.frequency, time[:, None] * self.frequency
        return _from_euler(
            a * (1.0 - np.cos(phase)), a * w * np.sin(phase), a * w * w * np.cos(phase)
        )


@dataclass(frozen=True)
class EulerSinusoids(Gains):
    """Roll, pitch and yaw A sin w t, as paper 000 simulates: x_d = [sin 5t, sin 2t, sin t]."""

    amplitude: Array = gain("rad", (3,), default=(1.0, 1.0, 1.0))
    """Of roll, pitch, yaw."""
    frequency: Array = gain("rad/s", (3,), default=(5.0, 2.0, 1.0))
    """Of roll, pitch, yaw."""

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_regular(self.amplitude)

    def at(self, time: Array) -> Reference:
        """Return the motion at each ``time`` [s]."""
        a, w, phase = self.amplitude, self.frequency, time[:, None] * self.frequency
        return _from_euler(a * np.sin(phase), a * w * np.cos(phase), -a * w * w * np.sin(phase))


_IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def turned(start: Array, vector: Array, part: tuple[Array, Array, Array]) -> Reference:
    """Return a rotation from ``start`` (4,) by ``vector`` (3,) [rad] times a fraction of time.

    ``part`` has the fraction, its first derivative [1/s] and its second [1/s^2], each (n,).
    """
    turned, rate, acceleration = (p[:, None] * vector for p in part)
    return Reference(att.multiply(start, att.from_rotation_vector(turned)), rate, acceleration)


def _quintic(time: Array, duration: float) -> tuple[Array, Array, Array]:
    """Return a rise from 0 to 1, without rate or acceleration at its ends, and its derivatives."""
    s = np.clip(time / duration, 0.0, 1.0)
    return (
        s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
        30.0 * s**2 * (1.0 - s) ** 2 / duration,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration**2,
    )


def _from_euler(x: Array, dx: Array, ddx: Array) -> Reference:
    """Return the reference of roll, pitch, yaw (n, 3) and their derivatives: w = J^-1(x) x'."""
    (roll, pitch, _), (p, q, r), (dp, dq, dr) = x.T, dx.T, ddx.T
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    rate = [p - sp * r, cr * q + sr * cp * r, -sr * q + cr * cp * r]
    acceleration = [
        dp - sp * dr - cp * q * r,
        cr * dq + sr * cp * dr - sr * p * q + (cr * cp * p - sr * sp * q) * r,
        -sr * dq + cr * cp * dr - cr * p * q - (sr * cp * p + cr * sp * q) * r,
    ]
    return Reference(
        att.from_euler_zyx(x), np.stack(rate, axis=-1), np.stack(acceleration, axis=-1)
    )


def _require_regular(reach: Array) -> None:
    if not abs(reach[1]) < 0.5 * np.pi:
        raise ValueError(
            f"amplitude[1]: pitch reaches {np.degrees(abs(reach[1])):.1f} deg, "
            "should be less than 90 deg, where Euler angles are singular"
        )
