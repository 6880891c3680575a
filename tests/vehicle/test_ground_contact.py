"""Feet and hull on the ground: what touches, how fast it came, and what counts as a crash."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from blocks import blocks_of

from mjspace import run
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.runner.checks import NO_CRASH
from mjspace.runner.replay import verify
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.effects import effects_of
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.state_layout import StateLayout

GRAVITY = 4.902e12 / 1738e3**2  # m/s^2, at the site


def dropped(height: float, speed: float, *overrides: str, name: str = "lander") -> Assembly:
    """Return a lander without thrust, its soles so high [m] and coming down so fast [m/s]."""
    return assemble(
        *load(
            name,
            (
                "plant.engine.fails_at=0.001",
                f"initial.position=[0, 0, {1.8 + height}]",
                f"initial.velocity=[0, 0, {-speed}]",
                "initial.euler=[0, 0, 0]",
                "rates.control='10 ms'",
                "duration=0.6",
                *overrides,
            ),
        )
    )


def flown(assembly: Assembly) -> dict[str, Any]:
    blocks = list(fly(assembly, first_start(assembly, (0,))))
    rows: dict[str, Any] = {
        name: np.concatenate([block.rows["/truth"][name][:, 0] for block in blocks])
        for name in blocks[0].rows["/truth"]
    }
    rows["time"] = np.concatenate([block.time for block in blocks])
    rows["events"] = [event for block in blocks for event in block.events]
    return rows


def test_a_soft_touchdown_is_told_with_the_velocity_before_it() -> None:
    rows = flown(dropped(0.05, 0.2, "duration=8", "rates.control='20 ms'"))
    fall = np.sqrt(0.2**2 + 2.0 * GRAVITY * 0.05)  # 0.45 m/s
    (event,) = [event for event in rows["events"] if event[3].startswith("first contact")]
    # One integration step of 2 ms: 3 mm/s; the thrust of the first step takes as much.
    assert event[0] == pytest.approx((fall - 0.2) / GRAVITY, abs=0.006)
    assert rows["touchdown_velocity"][-1] == pytest.approx([0.0, 0.0, -fall], abs=0.01)
    assert "leg_0_foot, leg_1_foot, leg_2_foot, leg_3_foot, at 0.4" in event[3]
    before = rows["time"] < event[0]
    for name in ("contact", "foot_contact", "foot_force", "hull_contact"):
        assert not rows[name][before].any(), name
    np.testing.assert_array_equal(rows["touchdown_velocity"][before], rows["velocity"][before])
    assert rows["foot_contact"][-1].all()
    assert rows["contact"][-1, 0] == 1.0
    assert not rows["hull_contact"].any()
    assert not rows["crash"].any()
    # It stands: each foot bears a quarter of 100 kg, less nothing.
    assert rows["foot_force"][-1] == pytest.approx(np.full(4, 25.0 * GRAVITY), rel=0.02)
    assert rows["hull_force"][-1, 0] == 0.0


def test_a_hull_that_hits_the_ground_is_a_crash_at_the_right_time_and_speed() -> None:
    """On its side the knees come first: 1.38 m below the middle, and 62 m/s."""
    rows = flown(dropped(6.0, 62.0, "initial.euler=[1.5708, 0, 0]", "duration=0.2"))
    crash, *more = [event for event in rows["events"] if event[3].startswith("crash")]
    assert not more
    assert crash[2] == "ERROR"
    lowest = 7.8 - 1.48  # a pad is 1.3 m out and 0.06 m thick, at -1.74; the knee reaches 1.38
    assert crash[0] == pytest.approx(lowest / 62.0, abs=0.01)
    assert np.linalg.norm(rows["crash_velocity"][-1]) == pytest.approx(62.2, abs=0.3)
    assert rows["crash"][rows["time"] < crash[0]].sum() == 0.0
    assert rows["crash"][rows["time"] >= crash[0]].all()


def test_legs_pressed_beyond_their_stroke_are_a_crash_before_the_hull_touches() -> None:
    rows = flown(dropped(0.1, 9.0))
    (crash,) = [event for event in rows["events"] if event[3].startswith("crash")]
    assert "pressed beyond its stroke of 0.3 m" in crash[3]
    k = int(np.argmax(rows["crash"][:, 0] > 0.0))
    assert not rows["hull_contact"][k, 0]
    assert flown(dropped(0.1, 4.0))["crash"].sum() == 0.0  # 0.16 m


def test_one_that_hits_at_1000_m_per_s_is_found_between_two_steps() -> None:
    for name in ("lander", "lander-craters"):
        rows = flown(dropped(20.0, 1000.0, "duration=0.05", name=name))
        assert rows["crash"][-1, 0] == 1.0, name
        assert rows["crash_velocity"][-1, 2] == pytest.approx(-1000.0, abs=0.1)


def test_a_crash_fails_the_flight_unless_the_scenario_looks_at_it(tmp_path: Path) -> None:
    overrides = [
        *("duration=0.2", "plant.engine.fails_at=0.001", "initial.position=[0, 0, 4]"),
        *("initial.velocity=[0, 0, -30]", "initial.euler=[0, 0, 0]", "events=[]"),
    ]
    result = run("lander", overrides=[*overrides, "checks=[]"], out=tmp_path / "a")
    assert [verdict.check for verdict in result.verdicts] == [NO_CRASH]
    assert not result.passed
    own = "checks=[{name='it crashes', signal='truth.crash', above=0.5}]"
    assert run("lander", overrides=[*overrides, own], out=tmp_path / "b").passed
    assert verify(result.path, start=0.1) is None


def test_without_a_ground_nothing_is_touched() -> None:
    assembly = assemble(*load("lander-printed"))
    layout = StateLayout(assembly)
    assert not effects_of(assembly, layout, [0])
    row = first_start(assembly, (0,)).physics
    row[:, layout.struts] = 0.1
    truth = layout.truth(row)
    for part, size in ((truth.contact, 1), (truth.foot_contact, 4), (truth.hull_contact, 1)):
        np.testing.assert_array_equal(part, np.zeros((1, size)))


@pytest.mark.parametrize("name", ["lander", "lander-craters", "lander-slope"])
@pytest.mark.parametrize(("height", "depth"), [(-50.0, 51.0), (1.7, 0.05)])
def test_a_start_in_the_ground_is_refused(name: str, height: float, depth: float) -> None:
    with pytest.raises(InputError, match=r"initial\.position: the vehicle begins in the g") as told:
        assemble(*load(name, [f"initial.position=[0, 0, {height}]"]))
    assert float(str(told.value).split(" is ")[1].split(" m deep")[0]) > depth


def test_a_start_on_the_ground_is_not_refused() -> None:
    assemble(*load("lander", ["initial.position=[0, 0, 1.799]"]))


def test_no_event_depends_on_the_length_of_a_block() -> None:
    told = []
    for periods in (500, 1):
        with blocks_of(periods):
            told.append(flown(dropped(0.4, 9.0, "initial.euler=[0.1, 0, 0]"))["events"])
    assert told[0] == told[1]
    assert {event[3][:5] for event in told[0]} >= {"first", "crash"}


def surface(assembly: Assembly, x: float, y: float) -> float:
    """Return how high the ground is at a place [m], where MuJoCo's plane is."""
    model = assembly.vehicle.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    ground = model.geom("site_ground").id
    normal, origin = data.geom_xmat[ground].reshape(3, 3)[:, 2], data.geom_xpos[ground]
    return float(
        origin[2] - (normal[0] * (x - origin[0]) + normal[1] * (y - origin[1])) / normal[2]
    )


@pytest.mark.parametrize("downhill", [0.0, 30.0, 90.0, 135.0, -100.0])
def test_the_slope_leads_down_the_way_it_says(downhill: float) -> None:
    assembly = assemble(*load("lander-slope", [f"plant.ground.downhill='{downhill} deg'"]))
    way = np.array([np.cos(np.radians(downhill)), np.sin(np.radians(downhill))])
    for x, y in ((3.0, 0.0), (0.0, 2.0), (-4.0, 5.0)):
        fall = np.tan(np.radians(10.0)) * float(way @ [x, y])
        assert surface(assembly, x, y) == pytest.approx(-fall, abs=1e-12)


def slides(slope: float) -> Array:
    """Return how far [m] the lander has slid after each control period on so steep a slope."""
    lean = np.radians(slope)
    rows = flown(
        dropped(
            0.0, 0.0, f"plant.ground.slope='{slope} deg'", f"initial.euler=[0, {lean}, 0]",
            f"initial.position=[0, 0, {1.8 / np.cos(lean) + 0.01}]", "duration=3",
            "rates.control='20 ms'",
        )
    )  # fmt: skip
    assert not rows["crash"].any()
    return np.asarray(rows["position"][:, 0])


def test_the_pads_that_fly_hold_on_what_their_friction_of_0_6_holds() -> None:
    """tan 20 deg is 0.36 and tan 34 deg 0.67; pads of 0.1 would slide on both."""
    stands = slides(20.0)
    # It settles by 7 mm in the last second; pads of 0.1 would slide by 0.4 m and more.
    assert abs(stands[-1] - stands[-50]) < 0.02
    # Sliding, it gains (sin 34 - 0.6 cos 34) g = 0.10 m/s^2.
    moves = slides(34.0)
    speed = np.diff(moves)[-1] / 0.02 / np.cos(np.radians(34.0))
    assert speed > 0.1
