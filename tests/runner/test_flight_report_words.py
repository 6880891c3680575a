"""What a check claims, in words."""

from typing import Any

import pytest

from mjspace.runner.flight_report import _claim
from mjspace.scenario.scenario import Check


@pytest.mark.parametrize(
    ("keys", "claim"),
    [
        ({}, "max of truth.rate"),
        ({"start": 2.0}, "max of truth.rate, from 2 s on"),
        ({"start": 2.0, "end": 3.0}, "max of truth.rate, from 2 s to 3 s"),
        ({"start": 2.0, "end": 2.0}, "max of truth.rate, at 2 s"),
        ({"end": 3.0}, "max of truth.rate, to 3 s"),
        ({"since": "on"}, "max of truth.rate, after 'on'"),
        ({"since": "on", "start": 1.0}, "max of truth.rate, from 1 s on after 'on'"),
        ({"until": "off"}, "max of truth.rate, until 'off'"),
        ({"statistic": "final", "start": 1.0}, "final of truth.rate"),
        ({"target": 2.0, "relative": True}, "max of truth.rate less 2.0, relative"),
    ],
)
def test_the_window_is_told(keys: dict[str, Any], claim: str) -> None:
    check = Check.model_validate({"name": "x", "signal": "truth.rate", "below": 1.0} | keys)
    assert _claim(check) == claim
