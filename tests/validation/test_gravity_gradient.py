"""Libration by a second route: Newton's orbit and Euler's equations in inertial axes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.constants import GM
from mjspace.validation.benchmarks import debra_delp
from mjspace.validation.benchmarks.gravity_gradient import (
    INERTIA,
    ORBIT,
    RATE,
    RELEASE,
    eigenvalues,
    exact_libration,
    lvlh,
    orbital_rate,
    roll_yaw_frequencies,
    swing_period,
)

RADIUS = ORBIT.semi_major_axis
START = lvlh(np.zeros(1))[0]


def in_inertial_axes(inertia: Array, released: Array, duration: float) -> tuple[Array, Array]:
    """Return the rotation vector [rad] from LVLH and the rate in LVLH [rad/s], ``duration`` on."""

    def motion(_: float, state: Array) -> Array:
        place, velocity, q, w = state[:3], state[3:6], state[6:10], state[10:]
        up = attitude.to_matrix(q).T @ place / RADIUS
        torque = 3.0 * GM["earth"] / RADIUS**3 * np.cross(up, inertia * up)
        return np.concatenate(
            [
                velocity,
                -GM["earth"] * place / np.linalg.norm(place) ** 3,
                0.5 * attitude.multiply(q, np.append(0.0, w)),
                (torque - np.cross(w, inertia * w)) / inertia,
            ]
        )

    forward, _, down = attitude.to_matrix(START).T
    q = attitude.from_rotation_vector(released[:3])
    spin = released[3:] + orbital_rate(q)
    start = [-RADIUS * down, RADIUS * RATE * forward, attitude.multiply(START, q), spin]
    end = solve_ivp(
        motion, (0.0, duration), np.concatenate(start), "DOP853", rtol=1e-13, atol=1e-15
    ).y[:, -1]
    relative = attitude.multiply(attitude.conjugate(lvlh(np.array([duration]))[0]), end[6:10])
    return attitude.to_rotation_vector(relative), end[10:] - orbital_rate(relative)


def test_libration_is_that_of_newton_and_euler_in_inertial_axes() -> None:
    wanted, _ = in_inertial_axes(INERTIA, np.concatenate([RELEASE, np.zeros(3)]), 5700.0)
    found = attitude.to_rotation_vector(exact_libration(RELEASE, np.array([0.0, 5700.0])))[-1]
    # two integrations at 1e-13; 6e-14 measured
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-12)


def test_frequencies_and_periods_are_the_known_ones() -> None:
    np.testing.assert_allclose(roll_yaw_frequencies(), [0.6151034284, 1.7809120619], atol=1e-10)
    assert 2.0 * np.pi / swing_period(0.0) / RATE == pytest.approx(1.2247448714, abs=1e-10)
    assert swing_period(0.0) == pytest.approx(4654.0305, abs=1e-4)
    assert swing_period(np.radians(30.0)) == pytest.approx(4994.6218, abs=1e-4)


def test_period_of_a_wide_swing_is_where_the_pitch_comes_back() -> None:
    period = swing_period(np.radians(30.0))
    release = np.array([0.0, np.radians(30.0), 0.0])
    q = exact_libration(release, np.array([0.0, 0.25 * period, 0.5 * period]))
    pitch = attitude.to_rotation_vector(q)[:, 1]
    # at some 7e-4 rad/s 1e-12 rad are 2e-9 s; 1e-14 rad measured
    assert abs(pitch[1]) < 1e-12
    assert pitch[2] == pytest.approx(-np.radians(30.0), abs=1e-12)


@pytest.mark.parametrize("shape", [(0.5, 0.4), (0.8, 0.9), (-0.04, -0.9), (-0.1, -0.9)])
def test_linear_motion_is_that_of_small_angles(shape: tuple[float, float]) -> None:
    inertia = debra_delp.inertia(*shape)
    begin = 1e-5 * np.array([1.0, 1.0, 1.0, RATE, -RATE, RATE])
    duration = 1000.0
    # the odd part of the motion: what is not linear is 1e-10 of it; 5e-15 measured
    ends = [np.concatenate(in_inertial_axes(inertia, s * begin, duration)) for s in (1.0, -1.0)]
    scale = np.array([1.0, 1.0, 1.0, RATE, RATE, RATE])
    found = 0.5 * (ends[0] - ends[1]) / scale
    wanted = expm(duration * debra_delp.linear(inertia)) @ begin / scale
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-13)


def test_eigenvalues_are_found_in_the_motion() -> None:
    A = np.array([[0.0, 1.0, 0.0], [-4.0, 0.2, 0.0], [1.0, 0.0, -0.5]])
    states = np.array([expm(0.1 * k * A) @ [1.0, 0.5, 0.2] for k in range(40)])
    found = np.sort_complex(eigenvalues(states, 0.1))
    np.testing.assert_allclose(found, np.sort_complex(np.linalg.eigvals(A)), atol=1e-12)


def test_regions_are_where_no_eigenvalue_grows() -> None:
    shapes = np.random.default_rng(5).uniform(-1.0, 1.0, (1000, 2))
    for shape in shapes:
        fastest = np.linalg.eigvals(debra_delp.linear(debra_delp.inertia(*shape))).real.max()
        # a double root is good to the square root of rounding
        assert debra_delp.stable(*shape) == (fastest < 1e-6 * RATE), shape


def test_regions_have_their_known_areas() -> None:
    middles = (np.arange(-250, 250) + 0.5) / 250.0
    inside = [(k1 > 0.0, debra_delp.stable(k1, k3)) for k1 in middles for k3 in middles]
    lagrange = sum(right and held for right, held in inside) / 250.0**2
    other = sum(held and not right for right, held in inside) / 250.0**2
    # a square of the grid either way along the borders
    assert lagrange == pytest.approx(0.5, abs=0.004)
    assert other == pytest.approx(0.0794, abs=0.001)
