"""Two campaigns on the same draws against counts made by hand, and closed forms of the tests."""

import json
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from command_lines import command_line
from scipy import stats

from mjspace.campaign.pairs import Pairs, _paired, compare
from mjspace.errors import InputError


def campaign(folder: Path, first: int, passed: list[bool], margin: list[float], x: float) -> Path:
    """Write a campaign's table: members from ``first`` on, which draw 1, 2, ... and ``x`` times."""
    members = np.arange(first, first + len(passed))
    table = pyarrow.table(
        {
            "member": members,
            "seed": np.full(len(members), 3),
            "passed": passed,
            "initial.rate[0]": x * members,
            "error: measured": margin,
            "error: margin": margin,
            "error: verdict": ["PASS"] * len(members),
            "trouble": [""] * len(members),
            "wall_time": np.ones(len(members)),
        }
    )
    (folder / "members").mkdir(parents=True)
    pyarrow.parquet.write_table(table, folder / "members" / "00000000-00000009.parquet")
    return folder


def test_members_that_both_have_are_counted_in_pairs(tmp_path: Path) -> None:
    one = campaign(tmp_path / "a", 0, [True, True, False, False], [1.0, 2.0, -1.0, -2.0], 1.0)
    two = campaign(tmp_path / "b", 1, [True, True, True, False], [2.5, 1.0, np.nan, -1.0], 1.0)
    found = compare(one, two)
    assert (found.both, found.first, found.second, found.neither) == (1, 0, 2, 0)
    assert found.difference == pytest.approx(2.0 / 3.0)
    (check,) = found.checks
    assert (check.name, check.members, check.larger) == ("error", 2, 1.0)
    assert check.difference == pytest.approx(np.median([0.5, 2.0]))
    assert check.interval == (0.5, 2.0)


def test_the_difference_of_rates_is_tested_exactly_and_has_an_interval() -> None:
    found = Pairs(both=80, first=2, second=13, neither=5, checks=[], metrics=[])
    sided = sum(stats.binom.pmf(k, 15, 0.5) for k in range(3))
    assert found.probability == pytest.approx(2.0 * sided)
    # Agresti and Min: (c - b) / (n + 2), with half a member more in each of the four counts.
    spread = np.sqrt(2.5 + 13.5 - 11.0**2 / 102.0) / 102.0
    right = 11.0 / 102.0 + stats.norm.ppf(0.975) * spread * np.array([-1.0, 1.0])
    assert found.interval == pytest.approx(tuple(right), rel=1e-12)
    assert found.interval[0] > 0.0
    assert Pairs(10, 0, 0, 0, [], []).probability == 1.0


def test_the_interval_of_the_median_covers_it_as_often_as_it_says() -> None:
    """By order statistics 95 % or a little more; 400 samples know it to 1.1 %, one sigma."""
    rng, inside = np.random.default_rng(5), 0
    for _ in range(400):
        margins = rng.exponential(size=25) - np.log(2.0)
        found = _paired("error: margin", np.zeros(25), margins)
        assert found is not None
        low, high = found.interval
        inside += low <= 0.0 <= high
    assert 0.92 < inside / 400 < 0.99


def test_other_draws_and_no_campaign_are_one_line(tmp_path: Path) -> None:
    one = campaign(tmp_path / "a", 0, [True] * 3, [1.0] * 3, 1.0)
    other = campaign(tmp_path / "b", 0, [True] * 3, [1.0] * 3, 2.0)
    with pytest.raises(InputError, match=r"differ in initial.rate\[0\] of member 1"):
        compare(one, other)
    far = campaign(tmp_path / "c", 7, [True] * 3, [1.0] * 3, 1.0)
    with pytest.raises(InputError, match="no member in common"):
        compare(one, far)
    (tmp_path / "d").mkdir()
    with pytest.raises(InputError, match="holds no member"):
        compare(one, tmp_path / "d")


def test_the_command_compares_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = campaign(tmp_path / "a", 0, [True, False], [1.0, -1.0], 1.0)
    two = campaign(tmp_path / "b", 0, [True, True], [1.5, 1.0], 1.0)
    assert command_line("compare", str(one), str(two)) == 0
    out = capsys.readouterr().out
    assert out.startswith("of 2 members 1 succeed in both, 0 in the first alone, 1 in the second")
    assert command_line("compare", str(one), str(two), "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["second"], found["difference"], found["probability"]) == (1, 0.5, 1.0)
    assert found["checks"][0]["difference"] == 1.25
    assert command_line("compare", str(one), str(two), "--tolerance", "1") == 2
    assert "--json is the only option" in capsys.readouterr().err
