"""Finding and constructing laws and references from a scenario's tables."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace.contract import Measurement, Reference
from mjspace.scenario.construct import construct, load_object
from mjspace.scenario.scenario import Component
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
    return construct(component, load_object(kind, folder), FACTS, folder)


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


def test_a_quantity_for_a_gain_without_a_unit_is_refused_with_the_cure(tmp_path: Path) -> None:
    (tmp_path / "damper.py").write_text(DAMPER)
    for bad, message in (
        (
            "30 N m s/rad",
            r"gain: got '30 N m s/rad', but .* declares no unit .* gain\('N m s/rad'\)",
        ),
        ("7", r"gain: got '7', should be a number"),
        (True, r"gain: got True, should be a number"),
        (float("nan"), r"gain: got nan, should be a number"),
        (["3 deg", 1.0], r"gain: got '3 deg', but"),
    ):
        with pytest.raises(ValueError, match=message):
            build("damper.py:Damper", tmp_path, gain=bad)


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
