"""A law in C flies as the same law in Python does, and one of other structs is refused."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from command_lines import command_line
from pages import write_files

from mjspace.errors import FlightError, InputError
from mjspace.log.reader import Log
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.state_layout import StateLayout

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")

IN_PYTHON = """
from dataclasses import dataclass
from typing import NamedTuple
import numpy as np
from mjspace import attitude
from mjspace.contract import Array, Gains, TorqueCommand, gain

class State(NamedTuple):
    integral: Array

class Signals(NamedTuple):
    error: Array

@dataclass(frozen=True)
class Law(Gains):
    attitude_gain: float = gain("N m")
    rate_gain: float = gain("N m s/rad")
    integral_gain: float = gain("")
    control_period: float = gain("s")

    def reset(self, measurement, reference):
        return State(np.zeros(3))

    def step(self, state, time, measurement, reference):
        e = attitude.multiply(attitude.conjugate(reference.attitude), measurement.attitude)
        error = np.where(e[0] < 0.0, -1.0, 1.0) * e[1:]
        torque = -self.attitude_gain * error - self.rate_gain * measurement.rate
        torque = torque - self.integral_gain * state.integral
        integral = state.integral + self.control_period * error
        return State(integral), TorqueCommand(torque), Signals(e)
"""
GAINS = ("attitude_gain='6 N m'", "rate_gain=12", "integral_gain=0.6")
SHORT = ["duration=5", "checks=[]"]


def compiled(folder: Path, source: str = "attitude_law.c", library: str = "") -> Path:
    """Compile a ``source`` in the folder into a library, of the page's name if left out."""
    path = folder / (library or "libattitude_law.so")
    command = ["cc", "-std=c99", "-Wall", "-Werror", "-pedantic", "-ffp-contract=off", "-shared"]
    subprocess.run([*command, "-fPIC", "-o", path, folder / source], check=True)
    return path


def changed(folder: Path, name: str, *changes: tuple[str, str]) -> None:
    """Compile the page's law with these ``changes`` of its text into ``name``.so."""
    text = (folder / "attitude_law.c").read_text()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    (folder / f"{name}.c").write_text(text)
    compiled(folder, f"{name}.c", f"{name}.so")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the page's scenario, its header and its compiled law."""
    folder = tmp_path_factory.mktemp("page")
    write_files("docs/flight_software.md", folder)
    scenario, header = folder / "attitude_law.toml", folder / "attitude_law.h"
    assert command_line("law-header", str(scenario), "-o", str(header)) == 0
    compiled(folder)
    return folder


@pytest.fixture(scope="module")
def flown(page: Path) -> Path:
    return run(page / "attitude_law.toml", overrides=SHORT, out=page / "out").path


def test_it_flies_as_the_same_law_in_python(page: Path, flown: Path) -> None:
    (page / "law.py").write_text(IN_PYTHON)
    overrides = ["law.kind=law.py:Law", *(f"law.{gain}" for gain in GAINS), *SHORT]
    other = run(page / "attitude_law.toml", overrides=overrides, out=page / "python").log
    log = Log(flown)
    assert log.topics == other.topics
    assert log.units == other.units | {"/state": log.units["/state"]}
    for topic in ("/state", "/command", "/law", "/truth"):
        for name, values in other.read(topic).items():
            np.testing.assert_allclose(log.read(topic)[name], values, rtol=0, atol=1e-12)
    assert np.ptp(log.read("/truth")["attitude_error"]) > 0.1


def test_a_replay_begins_at_any_instant_and_needs_trust(flown: Path) -> None:
    with pytest.raises(InputError, match=r"runs code out of the log, law\.so \(sha256 \w{16}\)"):
        verify(flown)
    assert verify(flown, trust=True) is None
    assert verify(flown, start=2.5, trust=True) is None


def test_another_log_is_flown_again_under_a_library(page: Path, flown: Path) -> None:
    log = run(
        page / "attitude_law.toml",
        overrides=["law.kind=coast:Coast", "duration=1", "checks=[]"],
        out=page / "coast",
    ).path
    gains = [
        *("attitude_gain=6", "rate_gain=12", "integral_gain=0.6"),
        "state={integral={shape=[3]}}",
        "signals={error={shape=[4]}}",
    ]
    law = "libattitude_law.so:attitude_law"
    again = replay(log, page / "again", law=law, gains=gains, folder=page)
    states = [Log(path).read("/state", end=1.0)["physics"] for path in (again.path, flown)]
    np.testing.assert_array_equal(*states)


def test_every_vehicle_of_a_batch_has_a_state_of_its_own(page: Path, flown: Path) -> None:
    assembly = assemble(*load(page / "attitude_law.toml", ["duration=0.5", "checks=[]"]))
    start = first_start(assembly, [0, 1])
    start.physics[1, StateLayout(assembly).rate] = [0.01, 0.02, -0.03]
    blocks = list(fly(assembly, start, [0, 1]))
    state = np.concatenate([block.rows["/state"]["law_integral"] for block in blocks])
    assert np.abs(state[-1, 0] - state[-1, 1]).max() > 1e-4
    alone = Log(flown).read("/state", end=0.5)["law_integral"]
    np.testing.assert_array_equal(state[:, 0], alone)


def test_what_is_compiled_anew_is_flown_anew(page: Path, tmp_path: Path) -> None:
    """In one process: a library of the same path would be loaded once."""
    shutil.copytree(page, tmp_path, dirs_exist_ok=True)
    scenario, torques = tmp_path / "attitude_law.toml", []
    for sign in ("-", "+"):
        changed(tmp_path, "libattitude_law", ("= -in->gains", f"= {sign}in->gains"))
        log = run(scenario, overrides=["duration=0.05", "checks=[]"], out=tmp_path / sign).log
        torques.append(log.read("/command")["torque"][0, 0])
    assert torques[0] == -torques[1] != 0.0


def test_reset_fills_in_the_state(page: Path) -> None:
    reset = """
int attitude_law_reset(const mjspace_input *in, mjspace_state *state) {
  for (int i = 0; i < 3; i++) state->integral[i] = in->measurement.attitude[i];
  return 0;
}
int attitude_law("""
    changed(page, "reset", ("\nint attitude_law(", reset))
    override = ["law.kind=reset.so:attitude_law", *table()]
    log = run(page / "attitude_law.toml", overrides=override, out=page / "reset").log
    first = log.read("/measurement")["attitude"][0]
    np.testing.assert_array_equal(log.read("/state")["law_integral"][0], first[:3])


INNER = """
int attitude_law_inner(const mjspace_input *in, mjspace_state *state, mjspace_command *command) {
  for (int i = 0; i < 3; i++) {
    command->torque[i] -= in->gains.rate_gain * in->measurement.rate[i];
    state->integral[i] += 0.01 * in->measurement.rate[i];
  }
  return STATUS;
}
"""
INNER_IN_PYTHON = (
    IN_PYTHON.replace("    def reset", "    batched = True\n    def reset", 1)
    .replace("np.zeros(3)", "np.zeros_like(measurement.rate)")
    .replace("e[0] < 0.0, -1.0, 1.0) * e[1:]", "e[:, :1] < 0.0, -1.0, 1.0) * e[:, 1:]")
    .replace(" - self.rate_gain * measurement.rate", "")
    + """
    def inner(self, state, time, command, measurement):
        torque = command.torque - self.rate_gain * measurement.rate
        return State(state.integral + 0.01 * measurement.rate), TorqueCommand(torque)
"""
)


def test_its_inner_loop_is_called_in_each_integration_step(page: Path) -> None:
    """Of 10 ms in a control period of 50 ms: as one in Python, and again from any instant."""
    without = ("-\n                             in->gains.rate_gain * in->measurement.rate[i]", "")
    text = (page / "attitude_law.c").read_text()
    (page / "looped.c").write_text(text.replace(*without) + INNER.replace("STATUS", "0"))
    assert without[0] in text
    compiled(page, "looped.c", "looped.so")
    shapes = ["state.integral.shape=[3]", "signals.error.shape=[4]"]
    gains = [f"law.{gain}" for gain in GAINS]
    in_c = ["law.kind=looped.so:attitude_law", *gains, *(f"law.{each}" for each in shapes), *SHORT]
    (page / "looped.py").write_text(INNER_IN_PYTHON)
    result = run(page / "attitude_law.toml", overrides=in_c, out=page / "looped")
    python = ["law.kind=looped.py:Law", *gains, *SHORT]
    other = run(page / "attitude_law.toml", overrides=python, out=page / "looped-python").log
    for topic in ("/state", "/command", "/truth"):
        for name, values in other.read(topic).items():
            np.testing.assert_allclose(result.log.read(topic)[name], values, rtol=0, atol=1e-12)
    assert verify(result.path, start=2.5, trust=True) is None
    built = assemble(*load(page / "attitude_law.toml", [*in_c, "duration=0.5"]))
    blocks = list(fly(built, first_start(built, [0, 1]), [0, 1]))
    state = np.concatenate([block.rows["/state"]["law_integral"] for block in blocks])
    np.testing.assert_array_equal(state[:, 0], state[:, 1])
    np.testing.assert_array_equal(state[:, 0], result.log.read("/state", end=0.5)["law_integral"])


def test_an_inner_loop_that_returns_an_error_ends_the_flight(page: Path) -> None:
    text = (page / "attitude_law.c").read_text()
    (page / "stuck.c").write_text(text + INNER.replace("STATUS", "in->time > 0.025 ? 3 : 0"))
    compiled(page, "stuck.c", "stuck.so")
    overrides = ["law.kind=stuck.so:attitude_law", *table()]
    result = run(page / "attitude_law.toml", overrides=overrides, out=page / "stuck")
    assert "the law's attitude_law_inner returned 3, which is not 0" in result.trouble


def table() -> list[str]:
    """Return the page's gains for a law of another kind, of a flight of two periods."""
    shapes = ["state.integral.shape=[3]", "signals.error.shape=[4]"]
    return [*(f"law.{key}" for key in (*GAINS, *shapes)), "duration=0.1", "checks=[]"]


def test_a_library_that_returns_an_error_ends_the_flight(page: Path) -> None:
    changed(page, "late", ("return 0;", "return in->time > 0.04 ? 7 : 0;"))
    overrides = ["law.kind=late.so:attitude_law", *table()]
    result = run(page / "attitude_law.toml", overrides=overrides, out=page / "late")
    assert isinstance(result.error, FlightError)
    assert (
        result.trouble == "stopped at t = 0.05 s: the law's attitude_law returned 7, which is not 0"
    )
    assert result.log.complete
    assert len(result.log.read("/command")["time"]) == 1


def test_so_does_one_whose_reset_returns_an_error(page: Path) -> None:
    text = "int attitude_law_reset(const mjspace_input *in, mjspace_state *state) {"
    text = f"\n{text} return in == 0 || state != 0; }}\nint attitude_law("
    changed(page, "unready", ("\nint attitude_law(", text))
    overrides = ["law.kind=unready.so:attitude_law", *table()]
    with pytest.raises(FlightError, match="the law's attitude_law_reset returned 1, which is not"):
        run(page / "attitude_law.toml", overrides=overrides, out=page / "unready")
    assert not (page / "unready").exists()


def test_a_command_that_is_not_finite_ends_the_flight(page: Path) -> None:
    changed(page, "nan", ("-in->gains.attitude_gain", "0.0 / 0.0 * in->gains.attitude_gain"))
    overrides = ["law.kind=nan.so:attitude_law", *table()]
    with pytest.raises(FlightError, match=r"/command\.torque is not finite.*t = 0 s"):
        run(page / "attitude_law.toml", overrides=overrides, out=page / "nan")


BAD = {
    "law.kind=nothing.so:attitude_law": r"law: no file .*nothing\.so",
    "law.kind=libattitude_law.so": r"law: 'libattitude_law\.so': write 'library\.so:function'",
    "law.kind=libattitude_law.so:no": r"law: libattitude_law\.so has no function 'no'",
    "law.kind=text.so:f": r"law: text\.so is no shared library that loads here: ",
    "law.kind=bare.so:f": r"law: bare\.so does not say for which structs it was compiled: write",
    "law.another=1": r"compiled for 'gains attitude_gain.*', the scenario has 'gains.* another'",
    "law.signals.error.shape=[3]": r"compiled for 'signals error\[4\]', the scenario .*error\[3\]",
    "sensors.gyro.measures=rate": r"compiled for 'measurement .*rate\[3\].*', the .*gyro\[3\]'",
    "law.rate_gain='8 parsec'": "law: rate_gain: '8 parsec' has the unknown unit 'parsec'",
    "law.rate_gain=[[1], [2, 3]]": "law: rate_gain: .* rows differ in length",
    "law.rate_gain=[]": r"law: rate_gain: got \[\], should be a number or an array of numbers",
    "law.rate_gain=true": "law: rate_gain: got True, should be a number",
    "law.file=x.csv": "law: file: got 'x.csv', should be a number or a number with a unit",
    "law.my-gain=1": "law: my-gain: should be a name that C has",
    "law.state=3": "law: state: got 3, should be a table of its fields",
    "law.state.time={}": "law: state.time: should be a name that C has, and neither 'time' nor",
    "law.signals.error=4": r"law: signals\.error: got 4, should be as { shape = \[3\], unit",
    "law.signals.error.shape=[0]": r"signals\.error: got {'shape': \[0\]}, should be as",
}


@pytest.mark.parametrize("override", BAD)
def test_what_cannot_be_flown_is_refused_in_one_line(
    page: Path, override: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (page / "text.so").write_text("no library")
    (page / "bare.c").write_text("int f(void);\nint f(void) { return 0; }\n")
    compiled(page, "bare.c", "bare.so")
    out, gains = page / "refused", [] if "kind" not in override else table()
    words = [word for each in [*gains, override] for word in ("--set", each)]
    assert command_line("run", str(page / "attitude_law.toml"), *words, "--out", str(out)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("mjspace: ")
    with pytest.raises(InputError, match=BAD[override]):
        run(page / "attitude_law.toml", overrides=[*gains, override], out=out)
    assert not out.exists()


def test_no_library_outside_the_folder_is_even_loaded(page: Path, tmp_path: Path) -> None:
    """A library's constructors run while it is loaded."""
    mark = tmp_path / "ran"
    code = f'#include <stdio.h>\n__attribute__((constructor)) static void f(void) {{ \
        fclose(fopen("{mark}", "w")); }}\n'
    (tmp_path / "bomb.c").write_text(code)
    compiled(tmp_path, "bomb.c", "bomb.so")
    overrides = ["duration=0.1", "checks=[]"]
    text = (page / "attitude_law.toml").read_text()
    scenario = page / "outside.toml"
    scenario.write_text(text.replace("libattitude_law.so:", f"{tmp_path}/bomb.so:"))
    with pytest.raises(InputError, match="outside the scenario's folder"):
        run(scenario, overrides=overrides, out=tmp_path / "out")
    assert not mark.exists()
    with pytest.raises(InputError, match="does not say for which structs"):
        run(scenario, overrides=overrides, out=tmp_path / "out", trust=True)
    assert mark.exists()


def test_the_header_is_of_a_law_in_a_library(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line("law-header", "detumble-wheels") == 2
    assert "law.kind: got 'quaternion_feedback:RateDamping'" in capsys.readouterr().err


@pytest.mark.parametrize("scenario", ["lander", "dgvscmg-tracking", "rcs-schmitt", "b-dot-igrf"])
@pytest.mark.parametrize("language", ["c", "c++"])
def test_a_header_of_any_scenario_compiles(
    scenario: str, language: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if language == "c++" and shutil.which("c++") is None:
        pytest.skip("there is no C++ compiler")
    assert command_line("law-header", scenario, "--set", "law.kind=x.so:law") == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 100
    size = '#include <stddef.h>\nextern "C" ' * (language == "c++")
    code = f"{text}\n{size}const char mjspace_law_layout[] = MJSPACE_LAW_LAYOUT;\n"
    options = ["-std=c99"] if language == "c" else ["-std=c++11"]
    command = ["cc", "-x", language, *options, "-pedantic", "-Wall", "-Werror", "-fsyntax-only"]
    subprocess.run([*command, "-"], input=code, text=True, check=True, cwd=tmp_path)
