"""What environments for reinforcement learning share: actions, observations, rewards, ends."""
