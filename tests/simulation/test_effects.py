"""When the stepper calls the hooks of a step effect."""

from typing import ClassVar

import pytest

from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.vehicle.step_effect import Instant, State, StepEffect

SHORT = ["duration=0.02", "checks=[]", "rates.physics=0.001"]


class AtControl(StepEffect):
    """Notes when it acts."""

    name: ClassVar[str] = "the note"

    def __init__(self) -> None:
        self.before: list[float] = []
        self.after: list[float] = []

    def before_step(self, memory: State, instant: Instant) -> State:
        self.before.append(instant.time)
        return memory

    def after_step(self, memory: State, instant: Instant) -> State:
        self.after.append(instant.time)
        return memory


class EveryStep(AtControl):
    every_step: ClassVar[bool] = True


@pytest.mark.parametrize("other", [True, False])
def test_an_effect_acts_as_often_as_it_says_whatever_the_others_do(
    other: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    seldom, often = AtControl(), EveryStep()
    built = assemble(*load("detumble-wheels", SHORT))
    start = first_start(built, [0])
    effects = (seldom, often) if other else (seldom,)
    monkeypatch.setattr("mjspace.simulation.stepper.effects_of", lambda *_: effects)
    list(fly(built, start))
    rates = built.scenario.rates
    assert rates.steps > 1
    instants = [k * rates.control for k in range(round(0.02 / rates.control) + 1)]
    assert seldom.before == pytest.approx(instants)
    assert seldom.after == pytest.approx(instants[:-1])  # the last is not flown
    if other:
        steps = round(0.02 / rates.physics)
        assert often.before == pytest.approx([k * rates.physics for k in range(steps + 1)])
        assert often.after == pytest.approx([k * rates.physics for k in range(steps)])
