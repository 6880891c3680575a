"""What is built from this repository installs elsewhere, under one name, and flies."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path, PurePosixPath
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]
NOT_SOURCE = (".*", "*.egg-info", "build", "dist", "runs", "__pycache__")


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
    pip = [
        sys.executable,
        "-m",
        "uv",
        "pip",
        "install",
        "--no-deps",
        "--python",
        home / "bin/python",
    ]
    subprocess.run([*pip, wheel], check=True)
    (packages,) = home.glob("lib/python*/site-packages")
    (packages / "borrowed.pth").write_text(sysconfig.get_path("purelib"))
    return home


def test_wheel_holds_every_file_of_the_package_and_nothing_else(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    wanted = {
        str(PurePosixPath(place, path.relative_to(ROOT / folder)))
        for folder, place in {
            "mjspace": "mjspace",
            "controllers": "mjspace/controllers",
            "assets": "mjspace/assets",
        }.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert held == wanted


def test_installed_package_flies_from_another_folder(installed: Path, tmp_path: Path) -> None:
    def run(*command: str | Path) -> "subprocess.CompletedProcess[str]":
        # A stray PYTHONPATH would let the repository in.
        alone = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        return subprocess.run(command, cwd=tmp_path, env=alone, text=True, capture_output=True)

    show = "import mjspace, mjspace.controllers, mjspace.assets as a; print(mjspace.__file__, a.__file__)"
    found = run(installed / "bin/python", "-c", show)
    assert found.stdout.count(str(installed)) == 2, found.stderr

    flight = run(
        *(installed / "bin/mjspace", "run", "contraction-adaptive", "--duration", "0.2"),
        *("--out", "flight"),
    )
    # So short a flight fails the checks on its end (1); bad input would be 2, a crash anything.
    assert flight.returncode in (0, 1), flight.stderr
    assert list(tmp_path.glob("flight/**/*.mcap"))
