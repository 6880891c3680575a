"""Writes docs/allan_deviation.png: the Allan deviation of gyros of a satellite at rest.

Usage: python tools/allan_deviation.py

A flight of four hours at 10 Hz, of a gyro with white noise, one whose bias walks, one whose bias is
a Gauss-Markov process, and one with all three. The lines are what the data sheet's numbers say.
"""

from collections.abc import Callable
from pathlib import Path

import allantools
import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mjspace.contract import Array
from mjspace.plotting.style import COLORS, STYLE
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

PICTURE = Path(__file__).parents[1] / "docs/allan_deviation.png"
PERIOD = 0.1
"""s, of samples."""
DENSITY = np.radians(0.15) / 60.0
"""Angular random walk, rad/s/sqrt(Hz): 0.15 deg/sqrt(h)."""
WALK = np.radians(20.0) / 3600.0 / 60.0
"""Rate random walk, rad/s/sqrt(s): 20 deg/h/sqrt(h)."""
INSTABILITY, TIME = np.radians(5.0) / 3600.0, 20.0
"""Of the Gauss-Markov bias: rad/s (5 deg/h), and s."""
ERRORS = {
    "noise": "noise_density='0.15 deg/sqrt(h)'",
    "walk": "bias_walk='20 deg/h/sqrt(h)'",
    "markov": "bias_instability='5 deg/h',correlation_time=20",
    "all": "noise_density='0.15 deg/sqrt(h)',bias_walk='20 deg/h/sqrt(h)',"
    "bias_instability='5 deg/h',correlation_time=20",
}
"""Of each gyro, as its table has them."""
MULTIPLES = tuple(2**k for k in range(13))
"""Samples in a cluster."""


def of_noise(tau: Array) -> Array:
    """Return the Allan variance of white noise at ``tau`` [s] (IEEE Std 952-1997, C.1.1)."""
    return DENSITY**2 / tau


def of_walk(tau: Array) -> Array:
    """Return that of the rate random walk as sampled, K^2 tau / 3 of many samples (C.1.4)."""
    count = tau / PERIOD
    return WALK**2 * PERIOD * (2.0 * count**2 + 1.0) / (6.0 * count)


def of_markov(tau: Array) -> Array:
    """Return that of the Gauss-Markov bias as sampled: variance less covariance of two clusters.

    Of many samples in TIME it is that of C.1.6.
    """
    count, kept = tau / PERIOD, np.exp(-PERIOD / TIME)
    lost = 1.0 - kept**count
    variance = count * (1.0 - kept**2) - 2.0 * kept * lost - kept * lost**2
    return INSTABILITY**2 * variance / (count * (1.0 - kept)) ** 2


EXPECTED: dict[str, Callable[[Array], Array]] = {
    "noise": of_noise,
    "walk": of_walk,
    "markov": of_markov,
    "all": lambda tau: of_noise(tau) + of_walk(tau) + of_markov(tau),
}
"""The Allan variance of each gyro [rad^2/s^2]."""


def still(duration: float) -> dict[str, Array]:
    """Return what each gyro of a satellite at rest reports for ``duration`` [s], (n, 3) [rad/s]."""
    gyros = [f"sensors.{name}={{measures='rate',{table}}}" for name, table in ERRORS.items()]
    rest = ("initial.rate=[0,0,0]", "initial.wheel_speed=[]", "plant.wheels.axes=[]")
    timing = (f"duration={duration}", f"rates={{physics={PERIOD},control={PERIOD}}}")
    nothing = ("checks=[]", "events=[]", "law={kind='coast:Coast'}")
    built = assemble(*load("detumble-wheels", [*timing, *rest, *nothing, *gyros]))
    rows = [block.rows for block in fly(built, first_start(built, [0]))]
    assert not any(each["/truth"]["rate"].any() for each in rows)
    return {name: np.concatenate([r["/measurement"][name][:, 0] for r in rows]) for name in ERRORS}


def deviation(rate: Array) -> tuple[Array, Array]:
    """Return (tau [s], overlapping Allan deviation of each axis) of rates (n, 3), (k, 3)."""
    wanted = PERIOD * np.array(MULTIPLES)
    axes = [
        allantools.oadev(rate[:, axis], rate=1.0 / PERIOD, data_type="freq", taus=wanted)
        for axis in range(3)
    ]
    return axes[0][0], np.stack([axis[1] for axis in axes], axis=1)


def interval(deviations: Array, multiple: int, count: int, level: float) -> tuple[Array, Array]:
    """Return the ends of the interval that holds the true deviation with probability ``level``.

    ``deviations`` are of clusters of ``multiple`` samples of ``count``; of white noise and of a
    random walk (Greenhall and Riley 2003, Uncertainty of Stability Variances Based on Finite
    Differences) the wider.
    """
    freedom = min(
        allantools.edf_greenhall(
            alpha=alpha, d=2, m=multiple, N=count + 1, overlapping=True, modified=False
        )
        for alpha in (0, -2)
    )
    ends = [allantools.confidence_interval(each, freedom, ci=level) for each in deviations]
    return np.array([low for low, _ in ends]), np.array([high for _, high in ends])


def draw(reports: dict[str, Array]) -> Figure:
    """Return the figure."""
    degrees_per_hour = np.degrees(1.0) * 3600.0
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    plot = figure.subplots()
    labels = {
        "noise": "white noise, 0.15 deg/sqrt(h)",
        "walk": "random walk, 20 deg/h/sqrt(h)",
        "markov": "Gauss-Markov bias, 5 deg/h, 20 s",
        "all": "all three",
    }
    for color, (name, rate) in zip(COLORS[1:4] + COLORS[:1], reports.items(), strict=True):
        tau, found = deviation(rate)
        fine = np.geomspace(tau[0], tau[-1], 200)
        line = degrees_per_hour * np.sqrt(EXPECTED[name](fine))
        plot.plot(fine, line, color=color, label=labels[name])
        for axis in range(3):
            ends = np.array(
                [
                    [end[0] for end in interval(found[k : k + 1, axis], m, len(rate), 0.683)]
                    for k, m in enumerate(MULTIPLES)
                ]
            )
            middle = found[:, axis]
            bars = np.abs(ends.T - middle)
            plot.errorbar(
                tau * 1.06 ** (axis - 1),
                degrees_per_hour * middle,
                yerr=degrees_per_hour * bars,
                fmt=".",
                markersize=3,
                elinewidth=0.6,
                color=color,
            )
    plot.set(xscale="log", yscale="log", ylim=(0.05, 200.0))
    plot.set_xlabel("cluster time [s]")
    plot.set_ylabel("Allan deviation [deg/h]")
    plot.legend(frameon=False, loc="upper right")
    return figure


if __name__ == "__main__":
    with matplotlib.rc_context(STYLE):
        draw(still(14400.0)).savefig(PICTURE, dpi=150)
