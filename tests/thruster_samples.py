"""What the tests of on/off thrusters share: their rates, how they are built and fired."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np

from mjspace.actuators.base import Actuator, Context
from mjspace.actuators.thruster_layout import ThrusterTable
from mjspace.contract import Array, Measurement, PulseCommand
from mjspace.scenario.equipment import Driven
from mjspace.scenario.plant import Initial, Rates

STEP, PERIOD, FORCE = 0.005, 0.02, 2.0  # s, s, N
NOTHING = np.zeros((1, 0))
TRUTH = Measurement(thrust=NOTHING, propellant=NOTHING)


def layout(count: int, thrust: Any = FORCE) -> dict[str, Any]:
    """Return the keys of so many thrusters that all push along x, of one ``thrust`` or of each."""
    rows = {"positions": [[0.0, 0.0, 0.0]] * count, "directions": [[1.0, 0.0, 0.0]] * count}
    return {**rows, "thrust": thrust}


def built(table: ThrusterTable, tank: str, mass: float, inertia: float) -> Any:
    """Return the thrusters on a vehicle that is a ``tank`` of that mass and inertia alone."""
    body = (
        f'<mujoco><worldbody><body name="{tank}"><inertial pos="0 0 0" mass="{mass}" '
        f'diaginertia="{inertia} {inertia} {inertia}"/></body></worldbody></mujoco>'
    )
    vehicle: Any = SimpleNamespace(model=mujoco.MjModel.from_xml_string(body))
    rates = Rates(physics=STEP, control=PERIOD)
    return table.actuator(Context(vehicle, Driven(), rates, Initial()))


def fire(thrusters: Actuator, on_times: Sequence[Any]) -> tuple[Any, Array, Array]:
    """Return (state, impulse of each step [N s], saturated) of periods with these on-times."""
    state, impulses, cuts = thrusters.reset(1), [], []
    for on in on_times:
        for _ in range(round(PERIOD / STEP)):
            state, mean, cut = thrusters.act(state, PulseCommand(np.atleast_2d(on)), TRUTH, STEP)
            impulses.append(mean[0] * STEP)
            cuts.append(cut[0])
    return state, np.array(impulses), np.array(cuts)


def check_batch(thrusters: Actuator) -> Any:
    """Check that each of four vehicles gets what it gets alone, of three thrusters; the state."""
    random = np.random.default_rng(2)
    every, alone = thrusters.reset(4), [thrusters.reset(1) for _ in range(4)]
    for _ in range(8):
        on_time = random.uniform(-0.01, 0.025, (4, 3))
        for _ in range(round(PERIOD / STEP)):
            every, mean, _ = thrusters.act(every, PulseCommand(on_time), TRUTH, STEP)
            for i in range(4):
                one = PulseCommand(on_time[i : i + 1])
                alone[i], mean_one, _ = thrusters.act(alone[i], one, TRUTH, STEP)
                np.testing.assert_array_equal(mean[i], mean_one[0])
    for name, values in every.items():
        np.testing.assert_array_equal(values, np.concatenate([one[name] for one in alone]))
    return every
