"""Laws that fly on estimates: what they see, what is logged, and whose an error is."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace import attitude, dm_env
from mjspace.campaign.members import Campaign, population
from mjspace.errors import FlightError, InputError
from mjspace.log.reader import Log
from mjspace.runner.replay import replay, verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation import joined
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly, what_is_compiled
from mjspace.simulation.recording import Block

OWN = """
from dataclasses import dataclass
from typing import Annotated, NamedTuple
import numpy as np
from mjspace.contract import Gains, TorqueCommand, Unit, gain

class Seen(NamedTuple):
    attitude: np.ndarray
    rate: np.ndarray
    doubt: np.ndarray

class Memory(NamedTuple):
    rate: Annotated[np.ndarray, Unit("rad/s")]

class Estimate(NamedTuple):
    attitude: np.ndarray
    rate: np.ndarray
    doubt: Annotated[np.ndarray, Unit("rad")]

@dataclass(frozen=True)
class Smooth(Gains):
    share: float = gain(default=0.25)
    batched: bool = True

    def reset(self, m):
        return Memory(m.rate.copy())

    def step(self, s, t, m):
        rate = s.rate + self.share * (m.rate - s.rate)
        return Memory(rate), Estimate(m.attitude * 1.0, rate.copy(), 0.5 * m.rate[..., :1])

@dataclass(frozen=True)
class Law(Gains):
    batched: bool = True

    def reset(self, m, r):
        return Memory(m.rate + 0.0)

    def step(self, s, t, m, r):
        return s, TorqueCommand(-m.rate), Seen(m.attitude + 0.0, m.rate + 0.0, m.doubt + 0.0)
"""
BASE = """
description = "a law on estimates"
duration = "1 s"
[rates]
physics = "10 ms"
control = "10 ms"
[initial]
rate = [0.1, -0.2, 0.3]
[sensors.gyro]
measures = "rate"
noise_std = 1e-3
[reference]
kind = "references:Hold"
[estimator]
kind = "own.py:Smooth"
[law]
kind = "own.py:Law"
[[checks]]
name = "estimated rate"
signal = "estimate.rate"
statistic = "min"
above = 0.01
[[checks]]
name = "estimation error"
signal = "truth.estimation_error"
below = 1e-12
"""


def scenario(folder: Path, code: str = "") -> Path:
    (folder / "own.py").write_text(OWN + code)
    (folder / "own.toml").write_text(BASE)
    return folder / "own.toml"


def flown(path: Path, *overrides: str, members: int = 1) -> list[Block]:
    built = assemble(*load(path, overrides))
    numbers = list(range(members))
    return list(fly(built, first_start(built, numbers), numbers))


def rows(blocks: list[Block], topic: str, field: str) -> Any:
    return np.concatenate([block.rows[topic][field] for block in blocks])


@pytest.mark.parametrize("estimator", ["true", "false"])
@pytest.mark.parametrize("law", ["true", "false"])
def test_the_law_sees_what_is_estimated(tmp_path: Path, estimator: str, law: str) -> None:
    blocks = flown(
        scenario(tmp_path),
        *(f"estimator.batched={estimator}", f"law.batched={law}"),
        members=2,
    )
    gyro = rows(blocks, "/measurement", "gyro")
    smooth = gyro[0]
    for sample, estimated in zip(gyro, rows(blocks, "/estimate", "rate"), strict=True):
        smooth = smooth + 0.25 * (sample - smooth)
        assert np.array_equal(estimated, smooth)
    for field in ("attitude", "rate", "doubt"):
        assert np.array_equal(rows(blocks, "/law", field), rows(blocks, "/estimate", field))
    # At the reset the law has the first estimate, and not what the first step makes of it again.
    assert np.array_equal(rows(blocks, "/state", "law_rate")[0], gyro[0])
    state = rows(blocks, "/state", "estimator_rate")
    assert np.array_equal(state[1:], rows(blocks, "/estimate", "rate")[:-1])
    assert not np.array_equal(gyro[:, 0], gyro[:, 1])


def test_it_is_compiled_and_the_same_in_python(tmp_path: Path) -> None:
    path = scenario(tmp_path)
    assert what_is_compiled(assemble(*load(path))) == "compiled: sensors, law and actuators"
    compiled = flown(path, members=3)
    called = flown(
        scenario(tmp_path, "\nSmooth.compiled = False\n"), "estimator.share=0.25", members=3
    )
    built = assemble(*load(path))
    assert "law called in Python: the law says compiled = False" in what_is_compiled(built)
    alone = flown(path)
    for topic, fields in compiled[0].rows.items():
        for field in fields:
            one = rows(compiled, topic, field)
            assert np.array_equal(one, rows(called, topic, field)), f"{topic}.{field}"
            assert np.array_equal(one[:, :1], rows(alone, topic, field)), f"{topic}.{field}"


def test_an_estimator_with_hidden_memory_is_called_in_every_period(tmp_path: Path) -> None:
    counting = """
CALLS = 0
class Counting(Smooth):
    def step(self, s, t, m):
        global CALLS
        CALLS += 1
        return super().step(s, t, m)
"""
    built = assemble(*load(scenario(tmp_path, counting), ["estimator.kind=own.py:Counting"]))
    assert "law called in Python: the law changes CALLS of its module" in what_is_compiled(built)


def test_it_is_logged_replayed_and_judged(tmp_path: Path) -> None:
    result = run(scenario(tmp_path), out=tmp_path / "out")
    assert result.passed
    log = Log(result.path)
    assert log.topics["/estimate"] == {"attitude": (4,), "rate": (3,), "doubt": (1,)}
    assert log.units["/estimate"] == {"rate": "rad/s", "doubt": "rad"}
    assert log.units["/state"] == {"estimator_rate": "rad/s", "law_rate": "rad/s"}
    assert log.topics["/law"] == {"attitude": (4,), "rate": (3,), "doubt": (1,)}
    assert log.attachment("estimator.py").decode() == OWN
    with pytest.raises(InputError, match=r"runs code out of the log, .*estimator\.py \(sha256"):
        verify(log)
    assert verify(log, trust=True) is None
    assert verify(log, start=0.37, trust=True) is None
    other = "quaternion_feedback:RateDamping"
    again = replay(log, tmp_path / "again", start=0.5, law=other, trust=True)
    found = Log(again.path)
    assert found.topics["/estimate"] == log.topics["/estimate"]
    first = found.read("/estimate")["rate"][0]  # with another law the estimator begins there too
    assert np.array_equal(first, found.read("/measurement")["gyro"][0])


def test_the_estimation_error_is_the_rotation_from_the_estimated_to_the_true_attitude(
    tmp_path: Path,
) -> None:
    turned = """
class Off(Smooth):
    def step(self, s, t, m):
        s, e = super().step(s, t, m)
        from mjspace.attitude import from_rotation_vector, multiply
        return s, e._replace(attitude=multiply(m.attitude, from_rotation_vector(
            np.array([-0.01, 0.02, -0.03]))))
"""
    blocks = flown(scenario(tmp_path, turned), "estimator.kind=own.py:Off")
    error = rows(blocks, "/truth", "estimation_error")
    assert np.allclose(error, [0.01, -0.02, 0.03], rtol=0.0, atol=1e-15)
    true, estimated = rows(blocks, "/truth", "attitude"), rows(blocks, "/estimate", "attitude")
    assert np.allclose(
        attitude.multiply(estimated, attitude.from_rotation_vector(error)), true, atol=1e-15
    )


@pytest.mark.parametrize("batched", ["true", "false"])
@pytest.mark.parametrize(
    ("step", "message"),
    [
        ("raise KeyError('lost')", r"the estimator raised KeyError at own\.py:\d+: 'lost'"),
        ("m.rate[...] = 0.0", r"the estimator raised ValueError at own\.py:\d+: .*read-only"),
        ("return s", "the estimator's step returned a Memory: it must return .state, estimate."),
        ("return s, None", r"the estimator's step returned \(a Memory, None\)"),
        (
            "return s, Estimate(m.attitude, m.rate[..., :int(2.0 + (t < 0.5))], m.rate)",
            r"the estimator's estimate\.rate has the shape \(.*2,?\) after \(.*3,?\)",
        ),
        (
            "return Memory(m.rate[..., :int(2.0 + (t < 0.5))]), Estimate(m.attitude, m.rate, t)",
            r"the estimator's (state\.rate has the shape|estimate\.doubt must be an array)",
        ),
    ],
)
def test_errors_are_the_estimators(tmp_path: Path, step: str, message: str, batched: str) -> None:
    code = f"""
def step(self, s, t, m):
    {step}
Smooth.step = step
"""
    with pytest.raises(FlightError, match=message):
        flown(scenario(tmp_path, code), f"estimator.batched={batched}")


def test_an_estimate_that_is_no_number_is_named(tmp_path: Path) -> None:
    code = """
def step(self, s, t, m):
    return s, Estimate(m.attitude, np.where(t > 0.495, np.nan, m.rate), m.rate[..., :1])
Smooth.step = step
"""
    with pytest.raises(FlightError, match=r"^/estimate\.rate is not finite.* at t = 0\.5 s"):
        flown(scenario(tmp_path, code))


def test_an_error_of_the_law_is_still_the_laws(tmp_path: Path) -> None:
    code = """
def step(self, s, t, m, r):
    m.rate[...] = 0.0
Law.step = step
"""
    with pytest.raises(FlightError, match=r"the law raised ValueError at own\.py:\d+.*read-only"):
        flown(scenario(tmp_path, code))
    with pytest.raises(FlightError, match=r"the estimator's reset returned an array"):
        flown(scenario(tmp_path, "\nSmooth.reset = lambda self, m: m.rate\n"))
    with pytest.raises(FlightError, match=r"no sensor measures doubt"):
        flown(scenario(tmp_path, "\nEstimate = lambda a, r, d: Memory(r)\n"))


def test_what_cannot_fly_on_estimates_is_refused(tmp_path: Path) -> None:
    path = scenario(tmp_path)
    with pytest.raises(InputError, match="estimator: the inner loop of Schmitt"):
        assemble(*load("rcs-schmitt", ["estimator.kind=mekf:MEKF", *MEKF]))
    for kind in ("own.so:law", "tcp://localhost:1"):
        with pytest.raises(InputError, match="estimator: a law in a shared library"):
            assemble(*load(path, [f"law.kind={kind}"]))
    with pytest.raises(InputError, match="estimator: 'mekf' has no 'Nobody'"):
        assemble(*load(path, ["estimator.kind=mekf:Nobody"]))
    with pytest.raises(InputError, match=r"estimator: references:Hold has no method reset"):
        assemble(*load(path, ["estimator.kind=references:Hold"]))
    with pytest.raises(
        InputError, match=r"estimator: attitude_noise: got -1 rad, should be 0 or more"
    ):
        assemble(*load(path, ["estimator.kind=mekf:MEKF", *MEKF, "estimator.attitude_noise=-1"]))
    with pytest.raises(InputError, match=r"estimator: attitude_noise: got 0"):
        assemble(*load(path, ["estimator.kind=mekf:MEKF", *MEKF[:2]]))


MEKF = ["estimator.gyro_noise=1e-5", "estimator.gyro_bias=1e-4", "estimator.attitude_noise=1e-4"]


def test_an_environment_flies_neither_estimator_nor_law(tmp_path: Path) -> None:
    environment = dm_env.load(scenario(tmp_path))
    observed = environment.reset().observation
    assert "gyro" in observed
    assert "doubt" not in observed


def test_gains_of_an_estimator_are_dispersed(tmp_path: Path) -> None:
    path = scenario(tmp_path)
    with path.open("a") as file:
        file.write(
            '[[dispersions]]\nkey = "estimator.share"\ndistribution = "uniform"\nlow = 0.1\n'
            "high = 0.9\n"
        )
    everyone = population(Campaign(str(path), (), 3, seed=1))
    built, drawn = everyone.member(2)
    flying: Any = built.law
    assert flying.estimator.share == drawn[0] != everyone.member(1)[1][0]


def test_nothing_joined_to_nothing_is_nothing() -> None:
    empty = joined.join(None, ())
    assert empty == ()
    assert joined.separate(empty) == {"estimator": (), "law": ()}
    assert joined.separate(()) == {"law": ()}
