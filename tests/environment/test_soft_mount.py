"""The soft mount of a wheel, against the transmissibility of a spring and a damper."""

import numpy as np
import pytest

from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

BUS, MOUNT, STIFFNESS, DAMPING = 10.0, 0.04, 40.0, 0.253
AMPLITUDE = 0.1


def transmissibility(frequency: float) -> float:
    """Return the torque on the bus for each newton metre between wheel and mount.

    sqrt(1 + (2 zeta r)^2) / sqrt((1 - r^2)^2 + (2 zeta r)^2), of a mount that swings against a bus
    that is free too: by their reduced inertia, and less by its share of the mount's.
    """
    reduced = MOUNT * BUS / (MOUNT + BUS)
    r = frequency / np.sqrt(STIFFNESS / reduced)
    damped = DAMPING / np.sqrt(STIFFNESS * reduced) * r
    ratio = np.sqrt(1.0 + damped**2) / np.hypot(1.0 - r**2, damped)
    return float(ratio * reduced / MOUNT)


@pytest.mark.parametrize("r", [0.5, 1.0, np.sqrt(2.0), 4.0])
def test_the_bus_gets_the_torque_of_the_closed_form(r: float) -> None:
    frequency = r * np.sqrt(STIFFNESS / MOUNT)
    change = f"plant.vibration.bench_wheel.frequency={frequency}"
    built = assemble(*load("soft-mount", ["checks=[]", change]))
    blocks = list(fly(built, first_start(built, [0])))
    rate = np.concatenate([block.rows["/truth"]["rate"][:, 0, 0] for block in blocks])
    time = 1e-3 * np.arange(len(rate))
    late = time > 4.0
    # The mount's own swing has fallen by exp(-3.16 x 4) = 3e-6.
    waves = np.cos(frequency * time[late]), np.sin(frequency * time[late]), np.ones(late.sum())
    cos, sin, _ = np.linalg.lstsq(np.stack(waves, axis=-1), rate[late], rcond=None)[0]
    torque = BUS * frequency * np.hypot(cos, sin)
    assert torque / AMPLITUDE == pytest.approx(transmissibility(frequency), rel=2e-5)
