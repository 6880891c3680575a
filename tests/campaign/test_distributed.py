"""Campaigns beyond one machine: a Dask cluster, an object store, and files that travel."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Thread

import pytest
from command_lines import command_line
from test_campaign import INERTIA, SCENARIO, bytes_of, fly, scenario

from mjspace.campaign import campaign as campaigns
from mjspace.campaign import distributed, store
from mjspace.campaign.carried import carried, unpacked
from mjspace.campaign.flights import fly_numbers, log_of
from mjspace.campaign.members import Campaign, population
from mjspace.campaign.places import place
from mjspace.campaign.same_bits import difference, facts
from mjspace.errors import InputError
from mjspace.log.reader import Log

LAW = """
from pathlib import Path
from typing import NamedTuple
import numpy as np
from own_gain import GAIN

DATA_FILES = ("bias.txt",)
BIAS = float((Path(__file__).parent / "bias.txt").read_text())

class Command(NamedTuple):
    torque: np.ndarray

class Law:
    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        return None, Command(BIAS - GAIN * measurement.rate), ()
"""


@pytest.mark.parametrize("absolute", [False, True])
def test_the_users_files_travel(absolute: bool, tmp_path: Path) -> None:
    """A machine without them flies what flew beside them; also where they are elsewhere."""
    laws, here = tmp_path / "laws", tmp_path / "mission"
    laws.mkdir()
    here.mkdir()
    (laws / "own.py").write_text(LAW)
    (laws / "own_gain.py").write_text("GAIN = 5.0\n")
    (laws / "bias.txt").write_text("0.25")
    (here / "base.toml").write_text('base = "detumble-wheels"\nchecks = []\n')
    text = SCENARIO.replace('"detumble-wheels"', '"base.toml"')
    kind = f"{laws if absolute else '../laws'}/own.py:Law"
    what = Campaign(scenario(here, text), (f"law={{kind='{kind}'}}",), 3, seed=2, trust=True)
    members = population(what)
    there, flown = carried(members), fly_numbers(members, range(3))
    shutil.rmtree(laws)
    shutil.rmtree(here)
    arrived = unpacked(there)
    again = fly_numbers(arrived, range(3))
    assert [each.verdicts for each in again] == [each.verdicts for each in flown]
    assert arrived.identity == members.identity
    assert tmp_path not in arrived.folder.parents
    changed = {name: b"GAIN = 4.0\n" for name in there.files if name.endswith("own_gain.py")}
    assert changed
    with pytest.raises(InputError, match=r"another law/own_gain.py where it is to fly"):
        unpacked(replace(there, files=there.files | changed, campaign=replace(what, count=4)))


def test_a_machine_with_other_bits_is_told_by_what_differs() -> None:
    ours = facts()
    assert not difference(ours, ours)
    assert difference(ours | {"mujoco": "3.9"}, ours) == f"mujoco 3.9, not {ours['mujoco']}"
    assert "platform linux aarch64, not" in difference(ours | {"platform": "linux aarch64"}, ours)
    assert "other code of mjspace" in difference(ours | {"code": "0"}, ours)
    assert "another processor" in difference(ours | {"arithmetic": "0"}, ours)
    same = ours | {"threads": "4"}
    with pytest.raises(InputError, match=r"worker w: has 4 threads.* --nthreads 1"):
        distributed._refuse_other("w", same, ours)


@pytest.mark.usefixtures("here")
def test_an_object_store_holds_the_same_table_and_goes_on(tmp_path: Path) -> None:
    out = place(f"memory://{tmp_path.name}/out")
    what = Campaign(scenario(tmp_path, SCENARIO + INERTIA), (), 5, seed=2)
    local = fly(what, tmp_path / "local", block=5, keep="failures")
    fly(replace(what, count=2), out, block=2, keep="failures")
    table = fly(what, out, block=2, keep="failures")
    assert bytes_of(table) == bytes_of(local)
    failed = [row["member"] for row in local.to_pylist() if not row["passed"]]
    assert sorted(int(path.parent.name) for path in out.glob("logs/*/*.mcap")) == failed
    kept = tmp_path / "kept.mcap"
    kept.write_bytes(log_of(out, failed[0]).read_bytes())
    one, other = (Log(p).read("/state") for p in (kept, log_of(tmp_path / "local", failed[0])))
    assert all(one[field].tobytes() == other[field].tobytes() for field in other)
    with pytest.raises(InputError, match="holds a campaign of seed 2, not 3"):
        fly(replace(what, seed=3), out)


@pytest.mark.usefixtures("here")
def test_finished_parts_become_one_file_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also after a kill between writing a large file and removing the small ones."""
    for module in (store, campaigns):
        monkeypatch.setattr(module, "PART", 4)
    what = Campaign(scenario(tmp_path), (), 10, seed=2)
    out = tmp_path / "out"
    whole = fly(what, tmp_path / "whole", block=4, keep="none")
    first = fly(replace(what, count=6), out, block=3, keep="none")
    names = sorted(path.name for path in out.glob("members/*"))
    assert names == ["00000000-00000003.parquet", "00000004-00000005.parquet"]
    shutil.copy(out / "members" / names[0], out / "members" / "00000000-00000001.parquet")
    assert bytes_of(fly(replace(what, count=6), out)) == bytes_of(first)
    assert bytes_of(fly(what, out, block=3, keep="none")) == bytes_of(whole)
    names = sorted(path.name for path in out.glob("members/*"))
    assert names == [f"0000000{a}-0000000{b}.parquet" for a, b in ((0, 3), (4, 7), (8, 9))]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--dask", "tcp://127.0.0.1:9"], "no scheduler answers within 0.2 s"),
        (["--dask", "nonsense://x"], "--dask nonsense://x: no scheduler answers"),
        (["--dask", "tcp://x:1", "--workers", "2"], "--dask: goes without --workers"),
        (["--out", "s3://bucket/out"], "--out s3://bucket/out: Install s3fs to access S3"),
        (["--out", "memory://x", "--report"], "--report: is written to a folder"),
        (["--out", "memory://x", "--member", "1"], "--member 1: its log is written to a folder"),
    ],
)
def test_what_cannot_be_reached_is_one_line(
    words: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(distributed, "CONNECT", 0.2)
    monkeypatch.chdir(tmp_path)
    assert command_line("campaign", scenario(tmp_path), "--n", "3", *words) == 2
    told = capsys.readouterr().err
    assert message in told
    assert len(told.splitlines()) == 1
    assert os.listdir(tmp_path) == ["spin.toml"]


@contextmanager
def workers(count: int) -> Iterator[distributed.Cluster]:
    """Yield a cluster of so many workers on this machine."""
    from distributed import LocalCluster

    words = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    with LocalCluster(n_workers=0, processes=True, dashboard_address=None) as local:
        command = [sys.executable, "-m", "distributed.cli.dask_worker", local.scheduler_address]
        begun = [
            subprocess.Popen([*command, *words], stderr=subprocess.DEVNULL) for _ in range(count)
        ]
        try:
            local.wait_for_workers(count, timeout=60)
            with distributed.cluster(local.scheduler_address) as dask:
                yield dask
        finally:
            for each in begun:
                each.kill()
                each.wait()


def interrupt(flown: int, _failed: int) -> None:
    if flown == 2:
        signal.raise_signal(signal.SIGINT)


@pytest.mark.slow
@pytest.mark.usefixtures("here")
@pytest.mark.filterwarnings("default")  # of Dask's threads and sockets
def test_a_killed_worker_costs_nothing_but_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two workers, of which one is killed in flight; one, interrupted and resumed; and alone."""
    what = Campaign(scenario(tmp_path), (), 8, seed=2)
    alone = fly(what, tmp_path / "alone", block=1, keep="failures")
    with workers(2) as dask:
        assert dask.cores == 2
        processes = dask.client.run(os.getpid)
        killed: list[str] = []

        def kill() -> None:
            """Kill a worker as soon as it has members to fly, which it has to unpack at first."""
            while not killed:
                for worker, doing in dask.client.processing().items():
                    if any("fly-" in str(key) for key in doing) and not killed:
                        os.kill(processes[worker], signal.SIGKILL)
                        killed.append(worker)

        killer = Thread(target=kill, daemon=True)
        killer.start()
        out = tmp_path / "killed"
        table = fly(what, out, dask=dask, block=2, keep="failures")
        killer.join(60)
        assert killed
        assert bytes_of(table) == bytes_of(alone)
        logs = list((tmp_path / "alone").glob("logs/*/*.mcap"))
        assert logs
        for path in logs:
            one, other = (Log(p).read("/state") for p in (path, log_of(out, int(path.parent.name))))
            assert all(one[field].tobytes() == other[field].tobytes() for field in other)
        assert len(dask.client.nthreads()) == 1
        again = tmp_path / "again"
        flight = campaigns.fly(what, again, dask=dask, block=2, keep="none", told=interrupt)
        assert flight.signal == signal.SIGINT
        assert flight.store.read().num_rows == 2
        assert bytes_of(fly(what, again, dask=dask, block=5, keep="none")) == bytes_of(alone)
        newer = facts() | {"mujoco": "4.9"}
        monkeypatch.setattr(distributed, "facts", lambda: newer)
        with (
            pytest.raises(InputError, match=r"worker tcp://\S+: mujoco \S+, not 4.9"),
            distributed.cluster(dask.address),
        ):
            pass
