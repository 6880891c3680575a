"""What a scenario may name, and what of it is refused before anything runs."""

import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import mjspace
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.scenario.trust import Trust
from mjspace.simulation.assembly import METHODS, assemble

TOUCHES = "from pathlib import Path\nPath({!r}).touch()\n"
LAW = """
class Law:
    def reset(self, measurement, reference): ...
    def step(self, state, time, measurement, reference): ...
"""


TABLES = {
    "law": '[law]\nkind = "{}"\n',
    "estimator": '[estimator]\nkind = "{}"\n',
    "reference": '[reference]\nkind = "{}"\n',
    "disturbance": '[environment]\npython = "{}"\n',
    "inner": '[law]\nkind = "phases:Phases"\n[[law.phases]]\nname = "a"\nlaw = {{ kind = "{}" }}\n',
}


def scenario(folder: Path, table: str) -> Path:
    path = folder / "x.toml"
    path.write_text(f'base = "detumble-wheels"\nchecks = []\nduration = "0.1 s"\n{table}')
    return path


@pytest.mark.parametrize("kind", ["os:system", "subprocess:Popen", "antigravity:fly"])
@pytest.mark.parametrize("table", TABLES)
def test_a_module_that_no_package_offers_is_not_imported(
    tmp_path: Path, table: str, kind: str
) -> None:
    with pytest.raises(InputError, match=rf"no module '{kind.partition(':')[0]}' in mjspace"):
        mjspace.run(scenario(tmp_path, TABLES[table].format(kind)), out=tmp_path / "out")
    assert "antigravity" not in sys.modules
    assert not (tmp_path / "out").exists()


def test_what_the_user_typed_is_trusted(tmp_path: Path) -> None:
    """A file anywhere and any module; yet no function is a law."""
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "mine").mkdir()
    kinds = [
        f"law.kind={tmp_path}/law.py:Law",
        "law.kind='../law.py:Law'",
        "law={kind='../law.py:Law'}",
    ]
    for override in kinds:
        loaded, folder = load(scenario(tmp_path / "mine", ""), [override])
        assert Trust(folder).load_class(loaded.law.kind, METHODS["law"]).__name__ == "Law"
    loaded, folder = load("detumble-wheels", ["law.kind=os:system"])
    with pytest.raises(ValueError, match="'os' has no 'system'"):
        Trust(folder).load(loaded.law.kind)
    disturbance = f"environment.python={tmp_path}/law.py:Law"
    loaded, folder = load("detumble-wheels", [disturbance])
    assert Trust(folder).load(loaded.environment.python)
    table = tmp_path / "table.csv"
    table.write_text("time,attitude0,attitude1,attitude2,attitude3\n0,1,0,0,0\n1,1,0,0,0\n")
    overrides = ["reference.kind=tabulated:Table", f"reference.file={table}"]
    assert mjspace.run(
        scenario(tmp_path / "mine", ""), overrides=overrides, out=tmp_path / "out"
    ).passed


@pytest.mark.parametrize("name", ["np", "Array", "dataclass", "nothing"])
def test_only_what_a_module_defines_is_a_law(name: str) -> None:
    with pytest.raises(ValueError, match=rf"'contraction' has no '{name}'.*Adaptive"):
        Trust(Path()).load(f"contraction:{name}")


def test_a_class_is_looked_at_before_it_is_constructed(tmp_path: Path) -> None:
    """One without the contract's methods is never called."""
    made = tmp_path / "made"
    code = "from pathlib import Path\nclass Bomb:\n    def __init__(self):\n"
    code += f"        Path({str(made)!r}).touch()\n"
    (tmp_path / "own.py").write_text(code)
    trust = Trust(tmp_path)
    with pytest.raises(ValueError, match=r"own\.py:Bomb has no method reset\(measurement"):
        trust.load_class("own.py:Bomb", METHODS["law"])
    with pytest.raises(InputError, match=r"law: own\.py:Bomb has no method"):
        mjspace.run(scenario(tmp_path, '[law]\nkind = "own.py:Bomb"\n'), out=tmp_path / "out")
    assert not made.exists()


def test_a_function_is_no_law(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def make(): ...\n")
    with pytest.raises(ValueError, match=r"own\.py:make is a function, should be a class"):
        Trust(tmp_path).load_class("own.py:make")


@pytest.mark.parametrize("absolute", [False, True])
def test_a_file_outside_the_folder_runs_with_trust_alone(tmp_path: Path, absolute: bool) -> None:
    (tmp_path / "law.py").write_text(TOUCHES.format(str(tmp_path / "ran")) + LAW)
    (tmp_path / "mine").mkdir()
    kind = f"{tmp_path if absolute else '..'}/law.py:Law"
    with pytest.raises(ValueError, match=r"law\.py is outside the scenario's folder: --trust"):
        Trust(tmp_path / "mine").load(kind)
    assert not (tmp_path / "ran").exists()
    Trust(tmp_path / "mine", everything=True).load(kind)
    assert (tmp_path / "ran").exists()


def test_a_link_out_of_the_folder_does_not_help(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/law.py").symlink_to(tmp_path / "law.py")
    with pytest.raises(ValueError, match="outside the scenario's folder"):
        Trust(tmp_path / "mine").load("law.py:Law")


def test_a_table_file_stays_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("top secret\n")
    (tmp_path / "mine").mkdir()
    table = '[reference]\nkind = "tabulated:Table"\nfile = "../secret"\n'
    with pytest.raises(InputError, match=r"secret is outside the scenario's folder") as refused:
        mjspace.run(scenario(tmp_path / "mine", table), out=tmp_path / "out")
    assert "top" not in str(refused.value)


def test_an_installed_package_offers_its_laws_as_an_entry_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "laws_of_mine.py").write_text(LAW + "from collections import OrderedDict\n")
    monkeypatch.syspath_prepend(tmp_path)
    found: Sequence[EntryPoint] = []
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: found)
    trust = Trust(Path())
    with pytest.raises(ValueError, match="no module 'laws_of_mine' in mjspace"):
        trust.load("laws_of_mine:Law")
    assert Trust(Path(), everything=True).load("laws_of_mine:Law").step
    found = [EntryPoint("mine", "laws_of_mine", "mjspace.controllers")]
    assert trust.load("laws_of_mine:Law") is trust.load("mine:Law")
    with pytest.raises(ValueError, match="'mine' has no 'OrderedDict'"):
        trust.load("mine:OrderedDict")


@pytest.mark.parametrize("module", ["typing", "enum", "numpy", "typer", "warnings"])
def test_python_m_imports_nothing_from_the_current_folder(tmp_path: Path, module: str) -> None:
    (tmp_path / f"{module}.py").write_text(TOUCHES.format(str(tmp_path / "ran")))
    command = [sys.executable, "-m", "mjspace", "list"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "contraction-ideal" in done.stdout
    assert not (tmp_path / "ran").exists()


def test_a_file_of_mjspaces_own_scenarios_is_found_from_anywhere(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('base = "cubesat-6u"\ndescription = "mine"\n')
    assert assemble(*load(path)).vehicle.model.body("structure").mass[0] == pytest.approx(9.6)
    (tmp_path / "cubesat_6u.xml").write_text("<mujoco/>")  # one's own comes first
    with pytest.raises(InputError, match=r"plant\.model: no free joint"):
        assemble(*load(path))
