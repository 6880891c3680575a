"""Which software, machine and seed made a flight: the log's metadata."""

import hashlib
import platform
import subprocess
import sys
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path

from mjspace import __version__
from mjspace.scenario.scenario import Scenario

PACKAGES = ("mujoco", "numpy", "scipy", "numba", "mcap")


def metadata(scenario: Scenario, model: bytes, member: int) -> dict[str, str]:
    """Return the log's metadata; ``model`` is the compiled model as it is attached."""
    return {
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": str(scenario.seed),
        "member": str(member),
        "integrator": scenario.rates.integrator,
        "physics_step": repr(scenario.rates.physics),
        "control_period": repr(scenario.rates.control),
        "duration": repr(scenario.duration),
        "model_sha256": hashlib.sha256(model).hexdigest(),
        "git": _revision(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        **software(),
    }


@cache
def software() -> dict[str, str]:
    """Return the versions of what computes, and where it does."""
    return {
        "mjspace": __version__,
        "python": platform.python_version(),
        "platform": f"{sys.platform} {platform.machine()}",
        **{package: version(package) for package in PACKAGES},
    }


@cache
def _revision() -> str:
    """Return the source's git revision, '' where it is installed without one."""
    try:
        found = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()
