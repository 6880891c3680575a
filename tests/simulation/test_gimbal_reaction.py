"""Why the paper's gimbal gain of 14 is lost at short control periods: the nozzle's reaction.

A nozzle that turns pushes the hull the other way, and the law reads the hull's rate. Two bodies on
one axis, the gimbal's servo in each integration step and the law in each control period say whether
the loop is stable, and the flights of ``lander-paper`` agree.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from mjspace.log.reader import Log
from mjspace.runner.run import run

STEP, THRUST, LEVER = 0.002, 160.0, 1.0
HULL, NOZZLE, ARM, OWN = 90.0, 1.5, 0.15, 0.02  # kg m^2, kg, m, kg m^2: assets/lander, about x
RATE_GAIN = 30.0  # of lander-paper's gimbals [N m s/rad]


def largest(period: float, lag: float, gain: float, nozzle: float = 1.0) -> complex:
    """Return the eigenvalue of largest size of the gimbal's loop over a control ``period`` [s].

    ``lag`` [s] is the servo's, ``gain`` [s] the law's from rate to gimbal angle, ``nozzle`` a
    factor on the nozzle's inertia. The state is the hull's rate, the nozzle's angle on it and that
    one's rate.
    """
    about = nozzle * (OWN + NOZZLE * ARM**2)
    coupling = about + nozzle * NOZZLE * ARM * LEVER
    mass = np.array([[HULL, coupling], [coupling, about]])
    motion = np.zeros((4, 4))
    motion[[0, 2], 1] = np.linalg.solve(mass, [-THRUST * LEVER, 0.0])
    motion[1, 2] = 1.0
    motion[[0, 2], 3] = np.linalg.solve(mass, [0.0, 1.0])  # by the motor, whose torque is held
    held = expm(motion * STEP)
    drive = nozzle * RATE_GAIN
    step = held[:3, :3] + held[:3, 3:] @ [[0.0, -drive / lag, -drive]]
    pushed, goes_on = np.zeros((3, 1)), np.eye(3)
    for _ in range(round(period / STEP)):
        pushed = step @ pushed + held[:3, 3:] * drive / lag
        goes_on = step @ goes_on
    values = np.linalg.eigvals(goes_on + pushed @ [[gain, 0.0, 0.0]])
    return complex(values[np.argmax(np.abs(values))])


def test_at_20_ms_it_is_on_the_edge_and_changes_its_sign_in_each_period() -> None:
    assert largest(0.02, 0.01, 14.0) == pytest.approx(-0.991, abs=1e-3)


@pytest.mark.parametrize("period", [0.016, 0.01, 0.004, 0.002])
@pytest.mark.parametrize("lag", [0.01, 0.034, 0.05])
def test_shorter_periods_are_unstable_and_would_not_be_with_a_nozzle_without_mass(
    period: float, lag: float
) -> None:
    assert largest(period, 0.01, 14.0).real < -1.3
    assert abs(largest(period, lag, 14.0, nozzle=1e-3)) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("period", "lag", "share"),
    [
        *((0.02, 0.01, 1.0), (0.01, 0.01, 1.0), (0.004, 0.01, 0.35)),
        *((0.004, 0.034, 1.0), (0.004, 0.045, 1.0), (0.002, 0.05, 1.0)),
    ],
)
def test_flights_oscillate_where_the_loop_is_unstable(
    period: float, lag: float, share: float, tmp_path: Path
) -> None:
    overrides = [f"rates.control={period}", f"plant.engine.gimbal_lag={lag}", "duration=10"]
    overrides += [f"law.loop_share=[1, {share}, 1]", "checks=[]", "events=[]"]
    run("lander-paper", overrides=overrides, out=tmp_path)
    rate = Log(tmp_path / "flight.mcap").read("/truth", ["gimbal_rate"])["gimbal_rate"][:, 1]
    late = np.sqrt(np.mean(rate[len(rate) // 2 :] ** 2))
    if abs(largest(period, lag, 14.0 * share)) > 1.0:
        assert late > 50.0  # rad/s; 84 to 381 measured
    else:
        assert late < 3.0  # 2.4 on the edge, at 20 ms; 1e-4 measured otherwise
