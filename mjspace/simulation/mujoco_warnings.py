"""MuJoCo's own log of warnings: the terminal and a file in the working folder."""

import mujoco


def silence() -> None:
    """Let MuJoCo neither print its warnings nor write them to a file: we report them."""
    config = mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = False
    mujoco.MjLogConfig.set(config)
