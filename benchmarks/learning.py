"""What a step of an environment for reinforcement learning costs, one and many, over bare MuJoCo.

An episode of ``learned-slew``, 120 control periods of five integration steps, with its reset, and
the same periods of MuJoCo's batch alone. Processor time, since others may use the cores.
"""

import statistics
import time
import warnings

import numpy as np
from mujoco.batch import Batch
from timing import head, row

from mjspace import dm_env, gym

SCENARIO = "learned-slew"
PERIODS, STEPS, REPEATS = 120, 5, 7


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    head("learned-slew, 120 control periods", "steps/s", "us a step", "bare", "resets [ms]")
    alone = gym.load(SCENARIO)
    timed("one, Gymnasium", 1, lambda: alone.reset(seed=1), lambda: alone.step(np.zeros(3)))
    control = dm_env.load(SCENARIO)
    timed("one, dm_control", 1, control.reset, lambda: control.step(np.zeros(3)))
    for count in (8, 64, 256):
        several = gym.load_vector(SCENARIO, count)
        zeros = np.zeros((count, 3))
        timed(
            f"{count} at once",
            count,
            lambda envs=several: envs.reset(seed=1),
            lambda envs=several, zeros=zeros: envs.step(zeros),
        )


def timed(name, count, reset, step) -> None:
    """Print a row: the median of some episodes."""
    model = gym.load(SCENARIO)._episodes.nominal.vehicle.model
    batch = Batch(model, count, 1)
    found = []
    for _ in range(REPEATS):
        instants = [time.process_time()]
        reset()
        instants.append(time.process_time())
        for _ in range(PERIODS):
            step()
        instants.append(time.process_time())
        for _ in range(PERIODS):
            batch.step(nstep=STEPS)
        instants.append(time.process_time())
        found.append(np.diff(instants))
    begin, flown, bare = (statistics.median(column) for column in zip(*found, strict=True))
    each = 1e6 / (PERIODS * count)
    row(
        name,
        f"{1e6 / ((begin + flown) * each):.0f}",
        f"{flown * each:.1f}",
        f"{bare * each:.1f}",
        f"{begin * 1e3:.1f}",
    )


if __name__ == "__main__":
    main()
