"""``mjspace validate`` through its real entry point."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from mjspace.cli import validation
from mjspace.validation import basilisk
from mjspace.validation.benchmark import Bound
from mjspace.validation.benchmarks import ALL
from mjspace.validation.results import Injected, Results, Row, Section


def validate(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    called = [sys.executable, "-m", "mjspace", "validate", *map(str, arguments)]
    return subprocess.run(called, capture_output=True, text=True, cwd=cwd, timeout=120)


def test_a_quick_run_flies_everything_and_passes(tmp_path: Path) -> None:
    done = validate("--quick", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    results = Results.model_validate_json(done.stdout)
    assert [section.name for section in results.sections] == [b.name for b in ALL]
    assert json.loads(done.stdout)["passed"] is True
    (folder,) = (tmp_path / "runs" / "validate").iterdir()
    assert {path.name for path in folder.iterdir()} == {"validation.json", "validation.html"}
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_one_benchmark_in_full(tmp_path: Path) -> None:
    done = validate("--only", "torque-free", "--out", tmp_path / "here")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "order of attitude" in done.stdout
    assert "caught faults" in done.stdout
    assert "Basilisk: not compared" in done.stdout
    assert str(tmp_path / "here" / "validation.html") in done.stdout


def test_a_model_gets_its_passport(tmp_path: Path) -> None:
    model = tmp_path / "lone.xml"
    model.write_text(
        "<mujoco><worldbody><body><freejoint/>"
        '<inertial pos="0 0 0" mass="1" diaginertia="1 2 2.5"/></body></worldbody></mujoco>'
    )
    done = validate("--model", model)
    assert done.returncode == 1
    assert "refused: automatic reset is on" in done.stdout
    assert "angular momentum" in done.stdout
    told = json.loads(validate("--model", model, "--json").stdout)
    assert told["passed"] is False
    assert told["integrator"] == "EULER"


@pytest.mark.parametrize("passed", [True, False])
def test_the_verdict_is_the_exit_status(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, passed: bool
) -> None:
    row = Row.judged(Bound("x", "", 1.0, "because"), 0.5 if passed else 2.0)
    injected = Injected(fault="sign", meaning="", expected=True, broken=["x"] if passed else [])
    section = dict.fromkeys(("title", "shows", "source", "x_label", "y_label", "error_label"), "")
    results = Results(
        versions={},
        quick=True,
        sections=[
            Section(
                name="fake",
                step=0.1,
                rows=[row],
                faults=[injected],
                motion=[],
                errors={},
                **section,
            )
        ],
    )
    monkeypatch.setattr("mjspace.validation.suite.validate", lambda *_, **__: results)
    with pytest.raises(typer.Exit) as ended:
        validation.validate(only=["torque-free"], quick=True, out=tmp_path)
    assert ended.value.exit_code == (0 if passed else 1)
    assert json.loads((tmp_path / "validation.json").read_text())["passed"] is passed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--only", "torque"), "--only: no benchmark 'torque': have torque-free, "),
        (("--model", "nowhere.xml"), "nowhere.xml"),
        (("--model", "x.xml", "--quick"), "--model: a passport is of one model"),
    ],
)
def test_bad_input_is_one_line_and_2(
    tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    done = validate(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "runs").exists()


def test_no_basilisk_is_a_remark() -> None:
    nothing = Results(versions={}, quick=True, sections=[])
    for python, said in (
        ("", "--basilisk PYTHON"),
        ("/nowhere/python", "No such file"),
        (sys.executable, "No module named 'Basilisk'"),
    ):
        results = basilisk.compared(nothing, python)
        assert results.passed
        assert said in results.remarks[0]


def test_a_passport_is_saved_where_a_folder_is_named(tmp_path: Path) -> None:
    model = tmp_path / "lone.xml"
    model.write_text(
        "<mujoco><worldbody><body><freejoint/>"
        '<inertial pos="0 0 0" mass="1" diaginertia="1 2 2.5"/></body></worldbody></mujoco>'
    )
    folder = tmp_path / "here"
    done = validate("--model", model, "--out", folder)
    assert done.returncode == 1
    assert str(folder / "passport.html") in done.stdout
    saved = json.loads((folder / "passport.json").read_text())
    assert saved["passed"] is False
    assert next(row["quantity"] for row in saved["rows"]) == "angular momentum"
    page = (folder / "passport.html").read_text()
    assert "automatic reset is on" in page
    assert ">FAIL</span>" in page
    assert str(model) in page
