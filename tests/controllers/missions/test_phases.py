"""A law made of laws: each vehicle flies its own phase, and nothing else touches its state."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.attitude.quaternion_feedback import RateDamping, Switched
from mjspace.controllers.missions.phases import Phases

from mjspace.contract import Array, Measurement, Reference
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.construct import construct
from mjspace.scenario.loading import load, to_toml
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust

FACTS = {"wheel_axes": np.eye(3), "wheel_inertia": np.full(3, 0.05), "control_period": 0.1}
REST = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
TABLE = [
    {
        "name": "damp",
        "law": {"kind": "quaternion_feedback:RateDamping", "rate_gain": "3 N m s/rad"},
        "until": {"after": 0.2, "signal": "rate", "below": 0.1},
    },
    {"name": "wait", "law": {"kind": "coast:Coast"}, "until": {"signal": "rate[2]", "above": 0.0}},
    {"name": "point", "law": {"kind": "quaternion_feedback:Switched"}},
]


def built(table: Any = TABLE) -> tuple[Any, Component]:
    component = Component.model_validate({"kind": "phases:Phases", "phases": table})
    return construct(component, Phases, FACTS, Trust(Path()))


def seen(*rates: Any) -> Measurement:
    rows = np.array(rates, dtype=float)
    attitude = np.tile([0.8, 0.0, 0.6, 0.0], (len(rows), 1))
    return Measurement(attitude=attitude, rate=rows, wheel_speed=np.ones((len(rows), 3)))


def phase_of(state: Any) -> list[float]:
    phases: list[float] = state.phase[:, 0].tolist()
    return phases


def test_each_vehicle_goes_on_when_its_own_condition_holds() -> None:
    law, _ = built()
    fast, slow, turning = [0.0, 0.2, 0.0], [0.0, 0.05, -0.01], [0.0, 0.05, 0.01]
    state = law.reset(seen(fast, slow), REST)
    for time, rates, wanted in [
        (0.0, (fast, slow), [0.0, 0.0]),
        (0.1, (fast, slow), [0.0, 0.0]),  # slow enough, too early
        (0.2, (fast, slow), [0.0, 1.0]),
        (0.3, (slow, slow), [1.0, 1.0]),
        (0.4, (slow, turning), [1.0, 2.0]),
        (0.5, (fast, fast), [1.0, 2.0]),  # no way back
    ]:
        state, command, signals = law.step(state, time, seen(*rates), REST)
        assert phase_of(state) == wanted
        np.testing.assert_array_equal(signals.phase, state.phase)
        still = np.array(wanted) == 1.0
        np.testing.assert_array_equal(command.torque[still], 0.0)
    assert state.began[:, 0].tolist() == [0.3, 0.4]


def test_a_phase_flies_its_law_from_its_beginning() -> None:
    law, _ = built()
    damp = RateDamping(rate_gain=3.0, **FACTS)
    point = Switched(**FACTS)
    first, later = seen([0.0, 0.05, 0.3]), seen([0.0, 0.02, 0.04])
    later = later._replace(attitude=-later.attitude)  # a law that began before would keep its sign
    state = law.reset(first, REST)
    alone = damp.reset(first, REST)
    for time in (0.0, 0.1):
        state, command, signals = law.step(state, time, first, REST)
        alone, torque, shown = damp.step(alone, time, first, REST)
        np.testing.assert_array_equal(command.torque, torque.torque)
        np.testing.assert_array_equal(signals.damp_u, shown.u)
        assert np.isnan(signals.point_u).all()
    state, command, signals = law.step(state, 0.2, later, REST)
    assert np.isnan(signals.damp_u).all()
    state, command, signals = law.step(state, 0.3, later, REST)
    _, torque, shown = point.step(point.reset(later, REST), 0.3, later, REST)
    np.testing.assert_array_equal(command.torque, torque.torque)
    np.testing.assert_array_equal(signals.point_error, shown.error)
    assert state.point_path[0, 0] == pytest.approx(0.1 * np.hypot(0.02, 0.04))


def test_a_batch_is_as_one_each_bit_for_bit() -> None:
    law, _ = built()
    random = np.random.default_rng(1)
    rates: Array = random.normal(0.0, 0.1, (20, 5, 3))
    many = law.reset(seen(*rates[0]), REST)
    ones = [law.reset(seen(rates[0, v]), REST) for v in range(5)]
    phases = set()
    for k in range(20):
        many, command, _ = law.step(many, 0.1 * k, seen(*rates[k]), REST)
        phases |= set(phase_of(many))
        for v in range(5):
            ones[v], alone, _ = law.step(ones[v], 0.1 * k, seen(rates[k, v]), REST)
            np.testing.assert_array_equal(command.torque[v], alone.torque[0])
            for name in many._fields:
                np.testing.assert_array_equal(
                    getattr(many, name)[v], getattr(ones[v], name)[0], err_msg=name
                )
    assert phases == {0.0, 1.0, 2.0}


def test_the_table_as_flown_has_every_gain_of_every_law() -> None:
    _, flown = built()
    first = flown.gains["phases"][0]
    assert first["law"]["rate_gain"] == 3.0
    assert first["law"]["control_period"] == 0.1
    again, twice = built(flown.gains["phases"])
    assert twice == flown
    assert again.phases[0].until.below == 0.1


def test_the_end_of_a_phase_takes_quantities() -> None:
    until = {"after": "0.5 min", "signal": "rate", "below": "6 deg/s", "above": "10 mrad"}
    law, flown = built([{**TABLE[0], "until": until}, *TABLE[1:]])
    end = law.phases[0].until
    assert (end.after, end.above) == (30.0, 0.01)
    assert end.below == pytest.approx(np.pi / 30, rel=1e-15)
    assert flown.gains["phases"][0]["until"] == {
        "after": 30.0, "signal": "rate", "below": end.below, "above": 0.01
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"law": {"kind": "coast:Coat"}}, r"phases.0.law: 'coast' has no 'Coat': did you mean 'C"),
        ({"law": {"kind": "quaternion_feedback:RateDamping", "rate_gian": 1}}, "phases.0.law: rat"),
        ({"law": {"kind": "own.py:Law"}}, "phases.0.law: own.py:Law: a law within another comes"),
        ({"until": {"signal": "rate[x]", "below": 1}}, r"phases.0.until: signal: got 'rate\[x\]'"),
        ({"until": {"signal": "rate"}}, "a signal and below or above go together"),
        (
            {"until": {"after": "10 deg"}},
            "phases.0.until: after: '10 deg' has the unit 'deg', should",
        ),
        ({"until": {"after": -1}}, "phases.0.until: after: got -1 s, should be 0 or more"),
        (
            {"until": {"afer": 1}},
            "phases.0.until: afer: Until has no such key: did you mean 'after'",
        ),
        (
            {"until": {"signal": "rate", "below": "1 dge/s"}},
            "until: below: .* unknown unit 'dge/s'",
        ),
        (
            {"until": 3},
            "phases.0: until: got 3, should be a table with after, signal, below, above",
        ),
        ({"law": "coast:Coast"}, "phases.0: law: should be a table with the kind of a law that"),
        ({"name": "Damp"}, "phases.0: name: got 'Damp', should be a word in lower case"),
        ({"until": None}, "phases.0: 'damp' would never end: it needs an until"),
        ({"name": "wait"}, "phases: got .*, should be one or more, with different names"),
        ({"nmae": "damp"}, "phases.0: .*nmae"),
    ],
)
def test_what_is_no_phase_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        built([{**TABLE[0], **change}, *TABLE[1:]])


def test_a_mission_is_replayed_bit_for_bit_from_within_any_phase(tmp_path: Path) -> None:
    short = ["plant.parts={}", "duration=3", "checks=[]", "initial.rate=[0.05,-0.03,0.3]"]
    soon = ["law.phases.0.until={after=1}", "law.phases.1.until={after=1}"]
    flown = run("mission", overrides=[*short, *soon], out=tmp_path)
    assert not flown.trouble
    for start in (0.0, 0.5, 1.5, 2.5):
        assert verify(flown.path, start=start) is None
    told = {event.message.partition(":")[0]: event.time for event in flown.log.events()}
    assert (told["wheels take over"], told["pointing begins"]) == (1.0, 2.0)


def test_a_mission_can_be_written_and_read_again(tmp_path: Path) -> None:
    scenario, _ = load("mission")
    (tmp_path / "again.toml").write_text(to_toml(scenario))
    assert load(tmp_path / "again.toml")[0] == scenario
    assert Trust(tmp_path).load(scenario.law.kind) is Phases
