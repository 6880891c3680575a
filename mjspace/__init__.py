"""mjspace: a spacecraft testbed on MuJoCo physics.

``mjspace.run(scenario)`` flies one, ``mjspace.load(scenario)`` only reads it, ``mjspace.replay(log,
out)`` flies a log again, ``mjspace.Log(path)`` reads one.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PLACES = {
    "load": "mjspace.scenario.loading",
    "run": "mjspace.runner.run",
    "replay": "mjspace.runner.replay",
    "verify": "mjspace.runner.replay",
    "Log": "mjspace.log.reader",
}

__all__ = ["Log", "load", "replay", "run", "verify"]


def __getattr__(name: str) -> Any:
    """Import what is asked for: a control law that imports mjspace.attitude needs no simulator."""
    if name in _PLACES:
        return getattr(import_module(_PLACES[name]), name)
    raise AttributeError(f"module 'mjspace' has no attribute {name!r}")
