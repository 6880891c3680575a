"""Writes docs/wheel_vibration.md: wheel vibration, disturbances, current loops, each as flown.

Usage: python tools/wheel_vibration.py

It flies everything itself, in about a minute.
"""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mjspace.controllers.motors.deadbeat import DeadbeatLoop
from mjspace.controllers.motors.motor_loops import CurrentLoop

from mjspace import attitude
from mjspace.actuators.pmsm import Drives
from mjspace.contract import Array
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.validation.benchmarks.double_gimbal import THESIS
from mjspace.validation.dgvscmg_replay import full, replayed, simplified

PAGE = Path(__file__).parents[1] / "docs/wheel_vibration.md"
TEXT = """# Wheel vibration, disturbances and motor loops

What thesis 001 shows beside its main flight, and what it leaves for later. Every number is flown
by `python tools/wheel_vibration.py`, which writes this page.

## With and without compensation of a disturbance

Its figures 3.2 and 5.6. The rejection of the wheel's vibration does not depend on the
compensation.

{compensation}

Scenarios `pd-plus-uncompensated` and `dgvscmg-uncompensated`, beside `pd-plus-robust` and
`dgvscmg-tracking`.

## The simplified model on the plant that flies

Its figure 2.5 compares two models under gimbals that turn at a constant rate. Here both are given
what `dgvscmg-tracking` did in its first {seconds:g} s: angles and rates of gimbals and wheel, and
the torque from outside.

{simplified}

The simplified model leaves out the inertia of the gimbals and, but for its spin, of the wheel.
The attitude law uses it, and its feedback takes up the difference.

## A disturbance of unknown frequency

The law `internal_model:InternalModel` estimates a sine on each axis, its frequency too. It needs
no bound of the disturbance; the robust law does, 0.06 N m here. The bus and reference are those of
`pd-plus`, the sines those of `pd-plus-internal-model`, the period is 1 ms.

{internal}

With a bias of 0.01 N m on each axis beside the sines, `bias_gain = 20` learns it, and the
frequencies are found more slowly; Lyapunov's argument does not cover that. Where a bound is known,
the robust law's relay leaves less.

## A vibration of angle or of time

The thesis' rejection assumes a vibration that depends on the rotor's angle, (2.76):
`plant.ripple`. One that depends on time, (2.75), is `plant.vibration`; `clock` makes the internal
model turn with time. On the bench of `pmsm-speed-timed`, with either vibration, RMS of the speed
error from 6 to 8 s [rad/s]:

{timed}

Each model rejects its own vibration, and of the other a part.

## PI or deadbeat current loop

The thesis asks for a better current law. `deadbeat.DeadbeatLoop` brings the current to the
desired one in one period. Motor of Table 4.1, loops at 10 kHz:

{current}

It buys bandwidth, and with it a stiff speed loop: the last row is the bench with `speed_gain =
120` as in `pmsm-speed-deadbeat`. It costs noise, four times the voltage of the slower PI, and
it needs the inductance to within a factor of two. The speed error that a vibration leaves is the
same with both, as the speed loop's gain determines it.

## Isolation: a soft mount, the motor, or both

The part `mounted_wheel` is a wheel on a spring and a damper about its axis, 31.6 rad/s and 10 %
of critical damping. In `soft-mount` nothing is controlled. Torque on the bus for each N m of
vibration, and the closed form sqrt(1 + (2 zeta r)^2) / sqrt((1 - r^2)^2 + (2 zeta r)^2):

{mount}

In `soft-mount-hybrid` the wheel turns at 20 rad/s with a vibration of 0.1 N m at the mount's
frequency, and a ripple of 0.1 N m at 480 rad/s. Torque on the bus at each [N m]:

{hybrid}

The mount alone amplifies what is at its own frequency; the motor's rejection, one sine for a
motor, leaves the ripple. Together each takes what the other cannot.

## Gimbals without sensors

A spinning wheel needs no sensor of angle or speed (`dgvscmg-sensorless`). A gimbal at rest has no
back-EMF. Signal injection finds the angle of a rotor at rest by the windings' inductance, where
that differs between the rotor's axes; these motors have one inductance. With {volts:g} V at
{hertz:g} Hz on the windings of a gimbal's motor, at eight angles:

{standstill}

At rest it is impossible on this plant: the currents are the same at every angle, to rounding. A
rotor that turns shows its back-EMF, 0.15 V at 0.1 rad/s.
"""


class Rows(NamedTuple):
    """A flight of one vehicle."""

    time: Array
    fields: Callable[[str], Array]
    """The rows (n, ...) of a topic's field, as in "truth.rate"."""

    def rms(self, name: str, start: float, axis: int | None = None) -> float:
        """Return the root of the mean square of the norm, or of one axis, from ``start`` [s] on."""
        rows = self.fields(name)[self.time >= start]
        of = rows if axis is None else rows[:, axis : axis + 1]
        return float(np.sqrt(np.mean(np.sum(of**2, axis=1))))

    def degrees(self, start: float) -> float:
        """Return the attitude error's RMS [deg]."""
        return float(np.degrees(self.rms("truth.attitude_error", start)))


def flown(name: str, *overrides: str) -> Rows:
    """Return a scenario's flight under ``overrides``."""
    with warnings.catch_warnings(action="ignore"):
        scenario, where = load(name, ["checks=[]", *overrides])
        built = assemble(scenario, where)
        blocks = list(fly(built, first_start(built, [0])))

    def field(of: str) -> Array:
        topic, _, name = of.partition(".")
        return np.concatenate([block.rows[f"/{topic}"][name][:, 0] for block in blocks])

    return Rows(scenario.rates.control * np.arange(len(field("truth.rate"))), field)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def compensation(uncompensated: Rows, compensated: Rows) -> str:
    """Return the table of figures 3.2 and 5.6, of the flights with the CMG."""
    rigid = [flown(name, "duration=50") for name in ("pd-plus-uncompensated", "pd-plus-robust")]
    cmg = uncompensated, compensated

    def row(what: str, of: Callable[[Rows], float], flights: Sequence[Rows]) -> list[str]:
        return [what, *(f"{of(flight):.3g}" for flight in flights)]

    return table(
        ["RMS", "without", "with"],
        [
            row("rigid bus, attitude error from 40 s on [deg]", lambda f: f.degrees(40.0), rigid),
            row("CMG, attitude error from 13 s on [deg]", lambda f: f.degrees(13.0), cmg),
            row("CMG, composite error from 8 s on [rad/s]", lambda f: f.rms("law.s", 8.0), cmg),
            row(
                "CMG, wheel's speed error from 8 s on [rad/s]",
                lambda f: f.rms("law.speed_error", 8.0, axis=2),
                cmg,
            ),
        ],
    )


def models(flight: Rows, seconds: float) -> str:
    """Return the table of both models."""
    begin = slice(0, round(seconds / flight.time[1]) + 1)
    bus, angle, rate, outside = (
        np.concatenate([flight.fields(name)[begin] for name in names], axis=1)
        for names in (
            ("truth.attitude", "truth.rate"),
            ("truth.gimbal_angle", "truth.wheel_angle"),
            ("truth.gimbal_rate", "truth.wheel_speed"),
            ("disturbance.torque",),
        )
    )
    rows = []
    for name, model in (("full, (2.47) and (2.48)", full), ("simplified, (2.60)", simplified)):
        motion = replayed(model, THESIS, bus[0], angle, rate, outside, flight.time[1])
        true = bus[::2]
        off = np.degrees(attitude.rotation_angle(motion[:, :4], true[:, :4])).max()
        apart = np.linalg.norm(motion[:, 4:] - true[:, 4:], axis=1).max()
        rows.append([name, f"{off:.2g}", f"{apart:.2g}"])
    head = ["model", "attitude, largest difference [deg]", "rate, largest difference [rad/s]"]
    return table(head, rows)


def internal() -> str:
    """Return the table of laws under sines of unknown frequency."""
    name = "pd-plus-internal-model"
    robust = "law={ kind = 'pd_plus:Robust', disturbance_bound = 0.06 }"
    same = ["duration=60", "rates.physics=1 ms", "rates.control=1 ms"]
    bias = "environment.torques.0.bias=[0.01, -0.01, 0.01]"
    flights = {
        "modified PD+": flown(name, "law={ kind = 'pd_plus:Modified' }", *same),
        "robust PD+": flown(name, robust, *same),
        "internal model": flown(name, *same),
        "internal model, with a bias": flown(name, bias, "law.bias_gain=20", *same),
    }

    def found(flight: Rows) -> str:
        return ", ".join(f"{each:.4f}" for each in flight.fields("law.frequency_hat")[-1])

    rows = [
        [law, f"{f.degrees(50.0):.2g}", found(f) if k >= 2 else "-"]
        for k, (law, f) in enumerate(flights.items())
    ]
    head = ["law", "attitude error from 50 s on, RMS [deg]"]
    return table([*head, "frequencies at 60 s, of 0.7854, 0.5236, 1.2 [rad/s]"], rows)


def timed() -> str:
    """Return the table of internal models and vibrations."""
    ripple = ["plant.ripple.bench_wheel.amplitude=0.1", "plant.vibration.bench_wheel.amplitude=0"]
    rows = []
    for model, clock in (("of the angle", 0), ("of time, 20 rad/s", 20)):
        of_law = f"law.clock={clock}"
        both = (flown("pmsm-speed-timed", of_law, *more) for more in (ripple, []))
        rows.append([model, *(f"{flight.rms('law.speed_error', 6.0):.2g}" for flight in both)])
    none = ["law.vibration_gain=0"]
    both = (flown("pmsm-speed-timed", *none, *more) for more in (ripple, []))
    rows.append(["none", *(f"{flight.rms('law.speed_error', 6.0):.2g}" for flight in both)])
    return table(["internal model", "vibration of the angle", "vibration of time"], rows)


def response(loop: CurrentLoop | DeadbeatLoop, noise: float = 0.0) -> tuple[Array, Array]:
    """Return I_q [A] and u_q [V] for a step to 1 A at 100 rad/s, in each of 4000 periods."""
    drives = Drives(*(np.array([value]) for value in (6.0, 3.0, 6e-3, 2.0, np.inf, 0.0)))
    speed, desired = np.array([100.0]), np.array([1.0])
    random = np.random.default_rng(0)
    memory, current, rows = loop.reset(speed), drives.reset(), []
    for _ in range(4000):
        measured = current + noise * random.normal(size=(1, 2))
        memory, voltage = loop.step(memory, measured, desired, speed)
        current, _, _ = drives.advance(current, voltage, speed, 1e-4)
        rows.append((current[0, 1], voltage[0, 1]))
    currents, voltages = np.array(rows).T
    return currents, voltages


def current_laws() -> str:
    """Return the table of PI and deadbeat."""
    motor = {"pole_pairs": np.array([6.0]), "resistance": 3.0, "torque_constant": 2.0}

    def loops(inductance: float) -> list[CurrentLoop | DeadbeatLoop]:
        of = {**motor, "inductance": inductance, "period": 1e-4}
        slow, fast = (CurrentLoop(**of, proportional_gain=gain) for gain in (3000.0, 6000.0))
        return [slow, fast, DeadbeatLoop(**of)]

    def row(what: str, of: Callable[[Array, Array], float], L: float, noise: float) -> list[str]:
        return [what, *(f"{of(*response(loop, noise)):.2g}" for loop in loops(L))]

    def settled(current: Array, voltage: Array) -> float:
        return 0.1 * (1 + int(np.max(np.flatnonzero(np.abs(current - 1.0) > 0.02) + 1, initial=0)))

    def over(current: Array, voltage: Array) -> float:
        return 100.0 * max(float(current.max()) - 1.0, 0.0)

    exact, wrong = 6e-3, 1.5 * 6e-3
    stiff = ["duration=0.5", "law.speed_gain=120"]
    pi = "law={{ kind = 'motor_bench:SpeedBench', vibration_gain = 0, current_gain = {} }}"
    benches = [[pi.format(3000)], [pi.format(6000)], []]
    peaks = [
        float(np.abs(flown("pmsm-speed-deadbeat", *law, *stiff).fields("law.speed_error")).max())
        for law in benches
    ]
    rows = [
        row("within 2 % of a step after [ms]", settled, exact, 0.0),
        row("overshoot [%]", over, exact, 0.0),
        row("overshoot with 1.5 times the inductance in the law [%]", over, wrong, 0.0),
        row("noise of 10 mA: current, RMS [mA]", lambda i, _: 1e3 * _spread(i), exact, 0.01),
        row("and voltage, RMS [V]", lambda _, u: _spread(u), exact, 0.01),
        ["stiff speed loop, largest speed error [rad/s]", *(f"{peak:.2g}" for peak in peaks)],
    ]
    return table(["", "PI, 3000 1/s", "PI, 6000 1/s", "deadbeat"], rows)


def _spread(values: Array) -> float:
    return float(np.std(values[2000:]))


def amplitude(flight: Rows, frequency: float, start: float) -> float:
    """Return the amplitude of the torque on a bus of 10 kg m^2 at a ``frequency`` [N m]."""
    late = flight.time >= start
    angle = frequency * flight.time[late]
    waves = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=-1)
    swing = np.linalg.lstsq(waves, flight.fields("truth.rate")[late, 0], rcond=None)[0]
    return float(10.0 * frequency * np.hypot(swing[0], swing[1]))


def mount() -> str:
    """Return the table of transmissibility."""
    rows = []
    reduced = 0.04 * 10.0 / 10.04
    for ratio in (0.3, 1.0, np.sqrt(2.0), 3.0, 10.0):
        frequency = ratio * np.sqrt(40.0 / reduced)
        flight = flown("soft-mount", f"plant.vibration.bench_wheel.frequency={frequency}")
        damped = 0.253 / np.sqrt(40.0 * reduced) * ratio
        form = np.sqrt(1.0 + damped**2) / np.hypot(1.0 - ratio**2, damped) * 10.0 / 10.04
        measured = amplitude(flight, frequency, 4.0) / 0.1
        rows.append([f"{ratio:.3g}", f"{measured:.4g}", f"{form:.4g}"])
    return table(["r", "flown", "closed form, times 10 / 10.04 for the bus that moves too"], rows)


def hybrid() -> str:
    """Return the table of passive, active and hybrid isolation."""
    rigid, still = "plant.parts.bench.part=driven_wheel", "law.vibration_gain=0"
    flights = {
        "neither": [rigid, still],
        "mount": [still],
        "rejection": [rigid],
        "both": [],
    }
    rows = []
    for name, overrides in flights.items():
        flight = flown("soft-mount-hybrid", *overrides)
        rows.append([name, *(f"{amplitude(flight, each, 5.0):.2g}" for each in (31.6, 480.0))])
    return table(["isolation", "31.6 rad/s", "480 rad/s"], rows)


VOLTS, HERTZ = 5.0, 1000.0


def standstill() -> str:
    """Return the table of what injected voltages show of a rotor's angle."""
    drives = Drives(*(np.array([value]) for value in (4.0, 2.5, 4.5e-3, 1.5, np.inf, 1.0)))

    def injected(angle: float, speed: float) -> Array:
        current, rows = drives.reset(), []
        for k in range(100):
            phase = 2.0 * np.pi * HERTZ * 1e-4 * k
            voltage = VOLTS * np.array([[np.cos(phase), np.sin(phase)]])
            at = np.array([angle + 1e-4 * k * speed])
            current, _, _ = drives.advance(current, voltage, np.array([speed]), 1e-4, at)
            rows.append(current[0])
        return np.array(rows)

    angles = np.linspace(0.0, 0.5 * np.pi, 9)[:-1]  # an electrical turn of four pole pairs
    rows = []
    for speed in (0.0, 0.1, 1.0):
        currents = np.array([injected(angle, speed) for angle in angles])
        apart = np.linalg.norm(currents - currents[0], axis=-1).max()
        rows.append([f"{speed:g}", f"{np.abs(currents).max():.3g}", f"{apart:.2g}"])
    return table(["speed [rad/s]", "largest current [A]", "between angles, at most [A]"], rows)


def page() -> str:
    """Return the page."""
    seconds = 10.0
    tracking = flown("dgvscmg-tracking", "duration=14")
    return TEXT.format(
        compensation=compensation(flown("dgvscmg-uncompensated"), tracking),
        seconds=seconds,
        simplified=models(tracking, seconds),
        internal=internal(),
        timed=timed(),
        current=current_laws(),
        mount=mount(),
        hybrid=hybrid(),
        volts=VOLTS,
        hertz=HERTZ,
        standstill=standstill(),
    )


if __name__ == "__main__":
    PAGE.write_text(page())
