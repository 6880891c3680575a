"""Where an error is said to come from."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mjspace.errors import place_of


def in_python_of_numpy() -> Any:
    return np.linalg.inv(np.zeros((3, 3)))


def in_cython_of_numpy() -> Any:
    return np.random.default_rng().normal(scale=-1.0)


def in_text() -> Any:
    return eval("1 / 0")


@pytest.mark.parametrize("raises", [in_python_of_numpy, in_cython_of_numpy, in_text])
def test_an_error_is_at_the_line_of_the_user_s_that_led_to_it(raises: Callable[[], Any]) -> None:
    with pytest.raises((ArithmeticError, ValueError)) as caught:
        raises()
    line = raises.__code__.co_firstlineno + 1
    assert place_of(caught.value) == f"test_errors.py:{line}"
