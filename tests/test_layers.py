"""Which module may import what, how long one may get, and that each says what it is for."""

import ast
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = [*ROOT.glob("mjspace/**/*.py"), *ROOT.glob("controllers/**/*.py")]
LAWS = [path for path in MODULES if path.is_relative_to(ROOT / "controllers")]
TESTBED = [path for path in MODULES if path not in LAWS]

# Flight software computes; it knows no simulator, no log, no clock and no file.
A_LAW_MAY_IMPORT = (
    *("numpy", "scipy", "numba"),
    *("mjspace.algebra", "mjspace.attitude", "mjspace.contract", "mjspace.controllers"),
    "mjspace.gufunc",
    *("abc", "collections", "dataclasses", "enum", "functools", "itertools", "math", "typing"),
    "warnings",
)
# What is computed before a flight, by a solver that no law needs.
A_PLANNER_MAY_IMPORT = {"minimum_time": "casadi"}
# The rooms of the testbed, from the ground up: what each may import, besides those that it names
# here by a line above its own. A room is a package or a single module of mjspace.
ROOMS = {
    "compiling": "",
    "gufunc": "compiling",
    "interrupts": "",
    "errors": "interrupts",
    "ranges": "",
    "units": "",
    "scenarios": "",
    "contract": "ranges units",
    "algebra": "contract gufunc",
    "attitude": "algebra contract gufunc",
    "signals": "contract errors",
    "scenario": "contract errors ranges units",
    "tracing": "gufunc",
    "vehicle": "contract errors scenario",
    "environment": "compiling contract errors gufunc scenario vehicle",
    "sensors": "algebra attitude contract errors gufunc scenario units",
    "actuators": ("contract environment errors gufunc scenario sensors signals units vehicle"),
    "log": "attitude contract errors scenario signals units",
    "plotting": "contract errors log scenario signals units",
    "rendering": "attitude contract environment errors log scenario vehicle",
    "reporting": "contract errors log plotting rendering scenario",
    "simulation": (
        "actuators algebra attitude compiling contract environment errors interrupts log ranges "
        "scenario sensors signals tracing units vehicle"
    ),
    "runner": (
        "compiling contract errors interrupts log plotting rendering reporting scenario signals "
        "simulation units vehicle"
    ),
    "campaign": "contract errors interrupts log reporting runner scenario simulation units",
    "learning": "attitude contract errors scenario signals simulation",
    "dm_env": "contract environment errors learning scenario simulation",
    "gym": "campaign contract errors learning rendering scenario simulation",
    "terminal": "compiling errors log scenario",
    "conversion": "attitude contract errors log plotting rendering",
    "validation": "actuators attitude contract environment log plotting runner scenario vehicle",
    "view": "attitude contract errors log plotting rendering reporting simulation vehicle",
    "cli": (
        "campaign compiling conversion errors interrupts log plotting rendering runner scenario "
        "simulation terminal validation view"
    ),
    "__main__": "cli interrupts",
}
# Outside packages that a few rooms alone may know.
ONLY_IN = {
    "mujoco": (
        "vehicle environment actuators simulation log rendering dm_env gym runner validation "
        "conversion view"
    ),
    "mcap": "log",
    "dm_control": "dm_env",
    "dm_env": "dm_env",
    "gymnasium": "gym",
    "mjspace.controllers": "",  # a scenario names its law, and the loader imports it
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
    may = (*A_LAW_MAY_IMPORT, A_PLANNER_MAY_IMPORT.get(path.stem, "numpy"))
    for name in imported(path):
        assert any(within(name, package) for package in may), name


def room_of(path: Path) -> str:
    """Return the package or module of mjspace that the file belongs to."""
    return path.relative_to(ROOT / "mjspace").parts[0].removesuffix(".py")


def test_rooms_stand_in_order_each_on_those_above() -> None:
    rooms = list(ROOMS)
    for number, (room, may) in enumerate(ROOMS.items()):
        assert set(may.split()) <= set(rooms[:number]), room
    assert {room_of(path) for path in TESTBED} - {"__init__"} == set(rooms)
    assert len(rooms) <= 34


def levels(rooms: Mapping[str, Iterable[str]]) -> dict[str, int]:
    """Return the level of each room: one above the highest that it imports; 1 on the ground.

    ``rooms`` has the imports of each, the ground first.
    """
    found: dict[str, int] = {}
    for room, below in rooms.items():
        found[room] = 1 + max((found[other] for other in below), default=0)
    return found


def test_rooms_stand_on_at_most_11_levels_below_the_entry_point() -> None:
    found = levels({room: may.split() for room, may in ROOMS.items()})
    assert max(found[room] for room in ROOMS if room != "__main__") <= 11


def imports_of(room: str) -> set[str]:
    """Return the other rooms that the room's modules import."""
    used = set()
    for path in TESTBED:
        if room_of(path) == room:
            for name in imported(path):
                package, _, rest = name.partition(".")
                if package == "mjspace":
                    used.add(rest.partition(".")[0])
    return used - {room, "controllers", "__version__"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_stands_beside_its_name(room: str) -> None:
    assert imports_of(room) == set(ROOMS[room].split())


@pytest.mark.parametrize("package", ONLY_IN)
def test_only_the_named_rooms_know(package: str) -> None:
    users = {room_of(path) for path in TESTBED if any(within(n, package) for n in imported(path))}
    assert users <= set(ONLY_IN[package].split())


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


def test_a_law_is_found_by_the_name_of_its_module_alone() -> None:
    names = [law.stem for law in LAWS if law.stem != "__init__"]
    assert len(names) == len(set(names))


def test_laws_load_where_no_simulator_is() -> None:
    # Imports that the text of a law does not show, such as those of mjspace/__init__.py, count too.
    laws = [
        ".".join(["mjspace", *law.relative_to(ROOT).with_suffix("").parts])
        for law in LAWS
        if law.stem != "__init__"
    ]
    code = "import sys; sys.modules.update(mujoco=None, mcap=None); import " + ", ".join(laws)
    subprocess.run([sys.executable, "-c", code], check=True)
