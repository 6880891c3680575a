"""Members that are alike fly in rows of one batch, each as alone; others by themselves."""

from pathlib import Path
from typing import Any

import pytest

from mjspace.campaign import flights
from mjspace.campaign.alike import alike, may_be_alike
from mjspace.campaign.flights import Call, fly_members
from mjspace.campaign.members import Campaign, population
from mjspace.simulation import loop

TUMBLE = """
base = "detumble-wheels"
description = "A tenth of a second of the tumble"
duration = 0.1

[sensors.rate]
noise_std = "0.01 deg/s"

[[checks]]
name = "rate"
signal = "truth.rate"
below = 0.5

[[dispersions]]
key = "initial.rate[0]"
distribution = "normal"
std = "1 deg/s"
"""
DESCENT = """
base = "lander-dispersed"
description = "The first tenths of a second of the descent: an engine that burns"
duration = 0.2

[[checks]]
name = "tilt"
signal = "truth.tilt"
below = 1
"""
LIMITED = "[plant.wheels]\nspeed_limit = 300\n"


def between(key: str, low: float, high: float) -> str:
    return f'[[dispersions]]\nkey = "{key}"\ndistribution = "uniform"\nlow = {low}\nhigh = {high}\n'


INERTIA = between("plant.gyrostat_inertia[1][1]", 11.0, 13.0)


def flown(what: Campaign, members: tuple[int, ...], monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return which members flew together, and the bytes of each one's ``/state`` and verdicts."""
    groups, rows = [], dict[tuple[int, str], bytes]()

    def noted(assembly: Any, start: Any, numbers: Any) -> Any:
        groups.append(tuple(numbers))
        for block in loop.fly(assembly, start, numbers):
            for row, number in enumerate(numbers):
                for name, values in block.rows["/state"].items():
                    before = rows.get((number, name), b"")
                    rows[number, name] = before + values[:, row].tobytes()
            yield block

    monkeypatch.setattr(flights, "fly", noted)
    found = fly_members(Call(what, population(what).identity, members, "none", Path("unused")))
    lines = {one.member: [verdict.line for verdict in one.verdicts] for one in found}
    names = sorted({name for _, name in rows})
    states = {number: tuple(rows[number, name] for name in names) for number in members}
    return groups, {number: (states[number], lines[number]) for number in members}


@pytest.mark.parametrize(
    ("text", "together", "may_be"),
    [
        (TUMBLE, True, True),
        (TUMBLE + INERTIA + between("plant.mass", 90, 110), True, True),
        # What the actuators keep of the inertia differs, or an engine burns the mass.
        (TUMBLE + INERTIA + LIMITED, False, True),
        (DESCENT, False, False),
        (TUMBLE + between("plant.wheels.inertia", 0.04, 0.06), False, False),
        (TUMBLE + between("law.rate_gain", 4, 6), False, False),
        (TUMBLE + between("sensors.rate.noise_std", 0.0001, 0.0002), False, False),
    ],
    ids=["start", "masses", "limited", "engine", "wheels", "gain", "noise"],
)
def test_members_fly_as_alone(
    text: str, together: bool, may_be: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.toml").write_text(text)
    what = Campaign(str(tmp_path / "own.toml"), (), 3, seed=4)
    assert may_be_alike(population(what)) == may_be
    groups, rows = flown(what, (0, 1, 2), monkeypatch)
    assert groups == ([(0, 1, 2)] if together else [(0,), (1,), (2,)])
    for member in range(3):
        alone = flown(what, (member,), monkeypatch)
        assert alone == ([(member,)], {member: rows[member]})
    assert len({state for state, _ in rows.values()}) == 3


def test_a_member_that_starts_elsewhere_is_as_one_that_is_assembled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn = (
        "dispersions=[{key='initial.rate',distribution='on_sphere',radius=0.1},"
        "{key='initial.attitude',distribution='random_attitude'}]"
    )
    for scenario in ("detumble-wheels", "learned-slew"):
        members = population(Campaign(scenario, (drawn,), 3))
        quick, _ = members.member(1)
        with monkeypatch.context() as patch:
            patch.setattr(type(members), "_elsewhere", lambda *_: None)
            whole, _ = members.member(1)
        assert quick.scenario == whole.scenario
        assert alike(quick, whole)
        assert quick.qpos.tobytes() == whole.qpos.tobytes() != members.nominal.qpos.tobytes()
        assert quick.qvel.tobytes() == whole.qvel.tobytes() != members.nominal.qvel.tobytes()
    # Another gain is not forgotten.
    tuned, _ = members.with_values({("rates", "control"): 0.1}).member(1)
    assert tuned.scenario.rates.control == 0.1
