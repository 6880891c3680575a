"""What a second of the double-gimbal CMG costs: its cascade of 10 kHz over bare ``mj_step``.

    python benchmarks/dgvscmg_cost.py

``dgvscmg-tracking``, not logged, against the same model stepped as often with nothing around it;
runs are paired as in ``closed_loop.py``.
"""

from collections.abc import Callable
from statistics import median

from closed_loop import bare_batch, bare_steps, flight, seconds

from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

ROUNDS = 15


def main() -> None:
    """Print the table."""
    print(f"{'':24}{'ratio':>8}{'s a vehicle second':>22}{'bare':>10}")
    for count, duration in ((1, 0.2), (64, 0.05)):
        vehicle = assemble(*load("dgvscmg-tracking", ["checks=[]", f"duration={duration}"]))
        steps = round(duration / vehicle.scenario.rates.physics)
        bare = bare_steps(vehicle, steps) if count == 1 else bare_batch(vehicle, count, 1, steps)
        report(f"{count} vehicle{'s'[: count > 1]}", flight(vehicle, count), bare, count * duration)


def report(name: str, run: Callable[[], object], bare: Callable[[], object], flown: float) -> None:
    """Print how much longer ``run`` takes than ``bare``, and both for each of ``flown`` seconds."""
    run(), bare()
    pairs = [(seconds(run), seconds(bare)) for _ in range(ROUNDS)]
    ratio = median(a / b for a, b in pairs)
    least, alone = (min(column) / flown for column in zip(*pairs, strict=True))
    print(f"{name:24}{ratio:8.2f}{least:22.3f}{alone:10.3f}")


if __name__ == "__main__":
    main()
