"""What is derived from a flight's state: numbers of /truth at a known state, and good blocks."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mjspace.attitude import from_euler_zyx, rotate
from mjspace.contract import Array, Event
from mjspace.errors import FlightError
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block, one_vehicle, shapes, until_trouble

GYROSTAT = np.diag([10.0, 12.0, 14.0])  # kg m^2, without the wheels' 0.05 kg m^2 about their axes
RATE, WHEELS, VELOCITY = [0.3, -0.2, 0.25], [19.7, -39.8, 59.75], [3.0, -4.0, 12.0]


def first_row(name: str, *overrides: str) -> tuple[Any, dict[str, dict[str, Array]]]:
    """Return the assembly and the first row of each field of its flight."""
    built = assemble(*load(name, [*overrides, "duration=0.02", "checks=[]", "events=[]"]))
    block = next(iter(fly(built, first_start(built, [0]))))
    rows = one_vehicle(block)
    return built, {topic: {f: a[0] for f, a in fields.items()} for topic, fields in rows.items()}


def test_momentum_energy_and_errors_of_a_satellite() -> None:
    turned = 0.4 * np.pi
    built, row = first_row(
        "detumble-wheels",
        f"initial.euler=[0,0,{turned}]",
        f"initial.rate={RATE}",
        f"initial.wheel_speed={WHEELS}",
        f"initial.velocity={VELOCITY}",
        "initial.position=[1,2,3]",
        "reference.attitude=[1,0,0,0]",
    )
    truth = row["/truth"]
    np.testing.assert_array_equal(truth["position"], [1, 2, 3])
    np.testing.assert_array_equal(truth["velocity"], VELOCITY)
    assert truth["attitude_error"] == pytest.approx(turned, rel=1e-14)
    rate = np.array(RATE)
    wheels = rate + WHEELS  # relative to the stars
    momentum = GYROSTAT @ rate + 0.05 * wheels  # body axes
    c, s = np.cos(turned), np.sin(turned)
    world = [
        c * momentum[0] - s * momentum[1],
        s * momentum[0] + c * momentum[1],
        momentum[2],
    ]
    np.testing.assert_allclose(truth["momentum"], world, rtol=1e-12)
    turning = 0.5 * (rate @ GYROSTAT @ rate + 0.05 * wheels @ wheels)
    mass = built.vehicle.model.body_subtreemass[1]
    assert truth["energy"] == pytest.approx(turning + 0.5 * mass * 169.0, rel=1e-12)
    assert "position_error" not in truth  # its reference says nothing of a place
    assert "tilt" not in truth


@pytest.mark.parametrize(
    "euler", [[0.2, 0.0, 0.7], [0.0, -0.3, 0.7], [0.2, -0.3, 0.7], [2.5, 0.3, -1.0]]
)
def test_tilt_and_distance_of_a_lander(euler: list[float]) -> None:
    built, row = first_row(
        "lander",
        f"initial.euler={euler}",
        "initial.position=[2001,1498,1007]",
        "initial.velocity=[-15,-20,-10]",
    )
    truth = row["/truth"]
    up = rotate(from_euler_zyx(np.array(euler)), np.array([0.0, 0.0, 1.0]))
    assert truth["tilt"] == pytest.approx(np.arccos(np.cos(euler[0]) * np.cos(euler[1])), rel=1e-12)
    assert truth["tilt"] == pytest.approx(np.arccos(up[2]), rel=1e-12)
    wanted = built.reference.at(np.zeros(1)).position[0]
    np.testing.assert_array_equal(truth["position_error"], np.subtract([2001, 1498, 1007], wanted))
    np.testing.assert_array_equal(row["/reference"]["position"], wanted)
    np.testing.assert_array_equal(row["/state"]["actuator_propellant"], truth["propellant"])
    # nothing touches the ground half a kilometre below
    np.testing.assert_array_equal(truth["touchdown_velocity"], [-15, -20, -10])
    for name in ("crash", "contact", "hull_force", *4 * ["foot_force"]):
        assert not truth[name].any(), name


def test_a_lander_on_its_head_is_tilted_by_half_a_turn() -> None:
    """Of this quaternion, one to the last bit, the part that leans is rounded to more than one."""
    leaning = np.array([0.0, 0.8686042843234141, 0.49550640485770714, 0.0])
    assert np.sqrt(np.square(leaning).sum()) > 1.0
    built = assemble(*load("lander", ["duration=0.02", "checks=[]", "events=[]"]))
    turned = replace(built, qpos=np.concatenate([built.qpos[:3], leaning, built.qpos[7:]]))
    block = next(iter(fly(turned, first_start(turned, [0]))))
    assert block.rows["/truth"]["tilt"][0, 0] == np.pi


GOOD = np.arange(12.0).reshape(4, 1, 3)
COLUMNS: Any = SimpleNamespace(moving=slice(0, 2))


def block(**changes: Array) -> Block:
    """Return four rows of one vehicle, some of them changed."""
    rows: dict[str, dict[str, Array]] = {
        "/state": {"physics": changes.get("physics", GOOD), "law_p": changes.get("law", GOOD)},
        "/measurement": {"rate": changes.get("rate", GOOD)},
        "/command": {"torque": changes.get("torque", GOOD)},
        "/law": {"p": changes.get("law", GOOD)},
    }
    events = [Event(0.1 * k, 0, "INFO", str(k)) for k in range(4)]
    return Block(7, 0.1 * np.arange(4), rows, events)


def spoiled(row: int, component: int, value: float) -> Array:
    rows = GOOD.copy()
    rows[row, 0, component] = value
    return rows


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e11])
@pytest.mark.parametrize(
    ("field", "name"),
    [("physics", "/state.physics"), ("rate", "/measurement.rate"), ("torque", "/command.torque")],
)
def test_a_block_ends_before_what_cannot_be_flown(field: str, name: str, value: float) -> None:
    kept, problem = until_trouble(block(**{field: spoiled(2, 1, value)}), COLUMNS)
    assert problem == f"{name} is not finite, or beyond 1e10, at t = 0.2 s"
    assert kept.period == 7
    np.testing.assert_array_equal(kept.time, [0.0, 0.1])
    assert [event[3] for event in kept.events] == ["0", "1"]
    for fields in kept.rows.values():
        for rows in fields.values():
            np.testing.assert_array_equal(rows, GOOD[:2])


def test_the_first_trouble_is_the_one_that_is_named() -> None:
    both = block(physics=spoiled(3, 0, np.nan), torque=spoiled(1, 2, np.nan))
    assert until_trouble(both, COLUMNS)[1].startswith("/command.torque is not finite")
    same = block(physics=spoiled(1, 0, np.nan), torque=spoiled(1, 2, np.nan))
    assert until_trouble(same, COLUMNS)[1].startswith("/state.physics is not finite")
    at_once, _ = until_trouble(block(rate=spoiled(0, 0, np.nan)), COLUMNS)
    assert len(at_once.time) == 0
    assert at_once.events == []


def test_the_largest_number_that_mujoco_takes_can_be_flown() -> None:
    """Its manual, of ``mju_isBad``: bad is what is above ``mjMAXVAL``, 1e10."""
    for sign in (-1.0, 1.0):
        largest = block(torque=spoiled(1, 0, sign * 1e10))
        assert until_trouble(largest, COLUMNS) == (largest, "")
        beyond = block(torque=spoiled(1, 0, sign * np.nextafter(1e10, np.inf)))
        assert len(until_trouble(beyond, COLUMNS)[0].time) == 1


@pytest.mark.parametrize(
    "fine", [{}, {"law": spoiled(1, 0, np.inf)}, {"physics": spoiled(1, 2, np.inf)}]
)
def test_what_moves_nothing_may_be_infinite(fine: dict[str, Array]) -> None:
    whole = block(**fine)
    assert until_trouble(whole, COLUMNS) == (whole, "")


def test_a_block_is_seen_as_one_vehicles() -> None:
    two = np.arange(24.0).reshape(4, 2, 3)
    both = Block(0, np.arange(4.0), {"/truth": {"rate": two}}, [])
    np.testing.assert_array_equal(one_vehicle(both)["/truth"]["rate"], two[:, 0])
    np.testing.assert_array_equal(one_vehicle(both, 1)["/truth"]["rate"], two[:, 1])
    assert shapes(both) == {"/truth": {"rate": (3,)}}


def test_what_happens_in_a_period_that_is_not_recorded_is_not_told(tmp_path: Any) -> None:
    """The disturbance fails after the faults of 0.01 s began: the log ends before them."""
    (tmp_path / "push.py").write_text(
        "def push(time, truth):\n    return 2 * [[0, 0, 1 / (time < 0.0099)]]\n"
    )
    (tmp_path / "x.toml").write_text(
        'base = "detumble-wheels"\n[environment]\npython = "push.py:push"\n'
    )
    faults = ", ".join(
        f"{{motor='wheel_{wheel}', kind='noisy', value=0.1, at={at}}}"
        for wheel, at in enumerate((0.0, 0.005, 0.01))
    )
    built = assemble(*load(str(tmp_path / "x.toml"), ["duration=1", f"faults=[{faults}]"]))
    flight = fly(built, first_start(built, [0]))
    block = next(flight)
    np.testing.assert_array_equal(block.time, [0.0, 0.005])
    assert [event[0] for event in block.events] == [0.0, 0.005]
    for wheel, (*_, message) in enumerate(block.events):
        assert f"wheel_{wheel} is noisy" in message
    with pytest.raises(FlightError, match=r"stopped at t = 0\.01 s.*ZeroDivisionError"):
        next(flight)


def test_a_disturbance_of_ones_own_adds_to_the_environment(tmp_path: Any) -> None:
    (tmp_path / "push.py").write_text("def push(time, truth):\n    return [1, 2, 3], [4, 5, 6]\n")
    (tmp_path / "x.toml").write_text(
        'base = "detumble-wheels"\n[environment]\npython = "push.py:push"\n'
        '[[environment.torques]]\nframe = "body"\nbias = [0.1, 0.2, 0.3]\n'
    )
    _, row = first_row(str(tmp_path / "x.toml"))
    np.testing.assert_allclose(row["/disturbance"]["force"], [1, 2, 3], rtol=1e-14)
    np.testing.assert_allclose(row["/disturbance"]["torque"], [4.1, 5.2, 6.3], rtol=1e-14)
