"""The recipes of docs/extending.md for actuators and faults: file and line, followed and flown."""

import importlib.util
import re
import sys
import textwrap
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from pydantic import Field, ValidationError, create_model

from mjspace.actuators.fault_kinds import KINDS
from mjspace.actuators.faults import Fault, FaultSet
from mjspace.actuators.reaction_wheels import ReactionWheels
from mjspace.contract import Array
from mjspace.errors import FlightError
from mjspace.runner.run import Result, fly_to_log
from mjspace.scenario.declared import DeclaredIn, type_of
from mjspace.scenario.loading import load
from mjspace.scenario.plant import PlantTable
from mjspace.scenario.scenario import Scenario
from mjspace.simulation.assembly import assemble

PAGE = Path(__file__).parents[2] / "docs/extending.md"
MODULE = "mjspace.actuators.ion_thruster"
LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray
    ion: np.ndarray

class Push:
    def reset(self, measurement, reference):
        return None
    def step(self, state, time, measurement, reference):
        return None, Command(np.zeros(3), np.array([{thrust}])), None
"""


def blocks(section: str) -> list[str]:
    """Return the Python of a section of the page: a file and a line."""
    text = PAGE.read_text().partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    return re.findall(r"^```python[^\n]*\n(.*?)^```$", text, re.M | re.S)


@pytest.fixture
def recipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> type[Scenario]:
    """Return the scenario with the line of the recipe, whose file stands in another folder."""
    file, line = blocks("An actuator")
    path = tmp_path / "ion_thruster.py"
    path.write_text(file)
    spec = importlib.util.spec_from_file_location(MODULE, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, MODULE, module)
    spec.loader.exec_module(module)
    names = {"PlantTable": PlantTable, "Annotated": Annotated, "Any": Any, "DeclaredIn": DeclaredIn}
    exec(f"class Plant(PlantTable):\n{textwrap.indent(textwrap.dedent(line), '    ')}", names)
    plant: Any = names["Plant"]
    flown: type[Scenario] = create_model(
        "Flown", __base__=Scenario, plant=(plant, Field(default_factory=plant))
    )
    return flown


def fly(recipe: type[Scenario], folder: Path, thrust: float, **changes: Any) -> Result:
    """Fly a satellite with wheels and an ion thruster of 2 N, of which the law commands more."""
    (folder / "law.py").write_text(LAW.format(thrust=thrust))
    table = load("detumble-wheels", ["duration=1", "checks=[]"])[0].model_dump(exclude_none=True)
    table["plant"]["ion_thruster"] = {"thrust_limit": "2 N"}
    table |= {"law": {"kind": "law.py:Push"}, "initial": {}, "environment": {}} | changes
    return fly_to_log(assemble(recipe.model_validate(table), folder), folder / "flight.mcap")


def velocity(flown: Result) -> Array:
    return flown.log.read("/truth")["velocity"][-1]


def test_it_flies_saturates_and_is_logged_with_its_unit(
    recipe: type[Scenario], tmp_path: Path
) -> None:
    flown = fly(recipe, tmp_path, thrust=3.0)
    mass = 106.0  # bus and three wheels of 2 kg
    np.testing.assert_allclose(velocity(flown), [2.0 / mass, 0.0, 0.0], rtol=1e-9, atol=1e-15)
    assert flown.log.units["/command"] == {
        "torque": "N m",
        "wheel_torque": "N m",
        "ion": "N",
        "ion_thrust": "N",
    }
    np.testing.assert_array_equal(flown.log.read("/command")["ion_thrust"], 2.0)
    assert "ion_thruster saturated" in [event.message for event in flown.log.events()]


@pytest.mark.parametrize("motor", ["ion_thruster", "ion_thrust", "ion_thrust[0]"])
def test_faults_know_its_motor(recipe: type[Scenario], tmp_path: Path, motor: str) -> None:
    fault = {"motor": motor, "kind": "scaled", "value": 0.5, "at": 0.0}
    flown = fly(recipe, tmp_path, thrust=1.0, faults=[fault])
    np.testing.assert_allclose(velocity(flown), [0.5 / 106.0, 0.0, 0.0], rtol=1e-9, atol=1e-15)


def test_its_table_is_one_of_the_scenarios(recipe: type[Scenario], tmp_path: Path) -> None:
    table = type_of(recipe.model_fields["plant"].annotation.model_fields["ion_thruster"])  # type: ignore[union-attr]
    assert list(table.model_fields) == ["position", "direction", "thrust_limit"]
    dump = load("detumble-wheels")[0].model_dump(exclude_none=True)
    dump["plant"]["ion_thruster"] = {"thrust_limit": -1.0, "trust": 1.0}
    with pytest.raises(ValidationError) as refused:
        recipe.model_validate(dump)
    assert {error["loc"]: error["type"] for error in refused.value.errors()} == {
        ("plant", "ion_thruster", "thrust_limit"): "greater_than",
        ("plant", "ion_thruster", "trust"): "extra_forbidden",
    }


def test_what_it_raises_in_flight_is_reported_as_its_own(
    recipe: type[Scenario], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules[MODULE].np, "clip", lambda *_: 1 / 0)
    where = r"test_actuator_recipe\.py:\d+"
    message = rf"the actuator Throttle \(ion_thrust\) raised ZeroDivisionError at {where}"
    with pytest.raises(FlightError, match=message):
        fly(recipe, tmp_path, thrust=1.0)


def test_a_new_kind_of_fault_is_a_class_and_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    file, line = blocks("A fault of an actuator")
    names: dict[str, Any] = {}
    exec(file, names)
    for name, kind in eval(f"{{{line}}}", names).items():
        monkeypatch.setitem(KINDS, name, kind)
    fault = Fault.model_construct(motor="wheel_1", kind="reversed", value=None, at=0.1)
    faults = FaultSet([fault], [ReactionWheels(np.eye(3))], hold=0.1, seed=0, members=[0])
    state, rows = faults.reset(), []
    for period in range(3):
        state, _ = faults.decide(state, 0.1 * period, None)
        state, (row,) = faults.change(state, (np.ones((1, 3)),), 0.1 * period)
        rows.append(row[0].tolist())
    assert rows == [[1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, -1.0, 1.0]]
