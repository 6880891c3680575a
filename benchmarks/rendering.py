"""What a video takes, over a bare loop of ``mujoco.Renderer`` with the same model and encoder.

``python benchmarks/rendering.py [SECONDS]``: of four seconds of a satellite and of a lander, 960 x
540 pixels at 25 frames a second; medians of paired runs in one process. The bare loop has neither
caption nor desired axes, and its states are in memory.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

import mujoco

import mjspace
from mjspace.log.reader import Log
from mjspace.rendering.render import render
from mjspace.rendering.scene import AXES
from mjspace.rendering.video import Video
from mjspace.vehicle.vehicle import from_bytes

ROUNDS, SIZE, RATE = 7, (960, 540), 25.0


def main() -> None:
    """Print the table."""
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 4.0
    print(f"{'':20}{'ms a frame':>12}{'bare':>8}{'ratio':>8}")
    for scenario in ("contraction-ideal", "lander"):
        with tempfile.TemporaryDirectory() as folder:
            overrides = [f"duration={duration}", "checks=[]"]
            log = mjspace.run(scenario, overrides=overrides, out=folder).log
            output = Path(folder, "flight.mp4")
            ours, bare = partial(render, log, output, size=SIZE, rate=RATE), bare_loop(log, output)
            pairs = [(seconds(ours), seconds(bare)) for _ in range(ROUNDS)]
        frames = int(duration * RATE) + 1
        each = [1e3 * median(times) / frames for times in zip(*pairs, strict=True)]
        ratio = median(a / b for a, b in pairs)
        print(f"{scenario:20}{each[0]:12.1f}{each[1]:8.1f}{ratio:8.2f}")


def bare_loop(log: Log, output: Path) -> Callable[[], None]:
    """Return what renders the same instants of the log to the same kind of file."""
    every = round(1.0 / RATE / float(log.metadata["control_period"]))
    states = log.read("/state", ["physics"], every=every)["physics"]
    compressed = log.attachment("model.mjb.gz")

    def run() -> None:
        model = from_bytes(compressed)
        data, option = mujoco.MjData(model), mujoco.MjvOption()
        option.geomgroup[AXES] = 1
        width, height = SIZE
        with (
            mujoco.Renderer(model, height, width) as renderer,
            Video(output, SIZE, RATE) as video,
        ):
            for state in states:
                mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
                mujoco.mj_forward(model, data)
                renderer.update_scene(data, "chase", option)
                video.write(renderer.render())

    return run


def seconds(run: Callable[[], None]) -> float:
    """Return how long ``run`` takes."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
