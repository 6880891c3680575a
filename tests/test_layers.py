"""Which module may import what, how long one may get, and that each says what it is for."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = [*ROOT.glob("mjspace/**/*.py"), *ROOT.glob("controllers/**/*.py")]
LAWS = [path for path in MODULES if path.is_relative_to(ROOT / "controllers")]
TESTBED = [path for path in MODULES if path not in LAWS]

# Flight software computes; it knows no simulator, no log, no clock and no file.
A_LAW_MAY_IMPORT = (
    *("numpy", "scipy", "numba", "mjspace.attitude", "mjspace.contract", "mjspace.controllers"),
    *("abc", "collections", "dataclasses", "enum", "functools", "itertools", "math", "typing"),
    "warnings",
)
# These packages are known to no other module of the testbed.
ONLY_IN = {
    "mujoco": (
        *(
            "plant",
            "addresses",
            "composition",
            "start",
            "columns",
            "ground_contact",
            "environment",
            "bearing_friction",
            "struct_offsets",
            "guards",
            "stability",
            "simulation",
            "held_disturbance",
            "tape",
            "recorder",
        ),
        *(
            "mujoco_log",
            "stand",
            "meter",
            "passport",
            "model_files",
            "model_ties",
            "conservation",
            "convergence",
            "plume",
        ),
        *("geometry", "offscreen", "render", "stage", "replay", "environments", "dm_bridge"),
    ),
    "mcap": ("log_*",),
    "dm_control": ("dm_bridge",),
    "dm_env": ("environments",),
    "mjspace.dm_env.bridge": ("environments",),
    "mjspace.dm_env.environment": (),  # imported only when asked for
    "mjspace.controllers": (),  # a scenario names its law, and the loader imports it
}


def imported(path: Path) -> Iterator[str]:
    """Yield the dotted name of everything that the module imports, at any depth of its code."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def within(name: str, package: str) -> bool:
    return f"{name}.".startswith(f"{package}.")


@pytest.mark.parametrize("path", LAWS, ids=lambda path: path.stem)
def test_a_law_imports_only_what_flight_software_may(path: Path) -> None:
    for name in imported(path):
        assert any(within(name, package) for package in A_LAW_MAY_IMPORT), name


@pytest.mark.parametrize("package", ONLY_IN)
def test_only_the_named_modules_know(package: str) -> None:
    users = {path.stem for path in TESTBED if any(within(n, package) for n in imported(path))}
    assert not {user for user in users if not any(fnmatch(user, may) for may in ONLY_IN[package])}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_module_says_what_it_is_for_and_is_short(path: Path) -> None:
    text = path.read_text()
    summary = (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
    assert summary.endswith((".", "?"))
    assert len(text.splitlines()) <= 350  # longer ones have a second subject


def test_no_module_hides_a_mapped_package() -> None:
    # pyproject.toml maps the folders of these names into mjspace; a module there would win or lose
    # against the folder, depending on how the project is installed.
    for name in ("assets", "controllers"):
        assert not (ROOT / "mjspace" / name).exists()
        assert not (ROOT / "mjspace" / f"{name}.py").exists()


def test_laws_load_where_no_simulator_is() -> None:
    # Imports that the text of a law does not show, such as those of mjspace/__init__.py, count too.
    laws = [f"mjspace.controllers.{law.stem}" for law in LAWS if law.stem != "__init__"]
    code = "import sys; sys.modules.update(mujoco=None, mcap=None); import " + ", ".join(laws)
    subprocess.run([sys.executable, "-c", code], check=True)
