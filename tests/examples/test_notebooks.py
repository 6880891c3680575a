"""The notebooks of examples/ run from beginning to end and show what is kept in them."""

import runpy
from pathlib import Path
from typing import Any

import nbformat
import pytest

ROOT = Path(__file__).parents[2]
TOOL: dict[str, Any] = runpy.run_path(str(ROOT / "tools/notebooks.py"))


def shown(book: Any) -> list[list[str]]:
    """Return of each cell which kinds of output it has, without how a stream was cut."""
    return [
        sorted({kind for output in cell.get("outputs", []) for kind in kinds(output)})
        for cell in book.cells
    ]


def kinds(output: Any) -> list[str]:
    return list(output.data) if "data" in output else [output.name]


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.ipynb")), ids=lambda p: p.stem)
def test_it_runs_and_shows_what_is_kept(path: Path) -> None:
    kept = nbformat.read(path, 4)
    assert all(cell.outputs for cell in kept.cells[1:] if cell.cell_type == "code")
    assert "stderr" not in {kind for cell in shown(kept) for kind in cell}
    assert shown(TOOL["executed"](path)) == shown(kept)
