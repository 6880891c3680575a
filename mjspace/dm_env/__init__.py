"""The scenarios as dm_control environments: ``mjspace.dm_env.load(scenario)``."""

from mjspace.dm_env.environment import load

__all__ = ["load"]
