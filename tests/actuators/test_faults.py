"""Faults of actuators: each kind against its definition, replay, a batch, and what is refused."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mjspace.actuators.faults import Fault, FaultSet, between
from mjspace.actuators.ideal_thrusters import IdealThrusters
from mjspace.actuators.reaction_wheels import ReactionWheels
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.sensors.noise import normals
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

HOLD = 0.1  # s
MOTORS = ("wheel_0", "wheel_1", "wheel_2")
RIGHT = np.sin(np.arange(12.0)[:, None] + [0.0, 1.0, 2.0])  # N m, of three wheels, each period


def given(members: int = 1, **table: Any) -> tuple[Array, list[Any]]:
    """Return what wheels that should give ``RIGHT`` do give, (periods, N, 3), and the events."""
    wheels = [ReactionWheels(np.eye(3))]
    faults = FaultSet(
        [Fault.model_validate({"motor": "wheel_1", **table})],
        wheels,
        HOLD,
        seed=3,
        members=range(members),
    )
    state, rows, events = faults.reset(), [], []
    for k, right in enumerate(RIGHT):
        state, happened = faults.decide(state, k * HOLD, {})
        state, (row,) = faults.change(state, (np.tile(right, (members, 1)),), k * HOLD)
        rows.append(row)
        events += happened
    return np.array(rows), events


@pytest.mark.parametrize(
    ("kind", "value", "wanted"),
    [
        ("dead", None, lambda right: 0.0 * right),
        ("stuck", None, lambda right: np.full_like(right, RIGHT[3, 1])),
        ("biased", "20 mN m", lambda right: right + 0.02),
        ("scaled", -0.5, lambda right: -0.5 * right),
        ("delayed", "200 ms", lambda right: RIGHT[2:6, 1]),
    ],
)
def test_a_motor_gives_what_its_fault_says(kind: str, value: Any, wanted: Any) -> None:
    # From the first period not before 0.35 s to the last before 0.8 s.
    rows, events = given(kind=kind, value=value, at="350 ms", until="800 ms")
    expected = RIGHT.copy()
    expected[4:8, 1] = wanted(RIGHT[4:8, 1])
    np.testing.assert_array_equal(rows[:, 0], expected)
    assert events == [
        (0.4, 0, "WARNING", f"fault: wheel_1 is {kind}"),
        (0.8, 0, "INFO", f"fault: wheel_1 is {kind} no more"),
    ]


def test_the_phase_in_the_log_is_0_before_1_while_it_lasts_and_2_after() -> None:
    wheels = [ReactionWheels(np.eye(3))]
    table = Fault.model_validate({"motor": "wheel_1", "kind": "dead", "at": 0.1, "until": 0.3})
    faults = FaultSet([table], wheels, HOLD, seed=3, members=[0])
    state, phases = faults.reset(), []
    for k in range(5):
        state, _ = faults.decide(state, k * HOLD, {})
        phases.append(float(state["fault_phase"][0, 0]))
    assert phases == [0.0, 1.0, 1.0, 2.0, 2.0]


def test_a_delayed_motor_gives_nothing_until_the_delay_has_passed() -> None:
    rows, _ = given(kind="delayed", value="300 ms", at=0.0)
    assert rows[:, 0, 1].tolist() == [0.0, 0.0, 0.0, *RIGHT[:-3, 1]]


def test_a_lagged_motor_follows_a_first_order_lag_from_what_it_last_applied() -> None:
    """Between instants y' = (u - y) / T with u held: y goes the part 1 - e^(-h / T) of the way."""
    rows, _ = given(kind="lagged", value="250 ms", at="350 ms", until="800 ms")
    expected = RIGHT.copy()
    for k in range(4, 8):
        left = expected[k - 1, 1] - RIGHT[k, 1]
        expected[k, 1] = RIGHT[k, 1] + left * np.exp(-HOLD / 0.25)
    np.testing.assert_allclose(rows[:, 0], expected, rtol=1e-14)


def test_a_fault_that_is_over_before_its_signal_begins_never() -> None:
    table = {"motor": "wheel_1", "kind": "dead", "until": 0.2}
    table["when"] = {"signal": "truth.rate", "above": 1.0}
    fault = Fault.model_validate(table)
    faults = FaultSet([fault], [ReactionWheels(np.eye(3))], HOLD, 0, [0])
    state, told = faults.reset(), []
    for k, rate in enumerate([0.5, 0.5, 2.0, 2.0]):
        seen = {"truth": SimpleNamespace(_asdict=lambda rate=rate: {"rate": np.array([[rate]])})}
        state, happened = faults.decide(state, k * HOLD, seen)
        told += happened
    assert told == []
    assert state["fault_phase"].tolist() == [[0.0]]


def test_between_control_instants_no_signal_begins_a_fault() -> None:
    table = {"motor": "wheel_1", "kind": "dead", "when": {"signal": "truth.rate", "above": 1.0}}
    faults = FaultSet([Fault.model_validate(table)], [ReactionWheels(np.eye(3))], HOLD, 0, [0])
    state, happened = faults.decide(faults.reset(), 0.05, None)
    assert happened == []
    assert state["fault_phase"].tolist() == [[0.0]]


@pytest.mark.parametrize(
    ("times", "falls_between"),
    [
        ([{"at": 0.2}], False),
        ([{"at": 0.25}], True),
        ([{"at": 0.2, "until": 0.4}], False),
        ([{"at": 0.2, "until": 0.35}], True),
        ([{"at": 0.2}, {"at": 0.31}], True),
        ([{"at": 0.0}, {"at": 0.3}], False),
        ([{"when": {"signal": "truth.rate", "above": 1.0}}], False),
    ],
)
def test_which_faults_begin_or_end_between_control_instants(
    times: list[dict[str, Any]], falls_between: bool
) -> None:
    tables = [Fault.model_validate({"motor": "wheel_1", "kind": "dead", **t}) for t in times]
    assert between(tables, 0.1) is falls_between


def test_noise_is_of_that_size_and_a_members_own() -> None:
    rows, _ = given(400, kind="noisy", value=0.1, at=0.0)
    noise = rows[:, :, 1] - RIGHT[:, None, 1]
    # 4800 numbers: their deviation is known to 1 %, their mean to 0.0014.
    assert np.std(noise) == pytest.approx(0.1, rel=0.04)
    assert abs(np.mean(noise)) < 0.006
    assert abs(np.mean(noise[1:] * noise[:-1])) < 6e-4  # white
    np.testing.assert_array_equal(given(1, kind="noisy", value=0.1, at=0.0)[0][:, 0], rows[:, 0])


def test_noise_is_of_a_stream_that_no_sensor_has() -> None:
    """Its numbers are those of ``normals`` for seed 3 and stream 1000 + the fault's number.

    With another stream, a logged flight would not be replayed.
    """
    rows, _ = given(2, kind="noisy", value=0.1, at=0.0)
    expected = normals(3, range(2), (1000,), 1)
    for k, row in enumerate(rows):
        np.testing.assert_array_equal(row[:, 1:2], RIGHT[k, 1] + 0.1 * expected(k))
    wheels = [ReactionWheels(np.eye(3))]
    tables = [Fault(motor=motor, kind="noisy", value=1.0, at=0.0) for motor in MOTORS[:2]]
    faults = FaultSet(tables, wheels, HOLD, seed=3, members=[0])
    state, _ = faults.decide(faults.reset(), 0.0, {})
    _, (row,) = faults.change(state, (np.zeros((1, 3)),), 0.0)
    assert row[0, 1] == normals(3, [0], (1001,), 1)(0)[0, 0]
    assert row[0, 0] != row[0, 1]


def test_a_fault_begins_when_any_topic_says_so() -> None:
    """Of a vector counts the norm, of some components theirs, and of each vehicle its own."""
    seen = {"truth": SimpleNamespace(_asdict=lambda: {"rate": np.array([[3.0, 4.0], [3.0, 0.0]])})}
    for signal, began in (("truth.rate", [0]), ("truth.rate[0]", []), ("truth.rate[1]", [0])):
        fault = Fault.model_validate(
            {"motor": "wheel_0", "kind": "dead", "when": {"signal": signal, "above": 3.5}}
        )
        faults = FaultSet([fault], [ReactionWheels(np.eye(3))], HOLD, 0, [0, 1])
        _, happened = faults.decide(faults.reset(), 0.0, seen)
        assert [vehicle for _, vehicle, *_ in happened] == began, signal
    # Of two vehicles each has two components.
    fault = Fault.model_validate(
        {"motor": "wheel_0", "kind": "dead", "when": {"signal": "truth.rate[2]", "above": 3.5}}
    )
    faults = FaultSet([fault], [ReactionWheels(np.eye(3))], HOLD, 0, [0, 1])
    with pytest.raises(InputError, match=r"faults\.0\.when\.signal: .* has 2 components"):
        faults.decide(faults.reset(), 0.0, seen)


def test_axes_of_a_torque_on_the_bus_are_its_motors() -> None:
    kinds = [IdealThrusters()]
    for name in ("thruster_torque", *(f"thruster_torque[{k}]" for k in range(3))):
        fault = Fault(motor=name, kind="scaled", value=2.0, at=0.0)
        faults = FaultSet([fault], kinds, HOLD, 0, [0])
        state, _ = faults.decide(faults.reset(), 0.0, {})
        _, (torque,) = faults.change(state, (np.ones((1, 3)),), 0.0)
        expected = np.ones(3)
        expected[int(name[-2]) if name.endswith("]") else slice(None)] = 2.0
        assert torque.tolist() == [expected.tolist()]
    for unknown in ("thruster_torque[3]", "wheel_0", ""):
        with pytest.raises(ValueError, match=r"faults\.0\.motor: none is called"):
            FaultSet([Fault(motor=unknown, kind="dead", at=0.0)], kinds, HOLD, 0, [0])


def test_several_faults_act_one_after_the_other_on_any_kind_of_actuator() -> None:
    thrusters = IdealThrusters()
    tables = [
        Fault(motor="wheel_torque", kind="scaled", value=0.5, at=0.0),
        Fault(motor="wheel_torque[2]", kind="biased", value=1.0, at=0.0),
        Fault(motor="thruster_torque[0]", kind="dead", at=0.0),
    ]
    faults = FaultSet(tables, [ReactionWheels(np.eye(3)), thrusters], HOLD, 0, [0])
    state, _ = faults.decide(faults.reset(), 0.0, {})
    one = np.ones((1, 3))
    _, (wheels, torque) = faults.change(state, (one, one), 0.0)
    assert wheels.tolist() == [[0.5, 0.5, 1.5]]
    assert torque.tolist() == [[0.0, 1.0, 1.0]]
    assert one.tolist() == [[1.0, 1.0, 1.0]]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("{motor='wheel_7',kind='dead',at=0}", r"faults.0.motor: none is called 'wheel_7': did"),
        ("{motor='wheel_0',kind='biased',at=0}", "value: a motor that is biased has one: give it"),
        ("{motor='wheel_0',kind='dead',value=1,at=0}", "a motor that is dead has none"),
        ("{motor='wheel_0',kind='dead'}", "at and when: give one of them"),
        ("{motor='wheel_0',kind='dead',at=3,until=2}", "until 2 s is not after at 3 s"),
        ("{motor='wheel_0',kind='noisy',value=-1,at=0}", "more than 0"),
        (
            "{motor='wheel_0',kind='delayed',value='7 ms',at=0}",
            "faults.0.value: 0.007 s is not",
        ),
    ],
)
def test_a_fault_that_cannot_be_is_refused_in_one_line(table: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as refused:
        assemble(*load("detumble-wheels", [f"faults=[{table}]"]))
    assert "\n" not in str(refused.value)


SHORT = ["duration=4", "rates.control=0.01", "checks=[]"]  # a row for each integration step


def burnt(thruster_fault: str, out: Path) -> tuple[Array, Array]:
    """Return thrust (n, 12) [N] and propellant (n, 1) [kg] of thrusters that damp a rate."""
    faults = f"faults=[{thruster_fault}]"
    log = run("detumble-thrusters", overrides=[*SHORT, faults], out=out).log
    return log.read("/command")["thruster_thrust"], log.read("/truth")["propellant"]


def test_a_thruster_that_stays_open_burns_and_a_dead_one_does_not(tmp_path: Path) -> None:
    stuck = "{motor='thruster_0',kind='biased',value=0.5,at=0},"
    rich, poor = (
        burnt(stuck, tmp_path / "open"),
        burnt("{motor='thruster_thrust',kind='dead',at=0}", tmp_path / "dead"),
    )
    assert not poor[0].any()
    assert np.ptp(poor[1]) < 1e-15
    assert rich[0][:-1, 0].min() >= 0.5
    used = rich[1][0, 0] - rich[1][-1, 0]
    scenario, _ = load("detumble-thrusters")
    rcs = scenario.plant.rcs
    assert rcs is not None
    assert rcs.specific_impulse is not None
    flow = 1.0 / (rcs.specific_impulse * 9.80665)
    assert used == pytest.approx(flow * rich[0][:-1].sum() * 0.01, rel=1e-9)
    assert used > flow * 0.5 * 4.0


def test_an_unknown_signal_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    fault = "{motor='wheel_0',kind='dead',when={signal='truth.ratte',below=1}}"
    with pytest.raises(InputError, match=r"faults.0.when.signal: no signal 'truth.ratte' .* did"):
        run("detumble-wheels", overrides=[f"faults=[{fault}]"], out=tmp_path / "none")
    assert not (tmp_path / "none").exists()


MANY = [
    "duration=2",
    "checks=[]",
    "faults=[{motor='wheel_0',kind='stuck',when={signal='truth.rate',below=0.36}},"
    "{motor='wheel_1',kind='noisy',value=0.1,at=0.2},"
    "{motor='wheel_2',kind='delayed',value='50 ms',at=1.0,until=1.5}]",
]


def test_a_faulty_flight_is_replayed_bit_for_bit_from_anywhere(tmp_path: Path) -> None:
    flown = run("detumble-wheels", overrides=MANY, out=tmp_path)
    for start in (0.0, 0.7, 1.2, 1.9):
        assert verify(flown.path, start=start) is None
    truth, command = flown.log.read("/truth"), flown.log.read("/command")
    told = [event.message for event in flown.log.events()]
    assert [line for line in told if line.startswith("fault")] == [
        "fault: wheel_1 is noisy",
        "fault: wheel_0 is stuck",
        "fault: wheel_2 is delayed",
        "fault: wheel_2 is delayed no more",
    ]
    slow = np.linalg.norm(truth["rate"], axis=1) < 0.36
    assert 0.1 < np.mean(slow) < 0.9
    held = command["wheel_torque"][slow, 0]
    np.testing.assert_array_equal(held, command["wheel_torque"][np.argmax(slow) - 1, 0])


def test_a_faulty_batch_is_as_one_each() -> None:
    built = assemble(*load("detumble-wheels", [*MANY, "duration=1"]))

    def state(members: list[int]) -> dict[str, Array]:
        blocks = list(fly(built, first_start(built, members), members))  # cut as the clock will
        fields = blocks[0].rows["/state"]
        return {f: np.concatenate([b.rows["/state"][f] for b in blocks]) for f in fields}

    batch = state([0, 1, 2])
    for member in range(3):
        for field, rows in state([member]).items():
            np.testing.assert_array_equal(batch[field][:, member], rows[:, 0])
    assert (batch["physics"][-1, 0] != batch["physics"][-1, 1]).any()
