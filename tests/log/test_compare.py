"""Two logs compared: what differs, by how much, and from when on."""

from pathlib import Path

import numpy as np
import pytest

from mjspace.log import compare as module
from mjspace.log.compare import compare
from mjspace.log.reader import Log
from mjspace.runner.run import run


def flight(folder: Path, *overrides: str) -> Log:
    return run("lqr-regulation", overrides=["duration=1", "checks=[]", *overrides], out=folder).log


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Log, Log]:
    """Return two logs under gains that differ, the second with its truth logged every 10 ms."""
    folder = tmp_path_factory.mktemp("logs")
    other = ["law.angle_weight=[1,1,1.1]", "log.truth='10 ms'", "duration=0.8"]
    return flight(folder / "a"), flight(folder / "b", *other)


def test_a_log_equals_itself(logs: tuple[Log, Log]) -> None:
    found = compare(logs[0], logs[0])
    assert len(found.signals) > 10
    assert not found.beyond
    assert all(each.largest == each.rms == 0.0 for each in found.signals)
    assert (found.start, found.end) == (0.0, 1.0)


def test_differences_are_those_of_the_common_instants(
    logs: tuple[Log, Log], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_PERIODS", 30)  # several parts
    found = compare(*logs, topics=["truth"], tolerance=1e-6)
    names = {each.name: each for each in found.signals}
    one, two = (log.read("/truth", ["rate"]) for log in logs)
    common = one["time"][::2][:81]
    assert np.allclose(common, two["time"], atol=1e-12)
    off = np.abs(one["rate"][::2][:81] - two["rate"])
    rate = names["truth.rate"]
    assert rate.rows == 81
    assert rate.largest == off.max() > 1e-5
    assert rate.at == pytest.approx(common[off.max(axis=1).argmax()])
    assert rate.rms == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-12)
    assert rate.beyond == pytest.approx(common[(off.max(axis=1) > 1e-6).argmax()])
    assert rate.scale == np.abs(one["rate"][::2][:81]).max()
    assert rate.unit == "rad/s"
    assert found.end == pytest.approx(0.8)


def test_what_one_log_alone_has_is_told(logs: tuple[Log, Log], tmp_path: Path) -> None:
    coast = flight(tmp_path, "law={kind='coast:Coast'}")
    found = compare(logs[0], coast)
    assert [name for name in found.only_first if name.startswith("law.")]
    assert not any("law." in each.name for each in found.signals)
    other_way = compare(coast, logs[0])
    assert (other_way.only_first, other_way.only_second) == (found.only_second, found.only_first)
    assert not compare(coast, logs[0], topics=["truth"]).only_second


def test_numbers_that_are_none_differ_from_others_and_not_from_themselves() -> None:
    off = module.SignalDifference("x", "")
    nan, inf = np.nan, np.inf
    off.add(np.arange(3.0), np.array([[nan], [inf], [1.0]]), np.array([[nan], [inf], [1.0]]), 0.0)
    assert off.largest == 0.0
    assert off.beyond is None
    off.add(np.array([3.0]), np.array([[nan]]), np.array([[1.0]]), 5.0)
    assert off.largest == inf
    assert off.beyond == 3.0


def test_logs_without_a_common_signal_are_refused(logs: tuple[Log, Log], tmp_path: Path) -> None:
    coast = flight(tmp_path, "law={kind='coast:Coast'}")
    with pytest.raises(ValueError, match="have no instant of a signal in common"):
        compare(logs[0], coast, topics=["law"])
