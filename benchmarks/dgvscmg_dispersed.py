"""Satellites with a double-gimbal CMG, each drawn anew: what rejecting the vibration does.

Where it starts, the wanted motion, the vibration, the bias momentum and by how much the law
mistakes the bus's inertia are drawn for each; all fly as one batch, with rejection and without.
``python benchmarks/dgvscmg_dispersed.py [count] [seed] [key=value of the scenario]``
"""

import multiprocessing
import sys
import warnings
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from mjspace.controllers.cmg.dgvscmg import Cascade
from mjspace.controllers.references.rate_references import Sinusoids

from mjspace.contract import Array, Measurement, Reference
from mjspace.environment.install import userdata
from mjspace.environment.torque_ripple import Ripple
from mjspace.scenario.loading import load
from mjspace.scenario.plant import PlantTable
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import Start, first_start, last_period
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import StateLayout

SCENARIO = "dgvscmg-low-momentum"  # for its limits and its wheel's motor
SEED = 20260401
SETTLED = 20.0  # s: errors are of what comes later
NO_REJECTION = [f"law.{name}_gain=[0,0,0]" for name in ("observer", "vibration", "adaptation")]


class Draw(NamedTuple):
    """What differs from scenario to scenario; N of them."""

    motion: list[Sinusoids]
    vibration: Array
    """Amplitude [N m], cycles a turn, phase [rad], (N, 3)."""
    wheel_speed: Array
    """At first [rad/s], (N,)."""
    mistake: Array
    """The law's inertia over the bus's, entry by entry, (N, 3, 3)."""


class Figures(NamedTuple):
    """What the flights showed, (N,) each."""

    gimbal_rate: Array
    """Largest of either [rad/s]."""
    gimbal_current: Array
    """Largest of either motor [A]."""
    wheel_current: Array
    wheel_speed: Array
    """Largest [rad/s]."""
    authority: Array
    """Least [N m s]."""
    torque_error: Array
    """RMS once settled [N m]."""
    pointing: Array
    """RMS once settled [deg]."""


@dataclass(frozen=True)
class Dispersed:
    """A law each of whose vehicles follows a motion of its own."""

    batched: ClassVar[bool] = True

    law: Cascade
    wanted: Reference
    """In each control period, (n, N, ...)."""

    def reset(self, measurement: Measurement, reference: Reference) -> Any:
        """Return the law's state."""
        return self.law.reset(measurement, self._wanted(0.0))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, Any]:
        """Return what the law does."""
        return self.law.step(state, time, measurement, self._wanted(time))

    def inner(
        self, state: Any, time: float, command: Any, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return what the law does."""
        return self.law.inner(state, time, command, measurement)

    def _wanted(self, time: float) -> Reference:
        period = round(time / self.law.control_period)
        return Reference(*(rows[period] for rows in self.wanted))


def drawn(seed: int, count: int) -> Draw:
    """Return random scenarios; the first of them are the same whatever the count."""
    motion, rows = [], []
    for random in map(np.random.default_rng, np.random.SeedSequence(seed).spawn(count)):
        axis = random.normal(size=3)
        angle = np.radians(random.uniform(10.0, 90.0))
        motion.append(
            Sinusoids(
                amplitude=random.uniform(0.02, 0.07, size=3),
                frequency=2.0 * np.pi / random.uniform(13.0, 60.0, size=3),
                phase=random.uniform(0.0, 2.0 * np.pi, size=3),
                start_mrp=np.tan(angle / 4.0) * axis / np.linalg.norm(axis),
            )
        )
        vibration = random.uniform((0.1, 0.25, 0.0), (0.5, 1.0, 2.0 * np.pi))
        stretch = random.uniform(0.95, 1.05, size=3)
        rows.append((vibration, random.uniform(30.0, 150.0), np.sqrt(np.outer(stretch, stretch))))
    return Draw(motion, *(np.array(column) for column in zip(*rows, strict=True)))


def flown(draw: Draw, changes: list[str]) -> Figures:
    """Fly them all, with these changes of the scenario."""
    warnings.simplefilter("ignore")
    vehicle, start = dispersed(draw, assemble(*load(SCENARIO, ["checks=[]", *changes])))
    peaks, errors = [], []
    for block in fly(vehicle, start, range(len(draw.motion))):
        rows, truth = block.rows, block.rows["/truth"]
        current = np.abs(truth["current"][..., 1])
        peaks.append([
            np.abs(truth["gimbal_rate"]).max(axis=(0, 2)), current[..., :2].max(axis=(0, 2)),
            current[..., 2].max(axis=0), np.abs(truth["wheel_speed"]).max(axis=(0, 2)),
            -rows["/law"]["authority"].min(axis=(0, 2)),
        ])  # fmt: skip
        if block.time[0] >= SETTLED:
            torque = torque_on_bus(vehicle, block.time, truth, rows["/disturbance"]["torque"])
            missed = np.linalg.norm(torque - rows["/law"]["torque"][:-1], axis=2)
            sine = np.linalg.norm(rows["/law"]["sigma_e"][:-1], axis=2)
            errors.append(np.stack([missed, np.degrees(4.0 * np.arctan(sine))], axis=1))
    *most, least = np.max(peaks, axis=0)
    settled = np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))
    return Figures(*most, -least, *settled)


def dispersed(draw: Draw, vehicle: Assembly) -> tuple[Assembly, Start]:
    """Return the scenario's assembly with what each draw wants of its law, and where they start."""
    scenario, law = vehicle.scenario, vehicle.law
    assert isinstance(law, Cascade)
    law = replace(law, inertia=vehicle.vehicle.inertia * draw.mistake)
    time = np.arange(last_period(scenario) + 1) * law.control_period
    each = [motion.at(time) for motion in draw.motion]
    wanted = Reference(*(np.stack(parts, axis=1) for parts in zip(*each, strict=True)))
    vehicle = replace(vehicle, law=Dispersed(law, wanted))

    start = first_start(vehicle, range(len(draw.motion)))
    start.physics[:, StateLayout(vehicle).wheel_speed] = draw.wheel_speed[:, None]
    for row, (amplitude, cycles, phase) in zip(start.physics, draw.vibration, strict=True):
        ripple = {"cmg_wheel": Ripple(amplitude=amplitude, cycles=cycles, phase=phase)}
        own = userdata(vehicle.vehicle.model, scenario.environment, PlantTable(ripple=ripple))
        row[-own.size :] = own  # the last part of MuJoCo's state
    return vehicle, start


def torque_on_bus(
    vehicle: Assembly, time: Array, truth: dict[str, Array], disturbance: Array
) -> Array:
    """Return the torque that acted in each period, its mean [N m], body axes, (n - 1, N, 3).

    From the bus's motion, by (2.57): Mb w' = h x w + tau + tau_d, h = Mb w + Jw W s.
    """
    inertia, rate = vehicle.vehicle.inertia, truth["rate"]
    angle, spin = truth["gimbal_angle"], 0.016 * truth["wheel_speed"]
    (so, si), (co, ci) = np.moveaxis(np.sin(angle), 2, 0), np.moveaxis(np.cos(angle), 2, 0)
    h = rate @ inertia + spin * np.stack([co * ci, so * ci, -si], axis=2)
    slope = np.diff(rate, axis=0) / np.diff(time)[:, None, None]
    other = np.cross(h, rate) + disturbance
    return np.asarray(slope @ inertia - 0.5 * (other[1:] + other[:-1]))


def main() -> None:
    """Print the table."""
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    count, seed = (*numbers, *(12, SEED)[len(numbers) :])[:2]
    changes = [word for word in sys.argv[1:] if "=" in word]
    draw = drawn(seed, count)
    with multiprocessing.Pool(2) as pool:
        jobs = [(draw, changes), (draw, [*changes, *NO_REJECTION])]
        one, none = pool.starmap(flown, jobs)
    print(
        "       drawn:  N m  a turn  rad/s | rad/s      A  wheel A  rad/s  N m s |"
        " torque error N m: without  with   ratio |    deg"
    )
    for n in range(count):
        amplitude, cycles, _ = draw.vibration[n]
        *peaks, error, pointing = (values[n] for values in one)
        print(
            f"{n:3}{amplitude:16.2f}{cycles:8.2f}{draw.wheel_speed[n]:7.1f} |"
            + "{:6.2f}{:7.2f}{:9.2f}{:7.0f}{:7.3f} |".format(*peaks)
            + f"{none.torque_error[n]:25.1e}{error:8.1e}{error / none.torque_error[n]:8.4f} |"
            + f"{pointing:8.1e}"
        )


if __name__ == "__main__":
    main()
