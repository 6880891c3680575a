"""The scenarios as Gymnasium environments: ``mjspace.gym.load(scenario)``."""

from mjspace.errors import missing

try:
    import gymnasium  # noqa: F401 - the modules below would say it less clearly
except ModuleNotFoundError:
    raise ImportError(str(missing("mjspace.gym", "gymnasium", "gym"))) from None

from mjspace.gym.environment import load
from mjspace.gym.vector import load_vector

__all__ = ["load", "load_vector"]
