"""Calls a script in the Python that has Basilisk: its dependencies may conflict with ours."""

import json
import subprocess
from importlib.resources import files
from typing import Any


class BasiliskMissingError(RuntimeError):
    """The interpreter has no Basilisk; the message has the interpreter's last line."""


def call(python: str, script: str, request: dict[str, Any]) -> dict[str, Any]:
    """Return what ``script``, a file of this room, answers to ``request``; both are JSON.

    Raises:
        BasiliskMissingError: the interpreter ``python`` cannot be run, or has no bsk.
    """
    command = [python, str(files("mjspace.validation") / script)]
    try:
        done = subprocess.run(
            command, input=json.dumps(request), capture_output=True, text=True, check=True
        )
    except OSError as error:
        raise BasiliskMissingError(f"{python}: {error.strerror}") from error
    except subprocess.CalledProcessError as error:
        lines = error.stderr.strip().splitlines()
        raise BasiliskMissingError(f"{python}: {lines[-1] if lines else 'no output'}") from error
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer
