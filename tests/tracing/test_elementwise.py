"""Elementwise operations and what is built of them, taken down and run again: NumPy's bits."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import guvectorize
from replaying import assert_replays, values

from mjspace import attitude

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=25, deadline=None)

UNARY = [
    *(np.negative, np.positive, np.abs, np.sqrt, np.square, np.sin, np.cos, np.tan, np.exp),
    *(np.arcsin, np.arccos, np.arctan, np.sinh, np.cosh, np.tanh, np.log, np.log1p, np.expm1),
    *(np.floor, np.ceil, np.trunc, np.rint, np.sign, np.reciprocal, np.cbrt, np.degrees),
    *(np.isfinite, np.isnan, np.signbit, np.logical_not, np.sinc, np.modf),
]
BINARY = [
    *(np.add, np.subtract, np.multiply, np.divide, np.power, np.arctan2, np.hypot, np.copysign),
    *(np.maximum, np.minimum, np.fmax, np.fmin, np.fmod, np.remainder, np.floor_divide, np.divmod),
    *(np.less, np.less_equal, np.greater, np.equal, np.not_equal, np.heaviside, np.nextafter),
    *(np.logical_and, np.logical_or, np.logical_xor),
]
VIEWS: list[Callable[[Any], Any]] = [
    lambda x: x,
    lambda x: x.T,
    lambda x: x[::-1],
    lambda x: x[..., ::2],
    lambda x: x[1:, 1:],
    lambda x: x[:, -1],
    lambda x: x[0, ::-2],
    lambda x: x[2, 1],
    lambda x: x[None, :, None],
    lambda x: np.broadcast_to(x[0], (3, 5)),
    lambda x: np.moveaxis(x[None], 0, -1),
]
views = st.sampled_from(VIEWS)


@given(st.sampled_from(UNARY), views, seeds)
@settings(max_examples=150, deadline=None)
def test_functions_of_one_array(ufunc: Any, view: Any, seed: int) -> None:
    assert_replays(lambda x: ufunc(view(x)), [values(seed, 4, 5)], [values(seed + 1, 4, 5)])


@given(st.sampled_from(BINARY), views, st.integers(0, 4), seeds)
@settings(max_examples=150, deadline=None)
def test_functions_of_two_arrays_that_are_broadcast(
    ufunc: Any, view: Any, other: int, seed: int
) -> None:
    def function(x: Any, y: Any) -> Any:
        one = view(x)
        return ufunc(one, [y[0, 0], y[:1, :1], one, view(y), np.abs(one)][other])

    first, then = ([values(s, 4, 5), values(s + 5, 4, 5)] for s in (seed, seed + 1))
    if ufunc in (np.maximum, np.minimum, np.fmax, np.fmin):
        # Of 0 and -0 either is the larger, by how many NumPy compares at once.
        first, then = ([np.where(x == 0.0, 1.0, x) for x in inputs] for inputs in (first, then))
    assert_replays(function, first, then)


NUMBERS = [0, 1, -1, 2, 3, 0.5, -0.0, 2.0, 1.5, np.float64(2.0), np.int64(3), np.pi, np.inf]
PYTHON = [number for number in NUMBERS if type(number) in (int, float)]
OPERATORS: list[Callable[[Any, Any], Any]] = [
    lambda x, y: x + y,
    lambda x, y: x - y,
    lambda x, y: x * y,
    lambda x, y: x / y,
    lambda x, y: x // y,
    lambda x, y: x % y,
    lambda x, y: x**y,
    lambda x, y: x < y,
    lambda x, y: x >= y,
    lambda x, y: x == y,
]


@given(st.sampled_from(OPERATORS), st.sampled_from(NUMBERS), views, st.booleans(), seeds)
@settings(max_examples=200, deadline=None)
def test_operators_with_a_number_on_either_side(
    operator: Any, number: Any, view: Any, on_the_left: bool, seed: int
) -> None:
    if operator is OPERATORS[6] and isinstance(number, np.generic):
        view = VIEWS[0]  # a power of a number by one of these is not taken down

    def function(x: Any) -> Any:
        return operator(number, view(x)) if on_the_left else operator(view(x), number)

    assert_replays(function, [values(seed, 4, 5)], [values(seed + 1, 4, 5)])


@given(st.sampled_from(OPERATORS), st.sampled_from(PYTHON), st.floats(0.01, 20.0), st.floats(0, 9))
@settings(max_examples=100, deadline=None)
def test_operators_of_the_time_are_those_of_python(
    operator: Any, number: Any, time: float, at_first: float
) -> None:
    if number != 0 or operator in (OPERATORS[0], OPERATORS[2], OPERATORS[6]):  # Python raises
        assert_replays(lambda t: operator(t, number) * 1.0, [at_first], [time])
    if number > 0:  # a power of a negative number may be complex
        assert_replays(lambda t: operator(number, t) * 1.0, [at_first + 0.1], [time])


@pytest.mark.parametrize("exponent", [2, 0.5, -1, 3, 2.0, 1.5])
def test_powers_of_elements_are_those_of_numbers(exponent: float) -> None:
    def function(x: Any) -> Any:
        return np.stack([abs(x[k]) ** exponent for k in range(400)])

    first, then = (np.random.default_rng(seed).normal(size=400) for seed in (1, 2))
    assert_replays(function, [first], [then])
    assert_replays(lambda x: abs(x) ** exponent, [first], [then])

    def of_arrays(x: Any) -> Any:  # of no dimensions
        return np.stack([x[k, ...] ** exponent for k in range(400)])

    assert_replays(of_arrays, [abs(first)], [abs(then)])


MASKS: list[Callable[[Any, Any, Any], Any]] = [
    lambda x, y, m: m & (x > 0.0),
    lambda x, y, m: ~m | (y <= x),
    lambda x, y, m: m ^ True,
    lambda x, y, m: m * x,
    lambda x, y, m: x + m,
    lambda x, y, m: m == (x > y),
    lambda x, y, m: np.where(m, x, y),
    lambda x, y, m: np.where(m, x, 0.5),
    lambda x, y, m: np.where(x > y, 1.0, -1.0),
    lambda x, y, m: np.where(m[0], x[:, :1], y),
    lambda x, y, m: np.where(m, m, x),
    lambda x, y, m: np.where(m[0, 0], x[0, 0], y[1, 1]),
    lambda x, y, m: np.where(True, x, y),
    lambda x, y, m: m.astype(float),
    lambda x, y, m: m[0, 0].astype(float) + x,
    lambda x, y, m: x.astype(float),
    lambda x, y, m: (m.any(axis=1), m.all(axis=0), m.any(), np.all(x), np.any(x, axis=-1)),
    lambda x, y, m: (m.max(axis=0), np.min(m, axis=1), np.mean(m, axis=1)),
    lambda x, y, m: np.zeros_like(m) | m,
    lambda x, y, m: np.clip(x, -1, 1),
    lambda x, y, m: np.clip(x, y, 0.5),
    lambda x, y, m: np.clip(x, None, y[0]),
    lambda x, y, m: np.clip(x[0, 0], -1.0, 1.0),
    lambda x, y, m: x.clip(-2.0, 2.0),
    lambda x, y, m: np.clip(0.3, x, y),
]


@pytest.mark.parametrize("function", MASKS)
@given(seed=seeds)
@few
def test_masks_choices_and_limits(function: Any, seed: int) -> None:
    first, then = (
        [values(s, 3, 4), values(s + 9, 3, 4), values(s + 5, 3, 4) > 0.0] for s in (seed, seed + 1)
    )
    assert_replays(function, first, then)


def _iadd(x: Any, y: Any) -> Any:
    z = x.copy()
    z += y
    z[1:] *= 2
    z[:, 0] -= y[:, 1]
    z **= 2
    return z


def _slices(x: Any, y: Any) -> Any:
    z = np.zeros_like(x)
    z[0] = y[1]
    z[1, :2] = 3
    z[2, 1] = x[0, 0]
    z[..., -1] = y[:, :1].squeeze(-1)
    z[:2, 1:3] = [7.0, 8.0]
    z[None, 1] = y[2:]
    return z


def _alias(x: Any, y: Any) -> Any:
    z = x.copy()
    part = z[1:]
    part += 1.0
    z[1:] = z[:-1]  # they overlap
    z[:, ::-1] = z
    z += z[0]
    return z, part


def _numbers_are_not_shared(x: Any, y: Any) -> Any:
    total = x[0, 0] + 0.0
    before = total
    total += y[0, 0]
    copied = total.copy()
    copied *= 2.0
    total **= 2
    element = x[1, 1]
    element -= 1.0
    return before, total, copied, element, x[1, 1] + 0.0


def _out(x: Any, y: Any) -> Any:
    z = np.empty_like(x)
    np.multiply(x, y, out=z)
    np.add(z, y[0], out=z)
    np.sqrt(z[0], out=z[1])
    w = np.full_like(x, y[0, 0])
    np.arctan2(w, x, w)
    return z, w


@pytest.mark.parametrize("function", [_iadd, _slices, _alias, _numbers_are_not_shared, _out])
@given(seed=seeds)
@few
def test_writing_into_arrays(function: Any, seed: int) -> None:
    first, then = ([values(s, 3, 4), values(s + 5, 3, 4)] for s in (seed, seed + 1))
    assert_replays(function, first, then)


@guvectorize(["void(f8[:], f8, f8[:], f8[:])"], "(n),()->(n),()")
def _scaled(vector: Any, scale: Any, result: Any, total: Any) -> None:
    total[0] = 0.0
    for i in range(vector.size):
        result[i] = vector[i] * scale
        total[0] += result[i]


@pytest.mark.parametrize(
    "function",
    [
        lambda x, y: _scaled(x, y[:, 0]),
        lambda x, y: _scaled(x[:, ::-1], 2),
        lambda x, y: _scaled(y[0], x),
        lambda x, y: np.vecdot(x, y),
    ],
)
@given(seed=seeds)
@few
def test_generalized_ufuncs(function: Any, seed: int) -> None:
    first, then = ([values(s, 3, 4), values(s + 5, 3, 4)] for s in (seed, seed + 1))
    assert_replays(function, first, then)


@pytest.mark.parametrize(
    "function",
    [
        lambda p, q: attitude.multiply(p, q),
        lambda p, q: attitude.conjugate(p),
        lambda p, q: attitude.normalize(p),
        lambda p, q: attitude.rotate(p, q[..., 1:]),
        lambda p, q: attitude.to_matrix(p),
        lambda p, q: attitude.from_rotation_vector(p[..., 1:]),
        lambda p, q: attitude.to_rotation_vector(p),
        lambda p, q: attitude.from_euler_zyx(p[..., 1:]),
        lambda p, q: attitude.to_euler_zyx(p),
        lambda p, q: attitude.to_mrp(p),
        lambda p, q: attitude.from_mrp(p[..., 1:]),
        lambda p, q: attitude.rotation_angle(p, q),
    ],
)
@given(seed=seeds)
@few
def test_attitude_algebra(function: Any, seed: int) -> None:
    first, then = ([values(s, 2, 4), values(s + 5, 2, 4)] for s in (seed, seed + 1))
    assert_replays(function, first, then)
