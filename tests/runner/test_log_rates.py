"""Topics that are logged less often: what is in the log, and everything that reads it."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from blocks import blocks_of
from log_samples import rewritten
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.log.reader import Log
from mjspace.plotting import phase_plane
from mjspace.plotting.decimate import Line, outlines
from mjspace.rendering.sampling import nearest_rows
from mjspace.runner import report
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

pytestmark = pytest.mark.filterwarnings(
    f"ignore::{UnphysicalInertiaWarning.__module__}.UnphysicalInertiaWarning"
)

RATES = {
    "/state": 20, "/truth": 4, "/measurement": 8, "/reference": 3, "/command": 1, "/law": 20,
    "/disturbance": 20,
}  # fmt: skip
SHORT = [
    *("rates.physics='1 ms'", "rates.control='1 ms'", "duration=0.111", "events=[]"),
    *("sensors.rate.noise_std=0.01", "plant.wheels.torque_limit=5"),
    "checks=[{name='fast',signal='law.e',statistic='peak',below=9}]",
]
SLOWER = [
    *("log.default='50 Hz'", "log.truth='250 Hz'", "log.measurement='8 ms'"),
    *("log.reference=0.003", "log.command='1 kHz'"),
]
ROWS = 112


@pytest.fixture(scope="module", autouse=True)
def _many_blocks() -> Iterator[None]:
    """Blocks of 7 periods: most of them have no row of the slower topics."""
    with blocks_of(7):
        yield


@pytest.fixture(scope="module")
def every(tmp_path_factory: pytest.TempPathFactory) -> Log:
    out = tmp_path_factory.mktemp("every")
    return run("contraction-adaptive", overrides=SHORT, out=out).log


@pytest.fixture(scope="module")
def slower(tmp_path_factory: pytest.TempPathFactory) -> Log:
    out = tmp_path_factory.mktemp("slower")
    return run("contraction-adaptive", overrides=[*SHORT, *SLOWER], out=out).log


def periods(log: Log, topic: str) -> Array:
    return np.rint(log.read(topic)["time"] * 1000.0).astype(int)


def test_each_topic_has_its_own_periods_and_both_ends(every: Log, slower: Log) -> None:
    assert slower.every == RATES
    assert set(every.every.values()) == {1}
    for topic, rate in RATES.items():
        chosen = sorted({*range(0, ROWS, rate), ROWS - 1})
        assert periods(slower, topic).tolist() == chosen, topic
        rows, all_rows = slower.read(topic), every.read(topic)
        for field, values in rows.items():
            assert values.tobytes() == all_rows[field][chosen].tobytes(), (topic, field)
    assert (len(slower), slower.start, slower.end) == (ROWS, 0.0, 0.111)
    assert slower.altered() == []


def test_other_readers_find_them_by_time(slower: Log) -> None:
    with slower.path.open("rb") as file:
        found = [(c.topic, m) for _, c, m in make_reader(file).iter_messages(list(RATES))]
    assert [m.log_time for _, m in found] == sorted(m.log_time for _, m in found)
    numbers = [m.sequence for topic, m in found if topic == "/state"]
    assert numbers == [0, 20, 40, 60, 80, 100, 111]


def test_frames_are_as_frequent_as_the_default_unless_they_have_a_rate(tmp_path: Path) -> None:
    """And they have the flight's last instant."""
    for rate, stamps in (("50 Hz", range(0, 112, 20)), ("1 kHz", range(0, 112, 10))):
        overrides = [*SHORT, f"log.default='{rate}'"]
        log = run("contraction-adaptive", overrides=overrides, out=tmp_path / rate).log
        with log.path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            *_, (_, _, _, last) = frames = list(reader.iter_decoded_messages(["/tf"]))
        bus = next(each.rotation for each in last.transforms if each.child_frame_id == "bus")
        attitude = log.read("/truth", ["attitude"])["attitude"][-1]
        assert [bus.w, bus.x, bus.y, bus.z] == pytest.approx(attitude, rel=1e-14)
        assert [frame[2].log_time for frame in frames] == [1_000_000 * k for k in (*stamps, 111)]


@pytest.mark.parametrize("start", [0.0, 0.02, 0.1, 0.111])
def test_a_flight_is_repeated_from_each_logged_state(
    start: float, slower: Log, tmp_path: Path
) -> None:
    assert verify(slower, start=start) is None
    again = replay(slower, tmp_path, start=start).log
    states, before = again.read("/state"), slower.read("/state", start=start)
    for field, values in before.items():
        assert states[field].tobytes() == values.tobytes(), field
    for topic in RATES:
        time = again.read(topic)["time"]
        assert (time[0], time[-1]) == (start, 0.111), topic
        assert {*time[1:]} <= {*slower.read(topic)["time"]}, topic  # the same instants again
    assert verify(again, start=start) is None


def test_a_replay_from_between_them_names_the_nearest(slower: Log, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"0\.047 s has no logged state: .* every 0\.02 s.* 0\.04"):
        replay(slower, tmp_path, start=0.047)
    with pytest.raises(InputError, match=r"t = 2 s is not in the log: it has 0 to 0\.111 s"):
        replay(slower, tmp_path, start=2.0)


def test_one_bit_between_two_states_is_a_difference(slower: Log, tmp_path: Path) -> None:
    def flip(topic: str, number: int, data: bytes) -> bytes:
        changed = (topic, number) == ("/command", 47)
        return data[:-1] + bytes([data[-1] ^ 1]) if changed else data

    found = verify(rewritten(slower.path, tmp_path / "changed.mcap", flip, digests=False))
    assert found is not None
    assert (found.topic, found.time) == ("/command", 0.047)


def test_checks_are_of_every_period(every: Log, slower: Log) -> None:
    """The error's largest value is not at a logged period of the law's, and the verdict has it."""
    error = np.linalg.norm(every.read("/law", ["e"])["e"], axis=1)
    assert error.max() > np.linalg.norm(slower.read("/law", ["e"])["e"], axis=1).max()
    assert slower.events()[-1] == every.events()[-1]
    assert f": {error.max():.6g} (" in slower.events()[-1].message


def test_the_row_nearest_to_a_time_may_be_many_chunks_away(slower: Log) -> None:
    for time, found in ((0.029, 0.02), (0.0301, 0.04), (0.105, 0.1), (0.106, 0.111), (9.0, 0.111)):
        assert slower.nearest("/state", time)["time"] == found
    times = np.array([0.029, 0.0301, 0.047, 0.105])
    rows = list(nearest_rows(slower, "/state", "physics", times))
    physics = slower.read("/state", ["physics"])["physics"]
    np.testing.assert_array_equal(rows, physics[[1, 2, 2, 5]])
    (alone,) = nearest_rows(slower, "/state", "physics", times[2:3])
    np.testing.assert_array_equal(alone, physics[2])


def test_a_line_has_as_many_points_as_its_topic_has_rows(slower: Log) -> None:
    ((time, values),) = outlines(slower, [Line("/truth", "rate")], points=40)
    assert len(time) >= 29
    assert np.unique(time[:, 0]).tolist() == slower.read("/truth")["time"].tolist()
    assert values.shape == time.shape


def test_a_phase_plane_is_of_the_instants_that_both_have(slower: Log) -> None:
    axes = phase_plane.figure(slower, "truth.rate[0]", "reference.rate[0]").axes[0]
    drawn = np.asarray(axes.lines[2].get_xdata())
    both = sorted({*range(0, ROWS, 12), ROWS - 1})
    rate = np.degrees(slower.read("/truth", ["rate"])["rate"][:, 0])
    np.testing.assert_allclose(drawn, rate[np.searchsorted(periods(slower, "/truth"), both)])


def test_info_says_how_often(slower: Log, capsys: pytest.CaptureFixture[str]) -> None:
    assert report.log_data(slower)["every"] == RATES
    report.print_log(slower)
    printed = capsys.readouterr().out
    assert "every 0.02 s: physics" in printed
    assert "every 0.001 s" not in printed


def test_a_log_cut_short_ends_with_its_most_frequent_topic(slower: Log, tmp_path: Path) -> None:
    with slower.path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(slower.path.read_bytes()[: summary.chunk_indexes[8].chunk_start_offset])
    log = Log(cut)
    assert (log.complete, len(log), log.end) == (False, 56, 0.055)
    assert log.nearest("/state", 0.055)["time"] == 0.04
    assert verify(log) is None


def test_a_flight_that_breaks_off_has_its_last_row_on_each_topic(
    tmp_path: Path, failing_law: Callable[..., Path]
) -> None:
    rates = ["duration=0.1", "log.default='20 ms'"]
    result = run(failing_law(0.0505), overrides=rates, out=tmp_path)
    assert result.trouble
    for topic in result.log.topics:
        assert result.log.read(topic)["time"].tolist() == [0.0, 0.02, 0.04, 0.05]


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        ("log.state='2.5 ms'", r"log\.state: 0\.0025 s is not a whole number of rates\.control"),
        ("log.default='300 Hz'", r"log\.default: 0\.003333333333 s .* 0\.003 s and 0\.004 s"),
        ("log.tf='0 Hz'", r"log\.tf: got '0 Hz', should be greater than 0"),
        ("log.law='5 m'", r"log\.law: '5 m' has the unit 'm', should be one of s, .*, Hz, kHz"),
        ("log.law='5'", r"log\.law: '5' has no unit: write a plain number for s, or .* Hz, kHz"),
        ("log.stat='1 s'", r"log\.stat: no such key: did you mean 'state'\?"),
    ],
)
def test_what_is_no_rate_is_refused(rate: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load("contraction-adaptive", [*SHORT, rate])
