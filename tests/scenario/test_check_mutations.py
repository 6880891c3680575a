"""Every check can fail: flown with the change that it names, it comes out the other way."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mjspace.runner.run import run
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import load, to_toml
from mjspace.scenario.scenario import Check, Scenario

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

LONG = 20_000  # integration steps: three in five of the changes, in a fifth of the time of all


def mutations(scenario: Scenario) -> dict[tuple[str, ...], list[Check]]:
    """Return the checks that each change makes fail, so that it is flown once for all of them."""
    found: dict[tuple[str, ...], list[Check]] = {}
    for check in scenario.checks:
        if check.fails_with:
            found.setdefault(tuple(check.fails_with), []).append(check)
    return found


def flights() -> Iterator[Any]:
    for name in scenario_names():
        for overrides, checks in mutations(load(name)[0]).items():
            mutated, _ = load(name, overrides)
            # What the mission flies is Python's for the most part.
            long = mutated.duration / mutated.rates.physics > LONG or name == "mission"
            yield pytest.param(
                name,
                overrides,
                checks,
                id=f"{name}:{';'.join(overrides)}",
                marks=pytest.mark.long if long else pytest.mark.slow,
            )


@pytest.mark.parametrize("name", scenario_names())
def test_every_check_says_what_it_fails_with(name: str) -> None:
    lacking = [check.name for check in load(name)[0].checks if not check.fails_with]
    assert not lacking


@pytest.mark.parametrize(("name", "overrides", "checks"), list(flights()))
def test_a_check_comes_out_the_other_way_when_what_it_claims_is_gone(
    name: str, overrides: tuple[str, ...], checks: list[Check], tmp_path: Path
) -> None:
    # The other checks may need a longer flight than this change lasts.
    alone = load(name)[0].model_copy(update={"checks": checks})
    (tmp_path / "alone.toml").write_text(to_toml(alone))
    result = run(tmp_path / "alone.toml", overrides=overrides, out=tmp_path)
    assert not result.trouble
    # A crash is judged in any flight above a ground: only the checks that were named count.
    judged = [verdict for verdict in result.verdicts if verdict.check in checks]
    assert len(judged) == len(checks)
    for verdict in judged:
        assert verdict.outcome == ("PASS" if verdict.check.expected == "FAIL" else "FAIL"), (
            verdict.line
        )
