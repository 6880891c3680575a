"""Flies the attitude laws of papers 000 and 002 and writes docs/attitude_laws.md.

Usage: python tools/attitude_laws_comparison.py docs/attitude_laws.md

It takes a minute. Each row is a scenario that comes with mjspace, its law replaced by the row's.
"""

import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.runner.run import run

THETA = np.array([15.0, 5.0, 5.0, 10.0, 7.0, 20.0, 1.0, -1.0, 0.0])
"""m11 m12 m13 m22 m23 m33 [kg m^2] and hI [N m s] of paper 002's satellite."""
EULER = 'kind="immersion_invariance:ImmersionInvariance"'
MRP, QUATERNION = (f'kind="immersion_invariance_nonsingular:{n}"' for n in ("Mrp", "Quaternion"))
COMPUTED = 'kind="computed_torque:ComputedTorque"'
YAW = "unwrap_from=[1,1,-5]"
OF_000 = {
    "immersion and invariance, Euler angles": f"{EULER},{YAW}",
    "computed torque, Kv = 15, Kp = 50": f"{COMPUTED},{YAW}",
    "computed torque, critically damped, Kp = 50": f"{COMPUTED},{YAW},rate_gain=14.142135623730951",
    "the first, its yaw not unwrapped": EULER,
    "immersion and invariance, MRP": MRP,
    "immersion and invariance, quaternions": QUATERNION,
}
OF_002 = {
    "contraction, ideal": 'kind="contraction:Ideal"',
    "contraction, adaptive": 'kind="contraction:Adaptive"',
    "contraction, gradient alone": 'kind="contraction:Gradient"',
    "passivity-based": 'kind="adaptive_tracking:Passivity"',
    "Hamiltonian": 'kind="adaptive_tracking:Hamiltonian"',
    "passivity-based, rate observed": 'kind="adaptive_output_feedback:OutputFeedback"',
    "immersion and invariance, adaptive": 'kind="immersion_invariance_adaptive:Adaptive",'
    "target_gain=25,manifold_gain=1.67,adaptation_gain=1000",
}
LAWS_OVER_Y = ("passivity-based", "Hamiltonian")
SLOW = "target_gain=0.5,manifold_gain=0.25"
OBSERVERS = 'kind="immersion_invariance_observers:'
SOFT = "rate_gain=25,attitude_gain=5,adaptation_gain=5"
ON_BOOM = {
    "contraction, ideal, with the stowed inertia": 'kind="contraction:Ideal",attitude_gain=5',
    "contraction, adaptive, forgetting 0.1 1/s": f'kind="contraction:Adaptive",{SOFT}',
    "the same, forgetting 0.3 1/s": f'kind="contraction:Adaptive",{SOFT},forgetting=0.3',
    "the same, without forgetting": f'kind="contraction:Adaptive",{SOFT},forgetting=0',
    "passivity-based": f'kind="adaptive_tracking:Passivity",{SOFT}',
    "Hamiltonian": f'kind="adaptive_tracking:Hamiltonian",{SOFT}',
    "immersion and invariance, adaptive": 'kind="immersion_invariance_adaptive:Adaptive",'
    "target_gain=5,manifold_gain=2,adaptation_gain=1000",
}


PAGE = """# Attitude laws compared

Papers 000 (immersion and invariance, Euler angles) and 002 (contraction, quaternions) fly with what
they build on and what they leave for later. The satellite is theirs: three wheels, a total momentum
of (1, -1, 0) N m s, and an inertia that no rigid body has, which is flown as printed. To write this
page again, in a minute: `python tools/attitude_laws_comparison.py docs/attitude_laws.md`.

## Immersion and invariance, with and without Euler angles

Paper 000's manoeuvre as printed, 6 s at 1 kHz (`immersion-invariance`, `computed-torque`,
`immersion-invariance-mrp`), K = 10 and Gamma = 5:

{of_000}

- **Computed torque is the same law.** Paper 000 calls its law similar to computed torque. With
  Kv = K + Gamma and Kp = K Gamma the torques differ by {apart:.0e} N m in 6 s, which is rounding.
  What immersion and invariance excludes are gains that oscillate, Kv^2 < 4 Kp.
- **MRP and quaternions** are of the error, by the shorter turn: the printed yaw of -5 rad, for
  which the law in Euler angles needs 2 kN m, is the attitude of 1.28 rad. Both laws have one
  manifold, w_e + 2 K q_v = 0, on which the tangent of a quarter of the error angle decays as e^-Kt.
  They differ in the coordinate that decays as e^-Gamma t off it: z = sigma_e' + K sigma_e [1/s] in
  MRP, z = w_e + 2 K q_v [rad/s] in quaternions.

A turn about y at 1.2 rad/s passes a pitch of 90 deg after 1.3 s
(`immersion-invariance-quaternion`):

{singular}

No attitude is singular for the last two. At an error of 180 deg the shorter turn changes its side,
and the torque with it.

## Without a measured disturbance, without a measured rate

Slowed down twenty times, at 250 Hz (`immersion-invariance-disturbance`,
`immersion-invariance-rate-observer`), the law in quaternions:

{observers}

- **The disturbance observer** is that of Astolfi, Karagiannis and Ortega (2008): estimate
  zeta + L H w, whose error is a multiple of e^-Lt under any motion.
- **The rate observer** estimates the constant momentum hI, from which w = H0^-1 (R^T hI - h) with h
  from the tachometers. A Lyapunov function proves it (Salcudean 1991, for a body without wheels).
  It is not an immersion and invariance observer: the simplest of those needs a function of the
  attitude whose derivative is the rate, and there is none.

## Unknown inertia: paper 002's manoeuvres

Scenario `contraction-adaptive` at paper 002's gains with wheels of 0.1 kg m^2, the law replaced,
for 20 s. Estimates start at zero. The adaptive immersion and invariance law
(`immersion-invariance-adaptive`) has K = 25, and Gamma = 1.67, which is Kc over the mean moment of
inertia; it takes the momentum from the tachometers and estimates the inertia alone.

The sweep, 120 deg about (1, 1, 1):

{sweep}

The regulation, the same turn in 2 s:

{regulation}

A motion about several axes, ours, for 40 s:

{multi_axis}

- **The passivity-based law** (Slotine and Li 1987; Egeland and Godhavn 1994) and 002's gradient law
  are one to second order of the attitude error: their desired rates differ by its square.
- **The Hamiltonian law** (Slotine and Di Benedetto 1990) is the same in Euler angles. On these
  manoeuvres it tracks as well. On a sweep of 120 deg about y, through a pitch of 90 deg, its flight
  ends so: {over_y}.
  The passivity-based law has an error of {passive_y:.1e} rad at most there.
- **Without a gyro**, what 002 leaves for later, the passivity-based law tracks as well as with one
  (`adaptive-output-feedback`). The rate is linear in 24 constants of inertia and momentum, and the
  proof covers its convergence under any bounded motion; that of the whole is not proved, and the
  flight with `law.momentum_scale=1` is unstable. With a known inertia the contraction law follows
  its observer in cascade (`contraction-output-feedback`).
- **Parameters.** 002 says that its estimates converge whatever the trajectory. On its own
  manoeuvres they do not, in any of these laws: a turn about one axis excites five of nine
  parameters. The signal `law.excitation`, the least eigenvalue of Z in (4.10), is {weak:.1e} at the
  end of the sweep and {strong:.1e} at the end of the motion about several axes, where the laws with
  a memory of the past motion find them and those of the gradient alone do not.
- **Ideal** means that inertia and momentum are known. Its first error is of the initial rate, and
  its peak torque as well.

## An inertia that changes

`contraction-boom`: a tip of 2 kg slides out to 3 m from 20 s on, at 0.1 m/s, while the satellite
moves about several axes; m22 and m33 rise from 14.5 and 16.5 to 31.7 and 33.7 kg m^2. Largest
attitude error [rad]:

{boom}

002's proof is for constant parameters. With its forgetting of 0.1 1/s the estimates lag by some ten
seconds, and are right again half a minute after the boom stops; without forgetting, the motion of
before still counts at the end. The law with the stowed inertia keeps its error.

![The attitude error, the excitation and the estimates of contraction-boom](contraction_boom.png)
"""


@dataclass(frozen=True)
class Flown:
    """A flight's log and how it ended."""

    truth: dict[str, Array]
    law: dict[str, Array]
    torque: Array
    """Commanded [N m], (n, 3)."""
    trouble: str

    @property
    def time(self) -> Array:
        """[s], (n,)."""
        return self.truth["time"]

    @cached_property
    def error(self) -> Array:
        """Of the attitude [rad], (n,)."""
        return self.truth["attitude_error"].reshape(len(self.time))

    def largest(self, start: float, end: float = np.inf) -> float:
        """Return the largest attitude error in a window of time [s]."""
        return float(self.error[(self.time >= start) & (self.time <= end)].max())

    def settled(self, bound: float) -> str:
        """Return when the error is below ``bound`` [rad] for good [s]."""
        above = np.flatnonzero(self.error >= bound)
        if len(above) == len(self.error) or above[-1] == len(self.error) - 1:
            return "never"
        return f"{self.time[above[-1] + 1]:.2f}"

    @property
    def ending(self) -> str:
        """Why the flight ended before its time, if it did."""
        return self.trouble.replace("/command.torque", "the torque") or "flown to its end"

    @property
    def rms_torque(self) -> float:
        """Of the torque's norm [N m]."""
        return float(np.sqrt(np.mean(np.sum(self.torque**2, axis=1))))

    def parameter_error(self) -> str:
        """Return the relative error of the estimates at the end, of those that the law has."""
        if "theta_hat" not in self.law:
            return "known"
        estimate = self.law["theta_hat"][-1]
        true = THETA[: len(estimate)]
        return f"{np.linalg.norm(estimate - true) / np.linalg.norm(true):.2g}"


def fly(scenario: str, law: str, *overrides: str) -> Flown:
    """Return the flight of a scenario under another law."""
    with TemporaryDirectory() as folder, warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        named = [f"law={{{law}}}", "checks=[]", *overrides]
        result = run(scenario, overrides=named, out=Path(folder) / "flown")
        log = Log(result.path)
        torque = log.read("/command", ["torque"])["torque"]
        return Flown(log.read("/truth"), log.read("/law"), torque, result.trouble)


def table(head: Sequence[str], flights: dict[str, Flown], *cells: Callable[[Flown], str]) -> str:
    """Return a Markdown table, a row for each flight."""
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    lines += [f"| {n} | {' | '.join(c(f) for c in cells)} |" for n, f in flights.items()]
    return "\n".join(lines)


def manoeuvre() -> tuple[str, float]:
    """Return the table of paper 000's manoeuvre, and how much computed torque differs [N m]."""
    flights = {n: fly("immersion-invariance", law) for n, law in OF_000.items()}
    first, computed, *_ = flights.values()
    text = table(
        ("law", "error below 0.05 rad from [s]", "from 3 s on at most [rad]", "peak torque [N m]",
         "rms torque [N m]", "torque less the first's, peak [N m]"),
        flights,
        lambda f: f.settled(0.05),
        lambda f: f"{f.largest(3.0):.1e}",
        lambda f: f"{np.abs(f.torque).max():.0f}",
        lambda f: f"{f.rms_torque:.0f}",
        lambda f: "0" if f is first else f"{np.abs(f.torque - first.torque).max():.2g}",
    )  # fmt: skip
    return text, float(np.abs(computed.torque - first.torque).max())


def singular() -> str:
    """Return the table of a turn through a pitch of 90 deg."""
    laws = {
        "immersion and invariance, Euler angles": EULER,
        "computed torque, Euler angles": COMPUTED,
        "immersion and invariance, MRP": MRP,
        "immersion and invariance, quaternions": QUATERNION,
    }
    flights = {n: fly("immersion-invariance-quaternion", law) for n, law in laws.items()}
    return table(
        ("law", "largest error from 1.25 s on [rad]", "peak torque [N m]", "ends"),
        flights,
        lambda f: f"{f.largest(1.25):.1e}",
        lambda f: f"{np.abs(f.torque).max():.3g}",
        lambda f: f.ending,
    )


def adaptation(reference: str, duration: float) -> tuple[str, dict[str, Flown]]:
    """Return the table of one of paper 002's manoeuvres, and its flights."""
    change = [f"reference={{kind='references:{reference}'}}", f"duration={duration}"]
    change += ["plant.wheels.inertia=0.1"]
    flights = {n: fly("contraction-adaptive", law, *change) for n, law in OF_002.items()}
    text = table(
        ("law", "largest error [rad]", "settled to 2 mrad [s]", "final error [rad]",
         "rms torque [N m]", "peak torque [N m]", "relative parameter error"),
        flights,
        lambda f: f"{f.error.max():.2e}",
        lambda f: f.settled(2e-3),
        lambda f: f"{f.error[-1]:.1e}",
        lambda f: f"{f.rms_torque:.2f}",
        lambda f: f"{np.abs(f.torque).max():.1f}",
        Flown.parameter_error,
    )  # fmt: skip
    return text, flights


def boom() -> str:
    """Return the table of the inertia that changes."""
    flights = {n: fly("contraction-boom", law) for n, law in ON_BOOM.items()}
    windows = ((10.0, 20.0), (40.0, 50.0), (60.0, 70.0), (90.0, 100.0))
    return table(
        ("law", *(f"{a:.0f} to {b:.0f} s" for a, b in windows), "m22, m33 at the end"),
        flights,
        *(lambda f, w=w: f"{f.largest(*w):.1e}" for w in windows),  # type: ignore[misc]
        lambda f: "{:.1f}, {:.1f}".format(*f.law["theta_hat"][-1, [3, 5]])
        if "theta_hat" in f.law else "",
    )  # fmt: skip


def observers() -> str:
    """Return the table of what is not measured."""
    rate, disturbance = "immersion-invariance-rate-observer", "immersion-invariance-disturbance"
    flights = {
        "0.1 N m from outside, not known": fly(disturbance, f"{QUATERNION},{SLOW}"),
        "the same, with the observer": fly(
            disturbance, f'{OBSERVERS}DisturbanceObserver",{SLOW},observer_gain=0.5'
        ),
        "rate measured": fly(rate, f"{QUATERNION},{SLOW}"),
        "rate observed": fly(rate, f'{OBSERVERS}RateObserver",{SLOW}'),
    }
    return table(
        ("flight", "largest error from 15 s on [rad]", "final error [rad]", "rms torque [N m]"),
        flights,
        lambda f: f"{f.largest(15.0):.2e}",
        lambda f: f"{f.error[-1]:.2e}",
        lambda f: f"{f.rms_torque:.3f}",
    )


def main(page: Path) -> None:
    """Write the page."""
    of_000, apart = manoeuvre()
    sweep, swept = adaptation("Sweep", 20.0)
    multi_axis, excited = adaptation("MultiAxis", 40.0)
    about_y = ["reference.axis=[0, 1, 0]", "initial.rate=[0, 0, 0]"]
    over = {n: fly("contraction-adaptive", OF_002[n], *about_y) for n in LAWS_OVER_Y}
    text = PAGE.format(
        of_000=of_000,
        apart=apart,
        singular=singular(),
        observers=observers(),
        sweep=sweep,
        regulation=adaptation("Regulation", 20.0)[0],
        multi_axis=multi_axis,
        over_y=over["Hamiltonian"].ending,
        passive_y=over["passivity-based"].error.max(),
        weak=swept["contraction, adaptive"].law["excitation"][-1, 0],
        strong=excited["contraction, adaptive"].law["excitation"][-1, 0],
        boom=boom(),
    )
    page.write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
