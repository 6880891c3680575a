"""Seeks the margins of the attitude laws on one slew and writes docs/margins.md.

Usage: python tools/margins_page.py docs/margins.md

It takes a quarter of an hour on two cores.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from mjspace.campaign.margins import Margin, Question, find

SCENARIO = """
base = "detumble-wheels"
description = "A slew by 60 deg in 20 s, held for 20 s"
duration = "40 s"
checks = []

[rates]
physics = "20 ms"
control = "20 ms"

[initial]
rate = [0, 0, 0]
wheel_speed = [0, 0, 0]

[reference]
kind = "references:Slew"
attitude = [0.8660254037844387, 0.3, -0.2, 0.34641016151377546]
duration = "20 s"
"""
REQUIRED = "max(truth.attitude_error) < 1 deg from 30 s"
SOFT = "rate_gain=12,attitude_gain=1"
MANIFOLD = "target_gain=1,manifold_gain=1"
LAWS = {
    "quaternion feedback": 'kind="quaternion_feedback:Fixed",attitude_gain=24,rate_gain=24',
    "PD+": 'kind="pd_plus:Classical",attitude_gain=48,rate_gain=24',
    "LQR": 'kind="linear_quadratic:Regulator",angle_weight=[144,144,144],rate_weight=[288,288,288]',
    "computed torque": 'kind="computed_torque:ComputedTorque",attitude_gain=1,rate_gain=2',
    "immersion and invariance": f'kind="immersion_invariance_nonsingular:Quaternion",{MANIFOLD}',
    "the same, rate observed": f'kind="immersion_invariance_observers:RateObserver",{MANIFOLD}',
    "the same, adaptive": f'kind="immersion_invariance_adaptive:Adaptive",{MANIFOLD},'
    "adaptation_gain=1000",
    "contraction, ideal": f'kind="contraction:Ideal",{SOFT}',
    "contraction, adaptive": f'kind="contraction:Adaptive",{SOFT}',
    "passivity-based, adaptive": f'kind="adaptive_tracking:Passivity",{SOFT}',
    "Hamiltonian, adaptive": f'kind="adaptive_tracking:Hamiltonian",{SOFT}',
}
COLUMNS = {
    "delay": "delay [s]",
    "lag": "lag [s]",
    "sampling": "control period [s]",
    "gain-up": "gain up to",
    "gain-down": "gain down to",
    "inertia-up": "its inertia up to",
    "inertia-down": "its inertia down to",
    "rate-noise": "noise of the rate [rad/s]",
    "attitude-noise": "noise of the attitude [rad]",
}

PAGE = """# Margins

How much delay, gain error or noise may there be before a law fails? `mjspace margins` changes a
scenario in one way at a time and flies it on the whole plant. It doubles the change until a flight
fails, then bisects between the last success and the first failure:

```console
$ mjspace margins lqr-regulation --only delay --require "final(truth.attitude_error) < 1 deg"
```

```text
{example}
```

| `--only` | what is changed |
|---|---|
| `delay` | all actuators apply what they should have applied earlier |
| `lag` | all actuators apply it behind a first-order lag with this time constant |
| `gain-up`, `gain-down` | all actuators apply a multiple of what they should: up to 32, or 1/32 |
| `inertia-up`, `inertia-down` | the law believes in a multiple of the vehicle's inertia |
| `sampling` | the law is called less often; the flight ends with the last whole period |
| `rate-noise`, `attitude-noise` | white noise on each axis of every sensor of it, beside its own |

What has to hold are the scenario's own checks or, instead, `--require "STATISTIC(SIGNAL) < VALUE
from TIME"`, repeatable, with `>` too and the [statistics of checks](scenario.md). A margin is known
to 5 % (`--tolerance`), a delay and a control period to one step. Bisection supposes that whatever
is worse than a failure fails too; a smaller change that fails between two that do not is not found.
`--json` has every flight, and `-o margins.png` draws them.

## The attitude laws on one slew

A satellite of 10, 12 and 14 kg m^2 with three wheels without limits turns by 60 deg in 20 s and
holds for 20 s, at 50 Hz. The gains are such that under each law a small error e obeys
e'' + 2 e' + e = 0, in seconds: all have one bandwidth. Required is an attitude error below 1 deg
from 30 s on. Written by `python tools/margins_page.py docs/margins.md` in a quarter of an hour.

{table}

Factors of the gain multiply what the wheels apply, those of the inertia the law's inertia; `-`
where the law has no such gain. With `<` and `>` nothing that was tried failed.

{remarks}
"""
REMARKS = """\
- **Delay.** The linear loop (2 s + 1) / s^2 crosses over at 2.06 rad/s with a phase margin of 76
  deg: it is stable up to a delay of 0.65 s, less half of the control period. The laws come within a
  sixth of that.
- **Lag.** Behind a lag T the linear loop is stable for T < 2 s (Routh: T s^3 + s^2 + 2 s + 1); a
  little above it, what grows is still below 1 deg after 40 s. The adaptive laws, whose
  estimates follow the error that the lag makes, survive 1.1 to 1.5 s.
- **Sampling.** Laws with a filter or an observer of their own, as the adaptive contraction law and
  the one that observes the rate, have to be called more often than the others.
- **Inertia.** What only feeds forward, as in PD+, hardly matters in so slow a slew. Where the
  believed inertia multiplies the feedback, too little of it is too little gain.
- **Adaptive laws** take somewhat more noise of the rate, and less of the attitude."""
EXAMPLE = [
    *("margins", "lqr-regulation", "--only", "delay"),
    *("--require", "final(truth.attitude_error) < 1 deg"),
]


def example() -> str:
    """Return what the page's command prints."""
    command = [sys.executable, "-m", "mjspace", *EXAMPLE]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.rstrip()


def margins_of(scenario: Path, law: str) -> dict[str, Margin]:
    """Return the margins under a law."""
    what = Question(str(scenario), (f"law={{{law}}}",), (REQUIRED,))
    return {margin.key: margin for margin in find(what)}


def cell(margin: Margin | None) -> str:
    """Return the worst value that was survived."""
    if margin is None:
        return "-"
    if margin.survived is None:
        return "none"
    sign = ">" if margin.failed is None and not margin.key.endswith("-down") else ""
    sign = "<" if margin.failed is None and margin.key.endswith("-down") else sign
    return f"{sign}{margin.survived:.2g}"


def main(page: Path) -> None:
    """Write the page."""
    lines = [f"| law | {' | '.join(COLUMNS.values())} |", "|---" * (len(COLUMNS) + 1) + "|"]
    with TemporaryDirectory() as folder:
        scenario = Path(folder) / "slew.toml"
        scenario.write_text(SCENARIO)
        for name, law in LAWS.items():
            found = margins_of(scenario, law)
            lines.append(f"| {name} | {' | '.join(cell(found.get(key)) for key in COLUMNS)} |")
            print(lines[-1], flush=True)
    page.write_text(PAGE.format(table="\n".join(lines), example=example(), remarks=REMARKS))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
