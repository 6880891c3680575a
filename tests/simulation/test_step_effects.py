"""Step effects: in which order they are called, what of them is logged, and whose an error is."""

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from mjspace.contract import Array, Event, Measurement
from mjspace.errors import FlightError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.effects import effects_of
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block
from mjspace.vehicle.step_effect import Instant, State, StepEffect

REST = [
    *("checks=[]", "events=[]", "initial={}", "reference={kind='references:Hold'}"),
    *("law={kind='coast:Coast'}", "rates.physics=0.01", "duration=0.09"),
]

Adder = Callable[..., None]


@pytest.fixture
def add(monkeypatch: pytest.MonkeyPatch) -> Adder:
    """Return a function that adds effects to those of every flight."""

    def added(*effects: StepEffect) -> None:
        for place in ("stepper", "initial_state"):
            monkeypatch.setattr(
                f"mjspace.simulation.{place}.effects_of",
                lambda *arguments: (*effects_of(*arguments), *effects),
            )

    return added


def built(control: float = 0.03, *overrides: str) -> Assembly:
    settings = [*REST, f"rates.control={control}", *overrides]
    return assemble(*load("detumble-wheels", settings))


def flown(assembly: Assembly, start: Start | None = None) -> list[Block]:
    return list(fly(assembly, start or first_start(assembly, [0])))


def rows(blocks: list[Block], topic: str, field: str) -> Array:
    return np.concatenate([block.rows[topic][field][:, 0] for block in blocks])


class Diary(StepEffect):
    """Remembers how often it acted; notes each call."""

    name: ClassVar[str] = "the diary"

    def __init__(self, *, every_step: bool) -> None:
        self.every_step = every_step  # type: ignore[misc]
        self.calls: list[tuple[str, float]] = []

    def note(self, hook: str, time: float) -> None:
        self.calls.append((hook, round(time, 6)))

    def reset(self, physics: Array) -> State:
        return {"count": np.zeros((len(physics), 1))}

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        self.note("observe", time)
        return memory

    def add_to_truth(self, memory: State, truth: Measurement) -> Measurement:
        return truth._replace(thrust=memory["count"])

    def at_control(self, memory: State, instant: Instant) -> State:
        assert instant.is_control
        self.note("at_control", instant.time)
        return memory

    def change(
        self, memory: State, applied: tuple[Array, ...], instant: Instant
    ) -> tuple[State, tuple[Array, ...]]:
        self.note("change", instant.time)
        return memory, applied

    def before_step(self, memory: State, instant: Instant) -> State:
        self.note("before_step", instant.time)
        np.testing.assert_array_equal(instant.memory["count"], memory["count"])
        if instant.time > 0.0445 and memory["count"][0, 0] < 5.5:
            instant.events.append(Event(instant.time, 0, "INFO", "noted"))
        return memory | {"count": memory["count"] + 1.0}

    def after_step(self, memory: State, instant: Instant) -> State:
        self.note("after_step", instant.time)
        return memory

    def logged(self, memory: State, sensordata: Array) -> dict[str, Array]:
        return {"twice": 2.0 * memory["count"]}


PERIOD = ["observe", "at_control", "change", "before_step", "after_step"]


@pytest.mark.parametrize("every_step", [False, True])
def test_the_order_of_the_calls(add: Adder, every_step: bool) -> None:
    diary = Diary(every_step=every_step)
    add(diary)
    flown(built(0.03, "duration=0.03"))
    between = [(hook, t) for t in (0.01, 0.02) for hook in ("before_step", "after_step")]
    last = [(hook, 0.03) for hook in PERIOD[:-1]]  # whose command is not flown
    expected = [(hook, 0.0) for hook in PERIOD] + (between if every_step else []) + last
    assert diary.calls == expected


def test_an_effect_acts_no_more_often_beside_one_that_acts_in_every_step(add: Adder) -> None:
    diary = Diary(every_step=False)
    add(diary, Push([0.0] * 6))
    flown(built(0.03, "duration=0.03"))
    last = [(hook, 0.03) for hook in PERIOD[:-1]]  # whose command is not flown
    assert diary.calls == [(hook, 0.0) for hook in PERIOD] + last


def test_actuators_that_act_in_every_step_are_changed_in_every_step(add: Adder) -> None:
    diary = Diary(every_step=False)
    add(diary)
    flown(built(0.03, "duration=0.03", "plant.wheels.speed_limit='100 rad/s'"))
    assert [time for hook, time in diary.calls if hook == "change"] == [0.0, 0.01, 0.02, 0.03]


def test_what_it_remembers_and_adds_is_logged_and_a_start(add: Adder) -> None:
    add(Diary(every_step=True))
    assembly = built()
    blocks = flown(assembly)
    count = rows(blocks, "/state", "actuator_count")
    np.testing.assert_array_equal(count[:, 0], [0.0, 3.0, 6.0, 9.0])
    np.testing.assert_array_equal(rows(blocks, "/truth", "thrust"), count)
    np.testing.assert_array_equal(rows(blocks, "/truth", "twice"), 2.0 * count)
    assert [event for block in blocks for event in block.events] == [(0.05, 0, "INFO", "noted")]
    start = Start(2, blocks[0].rows["/state"]["physics"][2], {}, (), {"count": count[2:3]})
    again = flown(assembly, start)
    np.testing.assert_array_equal(rows(again, "/state", "actuator_count"), count[2:])


class Push(StepEffect):
    """A constant force and torque on the bus."""

    name: ClassVar[str] = "the push"
    every_step: ClassVar[bool] = True

    def __init__(self, wrench: list[float]) -> None:
        self.of_one = np.array([wrench])

    def before_step(self, memory: State, instant: Instant) -> State:
        self.wrench = np.repeat(self.of_one, len(instant.physics), axis=0)
        return memory


def test_the_wrenches_of_several_effects_add_up(add: Adder) -> None:
    one, other = [1.0, 0.0, 2.0, 0.1, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0, 0.2, -0.1]
    add(Push(one), Push(other))
    assembly = built(0.02, "duration=0.1", "initial.attitude=[0, 1, 0, 0]")
    blocks = flown(assembly)
    total = np.add(one, other)
    applied = [rows(blocks, "/disturbance", name)[0] for name in ("force", "torque")]
    np.testing.assert_allclose(np.concatenate(applied), total, rtol=1e-12)
    mass = assembly.vehicle.model.body_subtreemass[1]
    velocity = rows(blocks, "/truth", "velocity")[-1]
    np.testing.assert_allclose(velocity, 0.1 * total[:3] / mass, rtol=1e-9)
    # The torque is about body axes, upside down about x; it turns with the body, by 1e-4 rad.
    momentum = rows(blocks, "/truth", "momentum")[-1]
    np.testing.assert_allclose(momentum, 0.1 * total[3:] * [1, -1, -1], atol=1e-5)


class Broken(StepEffect):
    """Fails in one of its calls."""

    name: ClassVar[str] = "the broken part"
    every_step: ClassVar[bool] = True

    def __init__(self, hook: str) -> None:
        setattr(self, hook, self.fail)

    def fail(self, *_: Any) -> Any:
        raise ZeroDivisionError("nothing left")


@pytest.mark.parametrize("hook", PERIOD)
def test_an_error_in_an_effect_is_named_as_its_own(add: Adder, hook: str) -> None:
    add(Broken(hook))
    message = r"t = 0 s: the broken part raised ZeroDivisionError at test_step_effects\.py:\d+: not"
    with pytest.raises(FlightError, match=message):
        flown(built())
