"""A scenario, a law and a test that fly at once, to begin one's own from."""

import math
from string import Template
from typing import Any

import numpy as np
import tomli_w

from mjspace.scenario.model_source import ModelSource
from mjspace.validation.inspection import Inspection, Whole

_TURN = 20  # deg, by which the attitude is off at first
_LARGEST_BANDWIDTH = 0.3  # rad/s
_DAMPING = 0.8
_SHARE = 0.2  # of the wheels' torque, which the law asks for at first

_LAW = Template('''\
"""A law to begin with: $what."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from mjspace import algebra, attitude
from mjspace.contract import Array, Gains, Measurement, Reference, Unit, gain


class Command(NamedTuple):
    """What the actuators are to do; a leading vehicle axis may precede each shape."""

$fields

class Signals(NamedTuple):
    """What the log is to show of the law."""

    rotation: Annotated[Array, Unit("rad")]
    """From the desired to the true attitude, body axes [rad], (..., 3)."""


@dataclass(frozen=True)
class Law(Gains):
    """$description"""

    batched = True
$gains
    def reset(self, measurement: Measurement, reference: Reference) -> None:
        """Return the state at the start: it has none."""

    def step(
        self, state: None, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[None, Command, Signals]:
        """Return (state, command, signals) for the control period that begins at time [s]."""
        error = attitude.multiply(attitude.conjugate(reference.attitude), measurement.attitude)
        rotation = attitude.to_rotation_vector(error)
$command
''')
_TORQUE = """\
        # The angular acceleration of a spring and a damper, times the inertia.
        stiffness, damping = self.bandwidth**2, 2.0 * self.damping * self.bandwidth
        wanted = -stiffness * rotation - damping * (measurement.rate - reference.rate)
        torque = algebra.times(self.inertia, wanted)
"""
_GAINS = f'''
    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """Of the vehicle; the scenario's when left out."""
    bandwidth: float = gain("rad/s", above=0.0)
    damping: float = gain(default={_DAMPING}, above=0.0)
    """Damping ratio."""
'''
_TEST = Template('''\
"""$name flies, and shows what its scenario says."""

from pathlib import Path

import mjspace


def test_it_flies(tmp_path: Path) -> None:
    result = mjspace.run(Path(__file__).with_name("$name.toml"), out=tmp_path)
    assert result.passed, [verdict.line for verdict in result.verdicts]
''')


def files(
    name: str, source: ModelSource | None = None, found: Inspection | None = None
) -> dict[str, bytes]:
    """Return the files to begin ``name`` with, by their paths in its folder.

    Those of a user's own model are among them: its ``source`` and what was ``found`` in it.
    """
    whole = None if found is None else found.vehicle
    scenario = _scenario(name, source, found)
    texts = {
        f"{name}.toml": tomli_w.dumps(scenario),
        f"test_{name.replace('-', '_')}.py": _TEST.substitute(name=name),
    }
    if scenario["law"]["kind"] == "law.py:Law":
        texts["law.py"] = _law(whole, controls="bandwidth" in scenario["law"])
    model = {} if source is None else source.files
    return {**model, **{path: text.encode() for path, text in texts.items()}}


def _scenario(name: str, source: ModelSource | None, found: Inspection | None) -> dict[str, Any]:
    whole = None if found is None else found.vehicle
    step = 0.005 if found is None else found.step
    control = step * max(1, math.floor(0.01 / step + 1e-9))
    moved = whole is None or whole.command
    duration, law = 60.0, {"kind": "law.py:Law" if moved else "coast:Coast"}
    checks: list[dict[str, Any]] = []
    scale = 50.0 if whole is None else float(np.trace(np.array(whole.inertia)))  # kg m^2
    if whole is None or _controls_attitude(whole):
        bandwidth = _bandwidth(whole)
        law["bandwidth"] = f"{bandwidth:g} rad/s"
        duration = max(duration, 12.0 / (_DAMPING * bandwidth))  # the error falls to e^-12
        checks.append({
            "name": "attitude held",
            "signal": "truth.attitude_error",
            "statistic": "final",
            "below": "1 deg",
        })  # fmt: skip
    checks.append({
        "name": "total momentum drift [N m s]",
        "signal": "truth.momentum",
        "statistic": "drift",
        "below": float(f"{1e-10 * max(scale, 1e-3):.0e}"),
    })  # fmt: skip
    return {
        "description": f"{name}: the attitude is {_TURN} deg off at first",
        "duration": _seconds(math.ceil(duration / control - 1e-9) * control),
        "rates": {"physics": _seconds(step), "control": _seconds(control)},
        **({} if source is None else {"plant": {"model": source.main}}),
        "initial": {"euler": [f"{_TURN} deg", 0.0, 0.0]},
        "reference": {"kind": "references:Hold"},
        "law": law,
        "checks": checks,
    }


def _seconds(time: float) -> str:
    return f"{time:.12g} s"


def _controls_attitude(whole: Whole) -> bool:
    """Tell whether the wheels' axes span space."""
    axes = np.reshape([wheel.axis for wheel in whole.wheels], (-1, 3))
    return len(axes) >= 3 and bool(np.linalg.matrix_rank(axes, tol=1e-6) == 3)


def _bandwidth(whole: Whole | None) -> float:
    """Return a bandwidth [rad/s] that asks for a share of the wheels' torque, to one digit."""
    limits = [] if whole is None else [w.torque_limit for w in whole.wheels if w.torque_limit]
    if whole is None or not limits:
        return _LARGEST_BANDWIDTH
    largest = float(np.linalg.eigvalsh(np.array(whole.inertia))[-1])
    wanted = math.sqrt(_SHARE * min(limits) / (largest * math.radians(_TURN)))
    return float(f"{min(wanted, _LARGEST_BANDWIDTH):.1g}")


def _law(whole: Whole | None, *, controls: bool) -> str:
    sizes = {"torque": (3, "N m")}
    if whole is not None:
        sizes = {name: (field.size, field.unit) for name, field in whole.command.items()}
    fields, made = [], []
    for name, (size, unit) in sizes.items():
        kind = f'Annotated[Array, Unit("{unit}")]' if unit else "Array"
        fields.append(f'    {name}: {kind}\n    """(..., {size})."""\n')
        if name == "torque" and controls:
            made.append("torque")
        else:
            made.append(f"np.zeros((*rotation.shape[:-1], {size}))")
    what = "a spring and a damper hold the attitude" if controls else "it commands nothing yet"
    return _LAW.substitute(
        what=what,
        fields="".join(fields),
        description=f"{what[0].upper()}{what[1:]}.",
        gains=_GAINS if controls else "",
        command=f"{_TORQUE if controls else ''}        command = Command({', '.join(made)})\n"
        "        return None, command, Signals(rotation)",
    )
