"""The truth of the lander benchmarks, by second routes."""

from importlib.resources import files
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.validation.benchmarks import lander_contact as lander

LANDER = Path(str(files("mjspace.assets"))) / "validation" / "lander.xml"


def test_heave_meets_an_integration_of_the_equation_of_motion() -> None:
    hull = lander.MASS - 4.0 * lander.FOOT

    def slope(_: float, state: Array) -> list[float]:
        height, speed = state
        push = -4.0 * (lander.STIFFNESS * height + lander.DAMPING * speed)
        return [speed, push / hull - lander.GRAVITY]

    times = lander.TOUCHDOWN + np.linspace(0.0, 1.0, 30)
    begin = [0.0, -np.sqrt(2.0 * lander.GRAVITY * lander.DROP)]
    span = (times[0], times[-1])
    solved = solve_ivp(slope, span, begin, "DOP853", t_eval=times, rtol=1e-13, atol=1e-15).y
    # 1e-13 a step of DOP853, some hundred steps.
    np.testing.assert_allclose(solved[0], lander.exact_height(times), atol=1e-12)


def test_fall_and_rest_are_those_of_the_moon() -> None:
    heights = lander.exact_height(np.array([0.0, lander.TOUCHDOWN, 100.0]))
    rest = -97.0 * 1.62 / 10_000.0
    # The touchdown is a root; rest is a long time after.
    np.testing.assert_allclose(heights, [0.1, 0.0, rest], atol=1e-15)


def test_feet_stay_on_the_ground_in_the_closed_form() -> None:
    # It holds while no strut pulls harder than its foot is heavy.
    times = lander.TOUCHDOWN + np.linspace(0.0, 2.0, 2001)
    height = lander.exact_height(times)
    speed = np.gradient(height, times)
    push = -lander.STIFFNESS * height - lander.DAMPING * speed
    assert push.min() > -lander.FOOT * lander.GRAVITY


def test_lander_has_the_paper_s_mass_and_inertia_in_all() -> None:
    model = mujoco.MjModel.from_xml_path(str(LANDER))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    whole = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, whole)
    # Rounding of a hundred; J = diag(100, 90, 80) with the paper's x upwards, our z.
    np.testing.assert_allclose(
        whole[:6, :6], np.diag([100.0, 100.0, 100.0, 90.0, 80.0, 100.0]), atol=1e-12
    )
    np.testing.assert_allclose(data.geom("leg_1_pad").xpos, [0.0, 1.3, 0.06], atol=1e-15)


@pytest.mark.parametrize("leg", range(4))
def test_feet_are_where_the_benchmark_has_them(leg: int) -> None:
    model = mujoco.MjModel.from_xml_path(str(LANDER))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ball = lander.FEET[leg] + [0.0, 0.0, lander.SOLE]
    np.testing.assert_allclose(data.geom(f"leg_{leg}_pad").xpos, ball, atol=1e-15)
