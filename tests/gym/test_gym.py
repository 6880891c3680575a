"""Scenarios as Gymnasium environments: the same flights, Gymnasium's contract, one or many."""

import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from compiled_flights import flown
from gymnasium.error import ResetNeeded, UnsupportedMode
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from mjspace import gym
from mjspace.campaign.members import Campaign, population
from mjspace.errors import InputError
from mjspace.vehicle.model_checks import ModelWarning
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

pytestmark = [
    pytest.mark.filterwarnings(f"ignore::{kind.__module__}.{kind.__name__}")
    for kind in (UnphysicalInertiaWarning, ModelWarning)
]

TUMBLING = [
    "checks=[]",
    "sensors.rate.noise_std=0.01",
    "sensors.rate.bias_walk=0.001",
    "sensors.attitude={noise_std=1e-4,delay='10 ms'}",
    "faults=[{motor='wheel_1',kind='noisy',value=0.01,at=0.03},{sensor='rate',kind='stuck',at=0.1}]",
    "dispersions=[{key='initial.rate',distribution='on_sphere',radius=0.3},"
    "{key='initial.attitude',distribution='random_attitude'}]",
]


def tumbling(*overrides: str) -> list[str]:
    return [*TUMBLING, *overrides]


@pytest.mark.filterwarnings("ignore:.*A Box:UserWarning", "ignore:.*alternative render modes")
@pytest.mark.filterwarnings("ignore:.*For Box action spaces:UserWarning")
@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [
        ("detumble-wheels", tumbling("duration=0.2")),
        ("lander", ["duration=0.2"]),
        ("b-dot", ["duration=40"]),
        ("dgvscmg-tracking", ["duration=0.01", "rates.control='0.1 ms'"]),
    ],
)
def test_gymnasium_accepts_it(scenario: str, overrides: list[str]) -> None:
    check_env(gym.load(scenario, overrides))


def commanded(scenario: str, overrides: Sequence[str], member: int) -> tuple[Any, Any]:
    """Fly a member of a campaign under its law; return its rows, and its commands as actions."""
    members = population(Campaign(scenario, tuple(overrides), 1000), alike=True)
    built = members.member(member)[0] if members.dispersions else members.nominal
    rows = flown(built, [member]).rows
    taken = [name for kind in built.actuators.kinds for name in kind.takes]
    columns = [rows[f"/command.{name}"][:, 0] for name in taken]
    return rows, np.concatenate([c.reshape(len(c), -1) for c in columns], axis=1)


def same_state(rows: Any, number: int, state: dict[str, np.ndarray]) -> bool:
    logged = {n: a for n, a in rows.items() if n.startswith("/state.") and ".law_" not in n}
    assert logged.keys() == {f"/state.{name}" for name in state}
    return all(logged[f"/state.{n}"][number, 0].tobytes() == a.tobytes() for n, a in state.items())


@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [
        ("detumble-wheels", tumbling("duration=0.3")),
        ("lander", ["duration=0.2", "checks=[]"]),
        (
            "yo-yo-despin",
            ["checks=[]", "duration=0.4", "rates.physics=0.005", "rates.control=0.01"],
        ),
    ],
)
def test_the_same_commands_are_the_same_flight_bit_for_bit(
    scenario: str, overrides: list[str]
) -> None:
    rows, actions = commanded(scenario, overrides, 7)
    alone, several = gym.load(scenario, overrides), gym.load_vector(scenario, 3, overrides)
    alone.reset(options={"member": 7})
    several.reset(options={"member": [3, 7, 11]})
    for number, action in enumerate(actions):
        assert same_state(rows, number, alone.state())
        assert same_state(rows, number, several.state(1))
        if number < len(actions) - 1:
            *_, over, _ = alone.step(action)
            several.step(np.stack([0 * action, action, -action]))
    assert over  # with the scenario's duration


ENDS = "task.terminate=[{signal='measurement.rate[0]',above=0.15,reward=-5}]"


class Singles:
    """Single environments, reset as a vector environment does it."""

    def __init__(self, seed: int, count: int, overrides: Sequence[str]) -> None:
        self.all = [gym.load("detumble-wheels", overrides) for _ in range(count)]
        self.first = np.array([env.reset(seed=seed + i)[0] for i, env in enumerate(self.all)])
        self.over = [False] * count

    def step(self, actions: np.ndarray, mode: AutoresetMode) -> list[Any]:
        """Return (observation, reward, terminated, truncated) of each."""
        found = []
        for i, (env, action) in enumerate(zip(self.all, actions, strict=True)):
            if self.over[i]:
                found.append((env.reset()[0], 0.0, False, False))
                self.over[i] = False
                continue
            observation, reward, ends, late, _ = env.step(action)
            self.over[i] = ends or late
            if self.over[i] and mode is not AutoresetMode.NEXT_STEP:
                observation, self.over[i] = env.reset()[0], False
            found.append((observation, reward, ends, late))
        return found


@pytest.mark.parametrize("mode", AutoresetMode)
def test_each_of_many_is_the_one_of_its_seed(mode: AutoresetMode) -> None:
    overrides = tumbling("duration=0.15", ENDS)
    several = gym.load_vector("detumble-wheels", 4, overrides, autoreset_mode=mode)
    assert several.metadata["autoreset_mode"] is mode
    alone = Singles(5, 4, overrides)
    observation, _ = several.reset(seed=5)
    np.testing.assert_array_equal(observation, alone.first)
    random, early, late = np.random.default_rng(0), 0, 0
    for _ in range(45):
        actions = random.normal(scale=100.0, size=(4, 3))
        observation, reward, ends, over, info = several.step(actions)
        if mode is AutoresetMode.SAME_STEP and (ends | over).any():
            np.testing.assert_array_equal(info["_final_obs"], ends | over)
            np.testing.assert_array_equal(info["_member"], ends | over)
        if mode is AutoresetMode.DISABLED and (ends | over).any():
            observation, _ = several.reset(options={"reset_mask": ends | over})
        expected = zip(*alone.step(actions, mode), strict=True)
        for got, want in zip((observation, reward, ends, over), expected, strict=True):
            np.testing.assert_array_equal(got, want)
        early, late = early + ends.sum(), late + over.sum()
    assert early > 3  # of which each leaves others in flight
    assert late > 0


def test_a_seed_is_an_episode() -> None:
    env = gym.load("detumble-wheels", tumbling("duration=0.1"))
    (first, one), (again, same), (other, _) = (env.reset(seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert one == same
    assert not np.array_equal(first, other)
    following, _ = env.reset()
    env.reset(seed=2)
    np.testing.assert_array_equal(env.reset()[0], following)


def test_what_is_dispersed_arrives() -> None:
    env = gym.load("detumble-wheels", [*TUMBLING[:1], *TUMBLING[-1:], "duration=0.1"])
    observed = np.array([env.reset(seed=s)[0] for s in range(20)]).T
    named = dict(zip(env.observation_labels, observed, strict=True))
    attitude = np.stack([named[f"attitude[{i}]"] for i in range(4)], axis=1)
    rate = np.stack([named[f"rate[{i}]"] for i in range(3)], axis=1)
    np.testing.assert_allclose(np.linalg.norm(rate, axis=1), 0.3, rtol=1e-12)
    assert np.std(rate / 0.3, axis=0) == pytest.approx(np.full(3, 3**-0.5), abs=0.2)
    assert np.std(attitude, axis=0) == pytest.approx(np.full(4, 0.5), abs=0.2)


def test_faults_and_deployments_happen_in_an_episode() -> None:
    out = ["plant.parts.boom.deployment.at=0.2", "faults=[]", "rates.physics=0.05"]
    overrides = ["checks=[]", "duration=0.6", "rates.control=0.1", *out]
    faulty = tumbling("duration=0.2")
    for scenario, changes, first, text in (
        ("gravity-gradient-boom", overrides, 0.2, "boom"),
        ("detumble-wheels", faulty, 0.03, "fault: wheel_1 is noisy"),
    ):
        several = gym.load_vector(scenario, 2, changes)
        several.reset(seed=0)
        zeros = np.zeros((2, len(several.action_labels)))
        told = []
        for _ in range(8):
            *_, info = several.step(zeros)
            told += [e for events in info.get("events", []) for e in events or ()]
        assert {event.vehicle for event in told} == {0, 1}
        assert (told[0].time, text in told[0].message) == (pytest.approx(first), True)


def test_an_episode_terminates_where_the_state_is_not_finite() -> None:
    overrides = ["duration=0.2", "checks=[]"]
    several = gym.load_vector("detumble-wheels", 3, overrides)
    first, _ = several.reset(seed=0)
    actions = np.zeros((3, 3))
    actions[1] = np.nan
    observation, reward, ends, over, _ = several.step(actions)
    np.testing.assert_array_equal(ends, [False, True, False])
    assert not over.any()
    assert reward[1] == 0.0 < reward[0]
    np.testing.assert_array_equal(observation[1], first[1])  # the last one that was finite
    assert (observation[0] != first[0]).any()
    observation, reward, ends, _, _ = several.step(np.zeros((3, 3)))
    assert not ends.any()
    assert reward[1] == 0.0 < reward[0]  # that step was its reset
    assert several.step(np.zeros((3, 3)))[1][1] > 0.0


def test_it_renders() -> None:
    env = gym.load("detumble-wheels", ["duration=0.1"], render_mode="rgb_array")
    env.reset()
    picture = env.render()
    env.close()
    assert picture.shape == (270, 480, 3)
    assert picture.std() > 10.0
    several = gym.load_vector("rcs-schmitt", 2, ["duration=0.1"], render_mode="rgb_array")
    several.reset(seed=0)
    several.step(np.ones((2, len(several.action_labels))))
    one, other = several.render() or ((), ())
    several.close()
    np.testing.assert_array_equal(one, other)


def test_it_says_what_is_wrong() -> None:
    env = gym.load("detumble-wheels", ["duration=0.01"])
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))
    with pytest.raises(ValueError, match="options: no 'start': have 'member'"):
        env.reset(options={"start": 1})
    with pytest.raises(ValueError, match="member -1: should be a whole number from 0"):
        env.reset(options={"member": -1})
    env.reset()
    with pytest.raises(
        ValueError, match=r"has shape \(2,\): it must be \(3,\), of torque\[0\] \[N m"
    ):
        env.step(np.zeros(2))
    env.step(np.zeros(3))
    env.step(np.zeros(3))
    with pytest.raises(ResetNeeded, match="the episode is over"):
        env.step(np.zeros(3))
    with pytest.raises(UnsupportedMode, match="render_mode 'human': should be 'rgb_array'"):
        gym.load("detumble-wheels", render_mode="human")
    with pytest.raises(InputError, match="num_envs: got 0, should be at least 1"):
        gym.load_vector("detumble-wheels", 0)
    several = gym.load_vector("detumble-wheels", 2, ["duration=0.01"])
    with pytest.raises(ValueError, match=r"seed: got \[1\], should be one for each of 2"):
        several.reset(seed=[1])
    with pytest.raises(ValueError, match=r"reset_mask .*should be an array of 2 truth values"):
        several.reset(options={"reset_mask": np.zeros(2, bool)})
    several.reset()
    with pytest.raises(ValueError, match=r"the actions have shape \(3,\): it must be \(2, 3\)"):
        several.step(np.zeros(3))


def test_a_law_is_not_flown() -> None:
    with pytest.raises(InputError, match=r"faults\.0\.when\.signal: law\.path: an environment fl"):
        gym.load("wheel-stuck")
    drawn = "dispersions=[{key='law.rate_gain',distribution='uniform',low=1,high=2}]"
    with pytest.raises(InputError, match=r"dispersions\.0\.key: law\.rate_gain: an environment fl"):
        gym.load("detumble-wheels", [drawn])


@pytest.mark.slow
def test_gymnasium_is_asked_for_in_one_line_and_dm_control_is_not_imported() -> None:
    code = """
import sys
sys.modules["gymnasium"] = None
try:
    import mjspace.gym
except ImportError as error:
    print(error)
del sys.modules["gymnasium"]
import mjspace.gym
print([name for name in sys.modules if name.startswith("dm_")])
"""
    said = subprocess.check_output([sys.executable, "-c", code], text=True).splitlines()
    assert said == ["mjspace.gym needs gymnasium: pip install 'mjspace[gym]'", "[]"]
