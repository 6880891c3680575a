"""What a video takes, over a bare loop of ``mujoco.Renderer`` with the same model and encoder.

``MUJOCO_GL=egl python benchmarks/rendering.py [SECONDS]``: of four seconds of a satellite and of a
lander, 960 x 540 pixels at 25 frames a second; medians of paired runs in one process. The bare loop
has no caption, desired axes, arrows or letters, its states are in memory, and it has to be told to
do without a display, as ours has not.
"""

import gzip
import sys
import tempfile
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
from timing import Run, head, paired, ratio, row

import mjspace
from mjspace.log.reader import Log
from mjspace.rendering.arrows import AXES
from mjspace.rendering.render import render
from mjspace.rendering.video import Video
from mjspace.vehicle.vehicle import from_mjb

SIZE, RATE = (960, 540), 25.0


def main() -> None:
    """Print the table."""
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 4.0
    head("flight", "ms a frame", "bare", "ratio")
    for scenario in ("contraction-ideal", "lander"):
        with tempfile.TemporaryDirectory() as folder:
            overrides = [f"duration={duration}", "checks=[]"]
            log = mjspace.run(scenario, overrides=overrides, out=folder).log
            output = Path(folder, "flight.mp4")
            ours = partial(render, log, output, size=SIZE, rate=RATE)
            times = paired(ours, bare_loop(log, output))
        frames = int(duration * RATE) + 1
        each = 1e3 * np.median(times, axis=0) / frames
        row(scenario, *(f"{ms:.1f}" for ms in each), f"{ratio(times):.2f}")


def bare_loop(log: Log, output: Path) -> Run:
    """Return what renders the same instants of the log to the same kind of file."""
    every = round(1.0 / RATE / float(log.metadata["control_period"]))
    states = log.read("/state", ["physics"], every=every)["physics"]
    compressed = log.attachment("model.mjb.gz")

    def run() -> None:
        model = from_mjb(gzip.decompress(compressed))
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


if __name__ == "__main__":
    main()
