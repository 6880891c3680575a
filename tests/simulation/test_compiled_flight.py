"""A flight whose periods are compiled is the flight in Python, bit by bit, event by event."""

import dataclasses
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, assembly, assert_same, flown, one_of
from mujoco.batch import SimulationError

from mjspace.simulation import loop
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.compiled_flight import CompiledFlight
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.stepper import Stepper
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

pytestmark = SHORT_BLOCKS


WHOLE = "compiled: sensors, law and actuators"


def flying(source: str, folder: Path, *overrides: str, name: str = "contraction-ideal") -> Assembly:
    """Return a flight of 0.1 s with a law of one's own, whose ``source`` is put into a file."""
    (folder / "own.py").write_text(source)
    law = "law={kind='own.py:Law'}"
    return assembly(name, "duration=0.1", law, *overrides, folder=folder)


SCENARIOS = {
    "contraction-adaptive": ["duration=0.2", "plant.wheels.torque_limit=5"],
    "dgvscmg-tracking": ["duration=0.1"],
    "pd-plus": ["duration=0.1"],
    "detumble-wheels": [
        "duration=0.2",
        "events=[{name='slow',signal='truth.rate[0]',below=0.29}]",
    ],
    "contraction-ideal": ["duration=0.5", "rates.control='10 ms'"],
    "contraction-noise": [
        "duration=0.1",
        *("sensors.attitude.noise_std=1e-3", "sensors.attitude.delay='3 ms'"),
        *("sensors.rate.bias_std=0.01", "sensors.rate.bias_walk=0.01"),
    ],
    "antenna-slew": [  # servos beside wheels, whose power is limited
        *("duration=3", "law.start_time=0", "plant.wheels.efficiency=0.8"),
        *("plant.wheels.power_limit='4 mW'", "plant.wheels.total_power_limit='10 mW'"),
        *("plant.wheels.regenerates=true", "plant.wheels.momentum_margin=true"),
    ],
    "dgvscmg-sensorless": ["duration=0.05"],  # an inner loop that measures with a bias
}


@pytest.mark.parametrize("name", SCENARIOS)
def test_compiled_rows_and_events_are_pythons(name: str) -> None:
    built = assembly(name, *SCENARIOS[name])
    compiled, python = flown(built), flown(built, compiled=False)
    assert compiled.compiled == WHOLE
    assert not compiled.trouble
    assert_same(compiled, python)
    if name in ("contraction-adaptive", "antenna-slew"):
        assert any("saturated" in event.message for event in compiled.events)


def test_a_motor_that_saturates_before_the_last_step_of_a_period_counts() -> None:
    # At 40 V the outer gimbal's motor saturates in the first steps of the first period alone.
    limited = "plant.drives.cmg_outer.voltage_limit=40"
    built = assembly("dgvscmg-tracking", "duration=0.05", limited)
    compiled, python = flown(built), flown(built, compiled=False)
    assert compiled.compiled == WHOLE
    assert_same(compiled, python)
    assert [event.message for event in compiled.events] == ["cmg_outer saturated"]


INNER = """
from dataclasses import dataclass

import numpy as np

from mjspace.controllers.cmg.dgvscmg import Cascade


@dataclass(frozen=True)
class Law(Cascade):
    def step(self, state, time, measurement, reference):
        TROUBLE
        return super().step(state, time, measurement, reference)

    def inner(self, state, time, command, measurement):
        after, motors = super().inner(state, time, command, measurement)
        return after, motors._replace(voltage=motors.voltage + 0.1 * np.sin(3000.0 * time))
"""


@pytest.mark.parametrize(
    ("trouble", "what"),
    [
        ("pass", WHOLE),
        ("assert time >= 0.0", r"flown in Python: a branch .* and the law has an inner loop"),
    ],
)
def test_an_inner_loop_has_the_time_of_each_step_and_the_sensors_last_report(
    trouble: str, what: str, tmp_path: Path
) -> None:
    more = ["duration=0.05", "sensors.wheel_speed.noise_std=0.001"]
    built = flying(INNER.replace("TROUBLE", trouble), tmp_path, *more, name="dgvscmg-tracking")
    compiled = flown(built)
    assert re.fullmatch(what, compiled.compiled)
    assert_same(compiled, flown(built, compiled=False))


@pytest.mark.parametrize("period", ["0.5 ms", "1.5 ms"])
def test_sensors_that_sample_between_control_instants_sample_then(period: str) -> None:
    timing = ["rates.physics='0.5 ms'", f"sensors.rate.period='{period}'"]
    built = assembly("contraction-noise", "duration=0.1", *timing)
    mixed, python = flown(built), flown(built, compiled=False)
    assert "sensors sample between control instants" in mixed.compiled
    assert_same(mixed, python)


@pytest.mark.parametrize("name", ["contraction-adaptive", "dgvscmg-tracking"])
def test_vehicles_are_alike_alone_and_together_at_any_number_of_threads(name: str) -> None:
    built = assembly(name, *SCENARIOS[name], "duration=0.05")
    members = (0, 1, 2, 3)
    start = first_start(built, members)
    physics = start.physics.copy()
    physics[:, 1:] *= 1.0 + 1e-3 * np.arange(4.0)[:, None]  # no two fly alike
    start = dataclasses.replace(start, physics=physics)
    python = flown(built, members, compiled=False, start=start)
    for threads in (1, 2, 3):
        together = flown(built, members, start=start, threads=threads)
        assert together.compiled == WHOLE
        assert_same(together, python)
    alone = flown(built, [2], start=one_of(start, 2))
    assert alone.bits(0) == python.bits(2)
    assert python.bits(1) != python.bits(2)


ERRORS = [
    "sensors.rate={noise_std=0.1,bias_std=0.02,bias_walk=0.01,delay='10 ms',quantization=1e-3}",
    "sensors.attitude={noise_std=0.01,bias_std=0.02,quantization=1e-3}",
    "sensors.wheel_speed={noise_std=0.5,bias_walk=0.1,delay='5 ms'}",
]


SELDOM = [
    "sensors.rate={period='7 ms',noise_std=0.1,bias_walk=0.01,delay='14 ms'}",
    "sensors.attitude={period='5 ms'}",
    "sensors.wheel_speed={noise_std=0.5}",
]


@pytest.mark.parametrize("errors", [ERRORS, SELDOM], ids=["errors", "seldom"])
def test_sensors_are_compiled_and_err_in_each_vehicle_by_itself(errors: list[str]) -> None:
    built = assembly("contraction-ideal", *errors, "duration=0.2")
    members = (0, 1, 2)
    python = flown(built, members, compiled=False)
    for threads in (1, 2):
        together = flown(built, members, threads=threads)
        assert together.compiled == WHOLE
        assert_same(together, python)
    for member in members:
        alone = flown(built, [member])
        assert alone.compiled == WHOLE
        assert alone.bits(0) == python.bits(member)
    assert python.bits(1) != python.bits(2)


def test_a_sensor_holds_what_it_sampled_last() -> None:
    rate = flown(assembly("contraction-ideal", *SELDOM, "duration=0.2")).rows["/measurement.rate"]
    changes = np.flatnonzero(np.any(np.diff(rate[:, 0], axis=0), axis=1)) + 1
    assert changes.tolist() == [*range(21, 200, 7)]  # until 14 ms after the first, that is held


def test_an_accelerometer_is_compiled_after_the_sample_that_it_begins_with() -> None:
    built = assembly("lander-estimated", "duration=2")  # an altimeter of 10 Hz, a law of 50 Hz
    compiled = flown(built, (0, 1), threads=2)
    assert compiled.compiled.startswith("compiled: sensors, law, actuators")
    assert_same(compiled, flown(built, (0, 1), compiled=False))


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("contraction-adaptive", []),
        ("dgvscmg-tracking", []),
        ("contraction-ideal", [*SELDOM, "rates.control='1 ms'"]),
    ],
)
def test_any_logged_period_is_a_start(name: str, more: list[str]) -> None:
    built = assembly(name, *SCENARIOS[name], *more)
    whole, middle = flown(built), 57
    logged: dict[str, dict[str, np.ndarray]] = {"sensor": {}, "actuator": {}, "law": {}}
    for topic, values in whole.rows.items():
        kind, _, field = topic.removeprefix("/state.").partition("_")
        if topic.startswith("/state.") and kind in logged:
            logged[kind][field] = values[middle]
    first = first_start(built, (0,))
    reference = built.reference.at(np.zeros(1))
    law = built.law.reset(
        Stepper(built, first).sense(0).measurement, type(reference)(*(a[0] for a in reference))
    )
    state = type(law)(*(logged["law"][field] for field in law._fields)) if law else ()
    start = Start(
        middle, whole.rows["/state.physics"][middle], logged["sensor"], state, logged["actuator"]
    )
    again = flown(built, start=start)
    assert again.compiled == WHOLE
    for field, values in again.rows.items():
        assert values.tobytes() == whole.rows[field][middle:].tobytes(), field


def test_vehicles_may_have_models_of_their_own() -> None:
    built = assembly("contraction-ideal", "duration=0.05")
    model, members = built.vehicle.model, (0, 1, 2)
    fields = {
        "body_mass": np.tile(model.body_mass, (3, 1)) * [[1.0], [1.1], [1.2]],
        "body_inertia": np.tile(model.body_inertia, (3, 1, 1)) * [[[1.0]], [[1.1]], [[1.2]]],
    }
    start = dataclasses.replace(first_start(built, members), model=fields)
    compiled = flown(built, members, start=start, threads=2)
    assert compiled.compiled == WHOLE
    assert_same(compiled, flown(built, members, start=start, compiled=False))
    assert compiled.bits(0) != compiled.bits(1)
    assert compiled.bits(0)["/state.physics"] == flown(built).bits(0)["/state.physics"]


@pytest.mark.parametrize("threads", [1, 2])
def test_vehicles_may_have_whole_models_of_their_own(threads: int) -> None:
    """With friction that MuJoCo solves for: its solver stops at what the model's masses tell it."""
    built = assembly("detumble-wheels", "duration=0.5")
    inertia = (f"plant.gyrostat_inertia=[[10,0,0],[0,{y},0],[0,0,14]]" for y in (11, 12, 13))
    each = [assembly("detumble-wheels", "duration=0.5", one) for one in inertia]
    for one in (built, *each):
        one.vehicle.model.dof_frictionloss[one.vehicle.wheel_dof] = 0.02
    models, members = [one.vehicle.model for one in each], (0, 1, 2)
    start = dataclasses.replace(first_start(built, members), models=models)
    compiled = flown(built, members, start=start, threads=threads)
    assert compiled.compiled == WHOLE
    assert_same(compiled, flown(built, members, start=start, compiled=False))
    for vehicle, one in enumerate(each):
        assert compiled.bits(vehicle) == flown(one).bits(0)
    assert compiled.bits(0) != compiled.bits(1)


HEAD = """
from typing import NamedTuple
import numpy as np
from mjspace import attitude
from mjspace.contract import TorqueCommand

class State(NamedTuple):
    integral: np.ndarray
    slowed: np.ndarray

class Signals(NamedTuple):
    error: np.ndarray
    size: np.ndarray

class Law:
    def __init__(self):
        self.inertia = np.diag([15.0, 12.0, 18.0])
        self.noise = np.random.default_rng(3)
        self.size = 0.0

    def reset(self, measurement, reference):
        return State(np.zeros(3), np.zeros(()))

    def step(self, state, time, measurement, reference):
        turned = attitude.multiply(attitude.conjugate(reference.attitude), measurement.attitude)
        error = np.copysign(1.0, turned[0]) * turned[1:]
        rate = measurement.rate - reference.rate
        integral = np.clip(state.integral + 1e-3 * error, -0.1, 0.1)
        size = np.linalg.norm(rate)
        torque = -self.inertia @ (2.0 * rate + error + 0.1 * integral)
        torque += np.cross(measurement.rate, self.inertia @ measurement.rate)
        torque = np.where(size > 0.2, 0.5, 1.0) * torque
        slowed = state.slowed * 0.99 + size**2
        {trouble}
        signals = Signals(np.concatenate([error, size[None]]), size / (1.0 + time))
        return State(integral, slowed), TorqueCommand(torque), signals
"""


def own_law(folder: Path, trouble: str = "", duration: float = 0.2, *more: str) -> Assembly:
    return flying(HEAD.replace("{trouble}", trouble), folder, f"duration={duration}", *more)


def test_an_unbatched_law_of_ones_own_is_compiled(tmp_path: Path) -> None:
    built = own_law(tmp_path)
    compiled = flown(built, (0, 1), threads=2)
    assert compiled.compiled == WHOLE
    assert_same(compiled, flown(built, (0, 1), compiled=False))


@pytest.mark.parametrize(
    ("trouble", "reason"),
    [
        ("torque = torque if size > 0.1 else 2.0 * torque", "a branch on a measured value"),
        ("torque[0] = float(error[0])", "a Python number"),
        ("torque = np.array([torque[0], 0.0, 0.0])", "np.stack"),
        ("self.size = size", "the law changes its own size"),
        ("torque[np.argmax(error)] = 0.0", "np.argmax"),
    ],
)
def test_a_law_that_cannot_be_compiled_is_called_in_python(
    trouble: str, reason: str, tmp_path: Path
) -> None:
    built = own_law(tmp_path, trouble)
    mixed, python = flown(built), flown(built, compiled=False)
    assert mixed.compiled.startswith("sensors and actuators compiled; law called in Python: ")
    assert reason in mixed.compiled
    assert_same(mixed, python)


@pytest.mark.parametrize(
    "result",
    [
        "signals = Signals(signals.error, float(size))",  # a Python number
        "torque = torque.tolist() if time > 0.05 else torque",
        "torque = torque.astype(np.float32) if time > 0.05 else torque",
        "slowed = float(slowed)",
    ],
)
def test_what_a_called_law_returns_may_be_any_numbers(result: str, tmp_path: Path) -> None:
    built = own_law(tmp_path)
    source = HEAD.replace("{trouble}", "assert time >= 0.0")
    place = "        return State(integral, slowed), TorqueCommand"
    built = flying(source.replace(place, f"        {result}\n{place}"), tmp_path)
    called, python = flown(built, (0, 1), threads=2), flown(built, (0, 1), compiled=False)
    assert "law called in Python" in called.compiled
    assert_same(called, python)


@pytest.mark.parametrize("errors", [ERRORS, SELDOM], ids=["errors", "seldom"])
@pytest.mark.parametrize("batched", [False, True])
def test_a_called_law_of_many_vehicles_is_pythons(
    batched: bool, errors: list[str], tmp_path: Path
) -> None:
    source = BATCHED.replace('torque.astype(str) + "?"', "0.5 * torque")
    if not batched:
        source = source.replace("batched = True", "batched = False")
    built = flying(source, tmp_path, *errors, name="contraction-noise")
    members = (0, 1, 2)
    python = flown(built, members, compiled=False)
    for threads in (1, 2):
        called = flown(built, members, threads=threads)
        assert called.compiled.startswith("sensors and actuators compiled; law called")
        assert_same(called, python)
    assert flown(built, [2]).bits(0) == python.bits(2)


KEEPING = """
from typing import NamedTuple
import numpy as np
from mjspace.contract import TorqueCommand

class State(NamedTuple):
    sum: np.ndarray

class Law:
    compiled = False

    def __init__(self):
        self.seen, self.torque = [], np.zeros(3)

    def reset(self, measurement, reference):
        return State(np.zeros(3))

    def step(self, state, time, measurement, reference):
        for array in (measurement.rate, state.sum, reference.attitude):
            assert not array.flags.writeable
            try:
                array.setflags(write=True)
            except ValueError:
                continue
            raise AssertionError("made writable")
        self.seen.append((measurement, state, reference))
        self.torque[:] = -5.0 * measurement.rate
        return State(state.sum + measurement.rate), TorqueCommand(self.torque), None
"""


def test_what_a_called_law_keeps_does_not_change_and_its_own_arrays_are_copied(
    tmp_path: Path,
) -> None:
    built = flying(KEEPING, tmp_path)
    rows, law = flown(built).rows, getattr(built.law, "law")  # noqa: B009 - the user's own
    assert len(rows["/truth.rate"]) == 101
    np.testing.assert_array_equal(
        [seen[0].rate for seen in law.seen], rows["/measurement.rate"][:, 0]
    )
    np.testing.assert_array_equal([seen[1].sum for seen in law.seen], rows["/state.law_sum"][:, 0])
    np.testing.assert_array_equal(
        [seen[2].attitude for seen in law.seen], rows["/reference.attitude"][:, 0]
    )
    np.testing.assert_array_equal(rows["/command.torque"], -5.0 * rows["/measurement.rate"])


def test_a_called_law_divides_by_zero_without_warnings(tmp_path: Path) -> None:
    built = own_law(tmp_path, "assert time >= 0.0; size = size / np.zeros(())")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        called = flown(built)
    assert ("law called in Python" in called.compiled, called.trouble) == (True, "")


def test_a_called_laws_change_of_shape_ends_the_flight_as_in_python(tmp_path: Path) -> None:
    # To a shape that would be broadcast to the one before.
    built = own_law(tmp_path, "error = error if time < 0.0605 else error[:1]")
    source = (tmp_path / "own.py").read_text()
    built = flying(source.replace("np.concatenate([error, size[None]])", "error"), tmp_path)
    called, python = flown(built), flown(built, compiled=False)
    assert "has the shape (1, 1) after (1, 3): shapes must not change" in called.trouble
    assert_same(called, python)


def test_actuators_under_a_called_law_have_the_motion_of_now(tmp_path: Path) -> None:
    # Wheels at their speed limit cut the command by how fast they turn.
    limit = "plant.wheels.speed_limit=30"
    built = own_law(tmp_path, "torque *= -3.0 if time > 0.0 else 1.0", 0.4, limit)
    called, python = flown(built), flown(built, compiled=False)
    assert "law called in Python" in called.compiled
    assert any("saturated" in event.message for event in python.events)
    assert_same(called, python)


def test_a_law_with_dice_is_noticed_and_flown_in_python(tmp_path: Path) -> None:
    # A generator's state is nowhere to be seen, but the first period shows it.
    trouble = "torque = torque + self.noise.normal(size=3)"
    with pytest.warns(RuntimeWarning, match=r"compiled, .* differs .* at t = 0 s") as caught:
        compiled = flown(own_law(tmp_path, trouble))
    assert sum(warning.category is RuntimeWarning for warning in caught) == 1
    assert compiled.compiled.startswith("flown in Python: ")
    assert_same(compiled, flown(own_law(tmp_path, trouble), compiled=False))


def test_a_wrong_program_is_noticed_and_the_flight_goes_on_in_python(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    built = assembly("contraction-adaptive", *SCENARIOS["contraction-adaptive"])
    python = flown(built, compiled=False)
    columns, calls = CompiledFlight.columns, 0

    def wrong(self: Any) -> Any:
        nonlocal calls
        calls += 1
        found = columns(self)
        if calls == 3:  # of the third block
            found["command"]["torque"] = found["command"]["torque"] * (1.0 + 1e-15)
        return found

    monkeypatch.setattr(CompiledFlight, "columns", wrong)
    with pytest.warns(RuntimeWarning, match=r"command torque differs .* t = 0\.08 s") as caught:
        found = flown(built)
    assert (len(caught), calls) == (1, 3)
    assert found.compiled == "flown in Python: command torque differs from Python's"
    assert_same(found, python)


@pytest.mark.parametrize(
    ("trouble", "message"),
    [
        ("torque = torque + np.where(time > 0.0605, np.inf, 0.0)", "/command.torque is not finite"),
        ("torque = torque * np.where(time > 0.0605, np.nan, 1.0)", "/command.torque is not finite"),
        ("torque = torque * np.where(time > 0.0605, 1e20, 1.0)", "/command.torque is not finite"),
        # One that can be commanded, and moves faster than MuJoCo flies.
        ("torque = torque * 0.0 + np.where(time > 0.0605, 9e9, 0.0)", "/state.physics is not"),
    ],
)
def test_trouble_in_a_block_ends_the_flight_as_in_python(
    trouble: str, message: str, tmp_path: Path
) -> None:
    built = own_law(tmp_path, trouble)
    compiled, python = flown(built), flown(built, compiled=False)
    assert message in python.trouble
    assert_same(compiled, python)
    assert compiled.compiled == "flown in Python: MuJoCo warned"
    assert 55 <= len(compiled.rows["time"]) <= 70


def test_what_a_law_raises_ends_the_flight_as_in_python(tmp_path: Path) -> None:
    # Of a law that is called in each period, between compiled steps.
    built = own_law(tmp_path, "assert time < 0.0605, 'too late'")
    compiled, python = flown(built), flown(built, compiled=False)
    assert "actuators compiled" in compiled.compiled
    assert "too late" in python.trouble
    assert_same(compiled, python)


def test_what_a_gufunc_raises_in_a_block_is_met_in_python(tmp_path: Path) -> None:
    """As linear algebra does that meets no numbers: no exception may leave the native call."""
    raising = """
import numpy as np
from mjspace.gufunc import gufunc

@gufunc(["void(f8[:,:], f8[:])"], "(n,n)->()")
def raising(matrix, least):
    least[0] = np.linalg.eigvalsh(np.ascontiguousarray(matrix))[0]
"""
    trouble = "raising.ufunc(np.where(time > 0.0605, np.nan, 0.0) * np.eye(3))"
    text = raising + HEAD.replace("{trouble}", f"torque = torque + {trouble}")
    built = flying(text, tmp_path, "duration=0.2")
    compiled, python = flown(built), flown(built, compiled=False)
    assert "infs or NaNs" in python.trouble
    assert "infs or NaNs" in compiled.compiled
    assert_same(compiled, python)


def test_an_error_of_mujoco_in_a_block_is_met_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    built = assembly("contraction-ideal", "duration=0.1")
    python, calls = flown(built, compiled=False), 0
    flies = CompiledFlight.fly_periods

    def failing(self: Any, count: int) -> None:
        nonlocal calls
        calls += 1
        flies(self, count)
        if calls == 2:
            raise SimulationError(np.array([0]), "no room", 1)

    monkeypatch.setattr(CompiledFlight, "fly_periods", failing)
    found = flown(built)
    assert "no room" in found.compiled
    assert_same(found, python)


def test_an_error_of_mujoco_where_the_law_is_called_is_met_in_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The law and the sensors have gone on by then: both go back to the block's second period.
    branch = "torque = torque if size > 0.1 else 2.0 * torque"
    noisy = "sensors.rate.noise_std=0.01"
    built = own_law(tmp_path, branch, 0.1, noisy)
    python, calls = flown(built, compiled=False), 0
    flies = CompiledFlight.fly_to_instant

    def failing(self: Any, period: int) -> None:
        nonlocal calls
        calls += 1
        if calls == 60:
            raise SimulationError(np.array([0]), "no room", 1)
        flies(self, period)

    monkeypatch.setattr(CompiledFlight, "fly_to_instant", failing)
    found = flown(built)
    assert (calls, "no room" in found.compiled) == (60, True)
    assert_same(found, python)


BATCHED = """
import numpy as np
from mjspace.contract import TorqueCommand


class Law:
    batched = True

    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        torque = -1.0 * measurement.rate
        return None, TorqueCommand(torque if time < 0.0605 else torque.astype(str) + "?"), None
"""


def test_a_command_that_is_no_numbers_any_more_ends_the_flight_as_in_python(
    tmp_path: Path,
) -> None:
    built = flying(BATCHED, tmp_path)
    compiled, python = flown(built), flown(built, compiled=False)
    assert "actuators compiled" in compiled.compiled
    assert "the law's command: torque is not numbers" in python.trouble
    assert_same(compiled, python)


def _blocks_of(periods: int, built: Assembly, members: Sequence[int]) -> int:
    """Return the ``BLOCK_BYTES`` of which blocks of these vehicles have so many periods."""
    return periods * 4 * first_start(built, members).physics.nbytes


def test_a_proof_is_good_for_the_short_blocks_that_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    built, members = assembly("contraction-noise", "duration=0.1", *ERRORS), (0, 1, 2)
    python, by_python, sense = flown(built, members, compiled=False), [], Stepper.sense

    def noted(self: Any, number: int) -> Any:
        by_python.append(number)
        return sense(self, number)

    monkeypatch.setattr(loop, "BLOCK_BYTES", _blocks_of(10, built, members))
    monkeypatch.setattr(Stepper, "sense", noted)
    found = flown(built, members)
    assert by_python == [0, 40, 80]
    assert_same(found, python)


def test_trouble_in_a_block_without_a_proof_of_its_own_is_met_in_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = own_law(tmp_path, "torque = torque + np.where(time > 0.0605, np.inf, 0.0)")
    python = flown(built, compiled=False)
    monkeypatch.setattr(loop, "BLOCK_BYTES", _blocks_of(10, built, (0,)))
    found = flown(built)
    assert found.compiled == "flown in Python: MuJoCo warned"
    assert "/command.torque is not finite" in found.trouble
    assert_same(found, python)


def test_an_error_of_mujoco_in_a_block_without_a_proof_of_its_own_is_met_in_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built, calls = own_law(tmp_path, "", 0.1, "sensors.rate.noise_std=0.01"), 0
    python, flies = flown(built, compiled=False), CompiledFlight.fly_periods

    def failing(self: Any, count: int) -> None:
        nonlocal calls
        calls += 1
        flies(self, count)
        if calls == 3:
            raise SimulationError(np.array([0]), "no room", 1)

    monkeypatch.setattr(loop, "BLOCK_BYTES", _blocks_of(10, built, (0,)))
    monkeypatch.setattr(CompiledFlight, "fly_periods", failing)
    found = flown(built)
    assert calls == 3
    assert re.fullmatch("flown in Python: .*no room", found.compiled)
    assert_same(found, python)


def test_stop_ends_it_after_the_block() -> None:
    calls = 0

    def stop() -> bool:
        nonlocal calls
        calls += 1
        return calls > 4

    built = assembly("contraction-ideal", "duration=1")
    found, whole = flown(built, stop=stop), flown(built)
    rows = len(found.rows["time"])
    assert 40 <= rows < 250
    for field, values in found.rows.items():
        assert values.tobytes() == whole.rows[field][:rows].tobytes()


def test_a_compiled_flight_warns_of_nothing() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", UnphysicalInertiaWarning)
        flown(assembly("contraction-ideal", "duration=0.1"))


@pytest.mark.parametrize(
    "frozen",
    [
        "measurement.rate",
        "measurement.attitude[:3]",
        "reference.rate + 0.0 * measurement.rate",
        "state.integral",
        "time + np.zeros_like(measurement.rate)",
    ],
)
def test_a_frozen_value_is_noticed_in_the_first_block(frozen: str, tmp_path: Path) -> None:
    # What no law can have by chance: the numbers inside a traced array.
    trouble = f"value = {frozen}; torque = torque + getattr(value, 'array', value).copy()"
    with pytest.warns(RuntimeWarning, match=r"compiled, .* differs .* at t = 0 s"):
        compiled = flown(own_law(tmp_path, trouble))
    assert_same(compiled, flown(own_law(tmp_path, trouble), compiled=False))


def test_a_frozen_value_in_the_next_state_is_noticed_too(tmp_path: Path) -> None:
    trouble = "slowed = slowed + getattr(state.slowed, 'array', state.slowed).copy()"
    with pytest.warns(RuntimeWarning, match=r"compiled, law slowed after a period differs"):
        compiled = flown(own_law(tmp_path, trouble))
    assert_same(compiled, flown(own_law(tmp_path, trouble), compiled=False))


TURNING = """
from typing import NamedTuple
import numpy as np
from mjspace.contract import TorqueCommand

class State(NamedTuple):
    matrix: np.ndarray

class Law:
    batched = True

    def reset(self, measurement, reference):
        return State(np.tile(np.arange(9.0).reshape(3, 3), (len(measurement.rate), 1, 1)))

    def step(self, state, time, measurement, reference):
        torque = (state.matrix @ measurement.rate[..., None])[..., 0]
        return State(np.swapaxes(state.matrix, -1, -2)), TorqueCommand(torque), None
"""


def test_a_state_that_is_turned_about_is_another(tmp_path: Path) -> None:
    built = flying(TURNING, tmp_path)
    compiled = flown(built)
    assert compiled.compiled == WHOLE
    assert_same(compiled, flown(built, compiled=False))
