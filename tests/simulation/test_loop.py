"""The loop on the real plant: against an independent integration, against itself, in trouble."""

import re
from pathlib import Path

import numpy as np
import oracle
import pytest
from blocks import blocks_of

from mjspace.attitude import rotation_angle
from mjspace.contract import Measurement, Reference
from mjspace.errors import FlightError
from mjspace.scenario.loading import load
from mjspace.simulation import loop
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block
from mjspace.simulation.state_layout import StateLayout
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

pytestmark = pytest.mark.filterwarnings(
    f"ignore::{UnphysicalInertiaWarning.__module__}.UnphysicalInertiaWarning"
)

NOISY = [
    "sensors.rate.noise_std=0.01",
    "sensors.rate.bias_walk=0.001",
    "sensors.attitude.noise_std=1e-4",
    "sensors.attitude.period='4 ms'",
    "sensors.attitude.delay='8 ms'",
    "plant.wheels.torque_limit=5",
    "plant.wheels.coulomb_friction=0.01",
]


def assembly(
    name: str = "contraction-adaptive", *overrides: str, folder: Path | None = None
) -> Assembly:
    scenario, beside = load(name, overrides)
    return assemble(scenario, folder or beside)


def flown(built: Assembly, members: tuple[int, ...] = (0,), threads: int = 1) -> list[Block]:
    return list(fly(built, first_start(built, members), members, threads=threads))


def rows(blocks: list[Block], topic: str, field: str, vehicle: int = 0) -> np.ndarray:
    return np.concatenate([block.rows[topic][field][:, vehicle] for block in blocks])


def state_bytes(blocks: list[Block], vehicle: int = 0) -> dict[str, bytes]:
    return {f: rows(blocks, "/state", f, vehicle).tobytes() for f in blocks[0].rows["/state"]}


def test_times_and_shapes() -> None:
    blocks = flown(assembly("contraction-ideal", "duration=0.7", "rates.control='2 ms'"))
    time = np.concatenate([block.time for block in blocks])
    np.testing.assert_allclose(time, np.arange(351) * 0.002, rtol=0, atol=1e-12)
    physics = rows(blocks, "/state", "physics")
    np.testing.assert_allclose(physics[:, 0], time, rtol=0, atol=1e-9)  # MuJoCo's own clock
    for fields in blocks[0].rows.values():
        for values in fields.values():
            assert values.shape[:2] == (len(blocks[0].time), 1)


def test_truth_is_of_the_same_instant_as_the_state() -> None:
    """Momentum, energy and disturbance come from the step that follows; they must not be late."""
    built = assembly(
        "contraction-ideal",
        "duration=0.05",
        "rates.control='5 ms'",
        "environment.torques=[{frame='inertial', bias=[1,2,3]}]",
    )
    blocks = flown(built)
    time = np.concatenate([block.time for block in blocks])
    momentum = rows(blocks, "/truth", "momentum")
    # A constant inertial torque: H = H0 + M t exactly; one step's lag would be 3e-3.
    np.testing.assert_allclose(
        momentum - momentum[0], time[:, None] * [1, 2, 3], rtol=0, atol=1e-12
    )
    spun = rows(blocks, "/truth", "rate"), rows(blocks, "/truth", "wheel_speed")
    vehicle = built.vehicle
    relative = spun[1] + spun[0] @ vehicle.wheel_axes.T
    energy = 0.5 * np.einsum("ni,ij,nj->n", spun[0], vehicle.inertia, spun[0])
    energy += 0.5 * (relative**2 @ vehicle.wheel_inertia)
    velocity = rows(blocks, "/truth", "velocity")
    assert np.abs(velocity).max() == 0.0
    np.testing.assert_allclose(rows(blocks, "/truth", "energy")[:, 0], energy, rtol=1e-12)


@pytest.mark.parametrize("overrides", [[], NOISY], ids=["ideal", "noisy"])
def test_alone_or_in_a_batch_at_any_thread_count_the_bits_are_the_same(
    overrides: list[str],
) -> None:
    built = assembly("contraction-adaptive", "duration=0.1", *overrides)
    members = tuple(range(64))
    one, two = flown(built, members, 1), flown(built, members, 2)
    for member in (0, 1, 63):
        alone = state_bytes(flown(built, (member,)))
        assert alone == state_bytes(one, member)
        assert alone == state_bytes(two, member)
    if overrides:  # and members differ, or the above would say little
        assert state_bytes(one, 0) != state_bytes(one, 1)


def test_any_period_is_a_start() -> None:
    built = assembly("contraction-adaptive", "duration=0.3", *NOISY)
    whole = flown(built)
    k = 137
    state = {f: rows(whole, "/state", f)[k : k + 1] for f in whole[0].rows["/state"]}
    law = built.law.reset(*_first_instant(built))
    start = Start(
        k,
        state["physics"],
        {f.removeprefix("sensor_"): v for f, v in state.items() if f.startswith("sensor_")},
        type(law)(*(state[f"law_{name}"] for name in law._fields)),
    )
    again = list(fly(built, start))
    for field in state:
        assert rows(again, "/state", field).tobytes() == rows(whole, "/state", field)[k:].tobytes()


def _first_instant(built: Assembly) -> tuple[Measurement, Reference]:
    start = first_start(built, (0,))
    reference = Reference(*(a[0] for a in built.reference.at(np.zeros(1))))
    return StateLayout(built).truth(start.physics), reference


LAW = """
from typing import NamedTuple
import numpy as np

class Command(NamedTuple):
    torque: np.ndarray

class Signals(NamedTuple):
    time: float

class Law:
    def __init__(self, trouble=""):
        self.trouble = trouble

    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        torque = np.zeros(3)
        if time > 0.0105 and self.trouble == "nan":
            torque[1] = np.nan
        if time > 0.0105 and self.trouble == "raise":
            1 / 0
        if self.trouble == "at once":
            1 / 0
        if self.trouble == "no torque":
            return None, Signals(time), Signals(time)
        if self.trouble == "two":
            return None, Command(np.zeros(2)), Signals(time)
        if time > 0.0105 and self.trouble == "huge":
            torque[0] = 1e300
        return None, Command(torque), Signals(time)
"""


@pytest.fixture
def law(tmp_path: Path) -> Path:
    (tmp_path / "law.py").write_text(LAW)
    return tmp_path


@pytest.mark.parametrize(
    ("trouble", "message"),
    [
        ("nan", r"/command\.torque is not finite, or beyond 1e10, at t = 0\.011 s"),
        ("raise", r"t = 0\.011 s: the law raised ZeroDivisionError at law\.py:\d+: division"),
        ("huge", r"/command\.torque is not finite, or beyond 1e10, at t = 0\.011 s"),
    ],
)
def test_trouble_ends_the_flight_and_keeps_every_good_period(
    law: Path, trouble: str, message: str
) -> None:
    built = assembly(
        "contraction-ideal",
        "duration=2",
        "law={kind='law.py:Law'}",
        f"law.trouble={trouble!r}",
        folder=law,
    )
    kept: list[Block] = []
    with pytest.raises(FlightError, match=message):
        kept.extend(fly(built, first_start(built, (0,))))
    assert sum(len(block.time) for block in kept) == 11  # 0 to 10 ms
    for fields in (fields for block in kept for fields in block.rows.values()):
        for values in fields.values():
            assert np.isfinite(values).all()


@pytest.mark.parametrize(
    ("trouble", "message"),
    [
        ("at once", "t = 0 s: the law raised ZeroDivisionError"),
        ("no torque", "t = 0 s: the law's command, a Signals, has no field 'torque'"),
        ("two", "t = 0 s: the law's command: torque has shape (..., 2): it must"),
    ],
)
def test_a_law_that_cannot_be_flown_is_told_so(law: Path, trouble: str, message: str) -> None:
    changes = ["duration=0.01", "law={kind='law.py:Law'}", f"law.trouble={trouble!r}"]
    built = assembly("contraction-ideal", *changes, folder=law)
    with pytest.raises(FlightError, match=re.escape(message)):
        flown(built)


OWN = """
import numpy as np
from typing import NamedTuple
from mjspace.contract import TorqueCommand


class Law:
    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        turning = float(np.linalg.norm(measurement.rate)) > 1.0
        return None, TorqueCommand(np.full(3, 0.1 if turning else 0.0)), None
"""


def test_stop_is_obeyed_at_once(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    calls = 0

    def stop() -> bool:
        nonlocal calls
        calls += 1
        return calls > 20

    built = assembly("contraction-ideal", "law={kind='own.py:Law'}", folder=tmp_path)
    blocks = list(fly(built, first_start(built, (0,)), stop=stop))
    # Called once more after each block, of which a slow machine makes more.
    assert sum(len(block.time) for block in blocks) == 22 - len(blocks)


def test_stop_is_obeyed_after_the_block_where_its_inside_is_compiled() -> None:
    built = assembly("contraction-ideal")
    (block,) = fly(built, first_start(built, (0,)), stop=lambda: True)
    assert 1 <= len(block.time) <= loop.BLOCK_PERIODS


def test_a_disturbance_of_ones_own_acts_and_is_logged(tmp_path: Path) -> None:
    (tmp_path / "push.py").write_text(
        "import numpy as np\n"
        "def push(time, truth):\n"
        "    return [0, 0, 0.5], [0.1, 0, 0] if time < 0.0495 else [0, 0, 0]\n"
    )
    (tmp_path / "law.py").write_text(LAW)
    built = assembly(
        "contraction-ideal",
        "duration=0.1",
        "rates.control='10 ms'",
        "law={kind='law.py:Law'}",
        "environment.python='push.py:push'",
        "initial={attitude=[0,1,0,0]}",
        folder=tmp_path,
    )
    blocks = flown(built)
    force, torque = rows(blocks, "/disturbance", "force"), rows(blocks, "/disturbance", "torque")
    np.testing.assert_allclose(force, np.tile([0, 0, 0.5], (11, 1)), atol=1e-15)
    np.testing.assert_allclose(torque[:5, 0], 0.1, atol=1e-15)
    np.testing.assert_allclose(torque[5:, 0], 0.0, atol=1e-15)
    momentum = rows(blocks, "/truth", "momentum")
    # 0.1 N m about body x for 50 steps of 1 ms, upside down about x; the body turns 1e-5 rad
    # meanwhile, and the torque with it.
    np.testing.assert_allclose(momentum[-1], [5e-3, 0, 0], rtol=0, atol=2e-8)
    mass = built.vehicle.model.body_subtreemass[1]
    np.testing.assert_allclose(
        rows(blocks, "/truth", "velocity")[-1], [0, 0, 0.05 / mass], rtol=1e-9, atol=1e-15
    )


def test_a_period_that_breaks_off_is_logged(tmp_path: Path) -> None:
    (tmp_path / "push.py").write_text(
        "import numpy as np\n"
        "def push(time, truth):\n"
        "    assert time < 0.0235, 'too late'\n"
        "    return np.zeros(3), np.zeros(3)\n"
    )
    built = assembly(
        "contraction-ideal",
        *("duration=0.1", "rates.control='10 ms'", "environment.python='push.py:push'"),
        folder=tmp_path,
    )
    blocks = fly(built, first_start(built, (0,)))
    np.testing.assert_allclose(next(blocks).time, [0.0, 0.01, 0.02])
    with pytest.raises(FlightError, match=r"stopped at t = 0\.02 s: the disturbance raised"):
        next(blocks)


@pytest.mark.parametrize(
    ("count", "seconds", "fit"),
    [(2000, 0.0, 2000), (2000, 1e-3, 250), (200, 1e-3, 200), (2000, 9.0, 2), (1, 9.0, 1)],
)
def test_a_block_has_as_many_periods_as_its_time_allows(
    count: int, seconds: float, fit: int
) -> None:
    assert loop._in_a_block(count, seconds) == fit


CASES = {
    "contraction-ideal": 1e-8,
    "contraction-adaptive": 1e-8,
    "contraction-gradient": 1e-8,
    "immersion-invariance": 1e-8,
}


@pytest.mark.parametrize("name", CASES)
def test_against_an_independent_integration_of_the_sampled_loop(name: str) -> None:
    """Attitude within 1e-8 rad: two RK4s of the same sampled loop, at 1 ms, on different equations.

    Measured: 2e-13 (ideal) to 3e-11 (2 kN m).
    """
    built = assembly(name, "duration=2")
    blocks = flown(built)
    start = first_start(built, (0,))
    truth = StateLayout(built).truth(start.physics)
    other = oracle.fly(
        built.law,
        built.reference,
        H=built.vehicle.inertia,
        wheel_axes=built.vehicle.wheel_axes,
        Jw=built.vehicle.wheel_inertia,
        q0=truth.attitude[0],
        w0=truth.rate[0],
        Omega0=truth.wheel_speed[0],
        duration=2.0,
    )
    apart = rotation_angle(rows(blocks, "/truth", "attitude"), other.attitude)
    assert apart.max() < CASES[name]


BETWEEN = ("rates.control=0.01", "plant.parts.east.deployment.at=0.1034", "duration=0.9")
"""The weights are released, and let go, between two control instants."""


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("contraction-adaptive", ("duration=0.6", "plant.wheels.torque_limit=5")),
        ("detumble-wheels", ("duration=1", "faults=[{motor='wheel_0', kind='dead', at=0.5}]")),
        ("yo-yo-despin", BETWEEN),
    ],
)
def test_rows_and_events_do_not_depend_on_the_blocks(name: str, overrides: tuple[str, ...]) -> None:
    built = assembly(name, *overrides)
    found = {}
    for periods in (500, 7, 1):
        with blocks_of(periods):
            blocks = flown(built)
        assert max(len(block.time) for block in blocks) <= periods
        whole = {
            (topic, field): rows(blocks, topic, field).tobytes()
            for topic, fields in blocks[0].rows.items()
            for field in fields
        }
        found[periods] = whole, [event for block in blocks for event in block.events]
    assert found[500][1]
    assert found[7] == found[500]
    assert found[1] == found[500]
