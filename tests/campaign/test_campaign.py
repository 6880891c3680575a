"""Campaigns flown: each member as alone, one table however it is divided, and resumed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_lines import command_line

from mjspace.campaign import campaign as campaigns
from mjspace.campaign import report
from mjspace.campaign.alike import may_be_alike
from mjspace.campaign.flights import Call, Flown, fly_members, log_of
from mjspace.campaign.members import Campaign, population, require_arrival
from mjspace.campaign.results import WALL_TIME
from mjspace.campaign.statistics import Gate
from mjspace.campaign.store import Store
from mjspace.errors import FlightError, InputError
from mjspace.log.reader import Log

SCENARIO = """
base = "detumble-wheels"
description = "A tenth of a second of the tumble, dispersed"
duration = 0.1

[sensors.rate]
noise_std = "0.01 deg/s"

[[checks]]
name = "rate at first"
signal = "truth.rate[0]"
statistic = "max"
below = 0.31

[[checks]]
name = "mean rate"
signal = "truth.rate"
statistic = "mean"
below = 0.5

[[dispersions]]
key = "initial.rate[0]"
distribution = "normal"
std = "1 deg/s"
"""
INERTIA = """
[[dispersions]]
key = "plant.gyrostat_inertia[1][1]"
distribution = "uniform"
low = 11
high = "13 kg m^2"
"""
MASS = f"""{INERTIA}
[[dispersions]]
key = "law.rate_gain"
distribution = "discrete"
values = [5, 6]
"""


def scenario(folder: Path, text: str = SCENARIO) -> str:
    path = folder / "spin.toml"
    path.write_text(text)
    return str(path)


def fly(what: Campaign, out: Path, **options: Any) -> Any:
    """Return the table without wall times."""
    return campaigns.fly(what, out, **options).store.read().drop_columns([WALL_TIME])


def bytes_of(table: Any) -> bytes:
    import pyarrow

    sink = pyarrow.BufferOutputStream()
    with pyarrow.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table.combine_chunks())
    return bytes(sink.getvalue())


@pytest.mark.parametrize("text", [SCENARIO, SCENARIO + INERTIA], ids=["start", "inertia"])
@pytest.mark.usefixtures("here")
def test_the_table_is_the_same_however_the_members_are_divided(text: str, tmp_path: Path) -> None:
    what = Campaign(scenario(tmp_path, text), (), 4, seed=2)
    assert may_be_alike(population(what))
    whole = fly(what, tmp_path / "whole", block=4, keep="none")
    parts = fly(what, tmp_path / "parts", block=3, keep="none")
    single = fly(what, tmp_path / "single", block=1, keep="none")
    assert whole["member"].to_pylist() == list(range(4))
    assert bytes_of(whole) == bytes_of(parts) == bytes_of(single)
    assert len(set(whole["mean rate: measured"].to_pylist())) == 4


@pytest.mark.usefixtures("here")
def test_a_campaign_goes_on_where_it_was_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    what = Campaign(scenario(tmp_path, SCENARIO + MASS), (), 6, seed=1)
    assert not may_be_alike(population(what))
    whole = fly(what, tmp_path / "whole", block=2, keep="none")
    every = fly_members
    flown: list[tuple[int, ...]] = []
    again: list[int] = []

    def killed(call: Call) -> list[Flown]:
        if flown:
            raise KeyboardInterrupt
        flown.append(call.members)
        return every(call)

    out = tmp_path / "killed"
    monkeypatch.setattr(campaigns, "fly_members", killed)
    with pytest.raises(KeyboardInterrupt):
        campaigns.fly(what, out, block=2, keep="none")
    assert flown == [(4, 5)]
    (out / "members" / "00000002-00000003.parquet.part").write_bytes(b"half")

    def noted(call: Call) -> list[Flown]:
        again.extend(call.members)
        return every(call)

    monkeypatch.setattr(campaigns, "fly_members", noted)
    resumed = fly(what, out, block=3, keep="none")
    assert sorted(again) == [0, 1, 2, 3]
    assert bytes_of(resumed) == bytes_of(whole)
    assert not list(out.glob("members/*.part"))
    more = Campaign(what.scenario, (), 7, seed=1)
    grown = fly(more, out, keep="none")
    assert sorted(again) == [0, 1, 2, 3, 6]
    assert grown.slice(0, 6).equals(whole)


@pytest.mark.usefixtures("here")
def test_a_member_alone_is_what_it_was_in_its_batch(tmp_path: Path) -> None:
    what = Campaign(scenario(tmp_path), (), 3, seed=2)
    out = tmp_path / "out"
    table = fly(what, out, keep="all")
    for row in table.to_pylist():
        log = Log(log_of(out, row["member"]))
        assert log.metadata["member"] == str(row["member"])
        truth = log.read("/truth")
        assert truth["rate"][0, 0] == row["initial.rate[0]"]
        assert truth["rate"][:, 0].max() == row["rate at first: measured"]
        assert row["rate at first: margin"] == 0.31 - row["rate at first: measured"]
        assert row["passed"] == (row["rate at first: verdict"] == "PASS")
    again = campaigns.fly_one(what, tmp_path / "again", 2, force=False, progress=lambda _: None)
    one, other = (log.read("/state") for log in (again.log, Log(log_of(out, 2))))
    assert all(one[field].tobytes() == other[field].tobytes() for field in other)
    with pytest.raises(InputError, match="--member 3: should be from 0 to 2"):
        campaigns.fly_one(what, out, 3, force=False, progress=lambda _: None)


@pytest.mark.usefixtures("here")
def test_failures_alone_are_logged_and_are_the_worst(tmp_path: Path) -> None:
    out = tmp_path / "out"
    flight = campaigns.fly(Campaign(scenario(tmp_path), (), 8, seed=2), out)
    found = report.answer(flight.store, Gate(0.4, 0.9))
    failed = [r["member"] for r in flight.store.read().to_pylist() if not r["passed"]]
    assert 0 < len(failed) < 8
    assert sorted(int(path.parent.name) for path in out.glob("logs/*/*.mcap")) == failed
    assert found.rate.successes == 8 - len(failed)
    assert {each.member for each in found.worst[: len(failed)]} == set(failed)
    assert found.worst[0].log == str(log_of(out, found.worst[0].member))
    first, mean = found.checks
    assert (first.failed, mean.failed) == (len(failed), 0)
    assert first.correlations["initial.rate[0]"] == pytest.approx(-1.0)
    assert first.measured is not None
    assert first.measured.least <= first.measured.low <= first.measured.median


def test_a_member_that_ends_early_takes_no_other_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = """
import numpy as np
from typing import NamedTuple

class Command(NamedTuple):
    torque: np.ndarray

class Law:
    def reset(self, measurement, reference):
        return None

    def step(self, state, time, measurement, reference):
        if time > 0.05 and measurement.rate[0] > 0.31:
            raise ArithmeticError("too fast")
        return None, Command(np.zeros(3)), ()
"""
    (tmp_path / "law.py").write_text(law)
    text = SCENARIO.replace("detumble-wheels", "own.toml")
    (tmp_path / "own.toml").write_text(
        'base = "detumble-wheels"\nchecks = []\n[law]\nkind = "law.py:Law"\n'
    )
    what = Campaign(scenario(tmp_path, text.replace("below = 0.31", "below = 9")), (), 4, seed=2)
    everyone = population(what)
    flown = fly_members(Call(what, everyone.identity, tuple(range(4)), "failures", tmp_path))
    fast = [one.member for one in flown if one.draws[0] > 0.3101]
    assert 0 < len(fast) < 4
    for one in flown:
        assert bool(one.trouble) == (one.member in fast)
        assert log_of(tmp_path, one.member).is_file() == (one.member in fast)
    assert all("too fast" in one.trouble for one in flown if one.trouble)
    with pytest.raises(InputError, match="changed during the campaign"):
        fly_members(Call(what, {}, (0,), "none", tmp_path))


def test_what_did_not_arrive_is_named(tmp_path: Path) -> None:
    everyone = population(Campaign(scenario(tmp_path, SCENARIO + MASS), (), 3, seed=1))
    assembly, drawn = everyone.member(1)
    flown = assembly.scenario.model_dump(mode="python")
    for dispersion, value in zip(everyone.dispersions, drawn, strict=True):
        with pytest.raises(FlightError) as raised:
            require_arrival(assembly, flown, dispersion, dispersion.name, value + 1e-9, "member 1")
        assert f"dispersion {dispersion.key} did not arrive" in str(raised.value)
    moved = replace(assembly, qvel=np.zeros_like(assembly.qvel))
    first = everyone.dispersions[0]
    with pytest.raises(FlightError, match=r"initial.rate\[0\] did not arrive"):
        require_arrival(moved, flown, first, first.name, drawn[0], "member 1")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--n", "0"], "--n 0: should be 1 or more"),
        (["--gate", "often"], "--gate: got 'often'"),
        (["--seed", "2"], "holds a campaign of seed 1, not 2: give another folder by --out"),
        (["--n", "2"], "holds 3 members: --n 3 or more"),
        (["--set", "law.rate_gain=7"], "another scenario: rate_gain = 6.0, not rate_gain = 7.0"),
        (["--member", "3"], "--member 3: should be from 0 to 2"),
        (["--force"], "--force: replaces the log of a --member"),
        (["--set", "dispersions=[]", "--set", "sensors={}"], "every member would be alike"),
        (["--set", "dispersions=[{key='initial.rat', distribution='normal', std=1}]"], "'rate'?"),
        (
            ["--set", "dispersions=[{key='initial.rate', distribution='normal', std=1}]"],
            "should be a number: give an index, [0]",
        ),
    ],
)
@pytest.mark.usefixtures("here")
def test_bad_input_is_one_line(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    what = Campaign(scenario(tmp_path), (), 3, seed=1)
    out = tmp_path / "out"
    store = Store(out, population(what))
    with store.opened():
        store.write([Flown(0, [0.3], [], [], "it was stopped", 1.0)])
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    usual = ["campaign", what.scenario, "--out", str(out)]
    for option, value in (("--n", "3"), ("--seed", "1")):
        if option not in words:
            usual += [option, value]
    assert command_line(*usual, *words) == 2
    told = capsys.readouterr()
    assert message in told.err
    assert len(told.err.splitlines()) == 1
    assert not told.out
    assert before == {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}


def test_a_draw_that_the_scenario_does_not_admit_names_the_member(tmp_path: Path) -> None:
    text = SCENARIO + '[[dispersions]]\nkey = "plant.mass"\ndistribution = "normal"\nstd = 1e4\n'
    everyone = population(Campaign(scenario(tmp_path, text), (), 20, seed=1))
    bad = next(m for m in range(20) if everyone.drawn([m])[0][1] < 0.0)
    with pytest.raises(InputError, match=f"member {bad} of the campaign: .*plant.mass: got -"):
        everyone.member(bad)


@pytest.mark.usefixtures("here")
def test_a_campaign_that_could_not_begin_leaves_its_folder_free(tmp_path: Path) -> None:
    out = tmp_path / "out"
    text = SCENARIO.replace("truth.rate[0]", "truth.rat")
    with pytest.raises(InputError, match=r"checks.0.signal: .*did you mean 'truth.rate'"):
        campaigns.fly(Campaign(scenario(tmp_path, text), (), 1, seed=1), out)
    fly(Campaign(scenario(tmp_path), (), 1, seed=1), out)


@pytest.mark.usefixtures("here")
def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    what = Campaign(scenario(tmp_path), (), 3, seed=1)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("x")
    with pytest.raises(InputError, match="holds something else"):
        campaigns.fly(what, tmp_path / "out")


@pytest.mark.usefixtures("here")
def test_a_gate_sets_the_exit_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["campaign", scenario(tmp_path), "--n", "8", "--seed", "1", "--keep", "none"]
    words += ["--out", str(tmp_path / "out")]
    assert command_line(*words, "--gate", "success >= 0.999") == 1
    assert "gate success >= 0.999 @ 0.95: not met" in capsys.readouterr().out
    assert command_line(*words, "--gate", "success >= 0.1", "--json") == 0
    assert '"gate": "success >= 0.1 @ 0.95"' in capsys.readouterr().out


@pytest.mark.slow
def test_processes_make_the_same_table_and_a_known_rate_is_inside_its_interval(
    tmp_path: Path,
) -> None:
    """A rate that starts below its bound passes: the probability is a normal distribution's."""
    from scipy.stats import binom, norm

    text = SCENARIO.replace("duration = 0.1", "duration = 0.005")
    right, inside = norm.cdf((0.31 - 0.3) / np.radians(1.0)), 0
    for seed in range(20):
        out = tmp_path / str(seed)
        what = Campaign(scenario(tmp_path, text), (), 40, seed=seed)
        everyone = population(what)
        with Store(out, everyone).opened():
            store = Store(out, everyone)
            store.write(fly_members(Call(what, everyone.identity, tuple(range(40)), "none", out)))
        low, high = report.answer(store, None).interval
        inside += low < right < high
    # 95 % of 20 campaigns; fewer than that many are in 1 of 1000 such tests.
    assert inside >= binom.ppf(0.001, 20, 0.95)
    what = Campaign(scenario(tmp_path, text), (), 40, seed=0)
    two = fly(what, tmp_path / "two", processes=2, block=7, keep="none")
    one = Store(tmp_path / "0", population(what)).read().drop_columns([WALL_TIME])
    assert bytes_of(two) == bytes_of(one)


TOGETHER = """
[[dispersions]]
keys = ["initial.rate[1]", "plant.gyrostat_inertia[1][1]"]
distribution = "normal"
covariance = [[1e-4, 9e-4], [9e-4, 1e-2]]
"""


@pytest.mark.usefixtures("here")
def test_a_correlated_set_flies_and_is_a_column_each(tmp_path: Path) -> None:
    path = scenario(tmp_path, SCENARIO + TOGETHER)
    table = fly(Campaign(path, (), 8, 1), tmp_path / "out")
    one, other = (table[key].to_numpy() for key in ("initial.rate[1]", INERTIA.split('"')[1]))
    assert np.corrcoef(one, other)[0, 1] > 0.6
    log = campaigns.fly_one(
        Campaign(path, (), 8, 1), tmp_path / "out", 3, force=False, progress=lambda time: None
    ).log
    assert log.read("/truth")["rate"][0, 1] == one[3]
    unknown = scenario(tmp_path, SCENARIO + TOGETHER.replace("initial.rate[1]", "law.gain"))
    with pytest.raises(InputError, match=r"dispersions.1.keys: law.gain: no 'gain' in law"):
        population(Campaign(unknown, (), 8))
