"""Reductions, products of matrices and moves of elements, run again: NumPy's bits."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from replaying import assert_replays, replayed, values

from mjspace.tracing.inner_loops import Untraceable

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=20, deadline=None)

REDUCTIONS = [np.sum, np.max, np.min, np.prod, np.any, np.all, np.mean]
LAYOUTS: list[Callable[[Any], Any]] = [
    lambda x: x,
    lambda x: x.T,
    lambda x: x.T * 1.0,  # laid out as its operand is
    lambda x: np.swapaxes(x, -1, -2) * 1.0,
    lambda x: x[..., ::-1],
    lambda x: x[::-1] if x.ndim else x,
    lambda x: x[..., ::2],
    lambda x: x[..., None],
    lambda x: np.moveaxis(x, 0, -1),
    lambda x: np.stack([x, x * 2.0], axis=-1),
    lambda x: np.concatenate([x, x], axis=0),
]


@st.composite
def reductions(draw: Any) -> tuple[Any, ...]:
    length = draw(st.integers(1, 40))
    shape = draw(
        st.sampled_from(
            [(length, 3), (3, length), (1, length), (length, 1), (2, length, 3), (2, 2, length)]
        )
    )
    layout = draw(st.sampled_from(LAYOUTS))
    result = layout(np.zeros(shape))
    axis = draw(st.one_of(st.none(), st.integers(-result.ndim, result.ndim - 1)))
    return shape, layout, axis, draw(st.booleans())


@given(st.sampled_from(REDUCTIONS), reductions(), seeds)
@settings(max_examples=120, deadline=None)
def test_reductions_add_up_in_numpys_order(function: Any, case: Any, seed: int) -> None:
    shape, layout, axis, keepdims = case

    def reduced(x: Any) -> Any:
        return function(layout(x), axis=axis, keepdims=keepdims)

    first, then = (values(s, *shape, special=0.02) for s in (seed, seed + 1))
    try:
        replayed(reduced, [first], [first])
    except Untraceable:
        assert axis is None  # several axes of another layout, whose order is not known
        return
    assert_replays(reduced, [first], [then])
    assert_replays(reduced, [np.zeros(shape)], [then])  # at first no order shows


@pytest.mark.parametrize(
    "function",
    [
        lambda x: np.sum(x),
        lambda x: np.sum(x, axis=(1, 2)),
        lambda x: np.sum(x, axis=(-1, -2), keepdims=True),
        lambda x: x.sum(axis=(0, 1, 2)),
        lambda x: x[0, 0, 0].sum(),
        lambda x: x[0, 0, :1].sum(),
        lambda x: x[:, :0].sum(axis=1),
        lambda x: x[:, 0:1].max(axis=1),
        lambda x: np.add.reduce(x, axis=1),
        lambda x: np.multiply.reduce(x[0, 0]),
        lambda x: np.logical_and.reduce(x[0] > 0.0),
        lambda x: (x > 0.0).mean(axis=-1),
        lambda x: x.mean(axis=(1, 2)),
        lambda x: np.linalg.norm(x, axis=-1),
        lambda x: np.linalg.norm(x, axis=0, keepdims=True),
        lambda x: np.linalg.norm(x[0], axis=(0, 1)),
        lambda x: np.linalg.norm(x[0, 0]),
        lambda x: np.linalg.norm(x[:, 1, 2]),
        lambda x: np.linalg.norm(x > 0.0, axis=-1),
    ],
)
@given(seed=seeds)
@few
def test_other_reductions(function: Any, seed: int) -> None:
    assert_replays(function, [values(seed, 3, 4, 9)], [values(seed + 1, 3, 4, 9)])


@given(st.integers(1, 9), st.integers(1, 9), st.integers(1, 9), st.integers(0, 8), seeds)
@settings(max_examples=150, deadline=None)
def test_products_of_matrices(n: int, k: int, m: int, case: int, seed: int) -> None:
    product: Callable[[Any, Any], Any] = [
        lambda a, b: a @ b,
        lambda a, b: a[0] @ b[0],
        lambda a, b: a[0, 0] @ b[0],
        lambda a, b: a[0] @ b[0, :, 0],
        lambda a, b: a[0, 0] @ b[0, :, 0],
        lambda a, b: a[0] @ b,
        lambda a, b: a @ a.transpose(0, 2, 1),
        lambda a, b: a[0] @ a[0].T,
        lambda a, b: np.matmul(b.transpose((0, 2, 1)), a.transpose(0, 2, 1))[:, ::-1],
    ][case]
    first, then = ([values(s, 2, n, k), values(s + 7, 2, k, m)] for s in (seed, seed + 1))
    assert_replays(product, first, then)


MOVES: list[Callable[[Any, Any], Any]] = [
    lambda x, y: np.concatenate([x, y]),
    lambda x, y: np.concatenate((x[:, :1], [[1], [2], [3]], y), axis=-1),
    lambda x, y: np.stack([x, y], axis=1),
    lambda x, y: np.stack([x[0, 0], 1.0, y[1, 1], -0.0]),
    lambda x, y: np.stack([np.stack([x[0], y[0]]), y[1:]]),
    lambda x, y: np.hstack([x, y]),
    lambda x, y: np.vstack([x[0], y]),
    lambda x, y: np.column_stack([x[:, 0], y]),
    lambda x, y: np.take(x, [2, 0, 0], axis=-1),
    lambda x, y: x.take(1, axis=0),
    lambda x, y: np.moveaxis(x[None], 0, -1),
    lambda x, y: np.repeat(x, 2, axis=0),
    lambda x, y: x.repeat([1, 0, 2], axis=0),
    lambda x, y: np.tile(x, (2, 1)),
    lambda x, y: np.roll(x, 1, axis=-1),
    lambda x, y: np.roll(x, (1, 2), axis=(0, 1)),
    lambda x, y: np.flip(x, axis=0),
    lambda x, y: np.broadcast_to(x[0], (2, 3, 4)),
    lambda x, y: np.expand_dims(x, 1),
    lambda x, y: x[:, None, 0, ..., None],
    lambda x, y: x.reshape(4, 3),
    lambda x, y: x.reshape((2, -1)),
    lambda x, y: x.T.reshape(-1),
    lambda x, y: x.T.ravel(),
    lambda x, y: np.squeeze(x[:1]),
    lambda x, y: x.transpose(),
    lambda x, y: np.diagonal(x),
    lambda x, y: np.atleast_2d(x[0]),
    lambda x, y: np.copy(x.T) * 1.0,
    lambda x, y: x[[2, 0]],
    lambda x, y: x[:, [0, 0, 3]],
    lambda x, y: x[[0, 1], [3, 2]],
    lambda x, y: x[np.array([[0, 1], [2, 0]]), 1],
    lambda x, y: x[..., np.array([True, False, True, False])],
    lambda x, y: x[..., [0, 3]].sum(axis=0),
    lambda x, y: np.stack([row[::-1] for row in x]),
    lambda x, y: np.stack([a for row in zip(x[0], y[1], strict=True) for a in row]),
    lambda x, y: np.cross(x[:, :3], y[0, 1:]),
    lambda x, y: np.cross([0.0, 0.0, 1.0], x[:, 1:]),
    lambda x, y: np.outer(x[0], y[:, 1:]),
    lambda x, y: np.outer([1.0, -2.0], x.T),
    lambda x, y: np.dot(x[1], y[2]) + np.dot(2.0, x[0]),
    lambda x, y: np.concatenate([x > 0.0, y > x]),
    lambda x, y: np.concatenate([x > 0.0, y]),
    lambda x, y: (np.zeros_like(x) + x.shape[0] + np.size(y) + len(x), np.ones_like(x[0])),
    lambda x, y: np.full_like(x, y[1, 2]) * np.ndim(x),
    lambda x, y: min([x[0, 0]]) + sum(x[0]) + abs(y[0, 0]),
]


@pytest.mark.parametrize("function", MOVES)
@given(seed=seeds)
@few
def test_moves_of_elements(function: Any, seed: int) -> None:
    first, then = ([values(s, 3, 4), values(s + 5, 3, 4)] for s in (seed, seed + 1))
    assert_replays(function, first, then)


STEPS: list[Callable[[Any, Any], Any]] = [
    lambda x, y: x + y,
    lambda x, y: x * y.T.copy().T,
    lambda x, y: x - y.mean(axis=0),
    lambda x, y: np.where(x > y, x, -y),
    lambda x, y: (x @ y)[::-1],
    lambda x, y: np.clip(x, -1.0, abs(y)).T,
    lambda x, y: np.stack([x[0], y[1], x[2]]),
    lambda x, y: x / (1.0 + y**2),
    lambda x, y: np.cross(x, y),
    lambda x, y: x + np.linalg.norm(y, axis=-1, keepdims=True),
    lambda x, y: np.concatenate([y[1:], x[:1]]),
    lambda x, y: np.sum(x[:, None] * y, axis=-1),
    lambda x, y: np.tanh(x) * np.sin(y),
    lambda x, y: x + y[0, 0] ** 2,
]


@given(st.lists(st.sampled_from(STEPS), min_size=2, max_size=6), seeds)
@settings(max_examples=80, deadline=None)
def test_programs_of_several_steps(steps: Any, seed: int) -> None:
    def program(x: Any, y: Any) -> Any:
        for step in steps:
            x, y = step(x, y), x
        return x, y

    first = [values(seed + k, 3, 3, special=0.0) for k in (0, 1)]
    assert_replays(program, first, [values(seed + k, 3, 3) for k in (2, 3)])
