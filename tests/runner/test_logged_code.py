"""Code out of a log runs with trust alone."""

import json
import sys
from pathlib import Path

import pytest
from log_samples import rewritten

from mjspace import cli
from mjspace.errors import InputError
from mjspace.log.reader import Log
from mjspace.runner.logged_code import unpack
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import run

LAW = """
import numpy as np
from mjspace.contract import TorqueCommand

class Still:
    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        return None, TorqueCommand(np.zeros(3)), None
"""
DISTURBANCE = "def push(time, truth):\n    return (0, 0, 0), (0, 0, 1e-3)\n"
SCENARIO = """
base = "detumble-wheels"
checks = []
duration = "0.05 s"
[law]
kind = "still.py:Still"
[environment]
python = "push.py:push"
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("own")
    (folder / "still.py").write_text(LAW)
    (folder / "push.py").write_text(DISTURBANCE)
    (folder / "x.toml").write_text(SCENARIO)
    return run(folder / "x.toml", out=folder / "out").path


def hostile(flown: Path, tmp_path: Path, *names: str) -> tuple[Path, Path]:
    """Return the log with code that touches a file in ``names``, and that file."""
    ran = tmp_path / "ran"
    attachments = {
        name: f"from pathlib import Path\nPath({str(ran)!r}).touch()\n".encode()
        + Log(flown).attachment(name)
        for name in names
    }
    return rewritten(flown, tmp_path / "hostile.mcap", attachments=attachments), ran


def test_a_log_with_code_is_refused_by_name_and_digest(flown: Path, tmp_path: Path) -> None:
    path, ran = hostile(flown, tmp_path, "law.py", "disturbance.py")
    for again in (lambda: verify(path), lambda: replay(path, tmp_path / "out")):
        with pytest.raises(InputError, match=r"law\.py \(sha256 \w{16}\).*--trust") as refused:
            again()
        assert "disturbance.py (sha256" in str(refused.value)
    assert not ran.exists()
    assert not (tmp_path / "out").exists()
    assert verify(path, trust=True) is None
    assert ran.exists()


def test_the_disturbance_of_a_log_needs_trust_under_another_law_too(
    flown: Path, tmp_path: Path
) -> None:
    path, ran = hostile(flown, tmp_path, "disturbance.py")
    law = "quaternion_feedback:RateDamping"
    with pytest.raises(
        InputError, match=r"runs code out of the log, disturbance\.py \("
    ) as refused:
        replay(path, tmp_path / "out", law=law, gains=["rate_gain=1"])
    assert "law.py" not in str(refused.value)
    assert not ran.exists()
    replay(path, tmp_path / "out", law=law, gains=["rate_gain=1"], trust=True)
    assert ran.exists()


def test_a_module_named_in_a_log_is_not_imported(flown: Path, tmp_path: Path) -> None:
    own = Log(flown).attachment("scenario.toml").decode()
    for kind in ("os:system", "/etc/x.py:Law", "../x.py:Law"):
        as_estimator = f'{own}\n[estimator]\nkind = "{kind}"\n'
        for scenario in (own.replace("law.py:Still", kind), as_estimator):
            attachments = {"scenario.toml": scenario.encode()}
            path = rewritten(flown, tmp_path / "x.mcap", attachments=attachments)
            with pytest.raises(InputError):
                verify(path)


def test_the_estimator_of_a_log_is_trusted_no_more_than_its_law(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Under another law too; and ``info`` runs nothing."""
    own = Log(flown).attachment("scenario.toml").decode().replace("disturbance.py:push", "")
    law, told = "quaternion_feedback:RateDamping", r"no module 'os'|runs code out of the log"
    scenario = f'{own}\n[estimator]\nkind = "os:system"\n'
    path = rewritten(flown, tmp_path / "x.mcap", attachments={"scenario.toml": scenario.encode()})
    assert "scenario        x" in info(path, capsys=capsys)
    with pytest.raises(InputError, match=told):
        replay(path, tmp_path / "out", law=law, gains=["rate_gain=1"])
    assert not (tmp_path / "out").exists()


def test_an_attachment_stays_in_its_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    with pytest.raises(InputError, match=r"the attachment 'law/\.\./\.\./up\.py' leads out"):
        unpack({"law/../../up.py": b""}, inside)
    with pytest.raises(InputError, match="leads out"):
        unpack({f"{tmp_path}/up.py": b""}, inside)
    assert not (tmp_path / "up.py").exists()


def info(path: Path, *options: str, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["mjspace", "info", str(path), *options])
        with pytest.raises(SystemExit):
            cli.main()
    return capsys.readouterr().out


def test_info_shows_what_would_run(flown: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = info(flown, capsys=capsys)
    assert "law.py, sha256 " in text
    assert "    import numpy as np\n" in text
    assert "    def push(time, truth):\n" in text
    data = json.loads(info(flown, "--json", capsys=capsys))
    assert set(data["code"]) == {"law.py", "disturbance.py"}
    assert f"sha256 {data['code']['law.py']}" in text


def test_control_characters_of_a_log_do_not_reach_the_terminal(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = b"# \x1b]0;title\x07\n" + Log(flown).attachment("law.py")
    path = rewritten(flown, tmp_path / "x.mcap", attachments={"law.py": code, "a\x1b[2J.py": b""})
    text = info(path, capsys=capsys)
    assert "\x1b" not in text
    assert r"\x1b]0;title\x07" in text
    assert r"a\x1b[2J.py" in text


def test_the_name_of_a_logs_scenario_leads_nowhere_else(
    flown: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mjspace.runner.run import output_folder

    for name in ("../../x", "/x", "..", "", "a\0b", "x" * 300):
        with pytest.raises(InputError, match="no name of a folder: give one by --out"):
            output_folder(None, name)
    assert output_folder(tmp_path, "../x") == tmp_path
