"""mjspace: a spacecraft testbed on MuJoCo physics.

The command line's words from Python: ``list_scenarios()``, ``load(scenario)``, ``run(scenario)``,
``replay(log, out)``, ``verify(log)``, ``plot(log, file)``, ``figure(log)``, ``render(log, file)``.
``convert(log, file)`` writes a log for other tools, ``compare(log, other)`` says how two differ.
``linearize(scenario)`` gives the matrices of its vehicle.
``Log(path)`` reads a log as NumPy arrays. Where a log is an argument, its path or a ``Log`` may be.
"""

import os
import sys

_HOME = os.path.dirname(os.path.dirname(__file__))
if sys.argv[:1] == ["-m"] and not sys.flags.safe_path and sys.path[0] != _HOME:
    del sys.path[0]  # python -m mjspace imports nothing from the current folder

from importlib import import_module  # noqa: E402
from typing import Any  # noqa: E402

__version__ = "0.1.0"

# None of these names is one of a module or a package of mjspace: importing that would replace it.
_MODULES = {
    "Log": "mjspace.runner.shown_log",
    "compare": "mjspace.log.compare",
    "convert": "mjspace.conversion.convert",
    "figure": "mjspace.plotting.page",
    "linearize": "mjspace.simulation.linearization",
    "list_scenarios": "mjspace.scenario.files",
    "load": "mjspace.scenario.loading",
    "plot": "mjspace.plotting.page",
    "render": "mjspace.rendering.render",
    "replay": "mjspace.runner.replay",
    "run": "mjspace.runner.run",
    "verify": "mjspace.runner.replay",
}

__all__ = [
    "Log",
    "compare",
    "convert",
    "figure",
    "linearize",
    "list_scenarios",
    "load",
    "plot",
    "render",
    "replay",
    "run",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Import a name of the API when it is first used.

    A control law that imports mjspace.attitude thus needs neither MuJoCo nor a log.
    """
    if name in _MODULES:
        return getattr(import_module(_MODULES[name]), name)
    raise AttributeError(f"module 'mjspace' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the module, with those that are imported when first used."""
    return sorted({*globals(), *__all__})
