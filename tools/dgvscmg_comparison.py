"""Writes docs/dgvscmg_comparison.md and its figure: a double-gimbal CMG against three wheels.

Usage: python tools/dgvscmg_comparison.py CMG.mcap QUIET.mcap WHEELS.mcap docs/dgvscmg_comparison.md

The page says which flights these are.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mjspace.actuators.pmsm import Pmsm
from mjspace.contract import Array
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.plotting.style import COLORS, STYLE

NAMES = ("CMG", "CMG, no vibration", "three wheels")
PAGE = """# One double-gimbal CMG or three reaction wheels

The same bus, manoeuvre and disturbance (thesis 001, chapter 5) on a double-gimbal variable-speed
CMG, `dgvscmg-tracking`, and on three reaction wheels, `dgvscmg-against-wheels`. Each of these is
the CMG's wheel: 0.016 kg m^2, and at most 167 rad/s, which is 2.67 N m s. Both fly the robust PD+
law with the same gains. The CMG's wheel has a torque ripple of 0.35 N m, which its speed loop
learns to reject; the reaction wheels have none, so the CMG is shown without it as well. It starts
with 1.17 N m s in its wheel, the reaction wheels at rest.

{table}

![Pointing, torque and energy]({figure})

- **Pointing** is the law's on all: what is left is what its compensation loses to smoothness.
- **Torque.** A double gimbal amplifies nothing: its gimbals' motors bear the output torque, as
  reaction wheels' motors do, and for a moment more, when the manoeuvre begins at a step and the
  gimbals have to be set in motion.
- **Mechanical energy.** Gimbals turn slowly, so that the same torque costs them little: they
  deliver {gimbals:.1f} J where the three wheels' motors deliver {wheels:.0f} J. But the third axis
  of the CMG is its wheel, which gets the torque along it at {slowest:.0f} to {fastest:.0f} rad/s:
  {spin:.0f} J delivered and {back:.0f} J absorbed. Rejecting the ripple moves another
  {ripple:.0f} J to and fro, as the motor delivers at that speed what the ripple absorbs.
- **Copper loss** is R I^2 of the CMG's motors as flown. The reaction wheels have no electrical side
  in their scenario; theirs is what the CMG's wheel motor, k_m = {km:g} N m/A and R = {R:g} ohm,
  would lose for the same torques.
- **Supply** is what is taken where no motor regenerates: for each motor the positive part of
  mechanical power and copper loss together.

Bearing friction and drive electronics are not modelled. To write this page again:

    mjspace run dgvscmg-tracking --out runs/cmg
    mjspace run dgvscmg-tracking --set "plant.ripple={{}}" --out runs/quiet
    mjspace run dgvscmg-against-wheels --out runs/wheels
    python tools/dgvscmg_comparison.py runs/{{cmg,quiet,wheels}}/flight.mcap \\
        docs/dgvscmg_comparison.md

The second fails the check on a vibration that it does not have.
"""


@dataclass(frozen=True)
class Flown:
    """What is compared; arrays have a row for each control period."""

    time: Array
    """[s], (n,)."""
    error: Array
    """Of the attitude [deg], (n,)."""
    torque: Array
    """Of each motor [N m], (n, m)."""
    power: Array
    """Mechanical, of each motor [W], (n, m)."""
    loss: Array
    """In the copper of each motor [W], (n, m)."""
    speed: Array
    """Of each wheel [rad/s], (n, w)."""

    @property
    def supply(self) -> Array:
        """Energy taken so far, without regeneration [J], (n,)."""
        taken = np.maximum(self.power + self.loss, 0.0).sum(axis=1)
        energy: Array = np.cumsum(taken) * (self.time[1] - self.time[0])
        return energy

    def energy(self, power: Array) -> float:
        """Return the integral of a power [J], summed over motors."""
        return float(power.sum() * (self.time[1] - self.time[0]))

    def delivered(self, motors: slice = slice(None)) -> float:
        """Return the work that motors do [J]."""
        return self.energy(np.maximum(self.power[:, motors], 0.0))

    def absorbed(self, motors: slice = slice(None)) -> float:
        """Return the work that is done on motors [J]."""
        return self.energy(np.maximum(-self.power[:, motors], 0.0))

    def settled(self, degrees: float) -> float:
        """Return when the error is below that many degrees for good [s]."""
        return float(self.time[np.flatnonzero(self.error >= degrees)[-1] + 1])


def cmg(path: Path) -> Flown:
    """Return a flight of the CMG: motors of outer gimbal, inner gimbal and wheel."""
    log = Log(path)
    truth, command = log.read("/truth"), log.read("/command", ["motor_torque"])
    drives = list(scenario_of(log).plant.drives.root.values())
    resistance = np.array([drive.resistance for drive in drives])
    torque = command["motor_torque"]
    speed = np.concatenate([truth["gimbal_rate"], truth["wheel_speed"]], axis=1)
    loss = resistance * (truth["current"] ** 2).sum(axis=2)
    error = np.degrees(truth["attitude_error"])
    return Flown(truth["time"], error, torque, torque * speed, loss, truth["wheel_speed"])


def reaction_wheels(path: Path, motor: Pmsm) -> Flown:
    """Return a flight of reaction wheels, each turned by that motor."""
    log = Log(path)
    truth, torque = log.read("/truth"), log.read("/command", ["wheel_torque"])["wheel_torque"]
    loss = motor.resistance * (torque / motor.torque_constant) ** 2
    speed, error = truth["wheel_speed"], np.degrees(truth["attitude_error"])
    return Flown(truth["time"], error, torque, torque * speed, loss, speed)


def table(flights: Sequence[Flown]) -> str:
    """Return the comparison as a Markdown table."""
    rows = {
        "pointing from 20 s on, RMS [deg]": lambda f: f"{rms(f.error[f.time >= 20.0]):.2e}",
        "error below 1 deg from [s]": lambda f: f"{f.settled(1.0):.2f}",
        "largest torque of a motor [N m]": lambda f: f"{np.abs(f.torque).max():.2f}",
        "torque of all motors, RMS [N m]": lambda f: f"{rms(np.linalg.norm(f.torque, axis=1)):.2f}",
        "fastest wheel [rad/s]": lambda f: f"{np.abs(f.speed).max():.0f}",
        "largest mechanical power of a motor [W]": lambda f: f"{np.abs(f.power).max():.0f}",
        "work done by the motors [J]": lambda f: f"{f.delivered():.1f}",
        "work done on the motors [J]": lambda f: f"{f.absorbed():.1f}",
        "copper loss [J]": lambda f: f"{f.energy(f.loss):.1f}",
        "supply, without regeneration [J]": lambda f: f"{f.supply[-1]:.0f}",
    }
    lines = ["| over 60 s | " + " | ".join(NAMES) + " |", "|---|" + "---|" * len(NAMES)]
    lines += [f"| {name} | {' | '.join(map(of, flights))} |" for name, of in rows.items()]
    return "\n".join(lines)


def figure(flights: Sequence[Flown], path: Path) -> None:
    """Draw pointing, torque and energy over time."""
    with matplotlib.rc_context({**STYLE, "svg.hashsalt": "mjspace"}):
        page = Figure(figsize=(8.0, 6.4), layout="constrained")
        pointing, torque, energy = page.subplots(3, 1, sharex=True)
        for flight, name, color in zip(flights, NAMES, COLORS[:3], strict=True):
            some = slice(None, None, 20)
            time = flight.time[some]
            pointing.semilogy(time, flight.error[some], color=color, label=name, lw=1.0)
            torque.plot(time, np.abs(flight.torque).max(axis=1)[some], color=color, lw=1.0)
            energy.plot(time, flight.supply[some], color=color)
        pointing.set_title("attitude error [deg]", loc="left")
        torque.set_title("largest torque of a motor [N m]", loc="left")
        energy.set_title("energy taken from the supply, none given back [J]", loc="left")
        energy.set_xlabel("time [s]")
        pointing.legend(frameon=False, ncols=len(NAMES))
        page.savefig(path, metadata={"Date": None})


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def main(flown: Path, quiet: Path, wheels: Path, page: Path) -> None:
    """Write the page and its figure beside it."""
    motor = scenario_of(Log(flown)).plant.drives.root["cmg_wheel"]
    flights = [cmg(flown), cmg(quiet), reaction_wheels(wheels, motor)]
    drawn = page.with_suffix(".svg")
    figure(flights, drawn)
    _, calm, against = flights
    spin, gimbals = slice(2, 3), slice(2)
    text = PAGE.format(
        table=table(flights),
        figure=drawn.name,
        ripple=flights[0].delivered() - calm.delivered(),
        gimbals=calm.delivered(gimbals),
        wheels=against.delivered(),
        spin=calm.delivered(spin),
        back=calm.absorbed(spin),
        slowest=calm.speed.min(),
        fastest=calm.speed.max(),
        km=motor.torque_constant,
        R=motor.resistance,
    )
    page.write_text(text)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
