"""What is built from this repository installs elsewhere, under one name, and flies."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]
NOT_SOURCE = (".*", "*.egg-info", "build", "dist", "runs", "__pycache__")
MAPPED = {
    "mjspace": "mjspace",
    "controllers": "mjspace/controllers",
    "assets": "mjspace/assets",
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the sdist from a copy of the tree, and the wheel from that sdist."""
    source = tmp_path_factory.mktemp("build") / "source"
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    subprocess.run([sys.executable, "-m", "build", "--no-isolation", source], check=True)
    (built,) = source.glob("dist/*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel into a new environment that borrows its dependencies from this one.

    A path in a .pth file is searched, but the .pth files in it are not read: the editable install
    of this repository stays out.
    """
    home = tmp_path_factory.mktemp("installed")
    venv.create(home)
    install = ["-m", "uv", "pip", "install", "--no-deps", "--python"]
    subprocess.run([sys.executable, *install, home, wheel], check=True)
    (packages,) = home.glob("lib/python*/site-packages")
    (packages / "borrowed.pth").write_text(sysconfig.get_path("purelib"))
    return home


def test_wheel_holds_every_file_of_the_package_and_nothing_else(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    # Pictures beside a model show it to a reader; those that it is drawn with are in parts/.
    previews = {
        f"mjspace/assets/{path.relative_to(ROOT / 'assets')}"
        for path in (ROOT / "assets").glob("*/*.png")
        if path.parent.name != "parts"
    }
    assert len(previews) >= 3
    wanted = {
        f"{package}/{path.relative_to(ROOT / folder).as_posix()}"
        for folder, package in MAPPED.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
        # A script beside a model made its pictures; it is no part of the package.
        if path.suffix != ".py" or path.with_name("__init__.py").exists()
    } - previews
    assert held == wanted


def extras() -> dict[str, list[str]]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return dict(project["optional-dependencies"])


def test_all_is_every_extra_but_that_of_developers() -> None:
    (everything,) = extras()["all"]
    assert everything == f"mjspace[{','.join(sorted(extras().keys() - {'all', 'dev'}))}]"


def test_what_an_error_tells_to_install_is_an_extra() -> None:
    files = [*ROOT.glob("mjspace/**/*.py"), *ROOT.glob("controllers/**/*.py")]
    code = "".join(path.read_text() for path in files)
    named = re.findall(r'missing\(.*, "(\w+)"\)', code) + re.findall(r"mjspace\[(\w+)\]", code)
    assert {"data", "dm", "planning", "search"} <= set(named) <= extras().keys()


@pytest.mark.parametrize(
    ("package", "what", "line"),
    [
        ("pyarrow", "from mjspace.log.arrow import pyarrow_for; pyarrow_for('x.parquet')",
         "x.parquet needs pyarrow: pip install 'mjspace[data]'"),
        ("dm_control", "import mjspace.dm_env",
         "mjspace.dm_env needs dm_control, which exists up to Python 3.12: "
         "pip install 'mjspace[dm]'"),
    ],
)  # fmt: skip
def test_one_line_says_what_is_missing(package: str, what: str, line: str) -> None:
    code = f"import sys; sys.modules[{package!r}] = None\n{what}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.splitlines()[-1].partition(": ")[2] == line


@pytest.mark.slow  # nothing is compiled yet where the wheel has just been installed
def test_installed_package_flies_from_another_folder(installed: Path, tmp_path: Path) -> None:
    # A stray PYTHONPATH would let the repository in.
    alone = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}

    def run(program: str, *words: str) -> "subprocess.CompletedProcess[str]":
        command = [installed / "bin" / program, *words]
        return subprocess.run(command, cwd=tmp_path, env=alone, text=True, capture_output=True)

    names = [package.replace("/", ".") for package in MAPPED.values()]
    show = f"import {', '.join(names)}; print({'.__file__, '.join(names)}.__file__)"
    found = run("python", "-c", show)
    assert found.stdout.count(str(installed)) == len(names), found.stderr

    # Without checks a flight passes that reaches its end; a crash has status 1 as a failure does.
    flight = run("mjspace", "run", "detumble-wheels", "--duration", "0.2",
                 "--set", "checks=[]", "--out", "flight")  # fmt: skip
    assert flight.returncode == 0, flight.stderr
    assert "Traceback" not in flight.stderr
    (log,) = tmp_path.glob("flight/**/*.mcap")
    told = run("mjspace", "info", log.relative_to(tmp_path).as_posix())
    assert told.returncode == 0, told.stderr
    assert "0.2 s" in told.stdout
