"""Attitude algebra against axioms, finite differences and SciPy."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from mjspace import attitude

ROUNDING = 1e-14  # a few dozen operations on numbers of order one
numbers = st.floats(-1.0, 1.0)
quaternions = (
    arrays(float, 4, elements=numbers)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(lambda q: q / np.linalg.norm(q))
)
vectors = arrays(float, 3, elements=numbers)


def scipy_rotation(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


@settings(deadline=None)
@given(quaternions, quaternions, vectors)
def test_multiply_composes_rotations(p: np.ndarray, q: np.ndarray, v: np.ndarray) -> None:
    both = attitude.rotate(attitude.multiply(p, q), v)
    np.testing.assert_allclose(both, attitude.rotate(p, attitude.rotate(q, v)), atol=ROUNDING)


@settings(deadline=None)
@given(quaternions, vectors)
def test_rotate_and_matrix_agree_with_an_outside_authority(q: np.ndarray, v: np.ndarray) -> None:
    np.testing.assert_allclose(attitude.to_matrix(q), scipy_rotation(q).as_matrix(), atol=ROUNDING)
    np.testing.assert_allclose(attitude.rotate(q, v), scipy_rotation(q).apply(v), atol=ROUNDING)
    back = attitude.rotate(attitude.conjugate(q), attitude.rotate(q, v))
    np.testing.assert_allclose(back, v, atol=ROUNDING)


def test_quarter_turn_about_z_takes_body_x_to_inertial_y() -> None:
    q = attitude.from_euler_zyx(np.array([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(attitude.rotate(q, np.array([1.0, 0, 0])), [0, 1, 0], atol=ROUNDING)


@settings(deadline=None)
@given(quaternions)
def test_from_matrix_inverts_to_matrix_up_to_the_double_cover(q: np.ndarray) -> None:
    back = attitude.from_matrix(attitude.to_matrix(q))
    assert back[0] >= 0.0
    # The longest of four rows is at least half as long as their diagonal allows: no cancellation.
    np.testing.assert_allclose(back * np.copysign(1.0, back @ q), q, atol=ROUNDING)


@pytest.mark.parametrize("q", [*np.eye(4), *(np.eye(4) + 1e-9 * np.ones((4, 4)))])
def test_from_matrix_keeps_digits_at_half_turns(q: np.ndarray) -> None:
    q = q / np.linalg.norm(q)
    back = attitude.from_matrix(attitude.to_matrix(q))
    assert attitude.rotation_angle(q, back) < ROUNDING


@settings(deadline=None)
@given(arrays(float, 3, elements=st.floats(-1.5, 1.5)))
def test_euler_angles_agree_with_an_outside_authority(angles: np.ndarray) -> None:
    q = attitude.from_euler_zyx(angles)
    wanted = Rotation.from_euler("ZYX", angles[::-1]).as_matrix()
    np.testing.assert_allclose(attitude.to_matrix(q), wanted, atol=ROUNDING)
    # Pitch 1.5 rad magnifies rounding by sec(pitch) = 14 in roll and yaw.
    np.testing.assert_allclose(attitude.to_euler_zyx(q), angles, atol=14 * ROUNDING)


def test_euler_quaternion_is_continuous_through_turns() -> None:
    yaw = np.linspace(-5.0, 20.0, 2501)
    q = attitude.from_euler_zyx(np.stack([0.3 * np.sin(yaw), 0.2 * yaw, yaw], axis=-1))
    # A step of 0.01 rad in yaw moves q by less than 0.01; a change of sign would move it by 2.
    assert np.max(np.linalg.norm(np.diff(q, axis=0), axis=-1)) < 0.01


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1.0, 3.0, np.pi - 1e-7, np.pi])
def test_rotation_angle_keeps_its_digits(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    p = attitude.from_euler_zyx(np.array([0.4, -1.0, 2.0]))
    q = attitude.multiply(p, attitude.from_rotation_vector(angle * axis))
    for other in (q, -q):
        # 4 units in the last place of a unit quaternion; an arc cosine would be off by 1e-8.
        assert abs(attitude.rotation_angle(other, p) - angle) < 4 * np.finfo(float).eps + 1e-15


@settings(deadline=None)
@given(arrays(float, 3, elements=st.floats(-1.8, 1.8)))
def test_rotation_vector_goes_there_and_back(vector: np.ndarray) -> None:
    q = attitude.from_rotation_vector(vector)
    wanted = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(attitude.to_matrix(q), wanted, atol=ROUNDING)
    np.testing.assert_allclose(attitude.to_rotation_vector(-q), vector, atol=ROUNDING)


@settings(deadline=None)
@given(quaternions.filter(lambda q: abs(q[0]) > 1e-9))  # at a half turn both sets have length one
def test_mrp_is_the_short_set_of_either_sign(q: np.ndarray) -> None:
    sigma = attitude.to_mrp(q)
    np.testing.assert_allclose(sigma, scipy_rotation(q).as_mrp(), atol=ROUNDING)
    np.testing.assert_allclose(attitude.to_mrp(-q), sigma, atol=ROUNDING)
    assert attitude.rotation_angle(attitude.from_mrp(sigma), q) < ROUNDING


def test_either_mrp_set_is_the_same_attitude() -> None:
    sigma = np.array([0.2, -0.5, 0.1])
    shadow = -sigma / (sigma @ sigma)
    same = attitude.rotation_angle(attitude.from_mrp(sigma), attitude.from_mrp(shadow))
    assert same < ROUNDING


def test_leading_axes_are_carried_and_broadcast() -> None:
    rng = np.random.default_rng(0)
    q = rng.normal(size=(5, 3, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    p, v = q[0, 0], rng.normal(size=(3, 3))
    each = [[attitude.rotate(q[i, j], v[j]) for j in range(3)] for i in range(5)]
    assert np.array_equal(attitude.rotate(q, v), each)
    assert attitude.rotation_angle(q, p).shape == (5, 3)
    one_way = [
        attitude.to_matrix,
        attitude.to_euler_zyx,
        attitude.to_mrp,
        attitude.to_rotation_vector,
        lambda x: attitude.from_mrp(attitude.to_mrp(x)),
        lambda x: attitude.from_matrix(attitude.to_matrix(x)),
    ]
    for function in one_way:
        whole = function(q)
        assert all(np.array_equal(whole[i, j], function(q[i, j])) for i, j in np.ndindex(5, 3))


def test_import_is_light() -> None:
    code = (
        "import sys; import mjspace.attitude;"
        "heavy = {'mujoco', 'scipy', 'numba', 'pydantic'} & set(sys.modules);"
        "sys.exit(bool(heavy) and str(heavy))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_euler_angles_make_up_the_rotation_at_a_pitch_of_90_degrees(pitch: float) -> None:
    for roll, yaw in [(0.0, 0.0), (0.3, -1.2), (2.0, 3.0)]:
        q = attitude.from_euler_zyx(np.array([roll, pitch, yaw]))
        again = attitude.from_euler_zyx(attitude.to_euler_zyx(q))
        # The pitch itself is the arctangent of rounding: half the digits are left.
        assert attitude.rotation_angle(q, again) < 1e-7
