"""What is fitted to a vehicle: tables declared elsewhere, their order and what excludes what."""

import subprocess
import sys
from typing import Any

import pytest
from pydantic import ValidationError

from mjspace.actuators.motor_drives import DriveTables
from mjspace.actuators.pmsm import Pmsm
from mjspace.actuators.reaction_wheels import Wheels
from mjspace.scenario.declared import type_of
from mjspace.scenario.equipment import Driven
from mjspace.scenario.plant import PlantTable
from mjspace.scenario.scenario import Scenario

MOTOR = {"pole_pairs": 1, "resistance": 1.0, "inductance": 1.0, "torque_constant": 1.0}
THRUSTER = {"positions": [[0.0, 0.0, 0.0]], "directions": [[1.0, 0.0, 0.0]], "thrust": 1.0}


def fitted(**table: Any) -> list[str]:
    return list(PlantTable.model_validate(table).equipment)


def test_a_scenarios_tables_are_imported_only_when_one_is_validated() -> None:
    code = "import sys, mjspace.scenario.loading; assert not {'mujoco', 'numba'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_actuators_act_and_are_logged_in_this_order() -> None:
    everything = [name for name, value in PlantTable().model_dump().items() if value is None]
    order = ["drives", "servos", "engine", "ideal_thrusters", "rcs", "cold_gas", "magnetorquers"]
    assert [name for name in everything if name in order] == order
    # Wheels in gimbals come after reaction wheels: whoever knows of these alone has the first.
    assert fitted(servos={"wheel_speed": 1.0}) == ["wheels", "servos"]
    found = fitted(magnetorquers={}, rcs=THRUSTER, ideal_thrusters=True)
    assert found == ["wheels", "ideal_thrusters", "rcs", "magnetorquers"]


def test_what_is_empty_or_false_or_none_is_not_fitted() -> None:
    # As logs of older flights write every default out.
    nothing = {"drives": {}, "ideal_thrusters": False, "rcs": None}
    assert fitted(**nothing, magnetorquers={}, wheels={"axes": []}) == ["magnetorquers"]
    assert fitted(**nothing) == ["wheels"]
    with pytest.raises(ValidationError, match="wheels"):
        PlantTable.model_validate({"wheels": None})


def test_a_vehicle_with_nothing_else_has_wheels_of_which_there_may_be_none() -> None:
    assert fitted() == ["wheels"]
    assert fitted(wheels={"axes": []}) == ["wheels"]
    assert PlantTable().wheels == Wheels()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"drives": {"a": MOTOR}}, "drives and wheels are both given: set wheels.axes = "),
        ({"engine": {"thrust_max": 1.0}}, "engine and wheels are both given: set wheels.axes = "),
        (
            {"wheels": {"axes": []}, "drives": {"a": MOTOR}, "engine": {"thrust_max": 1.0}},
            "drives and engine are both given: give one",
        ),
        (
            {"wheels": {"axes": []}, "servos": {"wheel_speed": 1.0}, "engine": {"thrust_max": 1.0}},
            "servos and engine are both given: give one",
        ),
        (
            {"rcs": THRUSTER, "cold_gas": {**THRUSTER, "specific_impulse": 70.0, "gas": 1.0}},
            "cold_gas and rcs are both given: give one",
        ),
    ],
)
def test_what_cannot_be_fitted_together_is_refused(table: Any, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        PlantTable.model_validate(table)


def test_errors_name_the_key_in_a_table_by_name() -> None:
    with pytest.raises(ValidationError) as refused:
        PlantTable.model_validate({"drives": {"a": {**MOTOR, "resistance": -1.0}}})
    assert [error["loc"] for error in refused.value.errors()] == [("drives", "a", "resistance")]


def test_the_type_of_a_key_is_known_wherever_its_table_is_declared() -> None:
    plant = PlantTable.model_fields
    assert type_of(plant["wheels"]) is Wheels
    assert type_of(plant["drives"]).__args__[1] is Pmsm
    assert type_of(plant["ideal_thrusters"]) is bool
    (fault,) = type_of(Scenario.model_fields["faults"]).__args__
    assert fault.__name__ == "Fault"
    assert type_of(Scenario.model_fields["seed"]) is int
    assert PlantTable(drives={"a": MOTOR}, wheels={"axes": []}).drives == DriveTables(
        {"a": Pmsm(**MOTOR)}
    )


def test_what_several_drive_stands_one_after_the_other() -> None:
    one = Driven(motors=("a",), gimbals=("a",))
    other = Driven(motors=("b", "c"), wheels=("b", "c"), encoded_wheels=("c",))
    assert Driven.together([one, other]) == Driven(("a", "b", "c"), ("a",), ("b", "c"), ("c",))
