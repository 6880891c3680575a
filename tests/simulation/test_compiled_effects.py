"""Step effects that are compiled fly as in Python, bit by bit, event by event."""

import dataclasses
from typing import Any

import mujoco
import numpy as np
import pytest
from blocks import blocks_of
from compiled_flights import SHORT_BLOCKS, assembly, assert_same, flown, one_of, start_of_row

from mjspace.environment.install import install_callbacks
from mjspace.sensors.suite import SensorSuite
from mjspace.simulation import compile_period, compiled_blocks, loop, mujoco_warnings
from mjspace.simulation.compiled_flight import CompiledFlight
from mjspace.simulation.initial_state import INTEGRATION, first_start
from mjspace.tracing.inner_loops import Untraceable

pytestmark = SHORT_BLOCKS


ALL = "compiled: sensors, law, actuators and step effects ({})"
LANDS = ["duration=1.2", "initial.position=[0.0, 0.0, 2.3]", "initial.velocity=[0.0, 0.0, -1.0]"]
CRASHES = ["duration=0.6", "initial.position=[0.0, 0.0, 2.6]", "initial.velocity=[0.2, 0.0, -9.0]"]
PLACES = "[[0,0.4,0],[0,-0.4,0],[0,0.4,0],[0,-0.4,0],[0,0,0.5],[0,0,-0.5],[0,0,0.5],[0,0,-0.5]]"
WAYS = "[[0,0,1],[0,0,-1],[0,0,-1],[0,0,1],[0,1,0],[0,-1,0],[0,-1,0],[0,1,0]]"
COLD_GAS = "thrust=0.5,specific_impulse='70 s',gas=0.5,exponent=1.4,minimum_on=0.01"
UNLIKE = [
    *(
        "plant.rcs.thrust=[0.5,0.8,0.5,0.5,0.9,0.5,0.5,0.7,0.5,0.6,0.5,0.5]",
        "plant.rcs.rise='7 ms'",
    ),
    "plant.rcs.delay=[0.005,0.015,0.005,0.005,0.12,0.005,0.005,0,0.005,0.005,0.005,0.005]",
    "plant.rcs.specific_impulse=[220,200,220,220,220,220,220,220,220,220,220,180]",
]
SCENARIOS = {
    "lander-touchdown": ("lander", LANDS, "the ground contact, the burning mass", 1),
    "lander-crash": ("lander", CRASHES, "the ground contact, the burning mass", 3),
    "rcs-three-axis": ("rcs-three-axis", ["duration=4"], "the burning mass", 0),
    "rcs-schmitt": ("rcs-schmitt", ["duration=0.2"], "the burning mass", 0),
    "rcs-three-axis, empty": (
        "rcs-three-axis",
        ["duration=6", "plant.rcs.propellant='0.1 g'"],
        "the burning mass",
        0,
    ),
    "unlike thrusters, burns over several periods": (
        "rcs-three-axis",
        [*("duration=4", "plant.rcs.burns='to_the_end'", "law.control_period='300 ms'"), *UNLIKE],
        "the burning mass",
        0,
    ),
    "cold gas, burns over several periods": (
        "detumble-wheels",
        [
            *("duration=2", "rates.control=0.1", "plant.wheels.axes=[]", "initial.wheel_speed=[]"),
            "law={kind='pulsed_pd:PulsedPd',attitude_gain=0,rate_gain=8,control_period=0.3}",
            f"plant.cold_gas={{positions={PLACES},directions={WAYS},{COLD_GAS},burns='to_the_end'}}",
        ],
        "the burning mass",
        0,
    ),
    "cold gas": (
        "detumble-wheels",
        [
            *("duration=2", "rates.control=0.1", "plant.wheels.axes=[]", "initial.wheel_speed=[]"),
            "law={kind='pulsed_pd:PulsedPd',attitude_gain=0,rate_gain=8}",
            f"plant.cold_gas={{positions={PLACES},directions={WAYS},{COLD_GAS}}}",
        ],
        "the burning mass",
        0,
    ),
    "dead from a time on": (
        "wheel-failure",
        [
            "duration=2",
            "faults=[{motor='wheel_1',kind='dead',at=0.51,until=1.3},"
            "{motor='wheel_torque',kind='delayed',value=0.1,at=1.0},"
            "{motor='wheel_0',kind='lagged',value=0.1,at=0.7}]",
        ],
        "the faults",
        4,
    ),
    "dead, and its power": (
        "wheel-failure",
        [
            "duration=2",
            "plant.wheels.efficiency=0.7",
            "faults=[{motor='wheel_1',kind='dead',at=0.51,until=1.3}]",
        ],
        "the faults",
        2,
    ),
    "stuck by a signal": (
        "wheel-stuck",
        ["duration=3", "faults.0.when.above='0.5 deg'", "faults.0.until=2"],
        "the faults",
        2,
    ),
    "yo-yo": (
        "yo-yo-despin",
        ["duration=1.3", *(f"plant.parts.{p}.deployment.at=0.1" for p in ("east", "west"))],
        "the deployment",
        4,
    ),
    "boom": (
        "gravity-gradient-boom",
        ["duration=300", "plant.parts.boom.deployment.ramp='7 s'"],
        "the deployment",
        2,
    ),
    "boom without a ramp": (
        "gravity-gradient-boom",
        ["duration=180", "plant.parts.boom.deployment.ramp='0 s'"],
        "the deployment",
        2,
    ),
    "magnetic field": ("b-dot-igrf", ["duration=200"], "the environment", 0),
    "desaturation-magnetic": ("desaturation-magnetic", ["duration=30"], "the environment", 0),
}


@pytest.mark.parametrize("case", SCENARIOS)
def test_compiled_rows_and_events_are_pythons(case: str) -> None:
    name, overrides, effects, events = SCENARIOS[case]
    built = assembly(name, *overrides)
    compiled, python = flown(built), flown(built, compiled=False)
    assert compiled.compiled == ALL.format(effects)
    assert not compiled.trouble
    assert_same(compiled, python)
    told = [event for event in python.events if "saturated" not in event.message]
    assert len(told) >= events, [event.message for event in told]


def test_effects_act_in_each_vehicle_by_itself_at_any_number_of_threads() -> None:
    # They touch down at different times, and burn all the while.
    built = assembly("lander", *LANDS, "duration=0.8")
    members = (0, 1, 2)
    start = first_start(built, members)
    physics = start.physics.copy()
    physics[:, 3] += [0.0, 0.02, 0.05]  # height
    start = dataclasses.replace(start, physics=physics)
    python = flown(built, members, compiled=False, start=start)
    touchdowns = [e for e in python.told if "first contact" in e.message]
    assert len({event.time for event in touchdowns}) == 3
    for threads in (1, 2, 3):
        together = flown(built, members, start=start, threads=threads)
        assert together.compiled == ALL.format("the ground contact, the burning mass")
        assert_same(together, python)
    for vehicle in members:
        alone = flown(built, [vehicle], start=one_of(start, vehicle))
        assert alone.bits(0) == python.bits(vehicle)


@pytest.mark.parametrize(
    "case",
    [
        *("lander-touchdown", "dead from a time on", "yo-yo", "boom", "dead, and its power"),
        "unlike thrusters, burns over several periods",
        "cold gas, burns over several periods",
    ],
)
def test_any_logged_period_is_a_start(case: str) -> None:
    name, overrides, effects, _ = SCENARIOS[case]
    built = assembly(name, *overrides)
    whole = flown(built)
    middle = 2 * len(whole.rows["time"]) // 3
    again = flown(built, start=start_of_row(built, whole, middle))
    assert again.compiled == ALL.format(effects)
    for field, values in again.rows.items():
        assert values.tobytes() == whole.rows[field][middle:].tobytes(), field


LAW = """
import numpy as np
from mjspace.controllers.landing.lander import VariableStructure


class Law(VariableStructure):
    def step(self, state, time, measurement, reference):
        assert time >= 0.0
        return super().step(state, time, measurement, reference)
"""


def without_compiled_sensors(patch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise Untraceable("a sensor")

    patch.setattr(SensorSuite, "sample_where_due", refuse)


SELDOM = "sensors.position.period='60 ms'"


@pytest.mark.parametrize(
    ("sensors", "what"),
    [
        (True, "sensors, actuators and step effects ({}) compiled; law called in Python: a branch"),
        (
            False,
            "actuators and step effects ({}) compiled; sensors and law called in Python: a sensor",
        ),
    ],
)
def test_a_law_that_is_called_in_python_lands_as_well(
    sensors: bool, what: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not sensors:
        without_compiled_sensors(monkeypatch)
    (tmp_path / "own.py").write_text(LAW)
    own = "law.kind='own.py:Law'"
    for overrides in (LANDS, CRASHES):
        built = assembly("lander", *overrides, SELDOM, own, folder=tmp_path)
        compiled, python = flown(built), flown(built, compiled=False)
        effects = "the ground contact, the burning mass"
        assert compiled.compiled.startswith(what.format(effects))
        assert_same(compiled, python)
        assert any("first contact" in event.message for event in python.events)


COUNTS = """
from mjspace.controllers.landing.lander import VariableStructure

calls = []


class Law(VariableStructure):
    def step(self, state, time, measurement, reference):
        calls.append(time)
        state, command, signals = super().step(state, time, measurement, reference)
        return state, command._replace(gimbal=command.gimbal + 1e-4 * len(calls)), signals
"""


@pytest.mark.parametrize("periods", [2, 3, 40])  # of a block, so that it is in any of them
@pytest.mark.parametrize("sensors", [True, False])
def test_a_law_that_is_called_in_python_is_called_once_where_something_happens(
    sensors: bool, periods: int, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not sensors:
        without_compiled_sensors(monkeypatch)
    flights = []
    for compiled in (True, False):
        folder = tmp_path / str(compiled)
        folder.mkdir()
        (folder / "own.py").write_text(COUNTS)
        own = "law.kind='own.py:Law'"
        built = assembly("lander", *CRASHES, SELDOM, own, folder=folder)
        with blocks_of(periods):
            flights.append(flown(built, compiled=compiled))
    assert ("sensors and law called in Python" in flights[0].compiled) is not sensors
    assert "law called in Python" in flights[0].compiled
    assert len(flights[1].events) >= 2
    assert_same(*flights)


@pytest.mark.parametrize(
    ("name", "overrides", "reason"),
    [
        (
            "wheel-failure",
            ["faults=[{motor='wheel_1',kind='noisy',value=0.01,at=0.1}]"],
            "the faults: a noisy motor is called in Python",
        ),
        (
            "detumble-wheels",
            ["environment.python='own.py:wind'"],
            "the disturbance: it is called in Python",
        ),
    ],
)
def test_what_is_not_compiled_is_named(
    name: str, overrides: list[str], reason: str, tmp_path: Any
) -> None:
    wind = "import numpy as np\ndef wind(time, truth):\n    return np.zeros(3), 1e-3 * truth.rate\n"
    (tmp_path / "own.py").write_text(wind)
    built = assembly(name, *overrides, "duration=0.3", folder=tmp_path)
    compiled = flown(built)
    assert compiled.compiled == f"flown in Python: {reason}"
    assert_same(compiled, flown(built, compiled=False))


def test_a_fault_that_waits_for_a_signal_is_not_compiled_without_the_law(tmp_path: Any) -> None:
    law = LAW.replace("landing.lander", "attitude.quaternion_feedback")
    (tmp_path / "own.py").write_text(law.replace("VariableStructure", "Switched"))
    built = assembly(
        *("wheel-stuck", "duration=0.3", "law.kind='own.py:Law'"),
        "faults.0.when={signal='measurement.rate[0]',above=-1e-4}",
        folder=tmp_path,
    )
    compiled = flown(built)
    assert "a step effect waits for a signal" in compiled.compiled
    assert_same(compiled, flown(built, compiled=False))


def test_what_is_compiled_is_seen_after_what_happens_at_the_start(tmp_path: Any) -> None:
    law = LAW.replace("landing.lander", "attitude.quaternion_feedback")
    (tmp_path / "own.py").write_text(law.replace("VariableStructure", "Switched"))
    built = assembly(
        *("wheel-failure", "duration=1", "law.kind='own.py:Law'", "faults.0.at=0"), folder=tmp_path
    )
    assert "law called in Python: a branch" in loop.what_is_compiled(built)


def test_a_wrong_look_is_noticed_in_the_first_block(monkeypatch: pytest.MonkeyPatch) -> None:
    built = assembly("lander", *LANDS)
    python, columns = flown(built, compiled=False), CompiledFlight.columns

    def wrong(self: Any) -> Any:
        found = columns(self)
        velocity = found["memory"]["touchdown_velocity"] = found["memory"][
            "touchdown_velocity"
        ].copy()
        velocity[1] *= 1.0 + 1e-15
        return found

    monkeypatch.setattr(CompiledFlight, "columns", wrong)
    with pytest.warns(RuntimeWarning, match=r"compiled, memory touchdown_velocity after a period"):
        found = flown(built)
    assert_same(found, python)


@pytest.mark.parametrize("name", ["lander", "rcs-three-axis"])
def test_a_step_without_constraints_reads_of_what_masses_make_those_of_subtrees_alone(
    name: str,
) -> None:
    # What the kernel leaves to be derived until a constraint is in force.
    install_callbacks()
    mujoco_warnings.silence()
    built = assembly(name)
    row, ends = first_start(built, [0]).physics[0], []
    for spoils in (False, True):
        model = built.vehicle.model.__copy__()
        for field in ("body_invweight0", "dof_invweight0", "tendon_invweight0", "dof_M0"):
            if spoils:
                getattr(model, field)[...] = np.nan
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, row, INTEGRATION)
        data.maxuse_efc = 0
        for _ in range(5):
            mujoco.mj_step(model, data)
        assert data.maxuse_efc == 0
        end = np.empty_like(row)
        mujoco.mj_getState(model, data, end, INTEGRATION)
        ends.append(end.tobytes() + data.sensordata.tobytes())
    assert ends[0] == ends[1]


def test_actuators_compute_nothing_of_the_sky(monkeypatch: pytest.MonkeyPatch) -> None:
    programs: list[Any] = []

    def kept(*arguments: Any, **options: Any) -> Any:
        programs.append(compile_period.compile_period(*arguments, **options))
        return programs[-1]

    monkeypatch.setattr(compiled_blocks, "compile_period", kept)
    flight = flown(assembly("leo-day", "duration=10"))
    assert flight.compiled == ALL.format("the environment")
    # Wheels and coils act in each of a period's four steps; with the truth of all sensors 619.
    assert len(programs[0].driving.calls.table) < 20
    assert len(programs[0].sensing.calls.table) > 500
