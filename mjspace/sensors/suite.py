"""A vehicle's sensors: the truth, sampled late, with errors, and held in between."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import Any

import numba
import numpy as np

from mjspace.contract import Array, Measurement
from mjspace.scenario.plant import Rates
from mjspace.scenario.sensors import Errors, Sensors
from mjspace.sensors.accelerometer import Strapdown
from mjspace.sensors.noise import normals
from mjspace.units import whole_number

NAVIGATION = ("position", "velocity", "altitude", "ground_velocity", "specific_force")
OPTIONAL = (*NAVIGATION, "magnetic_field")
"""The fields of ``Measurement`` whose sensors a scenario may leave out."""

State = dict[str, Array]
"""What the sensors remember, vehicle axis first. Each one that is not ideal has
``<sensor>_samples`` (N, delay + 1, width), its last reports in ``Measurement``'s units, the oldest
first; each whose bias walks also has ``<sensor>_walk`` (N, axes), the walk at the next sample."""


class SensorSuite:
    """The sensors of a batch of vehicles: fixed errors and streams, all memory in ``State``.

    A sensor takes sample j at integration step j * period. It reports the newest sample that is at
    least ``delay`` old, and its first until there is one. An ideal sensor has no state and reports
    the truth's own array, which is no copy.

    Attributes:
        ticks: the sampling periods of the sensors that are not ideal, in integration steps;
            ``sample`` is to be called at every multiple of each.
    """

    def __init__(
        self,
        sensors: Sensors,
        rates: Rates,
        seed: int,
        members: Sequence[int],
        wheels: int,
        gravity: Callable[[Array], Array] = np.zeros_like,
    ) -> None:
        """Draw the constant biases of ``members``, the vehicles' numbers in the campaign ``seed``.

        A member measures the same alone or in any batch. ``gravity`` gives what accelerometers do
        not feel, [m/s^2], at each position [m], both (N, 3) in inertial axes.

        Raises:
            ValueError: a period is no whole number of integration steps, a delay no whole number of
                periods, or the attitude's quantization is coarser than a quaternion can show.
        """
        if sensors.attitude.quantization >= 1.0:
            raise ValueError(
                f"sensors.attitude.quantization {sensors.attitude.quantization:g} rad: "
                "must be less than 1 rad"
            )
        widths = {"wheel_speed": wheels, "altitude": 1}
        every = [
            _sensor(name, table, rates, seed, members, widths.get(name, 3))
            for name, table in sensors
            if table is not None
        ]
        self._sensors = [sensor for sensor in every if sensor is not None]
        self._absent = [name for name in OPTIONAL if getattr(sensors, name) is None]
        self._ideal = not self._sensors and len(self._absent) == len(OPTIONAL)
        self._strapdown = None
        if sensors.specific_force is not None:
            period = next(s.period for s in self._sensors if s.name == "specific_force")
            self._strapdown = Strapdown(gravity, period, rates.physics)
        self.ticks = frozenset(sensor.period for sensor in self._sensors)

    def reset(self, truth: Measurement) -> State:
        """Return the state before the first sample, at step 0, where the ``truth`` is given."""
        state: State = {}
        if self._strapdown is not None:
            truth = truth._replace(specific_force=self._strapdown.reset(state, truth))
        for sensor in self._sensors:
            if sensor.walk:
                state[sensor.walk_field] = np.zeros_like(sensor.bias)
            first = sensor.read(state, 0, getattr(truth, sensor.name))
            state[sensor.samples_field] = np.repeat(first[:, None], sensor.delay + 1, axis=1)
        return state

    def sample(
        self, state: State, step_index: int, truth: Measurement
    ) -> tuple[State, Measurement]:
        """Return (state, measurement) at integration step ``step_index``.

        ``truth`` has a vehicle axis: attitude (N, 4), rate (N, 3), wheel_speed (N, n). ``state`` is
        left as it is, so that this step may be sampled from it again.
        """
        if self._ideal:
            return state, truth
        state = state.copy()
        seen = truth._asdict()
        if self._strapdown is not None and step_index % self._strapdown.period == 0:
            seen["specific_force"] = self._strapdown.take(state, step_index, truth)
        for sensor in self._sensors:
            if step_index % sensor.period == 0:
                sensor.take(state, step_index // sensor.period, seen[sensor.name])
            seen[sensor.name] = state[sensor.samples_field][:, 0]
        for name in self._absent:
            seen[name] = seen[name][:, :0]
        return state, Measurement(**seen)


@dataclass(frozen=True)
class _Sensor:
    name: str
    period: int  # integration steps
    delay: int  # samples
    bias: Array  # (N, axes)
    noise: float
    white: Callable[[int], Array]
    walk: float  # standard deviation of one period's increment
    increment: Callable[[int], Array]
    quantization: float
    distort: Callable[[Array, Array, float], Array]
    samples_field: str
    walk_field: str

    def read(self, state: State, index: int, truth: Array) -> Array:
        """Return what sample ``index`` shows of the ``truth``."""
        error = self.bias
        if self.noise:
            error = error + self.noise * self.white(index)
        if self.walk:
            error = error + state[self.walk_field]
        return self.distort(truth, error, self.quantization)

    def take(self, state: State, index: int, truth: Array) -> None:
        """Put sample ``index`` and the walk that follows it into ``state``."""
        new = self.read(state, index, truth)[:, None]
        if self.delay:
            new = np.concatenate([state[self.samples_field][:, 1:], new], axis=1)
        state[self.samples_field] = new
        if self.walk:
            state[self.walk_field] = state[self.walk_field] + self.walk * self.increment(index)


def _sensor(
    name: str,
    table: Errors,
    rates: Rates,
    seed: int,
    members: Sequence[int],
    axes: int,
) -> _Sensor | None:
    """Return the sensor, or None when at every control instant it shows the truth itself."""
    period_key = "rates.control" if table.period is None else f"sensors.{name}.period"
    seconds = rates.control if table.period is None else table.period
    period = whole_number(seconds, rates.physics, period_key, "rates.physics")
    control = rates.steps
    errors = (table.noise, table.bias, table.bias_walk, table.quantization, table.delay)
    follows = name != "specific_force"  # which is a mean over its own period
    if follows and not any(errors) and control % period == 0:
        return None
    delay = table.delay and whole_number(table.delay, seconds, f"sensors.{name}.delay", period_key)
    number = Measurement._fields.index(name)
    constant, white, increment = (normals(seed, members, (number, part), axes) for part in range(3))
    return _Sensor(
        name=name,
        period=period,
        delay=int(delay),
        bias=table.bias * constant(0),
        noise=table.noise,
        white=white,
        walk=table.bias_walk * sqrt(seconds),
        increment=increment,
        quantization=table.quantization,
        distort=_turn if name == "attitude" else _shift,
        samples_field=f"{name}_samples",
        walk_field=f"{name}_walk",
    )


def _shift(truth: Array, error: Array, digit: float) -> Array:
    value = truth + error
    return np.rint(value / digit) * digit if digit else value


def _turn(truth: Array, error: Array, digit: float) -> Array:
    """Return the attitude turned by the rotation vector ``error``, in digits of ``digit``, in rad.

    What is rounded is what a star tracker sends: the four components of the quaternion, to
    digit / 2. Being orthogonal to its rates of change about the body axes, it then has the error of
    an angle rounded to ``digit``, digit / sqrt(12), about every axis in every attitude, which
    rounded Euler angles or rotation vectors have not.
    """
    turned: Array = _turn_kernel(truth, error, digit)
    return turned


@numba.guvectorize(["void(f8[:], f8[:], f8, f8[:])"], "(q),(a),()->(q)", cache=True)
def _turn_kernel(q: Any, error: Any, digit: Any, turned: Any) -> None:
    angle = sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2])
    scale = sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    w, x, y, z = cos(0.5 * angle), scale * error[0], scale * error[1], scale * error[2]
    turned[0] = q[0] * w - q[1] * x - q[2] * y - q[3] * z
    turned[1] = q[0] * x + q[1] * w + q[2] * z - q[3] * y
    turned[2] = q[0] * y - q[1] * z + q[2] * w + q[3] * x
    turned[3] = q[0] * z + q[1] * y - q[2] * x + q[3] * w
    if digit > 0.0:
        square = 0.0
        for i in range(turned.size):
            turned[i] = np.rint(2.0 * turned[i] / digit)
            square += turned[i] * turned[i]
        for i in range(turned.size):
            turned[i] /= sqrt(square)
