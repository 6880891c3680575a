"""Executes the notebooks of examples/, each in a folder of its own, and keeps their outputs.

Usage: python tools/notebooks.py [NAME...]: all, where none is named.
"""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbformat
from nbclient import NotebookClient

EXAMPLES = Path(__file__).parents[1] / "examples"


def executed(path: Path) -> Any:
    """Return the notebook with the outputs of its cells.

    Raises:
        nbclient.exceptions.CellExecutionError: a cell raises.
    """
    book = nbformat.read(path, 4)
    beside = str(Path(sys.executable).parent)  # the command mjspace
    path_variable = f"{beside}{os.pathsep}{os.environ['PATH']}"
    with TemporaryDirectory() as folder:
        client = NotebookClient(
            book, timeout=300, record_timing=False, resources={"metadata": {"path": folder}}
        )
        client.execute(env={**os.environ, "PATH": path_variable})
    return book


def main() -> None:
    """Execute and write."""
    names = sys.argv[1:] or sorted(path.stem for path in EXAMPLES.glob("*.ipynb"))
    for name in names:
        path = EXAMPLES / f"{name}.ipynb"
        nbformat.write(executed(path), path)


if __name__ == "__main__":
    main()
