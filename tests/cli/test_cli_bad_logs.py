"""Whatever file a command is handed as a log: one line, status 2 and nothing written."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from log_samples import fly, rewritten

from mjspace import cli
from mjspace.log.index import inventory
from mjspace.runner.run import run

COMMANDS = {
    "info": (),
    "plot": ("-o", "out.png"),
    "report": ("-o", "out.html"),
    "render": ("-o", "out.png"),
    "replay": ("--out", "out"),
}
Command = Callable[..., tuple[int, str]]


@pytest.fixture
def command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Command:
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["mjspace", *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        code = ended.value.code
        return (
            code if isinstance(code, int) else 0 if code is None else 1
        ), capsys.readouterr().err

    return run


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("log") / "flight.mcap")


def assert_refused(command: Command, path: str, message: str) -> None:
    for name, rest in COMMANDS.items():
        status, said = command(name, path, *rest)
        assert status == 2, (name, said)
        assert message in said, name
        assert said.count("\n") == 1, said
        assert not os.path.exists("out.png")
        assert not os.path.exists("out.html")
        assert not os.path.exists("out")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "bad.mcap is not an MCAP file"),
        (b"just text", "bad.mcap is not an MCAP file"),
        (b"\x89MCAP0\r\n", "bad.mcap is an MCAP file, but not a log of mjspace"),
        # a schema record of two bytes, a message index before any chunk, a channel of garbage
        (
            b"\x89MCAP0\r\n\x03\x02" + bytes(9),
            "the schema record at byte 8 cannot be read",
        ),
        (b"\x89MCAP0\r\n\x07\x08" + bytes(15), "the message index record at byte 8 cannot be read"),
        (b"\x89MCAP0\r\n\x04\x09" + bytes(7) + b"\xff" * 9, "bad.mcap is damaged"),
    ],
)
def test_what_is_no_log_is_refused_by_every_command(
    command: Command, content: bytes, message: str
) -> None:
    Path("bad.mcap").write_bytes(content)
    assert_refused(command, "bad.mcap", message)


def test_a_folder_and_nothing_at_all_are_refused_by_every_command(command: Command) -> None:
    Path("dir.mcap").mkdir()
    assert_refused(command, "dir.mcap", "Is a directory: 'dir.mcap'")
    assert_refused(command, "none.mcap", "No such file or directory: 'none.mcap'")


def test_a_log_cut_before_its_first_chunk_holds_no_control_period(
    command: Command, whole: Path
) -> None:
    content, first = whole.read_bytes(), inventory(whole).chunks[0].position
    path = Path("half.mcap")
    # wherever the metadata are whole: eight cuts, and up to the last byte of the first chunk's head
    begin = content.index(b"flight.mcap") if b"flight.mcap" in content else first // 2
    for cut in [*np.linspace(max(begin, first // 2), first - 9, 4).astype(int), first, first + 8]:
        path.write_bytes(content[:cut])
        assert_refused(
            command,
            "half.mcap",
            "half.mcap was cut short before its first chunk: it holds no control period",
        )


def test_no_command_has_a_traceback_of_a_log_cut_anywhere(command: Command, whole: Path) -> None:
    content = whole.read_bytes()
    for cut in np.linspace(0, len(content) - 1, 25).astype(int):
        Path("cut.mcap").write_bytes(content[:cut])
        for name, rest in COMMANDS.items():
            status, said = command(name, "cut.mcap", *rest)
            assert status in (0, 2)
            assert said.count("\n") == (status == 2), said


def test_a_law_that_raises_in_its_reset_is_one_line_with_its_place(
    command: Command, failing_law: Callable[..., Path]
) -> None:
    """As where it refuses what is measured in the middle of a flight."""
    log = run(failing_law(1.0), overrides=["duration=0.05"], out="flown").path
    law = Path("law.py").read_text().replace("return None\n", 'raise ArithmeticError("no")\n', 1)
    rewritten(log, Path("x.mcap"), attachments={"law.py": law.encode()})
    for rest in (("--verify",), ("--out", "out", "--from", "0.02")):
        status, said = command("replay", "x.mcap", "--trust", *rest)
        assert status == 2
        assert said == "mjspace: log: the law raised ArithmeticError at law.py:12: no\n"
    assert not os.path.exists("out")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("bogus", "MUJOCO_GL=bogus: MuJoCo does not know this value; use one of egl, osmesa"),
        ("osmesa", "MUJOCO_GL=osmesa: the library OSMesa is not installed"),
        ("EGL", "MUJOCO_GL=egl: the library EGL is not installed"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="other platforms have other libraries")
def test_a_renderer_that_is_not_there_is_one_line_and_1(
    command: Command, monkeypatch: pytest.MonkeyPatch, value: str, message: str
) -> None:
    monkeypatch.setattr("mjspace.rendering.graphics.find_library", lambda name: None)
    monkeypatch.setenv("MUJOCO_GL", value)
    for arguments in (("render", "x.mcap", "-o", "x.png"), ("run", "slew"), ("validate",)):
        status, said = command(*arguments)
        assert status == 1
        assert message in said
        assert said.count("\n") == 1


def test_rendering_that_is_switched_off_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from mjspace.errors import NoRendererError
    from mjspace.rendering.offscreen import Canvas

    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(NoRendererError, match="MUJOCO_GL=off switches rendering off: unset it"):
        Canvas(None, (16, 16))
