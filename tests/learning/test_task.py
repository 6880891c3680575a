"""The task of a learner: what its observations and rewards are, and what is refused."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from mjspace import attitude, gym
from mjspace.errors import FlightError, InputError

START = [
    "duration='10 s'",
    "checks=[]",
    "rates.control='1 s'",
    "rates.physics='0.1 s'",
    "initial={attitude=[0.8, 0, 0.6, 0], rate=[0.1, 0, 0]}",
    "reference={kind='references:Turning',attitude=[0.6, 0.8, 0, 0],rate=[0, 0, 0.2]}",
]


def stepped(*overrides: str, actions: Sequence[Any] = ((0, 0, 0),)) -> tuple[Any, ...]:
    """Return what the last of the steps under these ``actions`` returns."""
    env = gym.load("detumble-wheels", [*START, *overrides])
    env.reset(seed=0)
    for action in actions:
        result = env.step(np.array(action, dtype=float))
    return result


def test_errors_are_those_of_the_measurement_in_body_axes() -> None:
    names = "['error.attitude','error.rate','measurement.attitude','measurement.rate',"
    names += "'reference.attitude','reference.rate','truth.attitude_error']"
    observation, *_ = stepped(f"task.observation={names}")
    turn, rate, q, w, q_ref, w_ref, error = np.split(observation, [3, 6, 10, 13, 17, 20])
    reached = attitude.multiply(q_ref, attitude.from_rotation_vector(turn))
    np.testing.assert_allclose(reached * np.sign(reached @ q), q, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(turn), error[0], rtol=1e-12)
    inertial = attitude.rotate(q, w) - attitude.rotate(q_ref, w_ref)
    np.testing.assert_allclose(attitude.rotate(q, rate), inertial, atol=1e-12)


def test_the_reward_is_the_sum_of_weighted_signals() -> None:
    names = "task.observation=['truth.attitude_error','truth.rate']"
    terms = (
        "task.reward=[{signal='truth.attitude_error',weight=-2},"
        "{signal='truth.rate',weight=-3,squared=true},"
        "{signal='command.torque[1:3]',weight=0.1}]"
    )
    observation, reward, *_ = stepped(names, terms, actions=[(0, 0, 0), (1, 3, -4)])
    error, *rate = observation
    assert reward == pytest.approx(-2 * error - 3 * np.dot(rate, rate) + 0.1 * 5, rel=1e-12)


def test_an_episode_ends_where_the_task_says() -> None:
    ends = "task.terminate=[{signal='truth.rate',above='0.11 rad/s',reward=-7}]"
    terms = "task.reward=[{signal='truth.rate',weight=0}]"
    _, reward, ended, truncated, _ = stepped(ends, terms)
    assert (reward, ended, truncated) == (0.0, False, False)
    _, reward, ended, truncated, _ = stepped(ends, terms, actions=[(0, 0, 0), (5, 0, 0)])
    assert (reward, ended, truncated) == (-7.0, True, False)
    *_, ended, truncated, _ = stepped(actions=[(0, 0, 0)] * 10)
    assert (ended, truncated) == (False, True)


FUNCTION = """
def reward(time, truth, measurement, reference, command):
    return 1000 * time - truth.position[0] + measurement.rate[0] + command.torque[2]

def text(time, truth, measurement, reference, command):
    return "good"
"""


def test_a_function_of_ones_own_rewards(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(FUNCTION)
    own = f"task.reward_function='{tmp_path}/own.py:reward'"
    observation, reward, *_ = stepped(
        own, "task.observation=['measurement.rate']", actions=[(0, 0, 2)]
    )
    assert reward == pytest.approx(1000 * 1.0 + observation[0] + 2.0, rel=1e-12)
    with pytest.raises(FlightError, match="the reward returned 'good': it must return a number"):
        stepped(own.replace(":reward", ":text"))


@pytest.mark.parametrize(
    ("override", "said"),
    [
        (
            "task.observation=['truth.rates']",
            r"task\.observation\.0: no signal 'truth\.rates'",
        ),
        ("task.observation=['rate']", r"task\.observation\.0: signal 'rate': write topic\.field"),
        ("task.reward=[{signal='law.u',weight=1}]", r"task\.reward\.0\.signal: no signal 'law\.u'"),
        ("task.reward=[{signal='truth.rate'}]", r"task\.reward\.0\.weight: missing"),
        ("task.terminate=[{signal='truth.rate'}]", r"task\.terminate\.0: neither below nor above"),
        ("task.reward_function='none.py:f'", r"task\.reward_function: "),
        ("task.rewards=[]", r"task\.rewards: no such key.*reward"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(override: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        gym.load("detumble-wheels", [override])
    assert "\n" not in str(caught.value)
