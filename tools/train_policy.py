"""Train the policy that scenario learned-slew flies, with PPO of Stable-Baselines3: minutes.

``python tools/train_policy.py`` needs ``pip install 'mjspace[gym]' stable-baselines3``. It writes
the network's weights into the scenario's file, ``mjspace/scenarios/learned_slew.npz``.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from mjspace import gym

SCENARIO = "learned-slew"
WEIGHTS = Path(__file__).parents[1] / "mjspace/scenarios/learned_slew.npz"
EPISODE = 120  # control periods


class Vectorised(VecEnv):
    """A vector environment of Gymnasium's as one of Stable-Baselines3; actions from -1 to 1."""

    def __init__(self, envs: Any) -> None:
        self.envs = envs
        self.centre = (envs.single_action_space.high + envs.single_action_space.low) / 2
        self.half = (envs.single_action_space.high - envs.single_action_space.low) / 2
        actions = Box(-1.0, 1.0, self.half.shape, np.float32)
        super().__init__(envs.num_envs, envs.single_observation_space, actions)

    def reset(self) -> Any:
        """Begin an episode in each."""
        seeds = list(self._seeds)
        self._reset_seeds()
        return self.envs.reset(seed=seeds)[0]

    def step_async(self, actions: Any) -> None:
        """Take the actions of the next step."""
        self._actions = self.centre + self.half * np.asarray(actions, dtype=float)

    def step_wait(self) -> Any:
        """Step; where an episode is over, the observation is that of the next one."""
        observed, reward, ends, late, told = self.envs.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row in np.flatnonzero(ends | late):
            infos[row] = {
                "terminal_observation": told["final_obs"][row],
                "TimeLimit.truncated": bool(late[row] and not ends[row]),
            }
        return observed, reward, ends | late, infos

    def close(self) -> None:
        """Free what rendering needs."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return the attribute, once for each environment."""
        return [getattr(self.envs, attr_name, None) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: they have nothing to set."""
        raise NotImplementedError

    def env_method(self, method_name: str, *_: Any, indices: Any = None, **__: Any) -> list[Any]:
        """Refuse: they have no methods of their own."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Return False for each."""
        return [False for _ in self._get_indices(indices)]


def main() -> None:
    """Train, and write the weights."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=800_000, help="control periods")
    parser.add_argument("--envs", type=int, default=64, help="episodes at once")
    parser.add_argument("--out", type=Path, default=WEIGHTS, help="the file of weights")
    options = parser.parse_args()
    began, cpu = time.perf_counter(), time.process_time()
    torch.set_num_threads(1)  # of so small a network, more only wait for each other
    envs = gym.load_vector(SCENARIO, options.envs, autoreset_mode=AutoresetMode.SAME_STEP)
    vectorised = Vectorised(envs)
    normalized = VecNormalize(VecMonitor(vectorised), clip_obs=np.inf, gamma=0.98)
    model = PPO(
        "MlpPolicy",
        normalized,
        n_steps=EPISODE,
        batch_size=1920,
        n_epochs=10,
        gamma=0.98,
        gae_lambda=0.95,
        learning_rate=lambda left: 1e-3 * left + 1e-5,
        policy_kwargs={"net_arch": [32, 32], "log_std_init": -0.7},
        seed=0,
        device="cpu",
        verbose=1,
    )
    model.learn(options.steps)
    np.savez(options.out, **weights_of(model, normalized, vectorised))
    print(
        f"{options.out}: {options.out.stat().st_size} bytes after "
        f"{time.perf_counter() - began:.0f} s, {time.process_time() - cpu:.0f} s of processor time"
    )


def weights_of(model: Any, normalized: Any, vectorised: Vectorised) -> dict[str, Any]:
    """Return weights and biases of the policy's network, by layer, from SI to SI.

    The normalization of the observation becomes part of the first layer, the range of the actions
    of the last one.
    """
    policy = model.policy
    layers = [
        layer for layer in policy.mlp_extractor.policy_net if isinstance(layer, torch.nn.Linear)
    ]
    arrays = [
        (layer.weight.detach().numpy().astype(float), layer.bias.detach().numpy().astype(float))
        for layer in (*layers, policy.action_net)
    ]
    mean = normalized.obs_rms.mean
    scale = np.sqrt(normalized.obs_rms.var + normalized.epsilon)
    weight, bias = arrays[0]
    arrays[0] = weight / scale, bias - weight @ (mean / scale)
    weight, bias = arrays[-1]
    half = vectorised.half
    arrays[-1] = half[:, None] * weight, half * bias + vectorised.centre
    found = {f"weights{number}": weight for number, (weight, _) in enumerate(arrays)}
    return found | {f"biases{number}": bias for number, (_, bias) in enumerate(arrays)}


if __name__ == "__main__":
    main()
