"""``mjspace convert`` and ``mjspace compare`` through the real entry point."""

import json
from pathlib import Path

import pytest
from command_lines import command_line

from mjspace.runner.run import run

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    folder = tmp_path_factory.mktemp("logs")
    shorter = ["duration=0.5", "checks=[]"]
    one = run("lqr-regulation", overrides=shorter, out=folder / "a")
    two = run(
        "lqr-regulation", overrides=[*shorter, "initial.rate=[0.02,-0.01,0.0151]"], out=folder / "b"
    )
    return str(one.path), str(two.path)


def test_convert_writes_a_table(logs: tuple[str, str], tmp_path: Path, capsys: Captured) -> None:
    out = tmp_path / "x.csv"
    words = ("-o", str(out), "--signal", "truth.rate[2]", "--rate", "10")
    assert command_line("convert", logs[0], *words) == 0
    assert capsys.readouterr().out.strip() == str(out)
    lines = out.read_text().splitlines()
    assert lines[0] == "time,truth.rate[2]"
    assert lines[1] == "0.0,0.015"
    assert len(lines) == 7


def test_compare_says_what_differs_and_since_when(
    logs: tuple[str, str], tmp_path: Path, capsys: Captured
) -> None:
    assert command_line("compare", logs[0], logs[0]) == 0
    assert "signals are equal" in capsys.readouterr().out
    picture = tmp_path / "x.png"
    assert command_line("compare", *logs, "--topic", "truth", "-o", str(picture)) == 1
    assert "truth.rate [rad/s]" in capsys.readouterr().out
    assert picture.stat().st_size > 20_000
    assert command_line("compare", *logs, "--tolerance", "1", "--json") == 0
    data = json.loads(capsys.readouterr().out)
    rate = next(each for each in data["signals"] if each["name"] == "truth.rate")
    assert 1e-4 < rate["largest"] < 2e-4
    assert rate["beyond"] is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("convert", "{}", "-o", "x.xls"), "convert: output 'x.xls': end it in one of"),
        (("convert", "{}", "-o", "x.csv", "--topic", "no"), "convert: no topic '/no' in the log"),
        (("convert", "{}", "-o", "x.csv", "--rate", "7"), "convert: rate: 7 Hz, should be"),
        (("compare", "{}", "no.mcap"), "log: "),
        (("compare", "{}", "{}", "--tolerance", "nan"), "--tolerance nan: should be a number"),
        (("compare", "{}", "{}", "-o", "x.jpg"), "compare: output 'x.jpg': end it in .png"),
    ],
)
def test_bad_input_is_one_line(
    arguments: tuple[str, ...],
    message: str,
    logs: tuple[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Captured,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command_line(*(each.format(logs[0]) for each in arguments)) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"mjspace: {message}")
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())
