"""Finding and constructing laws and references from a scenario's tables."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.contract import Measurement, Reference
from mjspace.scenario.construct import construct
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust
from mjspace.simulation.unbatched_law import UnbatchedLaw

FACTS = {
    "inertia": np.diag([1.0, 2.0, 3.0]),
    "wheel_axes": np.eye(3),
    "wheel_inertia": np.full(3, 0.1),
    "control_period": 0.01,
}

DAMPER = '''
from dataclasses import dataclass
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray

class Signals(NamedTuple):
    power: float

@dataclass(frozen=True)
class Damper:
    """Knows nothing of batches: every array has the shape of one vehicle."""
    control_period: float
    gain: float = 2.0

    def reset(self, measurement, reference):
        assert measurement.attitude.shape == (4,)
        assert measurement.rate.shape == (3,)
        return None

    def step(self, state, time, measurement, reference):
        torque = -self.gain * measurement.rate
        return None, Command(torque), Signals(torque @ measurement.rate)
'''


def build(kind: str, folder: Path = Path(), **gains: Any) -> tuple[Any, Component]:
    component = Component(kind=kind, **gains)
    trust = Trust(folder)
    return construct(component, trust.load(kind), FACTS, trust)


def test_facts_fill_what_the_table_leaves_out_and_the_table_wins() -> None:
    law, flown = build("contraction:Ideal", rate_gain="30 N m s/rad")
    np.testing.assert_array_equal(law.inertia, FACTS["inertia"])
    assert law.rate_gain == 30.0
    assert flown.gains["rate_gain"] == 30.0
    assert flown.gains["inertia"] == np.asarray(FACTS["inertia"]).tolist()
    law, _ = build("contraction:Ideal", inertia=np.eye(3).tolist())
    np.testing.assert_array_equal(law.inertia, np.eye(3))


@pytest.mark.parametrize(
    ("kind", "gains", "message"),
    [
        ("contraction:Ideal", {"rate_gian": 1}, r"rate_gian.*did you mean 'rate_gain'"),
        ("contraction:Ideal", {"inertia": [1, 2, 3]}, r"inertia: got .*\(3,\), should be 3 x 3"),
        ("contraction:Ideal", {"rate_gain": [1, 2]}, r"rate_gain: got .* should be one number"),
        ("contraction:Ideal", {"rate_gain": "3 kg"}, r"rate_gain.*unit 'kg'"),
        ("references:Hold", {"file": "none.csv"}, r"none\.csv"),
        ("contraction:Idael", {}, r"no 'Idael'.*Ideal"),
        ("contractoin:Ideal", {}, r"no module 'contractoin'.*'contraction'"),
        ("contraction", {}, r"'module:Class'"),
        ("mine.py:Law", {}, r"no file mine\.py"),
    ],
)
def test_what_is_wrong_is_said(kind: str, gains: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build(kind, **gains)


def test_a_gain_of_each_may_be_one_for_all_where_that_is_declared() -> None:
    rows = {"thruster_positions": np.eye(3), "thruster_directions": np.eye(3)}
    facts = FACTS | rows | {"thruster_force": np.ones(3), "control_period": 0.1}
    gains: dict[str, Any] = {"attitude_gain": 1.0, "rate_gain": 1.0}

    def shortest(value: Any) -> Any:
        component = Component(kind="pulsed_pd:PulsedPd", **gains | {"thruster_minimum_on": value})
        kind = Trust(Path()).load_class(component.kind)
        return construct(component, kind, facts, Trust(Path()))[0].thruster_minimum_on

    assert shortest("20 ms") == 0.02
    np.testing.assert_array_equal(shortest(["20 ms", 0.0, 0.01]), [0.02, 0.0, 0.01])
    with pytest.raises(ValueError, match="thruster_minimum_on: 2 rows for 3 of thruster_positions"):
        shortest([0.02, 0.01])
    with pytest.raises(ValueError, match=r"thruster_minimum_on: got -1 s, should be 0 or more"):
        shortest(-1.0)


UNDECLARED = """
from dataclasses import dataclass, field
from typing import Any, Literal

class Plain:
    def __init__(self, damping=1.0, mode="fast", table=None, law=None):
        self.damping, self.mode, self.table, self.law = damping, mode, table, law
    def at(self, time):
        pass

@dataclass
class Annotated:
    damping: float = 2.0
    weights: list[float] = field(default_factory=list)
    table: dict[str, float] = field(default_factory=dict)
    anything: Any = None
    note: str = ""
    notes: list[str] = field(default_factory=list)
    label: str | None = None
    mode: Literal["2 s", "fast"] = "fast"
"""
HOLD = {"kind": "references:Hold"}
DECLARE = r"write a number in SI, or declare damping: float = gain\('N m s/rad'\) in own.py:\w+, a"


@pytest.mark.parametrize(
    ("kind", "gains", "message"),
    [
        ("Plain", {"damping": "30 N m s/rad"}, "damping: got '30 N m s/rad', but .*" + DECLARE),
        ("Annotated", {"damping": "30 N m s/rad"}, "damping: got '30 N m s/rad', but .*" + DECLARE),
        ("Plain", {"damping": "0.5 1/s"}, r"damping: got '0\.5 1/s', .* gain\('1/s'\)"),
        ("Plain", {"damping": " 3  rad/s^3 "}, r"damping: got .* declares no unit for it"),
        ("Plain", {"damping": ["3 deg", 1.0]}, r"damping\[0\]: got '3 deg', .* number in SI$"),
        ("Plain", {"table": {"a": [1.0, {"b": "2 s"}]}}, r"table\.a\[1\]\.b: got '2 s', .* in SI$"),
        ("Plain", {"law": HOLD, "table": {"a": "2 s"}}, r"table\.a: got '2 s'"),
        ("Plain", {"table": [HOLD, {"a": "2 s"}]}, r"table\[1\]\.a: got '2 s'"),
        ("Annotated", {"weights": [1.0, "3 deg"]}, r"weights\[1\]: got '3 deg'"),
        ("Annotated", {"table": {"a": "3 deg"}}, r"table\.a: got '3 deg'"),
        ("Annotated", {"anything": "3 deg"}, "anything: got '3 deg'"),
        ("Annotated", {"damping": "7"}, "damping: got '7', should be a number"),
        ("Annotated", {"damping": True}, "damping: got True, should be a number"),
        ("Annotated", {"damping": float("nan")}, "damping: got nan, should be a number"),
        ("Annotated", {"mode": "3 s"}, "mode: got '3 s', should be one of '2 s', 'fast'"),
    ],
)
def test_a_quantity_without_a_declared_unit_is_refused_with_the_cure(
    tmp_path: Path, kind: str, gains: dict[str, Any], message: str
) -> None:
    (tmp_path / "own.py").write_text(UNDECLARED)
    with pytest.raises(ValueError, match=message):
        build(f"own.py:{kind}", tmp_path, **gains)


def test_text_that_is_not_a_quantity_or_is_annotated_as_text_is_passed_on(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(UNDECLARED)
    plain, _ = build("own.py:Plain", tmp_path, mode="2 wheels", table={"a": ["slow", "inf"]})
    assert (plain.mode, plain.table) == ("2 wheels", {"a": ["slow", "inf"]})
    texts = {"note": "2 s", "notes": ["3 m"], "label": "4 N", "mode": "2 s"}
    annotated, flown = build("own.py:Annotated", tmp_path, **texts)
    assert {name: getattr(annotated, name) for name in texts} == texts
    assert {name: flown.gains[name] for name in texts} == texts


DECLARED = """
from dataclasses import dataclass
import numpy as np
from mjspace.contract import gain

@dataclass
class Source:
    turn: float = gain("rad/s", default=0.1)
    axes: np.ndarray = gain("m", (2, 2), default=((1.0, 0.0), (0.0, 1.0)))
    stiffness: float = gain("N m/rad", default=1.0)
    share: float = gain(default=0.5)
"""


def test_a_declared_unit_is_converted_wherever_the_gain_is(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(DECLARED)
    gains = {"turn": "6 rpm", "axes": [["1 km", 2.0], ["3 mm", "4 m"]], "stiffness": "5 N m/rad"}
    source, flown = build("own.py:Source", tmp_path, **gains)
    assert source.turn == pytest.approx(0.2 * np.pi, rel=1e-15)
    np.testing.assert_array_equal(source.axes, [[1000.0, 2.0], [0.003, 4.0]])
    assert source.stiffness == 5.0
    again, _ = build("own.py:Source", tmp_path, **flown.gains)  # as a log has it: SI numbers
    assert (again.turn, again.stiffness) == (source.turn, source.stiffness)
    for bad, message in (
        ({"turn": "3 deg"}, "turn: '3 deg' has the unit 'deg', should be one of rad/s, deg/s"),
        ({"axes": [["1 s", 2.0], [3.0, 4.0]]}, "axes: '1 s' has the unit 's'"),
        ({"stiffness": "5 N m"}, "stiffness: '5 N m' has the unit 'N m', should be N m/rad"),
        ({"share": "5 deg"}, "share: got the text '5 deg', should be a plain number"),
        ({"turn": {"a": "3 deg"}}, "turn: got {'a': '3 deg'}, should be a number"),
    ):
        with pytest.raises(ValueError, match=message):
            build("own.py:Source", tmp_path, **bad)


def test_a_law_of_ones_own_is_flown_one_by_one(tmp_path: Path) -> None:
    (tmp_path / "damper.py").write_text(DAMPER)
    law, flown = build("damper.py:Damper", tmp_path, gain=3.0)
    assert flown.gains == {"control_period": 0.01, "gain": 3.0}
    wrapped = UnbatchedLaw(law)
    rate = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    seen = Measurement(attitude=np.tile([1.0, 0, 0, 0], (2, 1)), rate=rate)
    still = Reference(np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
    state = wrapped.reset(seen, still)
    state, command, signals = wrapped.step(state, 0.0, seen, still)
    np.testing.assert_array_equal(command.torque, -3.0 * rate)
    np.testing.assert_allclose(signals.power, -3.0 * (rate**2).sum(axis=1), rtol=1e-15)


def test_a_file_that_does_not_import_says_so(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text("import nothing_of_that_name\n")
    with pytest.raises(ValueError, match=r"broken\.py cannot be imported: ModuleNotFoundError"):
        build("broken.py:Law", tmp_path)


def test_a_table_from_a_file(tmp_path: Path) -> None:
    times = np.linspace(0.0, 10.0, 21)
    half = 0.05 * times**2 / 2
    rows = np.column_stack([times, np.cos(half), 0 * times, 0 * times, np.sin(half)])
    header = "time,attitude0,attitude1,attitude2,attitude3"
    np.savetxt(tmp_path / "turn.csv", rows, delimiter=",", header=header, comments="")
    reference, flown = build("tabulated:Table", tmp_path, file="turn.csv", ends="continue")
    wanted = reference.at(np.array([2.0]))
    np.testing.assert_allclose(wanted.attitude[0], [np.cos(0.1), 0, 0, np.sin(0.1)], atol=1e-3)
    assert "file" not in flown.gains  # a log must not need the file
    assert len(flown.gains["time"]) == 21
