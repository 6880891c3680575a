"""Scenarios with mistakes are flown, or refused in one line."""

import os
import time
import warnings
from itertools import islice

import isolated
import pytest
import scenarios

from mjspace.simulation import mujoco_warnings


@pytest.mark.parametrize("seed", range(4))
def test_no_mistake_in_a_scenario_is_a_traceback(seed: int) -> None:
    mujoco_warnings.silence()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, text in islice(scenarios.cases(seed), 15):
            said = isolated.outcome(lambda text=text: scenarios.attempt(text))
            assert not said, f"{name}: {said}"


def _endless() -> str:
    while True:
        time.sleep(1.0)


def test_an_outcome_names_what_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "SECONDS", 0.3)
    assert isolated.outcome(lambda: "") == ""
    assert "ZeroDivisionError" in isolated.outcome(lambda: str(1 / 0))
    assert isolated.outcome(os.abort) == "crashed by SIGABRT"
    assert isolated.outcome(_endless).startswith("hangs")
    assert "MemoryError" in isolated.outcome(lambda: str(len(bytes(isolated.MEMORY + 2**30))))
