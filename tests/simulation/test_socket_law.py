"""A law in another process flies as in the flight's own; one that is gone or lies ends it."""

import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from command_lines import command_line

from mjspace.errors import FlightError, InputError
from mjspace.log.reader import Log
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import Result, run
from mjspace.scenario.loading import component, load
from mjspace.scenario.trust import CommandLineText, Trust
from mjspace.simulation.assembly import assemble
from mjspace.simulation.flight_software.interface import Field, interface_of
from mjspace.simulation.flight_software.messages import CLASSES, Connection, Numbers, PeerError
from mjspace.simulation.flight_software.proto import proto_file
from mjspace.simulation.flight_software.serve import serve
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.state_layout import StateLayout

OWN = """
from typing import Annotated, NamedTuple
import numpy as np
from mjspace.contract import TorqueCommand, Unit

class State(NamedTuple):
    turned: Annotated[np.ndarray, Unit("rad")]
    calls: np.ndarray

class Signals(NamedTuple):
    error: Annotated[np.ndarray, Unit("rad/s")]

class Law:
    def __init__(self, control_period: float, gain: float = 3.0, breaks: float = 1e9):
        self.control_period, self.gain, self.breaks = control_period, gain, breaks

    def reset(self, measurement, reference):
        return State(np.zeros((2, 3)), 0.0)

    def step(self, state, time, measurement, reference):
        if time > self.breaks:
            raise ValueError("it breaks")
        turned = state.turned + self.control_period * measurement.gyro
        torque = -self.gain * measurement.rate - 0.1 * turned[0]
        return State(turned, state.calls + 1), TorqueCommand(torque), Signals(measurement.rate)

class Inner(Law):
    def inner(self, state, time, command, measurement): ...
"""
SCENARIO = """
base = "detumble-wheels"
description = "a law of one's own, and a noisy gyro under another name"
checks = []
duration = "1 s"
[sensors.gyro]
measures = "rate"
noise_std = "1e-4 rad/s"
[law]
kind = "own.py:Law"
gain = 4.0
"""


def listening(law: str, folder: Path, *gains: str) -> tuple[str, list[str]]:
    """Return the address at which the ``law`` listens, in a thread, and what it tells."""
    told: list[str] = []
    ready = threading.Event()

    def tell(line: str) -> None:
        told.append(line)
        ready.set()

    arguments = component(law, gains), "127.0.0.1", 0
    target = lambda: serve(*arguments, folder=folder, tell=tell)  # noqa: E731
    threading.Thread(target=target, daemon=True).start()
    assert ready.wait(20.0)
    return told[0].split()[3].rstrip(";"), told


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("own")
    (path / "own.py").write_text(OWN)
    (path / "x.toml").write_text(SCENARIO)
    return path


@pytest.fixture(scope="module")
def address(folder: Path) -> str:
    return listening("own.py:Law", folder)[0]


@pytest.fixture(scope="module")
def flown(folder: Path, address: str) -> Path:
    return run(folder / "x.toml", overrides=own(address), out=folder / "socket").path


def own(address: str) -> list[str]:
    return [f"law.kind={address}", "law.gain=4"]


def assert_same(log: Log, other: Log) -> None:
    """Compare two logs bit by bit, but for the round trip."""
    for topic, fields in other.topics.items():
        ours, theirs = log.read(topic), other.read(topic)
        assert set(log.topics[topic]) - set(fields) <= {"round_trip"}
        for name, values in theirs.items():
            if name == "round_trip":
                continue
            assert ours[name].tobytes() == values.tobytes(), (topic, name)


def test_its_flight_is_that_of_the_law_in_process(folder: Path, flown: Path) -> None:
    log, other = Log(flown), run(folder / "x.toml", out=folder / "process").log
    assert_same(log, other)
    assert log.topics["/state"]["law_turned"] == (2, 3)
    expected = {**other.units["/law"], "round_trip": "s"}
    assert log.units["/law"] == expected
    assert log.units["/state"] == other.units["/state"]
    taken = log.read("/law")["round_trip"]
    assert taken.shape == (201, 1)
    assert np.all((taken > 1e-5) & (taken < 10.0))


@pytest.mark.parametrize("scenario", ["detumble-wheels", "b-dot", "pd-plus", "mission", "cmg-slew"])
def test_laws_of_mjspace_fly_so_too(scenario: str, folder: Path, tmp_path: Path) -> None:
    law = load(scenario)[0].law
    place, told = listening(law.kind, folder)
    logs = []
    for name, kind in (("here", law.kind), ("there", place)):
        table = {"base": scenario, "checks": [], "events": [], "law": {"kind": kind, **law.gains}}
        (tmp_path / f"{name}.toml").write_text(tomli_w.dumps(table))
        duration = f"duration={10 * load(scenario)[0].rates.control!r}"
        flown = run(tmp_path / f"{name}.toml", overrides=[duration], out=tmp_path / name)
        assert not flown.trouble
        logs.append(flown.log)
    assert_same(logs[1], logs[0])
    assert len(told) == 1


def test_gains_are_given_at_either_end(folder: Path, address: str, tmp_path: Path) -> None:
    place, _ = listening("own.py:Law", folder, "gain=5")
    x = folder / "x.toml"
    logs = [
        run(x, overrides=[f"law.kind={place}"], out=tmp_path / "there").log,
        run(x, overrides=[f"law.kind={address}", "law.gain=5"], out=tmp_path / "here").log,
        run(x, overrides=[f"law.kind={place}", "law.gain=3"], out=tmp_path / "both").log,
    ]
    torques = [log.read("/command")["torque"].tobytes() for log in logs]
    assert len(set(torques)) == 1


def test_a_replay_needs_the_law_and_trust(flown: Path, folder: Path, address: str) -> None:
    with pytest.raises(InputError, match=rf"log: .* needs the law that listened at {address}: sta"):
        verify(flown)
    assert verify(flown, trust=True) is None
    assert verify(flown, start=0.5, trust=True) is None
    again = replay(flown, folder / "again", start=0.5, trust=True).log
    assert_same(again, Log(replay(flown, folder / "third", start=0.5, trust=True).path))
    other = replay(flown, folder / "other", law="coast:Coast").log
    assert "round_trip" not in other.topics.get("/law", {})
    third = replay(other.path, folder / "fourth", law=address, gains=["gain=4"])
    assert (
        third.log.read("/state")["physics"].tobytes()
        == Log(flown).read("/state")["physics"].tobytes()
    )


def test_every_vehicle_has_its_own_state(folder: Path, address: str, flown: Path) -> None:
    assembly = assemble(*load(folder / "x.toml", [*own(address), "duration=0.2"]))
    start = first_start(assembly, [0, 1])
    start.physics[1, StateLayout(assembly).rate] = [0.01, 0.02, -0.03]
    blocks = list(fly(assembly, start, [0, 1]))
    state = np.concatenate([block.rows["/state"]["law_turned"] for block in blocks])
    np.testing.assert_array_equal(state[:, 0], Log(flown).read("/state", end=0.2)["law_turned"])
    assert np.abs(state[-1, 0] - state[-1, 1]).max() > 1e-2


def test_what_the_law_raises_is_said_as_in_process(
    folder: Path, address: str, tmp_path: Path
) -> None:
    ends = []
    for name, kind in (("process", "own.py:Law"), ("socket", address)):
        overrides = [f"law.kind={kind}", "law.breaks=0.503"]
        result = run(folder / "x.toml", overrides=overrides, out=tmp_path / name)
        ends.append(result.trouble)
        assert result.log.complete
        assert result.log.end == pytest.approx(0.5)
    line = OWN.splitlines().index('            raise ValueError("it breaks")') + 1
    said = f"stopped at t = 0.505 s: the law raised ValueError at own.py:{line}: it breaks"
    assert ends == [said, said]
    assert run(folder / "x.toml", overrides=own(address), out=tmp_path / "next").passed


# What stands at the other end, after the greeting and the answer to Begin: a function of the
# connection and of the socket.

Peer = Callable[[Connection, socket.socket], None]


def peer(act: Peer) -> str:
    """Return the address of a peer that greets, takes what begins a flight, and then acts."""

    def greets(connection: Connection, opened: socket.socket) -> None:
        connection.send(CLASSES["Greeting"](protocol="mjspace law", version=1))
        connection.receive("Begin")
        connection.send(CLASSES["Answer"]())
        act(connection, opened)

    return bare(greets)


def bare(act: Peer) -> str:
    """Return the address of a peer that acts."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve_one() -> None:
        with listener:
            opened, _ = listener.accept()
        with opened, suppress(PeerError, OSError):
            act(Connection(opened), opened)

    threading.Thread(target=serve_one, daemon=True).start()
    return f"tcp://127.0.0.1:{listener.getsockname()[1]}"


def torque(*values: float) -> bytes:
    return Numbers("Command", {"torque": Field((len(values),))}).encode([values])


ZERO = torque(0.0, 0.0, 0.0)


def answering(*answers: dict[str, Any]) -> Peer:
    """Return a peer that answers calls so, the last answer ever again."""

    def act(connection: Connection, opened: socket.socket) -> None:
        number = 0
        while True:
            call = connection.receive("Call")
            if call.reset:
                connection.send(CLASSES["Answer"]())
                continue
            connection.send(CLASSES["Answer"](**answers[min(number, len(answers) - 1)]))
            number += 1

    return act


def after_ten(last: Peer) -> Peer:
    """Return a peer that commands zero for ten periods, and then acts so."""

    def act(connection: Connection, opened: socket.socket) -> None:
        for _ in range(11):
            call = connection.receive("Call")
            connection.send(CLASSES["Answer"](command=b"" if call.reset else ZERO))
        connection.receive("Call")
        last(connection, opened)

    return act


def flight(kind: str, folder: Path, out: Path) -> Result:
    overrides = [f"law.kind={kind}", "law.timeout='500 ms'", "duration=0.5"]
    return run(folder / "x.toml", overrides=overrides, out=out)


def trickle(connection: Connection, opened: socket.socket) -> None:
    for byte in struct.pack("<I", 100) + bytes(100):
        opened.sendall(bytes([byte]))
        time.sleep(0.05)


def sends(data: bytes) -> Peer:
    def act(connection: Connection, opened: socket.socket) -> None:
        opened.sendall(data)
        time.sleep(2.0)

    return act


def hangs(connection: Connection, opened: socket.socket) -> None:
    time.sleep(2.0)


ENDS = {
    "dies": (lambda connection, opened: None, "closed the connection"),
    "late": (hangs, r"has not sent its Answer within 0\.5 s"),
    "trickles": (trickle, r"has not sent its Answer within 0\.5 s"),
    "no length": (sends(b"HTTP/1.1 400\r\n"), "sent no Answer, but what would have 1347703880 b"),
    "cut": (
        lambda connection, opened: opened.sendall(struct.pack("<I", 9) + b"\x0a"),
        "closed the connection",
    ),
    "damaged": (sends(struct.pack("<I", 4) + b"\xff\xff\xff\xff"), "sent a damaged Answer"),
    "damaged command": (
        answering({"command": ZERO}, {"command": b"\xff"}),
        "sent a damaged Command",
    ),
    "fewer numbers": (
        answering({"command": ZERO}, {"command": torque(0.0, 0.0)}),
        "sent 2 numbers as torque of its Command, should be 3",
    ),
    "nothing": (
        answering({"command": ZERO}, {}),
        "sent 0 numbers as torque of its Command, should",
    ),
    "state without fields": (
        answering({"command": ZERO, "state": ZERO}),
        "sent a State, and has declared no field of it",
    ),
    "no name": (
        answering({"command": ZERO, "signals_fields": [CLASSES["Field"](name="a b")]}),
        "'a b' cannot name a logged field",
    ),
    "our signal": (
        answering({"command": ZERO, "signals_fields": [CLASSES["Field"](name="round_trip")]}),
        "has a signal 'round_trip', which the flight measures itself",
    ),
    "two fields": (
        answering({"command": ZERO, "signals_fields": 2 * [CLASSES["Field"](name="x")]}),
        "declares two fields of one name",
    ),
    "large fields": (
        answering({"command": ZERO, "signals_fields": [CLASSES["Field"](shape=[4000000000])]}),
        "declares fields of more than 1048576 bytes",
    ),
    "another command": (
        answering({"command": ZERO, "command_fields": [CLASSES["Field"](name="x", shape=[3])]}),
        r"the law's command, a Command, has no field 'torque': it must be of shape \(\.\.\., 3\)",
    ),
    "error": (answering({"command": ZERO}, {"error": "no\x1b fuel"}), r"s: no\\x1b fuel$"),
    "not a number": (
        answering({"command": ZERO}, {"command": torque(0.0, np.nan, 0.0)}),
        r"/command\.torque is not finite",
    ),
}


@pytest.mark.parametrize("name", ENDS)
def test_a_law_that_is_gone_or_lies_ends_the_flight(
    name: str, folder: Path, tmp_path: Path
) -> None:
    act, said = ENDS[name]
    begins_well = name in ("dies", "late", "trickles", "no length", "cut", "damaged")
    kind = peer(after_ten(act) if begins_well else act)
    began = time.monotonic()
    if "fields" not in name and name not in ("no name", "our signal", "another command"):
        result = flight(kind, folder, tmp_path)
        assert isinstance(result.error, FlightError)
        assert result.log.complete
        assert len(result.log.read("/command")["time"]) == (10 if begins_well else 1)
        trouble = result.trouble
    else:  # in the first period: nothing is written
        with pytest.raises(FlightError) as raised:
            flight(kind, folder, tmp_path / "none")
        trouble = str(raised.value)
        assert not (tmp_path / "none").exists()
    assert time.monotonic() - began < 30.0
    assert "\n" not in trouble
    with pytest.raises(AssertionError, match=said):
        raise AssertionError(trouble)


def greets(**changed: Any) -> Peer:
    def act(connection: Connection, opened: socket.socket) -> None:
        connection.send(CLASSES["Greeting"](**{"protocol": "mjspace law", "version": 1} | changed))
        time.sleep(2.0)

    return act


REFUSED = {
    "silent": (hangs, r"what listens at tcp://\S+ has not sent its Greeting within 0\.5 s"),
    "closes": (lambda connection, opened: None, "closed the connection"),
    "another": (sends(b"SSH-2.0-OpenSSH\r\n"), "sent no Greeting, but what would have"),
    "protocol": (greets(protocol="other"), "speaks 'other' 1, should be 'mjspace law' 1"),
    "version": (greets(version=7), "speaks 'mjspace law' 7, should be 'mjspace law' 1"),
    "late answer": (greets(), r"has not sent its Answer within 0\.5 s"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_law_is_refused_before_the_flight(
    name: str, folder: Path, tmp_path: Path
) -> None:
    act, said = REFUSED[name]
    with pytest.raises(InputError, match=f"^law: .*{said}"):
        flight(bare(act), folder, tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_nothing_is_sent_to_what_does_not_greet(folder: Path, tmp_path: Path) -> None:
    """Another service of this machine, as a database without a password, must not hear of it."""
    heard: list[bytes] = []
    ended = threading.Event()

    def listens(connection: Connection, opened: socket.socket) -> None:
        opened.settimeout(5.0)
        heard.append(opened.recv(1000))
        ended.set()

    with pytest.raises(InputError, match="Greeting"):
        flight(bare(listens), folder, tmp_path / "none")
    assert ended.wait(10.0)
    assert heard == [b""]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


BAD = {
    "tcp://127.0.0.1:{port}": r"law: no law listens at tcp://\S+: Connection refused \(mjspace ser",
    "tcp://127.0.0.1:0": "the port should be from 1 to 65535",
    "tcp://127.0.0.1:70000": "the port should be from 1 to 65535",
    "tcp://127.0.0.1:0005555000": "the port should be from 1 to 65535",
    "tcp://127.0.0.1:x": "the port should be from 1 to 65535",
    "tcp://127.0.0.1": "law: 'tcp://127.0.0.1': write 'tcp://host:port'",
    "tcp://:5555": "law: 'tcp://:5555': write 'tcp://host:port'",
    "udp://127.0.0.1:5555": "law: 'udp://127.0.0.1:5555': write 'tcp://host:port'",
    "tcp://127.0.0.1:5 law.timeout=0": "law: timeout: got 0, should be above 0 and at most 86400 s",
    "tcp://127.0.0.1:5 law.timeout=5m": "law: timeout: got '5m', should be a number or a number wi",
}


@pytest.mark.parametrize("kind", BAD)
def test_an_address_that_is_none_is_refused_in_one_line(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [f"law.kind={kind.format(port=free_port())}"]
    words = [word for each in " ".join(words).split() for word in ("--set", each)]
    out = folder / "refused"
    assert command_line("run", str(folder / "x.toml"), *words, "--out", str(out)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    with pytest.raises(AssertionError, match=BAD[kind]):
        raise AssertionError(said)
    assert not out.exists()


@pytest.mark.parametrize(
    ("gain", "said"),
    [
        ("gian=4", r"law: gian: own\.py:Law has no such key: did you mean 'gain'"),
        ("gain='4 s'", "law: gain: got '4 s', but own.py:Law declares no unit"),
        ("gain=2026-11-29", r"law: gains: got {'gain': datetime\.date.*should be numbers, texts"),
        ("gain=text", "law: gain: got 'text', should be a number"),
        ("file='/etc/passwd'", "law: /etc/passwd is outside the scenario's folder"),
        ("gain={kind='os:system'}", "law: gain: no module 'os' in mjspace"),
    ],
)
def test_the_law_refuses_gains_before_the_flight(
    gain: str, said: str, folder: Path, address: str, tmp_path: Path
) -> None:
    overrides = [f"law.kind={address}", f"law.{gain}"]
    with pytest.raises(InputError, match=said):
        run(folder / "x.toml", overrides=overrides, out=tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_another_machine_needs_trust_and_is_not_even_looked_up(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def refuses(*arguments: Any, **_: Any) -> Any:
        asked.append(arguments[0])
        raise OSError("no network")

    monkeypatch.setattr(socket, "create_connection", refuses)
    for place in ("example.org:80", "10.0.0.1:5555", "[2001:db8::1]:5555", "127.0.0.1.evil.org:1"):
        scenario = tmp_path / "x.toml"
        scenario.write_text(SCENARIO.replace("own.py:Law", f"tcp://{place}"))
        with pytest.raises(InputError, match="is another machine, to which the flight's data"):
            run(scenario, out=tmp_path / "none")
        assert not asked
    with pytest.raises(InputError, match=r"no law listens at .*: no network"):
        run(scenario, out=tmp_path / "none", trust=True)
    assert asked == [("127.0.0.1.evil.org", 1)]
    trust = Trust(folder)
    assert trust.address("tcp://[::1]:5555") == ("::1", 5555)
    assert trust.address("tcp://localhost:5555") == ("localhost", 5555)
    assert trust.address(CommandLineText("tcp://far.org:5555")) == ("far.org", 5555)


def test_a_law_with_an_inner_loop_is_not_served(folder: Path) -> None:
    with pytest.raises(ValueError, match=r"own\.py:Inner has an inner loop"):
        serve(component("own.py:Inner", ()), "127.0.0.1", 0, folder=folder, tell=print)


def test_a_damaged_call_ends_that_flight_alone(folder: Path, address: str, tmp_path: Path) -> None:
    place, told = listening("own.py:Law", folder)
    host, port = Trust(folder).address(place)
    for data in (b"", b"GET / HTTP/1.1\r\n\r\n", struct.pack("<I", 2) + b"\xff\xff"):
        with socket.create_connection((host, port), 10.0) as opened:
            Connection(opened).receive("Greeting", 10.0)
            opened.sendall(data)
            with suppress(OSError):  # it may be closed there already
                opened.shutdown(socket.SHUT_WR)
                opened.recv(100)
    assert run(folder / "x.toml", overrides=own(place), out=tmp_path / "next").passed
    assert sorted(told[1:]) == [
        "a flight closed the connection",
        "a flight sent a damaged Begin",
        "a flight sent no Begin, but what would have 542393671 bytes",
    ]


def test_the_protobuf_file_declares_what_is_sent(folder: Path, address: str) -> None:
    interface = interface_of(assemble(*load(folder / "x.toml", own(address))))
    text = proto_file(interface, "x")
    assert max(map(len, text.splitlines())) <= 100
    for name, kind in CLASSES.items():
        for number, field in enumerate(kind.DESCRIPTOR.fields, start=1):
            assert f" {field.name} = {number};" in text.split(f"message {name} {{")[1]
    measured = text.split("message Measurement {")[1].split("}")[0]
    fields = list(interface.measurement)
    assert fields[:3] == ["attitude", "wheel_speed", "gyro"]
    for number, name in enumerate(fields, start=1):
        assert f"  repeated double {name} = {number};" in measured


@pytest.fixture
def served(folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    command = [sys.executable, "-m", "mjspace", "serve-law", "own.py:Law", "--port", "0"]
    process = subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    yield process.stdout.readline().split()[3].rstrip(";"), process
    process.kill()
    process.communicate()


@pytest.mark.slow
def test_serve_law_serves_until_it_is_interrupted(
    served: tuple[str, subprocess.Popen[str]], folder: Path, flown: Path, tmp_path: Path
) -> None:
    place, process = served
    assert place.startswith("tcp://127.0.0.1:")
    for name in ("one", "two"):
        words = [word for each in own(place) for word in ("--set", each)]
        out = str(tmp_path / name)
        assert command_line("run", str(folder / "x.toml"), *words, "--out", out) == 0
        assert_same(Log(tmp_path / name / "flight.mcap"), Log(flown))
    process.send_signal(2)
    said = process.communicate(timeout=20.0)[1]
    assert said == "mjspace: interrupted\n"
    assert process.returncode == 130


@pytest.mark.slow
def test_a_killed_law_ends_the_flight_with_a_whole_log(
    served: tuple[str, subprocess.Popen[str]], folder: Path, tmp_path: Path
) -> None:
    place, process = served
    reached: list[float] = []

    def progress(now: float) -> None:
        if not reached:
            process.kill()
        reached.append(now)

    result = run(
        folder / "x.toml",
        overrides=[*own(place), "duration=600"],
        out=tmp_path / "killed",
        progress=progress,
    )
    assert "the law at tcp://127.0.0.1:" in result.trouble
    assert result.log.complete
    assert result.log.end > 0.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nothing.py:Law"], "serve-law: no file nothing.py"),
        (["own.py:Nothing"], "serve-law: 'own.py' has no 'Nothing'"),
        (["own.py:Law", "--host", "256.0.0.1"], "serve-law: "),
    ],
)
def test_serve_law_refuses_what_cannot_be_served(
    words: list[str],
    said: str,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folder)
    assert command_line("serve-law", *words, "--port", "0") == 2
    error = capsys.readouterr().err
    assert error.startswith(f"mjspace: {said}")
    assert error.count("\n") == 1
