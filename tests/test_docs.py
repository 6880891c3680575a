"""What the pages say is run: files are written, commands typed, Python executed."""

import ast
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from pages import blocks

import mjspace

ROOT = Path(__file__).parents[1]
PAGES = [
    page.relative_to(ROOT).as_posix()
    for page in [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]
    if re.search(r"^```(python|console)", page.read_text(), re.M)
    if page.name != "extending.md"  # each of its recipes has a test of its own
]
LONG_PAGES = {"docs/lander.md", "docs/lander_descent.md", "docs/rendering.md"}
"""Those that take most of a minute."""
TEXTS = [
    path
    for pattern in ("*.md", "docs/*.md", "assets/**/*.md", "benchmarks/*.md")
    for path in sorted(ROOT.glob(pattern))
]
PACKAGES = {"mjspace": "mjspace", "controllers": "mjspace/controllers", "assets": "mjspace/assets"}
"""Folders of the repository, and what they are in an installed package."""


def linked(home: Path) -> Path:
    """Return a tree like an installed package's, of links to this repository's files.

    A page may add files to it and change them. Numba's caches, which are links too, stay valid.
    """
    for folder, package in PACKAGES.items():
        for here, folders, files in os.walk(ROOT / folder):
            there = home / package / Path(here).relative_to(ROOT / folder)
            there.mkdir(parents=True, exist_ok=True)
            for name in files:
                (there / name).symlink_to(Path(here) / name)
            if "__pycache__" in folders:
                folders.remove("__pycache__")
                (there / "__pycache__").symlink_to(Path(here) / "__pycache__")
    return home


def put(language: str, path: Path, text: str) -> None:
    """Write a file, or make the change that a diff describes."""
    if language == "diff":
        lines = [line for line in text.splitlines() if line.strip()]
        before, after = (
            "\n".join(line[1:] for line in lines if line[0] in f" {sign}") for sign in "-+"
        )
        source = path.read_text()
        assert source.count(before) == 1, (path, before)
        text = source.replace(before, after)
    path.unlink(missing_ok=True)  # never through a link
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[pytest.mark.long] * (p in LONG_PAGES)) for p in PAGES]
)
def test_everything_on_the_page_works(
    page: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    found = blocks((ROOT / page).read_text())
    assert found
    paths = [str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = os.environ | {"PATH": os.pathsep.join(paths)}
    extends = any(name.partition("/")[0] in PACKAGES for _, name, _ in found)
    tree = linked(tmp_path / "tree") if extends else tmp_path
    if extends:
        environment |= {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}

    def start(command: list[str]) -> None:
        process = subprocess.Popen(
            command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
        )
        request.addfinalizer(process.wait)
        request.addfinalizer(process.kill)
        assert process.stdout is not None
        with process.stdout:
            assert process.stdout.readline()  # it is ready

    def do(command: list[str]) -> None:
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, (command, done.stdout, done.stderr)

    for language, name, text in found:
        folder, _, rest = name.partition("/")
        if folder in PACKAGES:
            put(language, tree / PACKAGES[folder] / rest, text)
        elif name:
            put(language, tmp_path / name, text)
        elif language == "python":
            do([sys.executable, "-c", text])
        elif language == "console":
            for line in filter(lambda line: line.startswith("$ "), text.splitlines()):
                words = shlex.split(line.removeprefix("$ "), comments=True)
                if words[0] == "cc" and shutil.which("cc") is None:
                    pytest.skip("the page compiles C, and there is no compiler")
                of_page = words[0] == "python" and (tmp_path / words[1]).exists()
                if words[0] in ("mjspace", "cc") or of_page:
                    start(words[:-1]) if words[-1] == "&" else do(words)


@pytest.mark.parametrize(
    ("tool", "page"),
    [("scenario_reference", "docs/scenario.md"), ("scenarios_page", "docs/scenarios.md")],
)
def test_a_generated_page_is_what_the_code_says(tool: str, page: str) -> None:
    assert (ROOT / page).read_text() == runpy.run_path(str(ROOT / f"tools/{tool}.py"))["page"]()


def test_the_rooms_shown_are_those_of_the_imports() -> None:
    tool = runpy.run_path(str(ROOT / "tools/rooms.py"))
    layers = runpy.run_path(str(ROOT / "tests/test_layers.py"))
    rooms = tool["imports"]()
    assert {room: set(may.split()) for room, may in layers["ROOMS"].items()} == rooms
    text = tool["PAGE"].read_text()
    assert text == tool["page"](text, rooms)
    assert tool["PICTURE"].read_text() == tool["picture"](rooms)
    level = tool["levels"](rooms)
    assert all(level[other] < level[room] for room in rooms for other in rooms[room])


@pytest.mark.parametrize("page", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_and_modules_that_a_page_names_are_there(page: Path) -> None:
    # What a recipe adds is not there yet, and what moved is no longer there.
    text = re.sub(r"^\| `mjspace\.\S+` (?=\| `mjspace)", "", page.read_text(), flags=re.M)
    added = {name for _, name, _ in blocks(text) if name}
    modules = tuple(name.removesuffix(".py").replace("/", ".") for name in added)
    for path in re.findall(r"`((?:mjspace|controllers|tests|tools)/[\w/]+\.\w+)`", text):
        assert (ROOT / path).exists() or path in added, path
    for name in re.findall(r"\b(mjspace(?:\.[a-z_0-9]+)+(?:\.[A-Z]\w+)?)\b(?!\.\w)", text):
        assert _is_there(name) or name.startswith(modules), name


def _is_there(name: str) -> bool:
    """Return whether the dotted name is a module, or something in one."""
    module, _, last = name.rpartition(".")
    if name == "mjspace.sha256":  # a metadata record of the log
        return True
    try:
        return find_spec(name) is not None or hasattr(import_module(module), last)
    except ModuleNotFoundError:
        return hasattr(import_module(module), last)


def test_the_walks_name_what_is_in_each_module() -> None:
    text = (ROOT / "docs/architecture.md").read_text()
    steps = re.findall(r"^\d\. `([\w/]+\.py)`: `(\w+)`", text, re.M)
    assert len(steps) == 16  # two walks of eight modules
    for path, name in steps:
        tree = ast.parse((ROOT / path).read_text())
        named = [node.name for node in ast.walk(tree) if hasattr(node, "name")]
        assert name in named, (path, name)


def test_the_reference_has_all_that_the_package_offers() -> None:
    text = (ROOT / "docs/api.md").read_text()
    for name in mjspace.__all__:
        thing = getattr(mjspace, name)
        assert f"::: {thing.__module__}.{thing.__qualname__}\n" in text, name


def test_the_citation_is_of_this_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = dict(
        line.split(": ", 1)
        for line in (ROOT / "CITATION.cff").read_text().splitlines()
        if ": " in line
    )
    assert citation["version"] == project["version"] == mjspace.__version__
    assert citation["license"] == project["license"]


def test_the_pictures_of_the_readme_are_small() -> None:
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", (ROOT / "README.md").read_text())
    assert len(pictures) == 3
    assert sum((ROOT / picture).stat().st_size for picture in pictures) < 1_000_000


class _Page(HTMLParser):
    """The ids of a page, and what it refers to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.targets: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        for name, value in attrs:
            if name == "id":
                self.ids.add(value)
            elif name in ("href", "src") and value:
                self.targets.add(value)
                assert tag == "a" or not value.startswith("http"), value  # nothing is loaded


@pytest.mark.slow
def test_whatever_the_site_refers_to_is_there(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "-q", "--strict", "--site-dir", tmp_path],
        cwd=ROOT,
        check=True,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )
    pages = {path: _Page(path.read_text()) for path in tmp_path.rglob("*.html")}
    assert len(pages) > 40
    for path, page in pages.items():
        if path.name == "404.html":  # its links are those of a server
            continue
        for target in page.targets:
            parts = urlsplit(target)
            if parts.scheme:
                assert parts.scheme in ("https", "data"), (path, target)
                continue
            there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert there.exists(), (path, target)
            if parts.fragment and there.suffix == ".html":
                assert unquote(parts.fragment) in pages[there].ids, (path, target)
