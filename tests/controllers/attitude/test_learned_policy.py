"""The learned policy: what it computes, that it is flown as it was trained, what is refused."""

from typing import Any

import numpy as np
import pytest
from compiled_flights import flown
from mjspace.controllers.attitude.learned_policy import TorquePolicy

from mjspace.contract import Measurement, Reference
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

ERRORS = ["error.attitude", "error.rate"]


def test_it_computes_the_perceptron() -> None:
    random = np.random.default_rng(0)
    W0, W1, b0, b1 = (random.normal(size=shape) for shape in ((5, 6), (3, 5), 5, 3))
    law = TorquePolicy([W0.tolist(), W1.tolist()], [b0.tolist(), b1.tolist()], ERRORS)
    # A quarter turn about x from the desired attitude, which turns at 2 rad/s about its z: -y is
    # the desired axes' z in body axes.
    q = np.array([[0.5**0.5, 0.5**0.5, 0.0, 0.0]])
    rate = np.array([[0.1, 0.2, 0.3]])
    reference = Reference(np.array([1.0, 0, 0, 0]), np.array([0.0, 0, 2.0]), np.zeros(3))
    _, command, signals = law.step(None, 0.0, Measurement(attitude=q, rate=rate), reference)
    x = np.array([np.pi / 2, 0, 0, 0.1, 0.2 - 2.0, 0.3])
    np.testing.assert_allclose(signals.observation, [x], atol=1e-12)
    np.testing.assert_allclose(command.torque, [W1 @ np.tanh(W0 @ x + b0) + b1], rtol=1e-12)


def test_the_flight_of_a_learned_policy_passes_and_is_an_episode() -> None:
    gym = pytest.importorskip("mjspace.gym")
    rows = flown(assemble(*load("learned-slew"))).rows
    settled = rows["time"][:, 0] >= 45.0
    assert rows["/truth.attitude_error"][settled].max() < np.radians(3.0)
    assert rows["/truth.rate"][settled].max() < np.radians(0.5)
    env = gym.load("learned-slew", ["dispersions=[]"])
    observation, _ = env.reset(options={"member": 0})
    rewards: list[float] = []
    for torque, observed in zip(
        rows["/command.torque"][:, 0], rows["/law.observation"][:, 0], strict=True
    ):
        assert observation.tobytes() == observed.tobytes()  # as it was trained
        if len(rewards) < 120:
            observation, reward, *_ = env.step(torque)
            rewards.append(reward)
    rates = np.linalg.norm(rows["/truth.rate"][1:, 0], axis=1)
    np.testing.assert_allclose(rewards, -rows["/truth.attitude_error"][1:, 0, 0] - rates, rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"observation": ["truth.rate"]}, "observation: got 'truth.rate', should be a whole sig"),
        ({"observation": "error.rate"}, "observation: got 'error.rate', should be a list"),
        ({"biases": [[0, 0, 0]]}, "biases: of 1 layers, should be of 2"),
        ({"weights": [np.eye(3), np.ones((1, 3))], "biases": [[0, 0, 0], [0]]}, "has 1 rows, sho"),
        ({"weights": [np.eye(3), np.eye(4)]}, "weights: layer 1 is .4, 4., should be .rows, 3."),
        ({"weights": [[["x"]]]}, "weights: should be a list of arrays of finite numbers"),
    ],
)
def test_what_does_not_fit_is_said(changes: dict[str, Any], said: str) -> None:
    right = {"weights": [np.eye(3)] * 2, "biases": [np.zeros(3)] * 2, "observation": ERRORS}
    with pytest.raises(ValueError, match=said):
        TorquePolicy(**right | changes)


def test_an_observation_of_another_length_is_refused() -> None:
    law = TorquePolicy([np.eye(3)], [np.zeros(3)], ERRORS)
    still = Measurement(attitude=np.array([[1.0, 0, 0, 0]]), rate=np.zeros((1, 3)))
    reference = Reference(np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="are 6 numbers, the network's first layer takes 3"):
        law.reset(still, reference)
