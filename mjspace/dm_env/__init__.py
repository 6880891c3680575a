"""The scenarios as dm_control environments: ``mjspace.dm_env.load(scenario)``."""

from mjspace.errors import missing

try:
    import dm_control  # noqa: F401 - it is what the modules below are made of
except ModuleNotFoundError:
    needed = "dm_control, which exists up to Python 3.12"
    raise ImportError(str(missing("mjspace.dm_env", needed, "dm"))) from None

from mjspace.dm_env.environment import load

__all__ = ["load"]
