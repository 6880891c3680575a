"""The command line, called in the process of the test."""

import sys

import pytest

from mjspace import cli


def command_line(*words: str) -> int:
    """Return the exit status of ``mjspace`` with these words."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["mjspace", *words])
        with pytest.raises(SystemExit) as ended:
            cli.main()
    return int(ended.value.code or 0)
