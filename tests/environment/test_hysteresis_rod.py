"""Hysteresis rods: the model's own equation, its loops' areas, and the energy that they take."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_flights import assembly, assert_same, flown
from pydantic import ValidationError
from scipy.integrate import quad, solve_ivp

from mjspace.contract import Array
from mjspace.environment.hysteresis_rod import HysteresisRod, lags_after
from mjspace.environment.orbit import Orbit
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

ROD = HysteresisRod(
    axis=[0, 2, 0], volume=1e-4, coercivity=12.0, remanence=0.004, saturation=0.025, reversible=0.1
)
SPIN = """
description = "A ball turns about an axis across a field that stands still"
duration = "252 s"
[rates]
physics = "{step} s"
control = "{step} s"
[plant]
gyrostat_inertia = [[10, 0, 0], [0, 10, 0], [0, 0, 10]]
[initial]
rate = [0.1, 0, 0]
[environment.orbit]
semi_major_axis = "7000 km"
[environment.magnetic_field]
tilt = 0
[[environment.hysteresis_rods]]
axis = [0, 2, 0]
volume = 1e-4
coercivity = 12
remanence = 0.004
saturation = 0.025
reversible = 0.1
[reference]
kind = "references:Hold"
[law]
kind = "coast:Coast"
"""


def along(rod: HysteresisRod, fields: Array) -> Array:
    """Return the flux density [T] after each of the ``fields`` [A/m], from none."""
    loops, lag, now, found = np.array([[rod.coercivity, rod.rate]]), np.zeros(1), 0.0, []
    for field in fields:
        lag = lags_after.ufunc(lag, np.array([field - now]), loops)
        now = field
        found.append(rod.flux_density(np.array([now]), lag)[0])
    return np.array(found)


def test_it_solves_the_papers_equation() -> None:
    # dB/dH = Q (2/pi) k Bs cos^2(pi B / 2 Bs), Q = q + (1 - q) ((H - H_left) / 2 Hc)^2 upwards, as
    # Flatley and Henretty write it, integrated from one turn of the field to the next.
    k, top = ROD.steepness, ROD.saturation

    def slope(sign: float, field: float, flux: Array) -> Array:
        middle = np.tan(0.5 * np.pi * flux / top) / k
        f = (sign * (field - middle) + ROD.coercivity) / (2.0 * ROD.coercivity)
        part = ROD.reversible + (1.0 - ROD.reversible) * f**2
        return part * 2.0 / np.pi * k * top * np.cos(0.5 * np.pi * flux / top) ** 2

    turns, flux, expected = [0.0, 20.0, -7.0, 15.0, -30.0, 1.0], np.zeros(1), []
    for begin, end in pairwise(turns):
        sign = math.copysign(1.0, end - begin)
        path = solve_ivp(
            lambda h, b, sign=sign: slope(sign, h, b), (begin, end), flux, "DOP853",
            rtol=1e-11, atol=1e-15,
        )  # fmt: skip
        flux = path.y[:, -1]
        expected.append(flux[0])
    np.testing.assert_allclose(along(ROD, np.array(turns[1:])), expected, rtol=1e-8)
    # a change in parts is the change as a whole
    parts = np.concatenate([np.linspace(a, b, 8)[1:] for a, b in pairwise(turns)])
    np.testing.assert_allclose(along(ROD, parts)[6::7], expected, rtol=1e-8)


def area(rod: HysteresisRod, largest: float) -> float:
    """Return what the closed loop between the fields -largest and ``largest`` encloses [J/m^3].

    Upwards f = (f0 + t) / (1 + f0 t), t = tanh((H + largest) rate), and the loop is its own image
    through the origin: the lag is -y Hc below and y Hc above, with t y^2/4 - y + 3 t/4 = 0.
    """
    t = math.tanh(2.0 * largest * rod.rate)
    y = (1.0 - math.sqrt(1.0 - 0.75 * t * t)) * 2.0 / t

    def upwards(field: float) -> float:
        t, f0 = math.tanh((field + largest) * rod.rate), 0.5 - 0.5 * y
        lag = rod.coercivity * (2.0 * (f0 + t) / (1.0 + f0 * t) - 1.0)
        return float(rod.flux_density(np.array(field), np.array(lag)))

    return quad(lambda h: -upwards(-h) - upwards(h), -largest, largest, epsabs=1e-12)[0]


def test_the_saturated_loop_encloses_four_times_coercivity_and_saturation() -> None:
    steep = HysteresisRod(
        axis=[1, 0, 0], volume=1e-7, coercivity=1.0, remanence=0.95, saturation=1.0
    )
    # tails of the arc tangent beyond 1e4 Hc: 2 x 2/pi x 1/(k H) each way, 5e-5 of it
    assert area(steep, 1e4) == pytest.approx(4.0, rel=2e-3)
    field = 1e3 * np.sin(np.linspace(0.0, 6.0 * np.pi, 600_001))
    turn = np.trapezoid(along(steep, field)[400_000:], field[400_000:])
    assert -turn == pytest.approx(area(steep, 1e3), rel=1e-3)


def spin(folder: Path, step: float) -> dict[str, Any]:
    (folder / "spin.toml").write_text(SPIN.format(step=step))
    return flown(assemble(*load(folder / "spin.toml"))).rows


def test_a_turn_costs_the_loops_area_times_the_volume(tmp_path: Path) -> None:
    rows = spin(tmp_path, 0.25)
    time, energy = rows["time"][:, 0], rows["/truth.energy"][:, 0, 0]
    rate = rows["/truth.rate"][:, 0, 0]
    turned = np.concatenate([[0.0], np.cumsum(0.125 * (rate[1:] + rate[:-1]))])
    assert time[-1] == 252.0
    largest = rows["/truth.rod_field"].max()
    left = np.interp(2.0 * np.pi * np.arange(1.0, 4.0), turned, energy)
    # the second turn to the third: the first is not closed yet; 3e-4 off as measured
    assert left[1] - left[2] == pytest.approx(area(ROD, largest) * ROD.volume, rel=1e-3)


def test_its_error_is_of_second_order_in_the_step(tmp_path: Path) -> None:
    energies = [spin(tmp_path, step)["/truth.energy"][:, 0, 0] for step in (4.0, 2.0, 0.5)]
    lost = [energy[0] - energy[-1] for energy in energies]
    coarse, fine = abs(lost[0] - lost[2]), abs(lost[1] - lost[2])
    assert fine < 0.5 * coarse
    assert fine < 1e-2 * lost[2]


def test_a_batch_flies_as_one_and_a_log_is_flown_again(tmp_path: Path) -> None:
    (tmp_path / "spin.toml").write_text(SPIN.format(step=2.0))
    built = assemble(*load(tmp_path / "spin.toml"))
    many = flown(built, (0, 1))
    assert many.bits(0) == many.bits(1) == flown(built).bits(0)
    assert verify(run(tmp_path / "spin.toml", out=tmp_path / "x").log) is None


@pytest.mark.usefixtures("short_blocks")
def test_compiled_it_is_what_python_flies() -> None:
    built = assembly("passive-magnetic", "duration=600", "rates.physics='0.5 s'")
    compiled = flown(built, (0, 1))
    assert "hysteresis" in compiled.compiled
    assert_same(compiled, flown(built, (0, 1), compiled=False))


def test_what_is_no_rod_is_refused() -> None:
    table = ROD.model_dump()
    with pytest.raises(ValidationError, match=r"remanence: got 0.03 T, should be below the satur"):
        HysteresisRod(**table | {"remanence": 0.03})
    with pytest.raises(ValidationError, match=r"hysteresis_rods: needs an \[environment.magnetic"):
        Environment(orbit=Orbit(semi_major_axis=7e6), hysteresis_rods=[table])
