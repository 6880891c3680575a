"""Users' code can change nothing that it receives; what it returns and raises is named as that."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blocks import blocks_of

from mjspace.contract import Reference
from mjspace.errors import FlightError, InputError
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block
from mjspace.simulation.user_code import reference_at

HEAD = """
from typing import NamedTuple
import numpy as np
from mjspace.contract import Reference, TorqueCommand

class Seen(NamedTuple):
    e: np.ndarray

class Law:
    def __init__(self, batched=False):
        self.batched = batched
        self.memory = np.zeros((1, 3) if batched else 3)

    def reset(self, m, r):
        return None

    def zero(self, m):
        return TorqueCommand(np.zeros_like(m.rate))

class Source:
    def at(self, time):
        n = len(time)
        return Reference(np.tile([1.0, 0, 0, 0], (n, 1)), np.zeros((n, 3)), np.zeros((n, 3)))

def push(time, truth):
    return np.zeros(3), np.zeros(3)
"""

BASE = """
description = "users' code"
duration = "0.5 s"
[rates]
physics = "10 ms"
control = "10 ms"
[initial]
rate = [0.1, -0.2, 0.3]
[environment]
python = "own.py:push"
[reference]
kind = "own.py:Source"
[law]
kind = "own.py:Law"
[[checks]]
name = "it turns"
signal = "truth.rate"
statistic = "min"
above = 0.3
"""


def scenario(folder: Path, code: str) -> Path:
    """Write a scenario whose law, reference and disturbance are HEAD with ``code`` after it."""
    (folder / "own.py").write_text(HEAD + code)
    (folder / "own.toml").write_text(BASE)
    return folder / "own.toml"


def flown(folder: Path, code: str, *overrides: str) -> list[Block]:
    built = assemble(*load(scenario(folder, code), overrides))
    return list(fly(built, first_start(built, [0])))


def law(step: str, reset: str = "return None") -> str:
    return f"""
def step(self, s, t, m, r):
    {step}
def reset(self, m, r):
    {reset}
Law.step, Law.reset = step, reset
"""


GOOD = "return None, self.zero(m), Seen(m.rate)"


@pytest.mark.parametrize("batched", ["true", "false"])
@pytest.mark.parametrize(
    "write",
    [
        "m.rate[...] = 0.0",
        "m.attitude.__imul__(-1.0)",
        "m.wheel_speed[...] = 0.0",
        "r.attitude[...] = m.attitude",
        "r.rate.__iadd__(1.0)",
    ],
)
def test_a_law_cannot_write_into_what_it_receives(tmp_path: Path, write: str, batched: str) -> None:
    with pytest.raises(FlightError, match=r"ValueError at own\.py:\d+: .*read-only.*copy it"):
        flown(tmp_path, law(f"{write}; {GOOD}"), f"law.batched={batched}")


@pytest.mark.parametrize("sensor", ["sensors.rate.noise_std=1e-3", "sensors.rate.delay='10 ms'"])
def test_nor_into_what_a_sensor_that_is_not_ideal_reports(tmp_path: Path, sensor: str) -> None:
    with pytest.raises(FlightError, match="read-only"):
        flown(tmp_path, law(f"m.rate[...] = 0.0; {GOOD}"), sensor, "law.batched=true")


@pytest.mark.parametrize("batched", ["true", "false"])
def test_a_law_cannot_change_its_state_in_place(tmp_path: Path, batched: str) -> None:
    code = law(
        "s.e.__iadd__(1.0); return s, self.zero(m), None", "return Seen(np.zeros_like(m.rate))"
    )
    with pytest.raises(FlightError, match=r"own\.py:\d+: .*read-only"):
        flown(tmp_path, code, f"law.batched={batched}")


@pytest.mark.parametrize(
    "part",
    [
        "Seen(self.memory[:]), self.zero(m), None",
        "None, self.zero(m), Seen(self.memory)",
        "None, TorqueCommand(self.memory), None",
    ],
)
def test_nor_what_it_has_returned_before(tmp_path: Path, part: str) -> None:
    code = law(
        f"self.memory += 1e-9; return {part}",
        "return Seen(self.memory[:])" if part.startswith("Seen") else "return None",
    )
    with pytest.raises(FlightError, match=r"own\.py:\d+: .*read-only"):
        flown(tmp_path, code, "law.batched=true")


def test_nor_what_its_inner_loop_receives(tmp_path: Path) -> None:
    code = (
        law(GOOD)
        + """
def inner(self, s, t, command, m):
    m.rate[...] = 0.0
    return s, command
Law.inner = inner
"""
    )
    with pytest.raises(
        FlightError, match=r"inner loop raised ValueError at own\.py:\d+: .*read-only"
    ):
        flown(tmp_path, code, "law.batched=true", "rates.physics='5 ms'")


@pytest.mark.parametrize("field", ["rate", "position", "magnetic_field", "orbit_position"])
def test_a_disturbance_cannot_write_into_the_truth(tmp_path: Path, field: str) -> None:
    code = (
        law(GOOD)
        + f"""
def push(time, truth):
    truth.{field}[...] = 0.0
    return np.zeros(3), np.zeros(3)
"""
    )
    orbit = (
        "environment.orbit.semi_major_axis='6878 km'",
        "environment.magnetic_field.model='dipole'",
    )
    with pytest.raises(
        FlightError, match=r"the disturbance raised ValueError at own\.py:\d+: .*read-only"
    ):
        flown(tmp_path, code, *orbit)


def test_a_reference_cannot_change_what_it_has_returned(tmp_path: Path) -> None:
    code = (
        law(GOOD)
        + """
class Source:
    def __init__(self):
        self.rows = np.zeros((1000, 3))
    def at(self, time):
        n = len(time)
        self.rows += 1.0
        return Reference(np.tile([1.0, 0, 0, 0], (n, 1)), self.rows[:n], np.zeros((n, 3)))
"""
    )
    refused = pytest.raises(
        FlightError, match=r"the reference raised ValueError at own\.py:\d+: .*read-only"
    )
    with blocks_of(10), refused:  # it is asked in each block
        flown(tmp_path, code, "duration=10")


def test_a_copy_may_be_changed_and_the_truth_stays(tmp_path: Path) -> None:
    code = law(
        "rate = m.rate.copy(); rate -= 1.0; return None, TorqueCommand(0.0 * rate), Seen(rate)"
    )
    result = run(scenario(tmp_path, code), out=tmp_path / "out")
    assert result.passed
    rate = result.log.read("/truth", ["rate"])["rate"]
    np.testing.assert_allclose(result.log.read("/law")["e"], rate - 1.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("step", "message"),
    [
        ("return None", r"step returned None: it must return \(state, command, signals\)"),
        ("return None, self.zero(m)", r"step returned \(None, a TorqueCommand\): it must return"),
        ("return self.zero(m)", "step returned a TorqueCommand: it must return"),
        ("return [None, self.zero(m), None]", "step returned a list: it must return"),
        ("return None, np.zeros(3), None", r"array of shape \(3,\), None\): the command must be"),
        ("return None, (np.zeros(3),), None", "the command must be a named tuple"),
        ("return None, self.zero(m), {'e': 1.0}", r"TorqueCommand, a dict\): the signals must be"),
        ("return {}, self.zero(m), None", "the state must be a named tuple"),
        ("return None, self.zero(m), Seen('x')", "the law's signals.e is not an array of numbers"),
        ("return None, self.zero(m), Seen(np.zeros(3 if t < 0.2 else 4))",
         r"t = 0\.2 s: the law's signals\.e has the shape \(1, 4\) after \(1, 3\)"),
        ("return (None, self.zero(m), None) if t < 0.2 else None", r"t = 0\.2 s: .*returned None"),
        ("return None, self.zero(m), None if t < 0.2 else {'e': 1}", r"t = 0\.2 s: .* a dict\)"),
        ("return None if t < 0.2 else Seen(1.0), self.zero(m), None",
         r"t = 0\.2 s: the law's state has the fields \['e'\] after \[\]"),
    ],
)  # fmt: skip
def test_a_wrong_return_is_named(tmp_path: Path, step: str, message: str) -> None:
    with pytest.raises(FlightError, match=message):
        flown(tmp_path, law(step))


LINE = HEAD.count("\n") + 3
"""Of the first line of a law's ``step``, in own.py."""

FLIGHT_ERROR = "from mjspace.errors import FlightError"


@pytest.mark.parametrize("batched", ["true", "false"])
@pytest.mark.parametrize(
    ("step", "message"),
    [
        ("return 1 / 0", "ZeroDivisionError at own.py:{line}: division by zero"),
        ("x = 1; return np.linalg.inv(np.zeros((3, 3)))", "LinAlgError at own.py:{line}: Singular"),
        # The innermost line of the user's counts.
        ("deep = lambda: 1 / 0\n    return deep()", "ZeroDivisionError at own.py:{line}: div"),
        ("return {}['gain']", "KeyError at own.py:{line}: 'gain'"),
        ("raise ValueError('one\\n  two')", "ValueError at own.py:{line}: one two"),
        (f"{FLIGHT_ERROR}; raise FlightError('lost')", "FlightError at own.py:{line}: lost"),
        (
            f"{FLIGHT_ERROR}; raise type('Lost', (FlightError,), {{}})('far')",
            "Lost at own.py:{line}: far",
        ),
    ],
)
def test_what_a_law_raises_has_its_file_and_line(
    tmp_path: Path, step: str, message: str, batched: str
) -> None:
    with pytest.raises(FlightError) as raised:
        flown(tmp_path, law(step), f"law.batched={batched}")
    assert f"t = 0 s: the law raised {message.format(line=LINE)}" in str(raised.value)
    with pytest.raises(FlightError) as raised:
        flown(tmp_path, law(GOOD, step), f"law.batched={batched}")
    assert f"t = 0 s: the law raised {message.format(line=LINE + 2)}" in str(raised.value)


@pytest.mark.parametrize(
    ("inner", "message"),
    [
        ("None", r"the law's inner loop returned None: it must return \(state, command\)"),
        ("(1.0, c)", r"returned \(a float, a TorqueCommand\): it must"),
        ("(s, [c.torque])", r"returned \(\(\), a list\): it must"),
        ("(s, c, None)", r"returned \(\(\), a TorqueCommand, None\): it must"),
        ("c / 2", r"the law's inner loop raised TypeError at own\.py:\d+"),
    ],
)
def test_a_wrong_return_of_an_inner_loop_is_named(tmp_path: Path, inner: str, message: str) -> None:
    code = law(GOOD) + f"\nLaw.inner = lambda self, s, t, c, m: {inner}\n"
    with pytest.raises(FlightError, match=message):
        flown(tmp_path, code, "law.batched=true", "rates.physics='5 ms'")


def test_an_inner_loop_without_memory_may_return_none(tmp_path: Path) -> None:
    code = law(GOOD) + "\nLaw.inner = lambda self, s, t, c, m: (None, c)\n"
    assert flown(tmp_path, code, "law.batched=true", "rates.physics='5 ms'")


class Broken:
    """Actuators with a fault in their own code."""

    def __init__(self, actuators: Any) -> None:
        self._actuators = actuators

    def __getattr__(self, name: str) -> Any:
        return getattr(self._actuators, name)

    def act(self, *_: Any) -> Any:
        raise KeyError("limit")


@pytest.mark.parametrize("inner", ["", "\nLaw.inner = lambda self, s, t, c, m: (s, c)\n"])
def test_an_error_inside_an_actuator_is_not_the_laws(tmp_path: Path, inner: str) -> None:
    """It is a fault of mjspace, and stays the exception that it is, with its traceback."""
    path = scenario(tmp_path, law(GOOD) + inner)
    built = assemble(*load(path, ["law.batched=true", "rates.physics='5 ms'"]))
    broken: Any = Broken(built.actuators)
    with pytest.raises(KeyError, match="limit"):
        list(fly(replace(built, actuators=broken), first_start(built, [0])))


def test_a_law_may_declare_units(tmp_path: Path) -> None:
    code = (
        law(GOOD, "return Memory(np.zeros(1))")
        + """
from typing import Annotated
from mjspace.contract import Array, Unit
class Seen(NamedTuple):
    e: Annotated[Array, Unit("rad/s")]
class Memory(NamedTuple):
    slip: Annotated[np.ndarray, Unit("m")]
class Push(NamedTuple):
    torque: np.ndarray
    heat: Annotated[np.ndarray, Unit("W")]
Law.step = lambda self, s, t, m, r: (s, Push(0.0 * m.rate, np.zeros(1)), Seen(m.rate))
"""
    )
    log = run(scenario(tmp_path, code), out=tmp_path / "out").log
    assert log.units["/law"] == {"e": "rad/s"}
    assert log.units["/state"] == {"law_slip": "m"}
    assert log.units["/command"] == {"torque": "N m", "heat": "W"} | {
        name: "N m" for name in log.topics["/command"] if name.endswith("_torque")
    }


def test_periods_before_a_change_of_shape_are_kept(tmp_path: Path) -> None:
    code = law("return None, self.zero(m), Seen(np.zeros(3 if t < 0.195 else 4))")
    built = assemble(*load(scenario(tmp_path, code)))
    kept: list[Block] = []
    with pytest.raises(FlightError, match="has the shape"):
        kept.extend(fly(built, first_start(built, [0])))
    assert sum(map(len, (block.time for block in kept))) == 20


@pytest.mark.parametrize("reset", ["return 1.0", "return np.zeros(3)", "return {}"])
def test_a_wrong_first_state_is_named(tmp_path: Path, reset: str) -> None:
    for batched in ("true", "false"):
        with pytest.raises(FlightError, match=r"law's reset returned .*: it must return its"):
            flown(tmp_path, law(GOOD, reset), f"law.batched={batched}")


@pytest.mark.parametrize(
    "later", ["None", "(None, self.zero(m))", "(None, self.zero(m), {'e': 1})", "(None, 1.0, None)"]
)
def test_a_batched_law_that_returns_something_else_later_is_named(
    tmp_path: Path, later: str
) -> None:
    code = law(f"return (None, self.zero(m), None) if t < 0.2 else {later}")
    with pytest.raises(FlightError, match=r"t = 0\.2 s: the law's step returned"):
        flown(tmp_path, code, "law.batched=true")


def test_a_batched_law_without_a_vehicle_axis_is_named(tmp_path: Path) -> None:
    code = law("return None, self.zero(m), Seen(np.zeros(3))")
    with pytest.raises(FlightError, match=r"signals\.e has the shape \(3,\): of a batched law"):
        flown(tmp_path, code, "law.batched=true")


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("del Law.reset", r"law: own\.py:Law has no method reset\(measurement, reference\)"),
        ("", r"law: own\.py:Law has no method step\(state, time,"),
        (law(GOOD) + "del Source.at", r"reference: own\.py:Source has no method at\(time\)"),
        (
            law(GOOD) + "push = 3",
            r"environment\.python: own\.py:push is neither a class nor a function: int",
        ),
    ],
)
def test_what_lacks_a_method_is_refused_before_the_flight(
    tmp_path: Path, code: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        assemble(*load(scenario(tmp_path, code)))


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ("None", "the disturbance returned None: it must return a force"),
        ("np.zeros(6)", "the disturbance returned"),
        ("(np.zeros(3), np.zeros(2))", r"shapes \(3,\) and \(2,\)"),
        ("(0.0, 1 / 0)", r"the disturbance raised ZeroDivisionError at own\.py:\d+"),
    ],
)
def test_a_wrong_disturbance_is_named(tmp_path: Path, returned: str, message: str) -> None:
    code = law(GOOD) + f"\ndef push(time, truth):\n    return {returned}\n"
    with pytest.raises(FlightError, match=message):
        flown(tmp_path, code)


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ("np.zeros((n, 4))", r"returned an array of shape \(51, 4\): it must return a named tuple"),
        ("TorqueCommand(np.zeros((n, 3)))", "the reference returned a TorqueCommand"),
        ("Reference(np.zeros((3, 4)), np.zeros((n, 3)), np.zeros((n, 3)))",
         r"the reference's attitude has the shape \(3, 4\) for 51 times"),
    ],
)  # fmt: skip
def test_a_wrong_reference_is_named(tmp_path: Path, returned: str, message: str) -> None:
    code = (
        law(GOOD)
        + f"""
class Source:
    def at(self, time):
        n = len(time)
        return {returned}
"""
    )
    with pytest.raises(FlightError, match=message):
        flown(tmp_path, code)


@pytest.mark.parametrize("batched", ["true", "false"])
def test_reading_what_no_sensor_measures_names_the_sensor(tmp_path: Path, batched: str) -> None:
    code, chosen = law(f"m.position; {GOOD}"), f"law.batched={batched}"
    line = 1 + (HEAD + code[: code.index("m.position")]).count("\n")
    with pytest.raises(FlightError) as caught:
        flown(tmp_path, code, chosen)
    message = str(caught.value)
    assert f"own.py:{line}: no sensor measures position: add [sensors.position]" in message
    assert "\n" not in message
    flown(tmp_path, code, chosen, "sensors.position={}")


def test_a_disturbance_knows_its_surroundings_whatever_the_sensors(tmp_path: Path) -> None:
    """The field and the place in the orbit, against the logged magnetometer and Kepler's law."""
    code = (
        law(GOOD)
        + """
SEEN = []
def push(time, truth):
    SEEN.append((time, truth))
    return np.zeros(3), np.zeros(3)
"""
    )
    orbit = (
        "environment.orbit={semi_major_axis='7000 km', eccentricity=0.01, inclination='60 deg'}",
        "environment.magnetic_field.model='dipole'",
        "rates.physics='5 ms'",
    )
    with_sensor = flown(tmp_path, code, *orbit, "sensors.magnetic_field={}")
    from mjspace.scenario.user_files import load_file

    seen = load_file(tmp_path / "own.py").SEEN
    rows = [block.rows["/truth"]["magnetic_field"][:, 0] for block in with_sensor]
    field = np.concatenate(rows)  # a slow machine ends a block earlier
    assert [time for time, _ in seen] == pytest.approx(0.005 * np.arange(101))
    for (_, truth), expected in zip(seen[::2], field, strict=True):
        np.testing.assert_array_equal(truth.magnetic_field, expected)
    seen.clear()
    flown(tmp_path, code, *orbit)
    for (_, truth), expected in zip(seen[::2], field, strict=True):
        np.testing.assert_array_equal(truth.magnetic_field, expected)
    place, motion = (
        np.array([getattr(truth, name) for _, truth in seen])
        for name in ("orbit_position", "orbit_velocity")
    )
    # Vis-viva for a = 7000 km; and positions change as the velocities say (central differences
    # of 10 ms: the jerk's share is n^2 h^2 / 6 = 2e-11).
    radius, speed = (np.linalg.norm(rows, axis=1) for rows in (place, motion))
    np.testing.assert_allclose(speed**2, 3.986004418e14 * (2 / radius - 1 / 7e6), rtol=1e-12)
    np.testing.assert_allclose((place[2:] - place[:-2]) / 0.01, motion[1:-1], rtol=1e-6, atol=1e-5)


def test_an_inner_loop_of_a_law_for_one_vehicle_is_refused(tmp_path: Path) -> None:
    code = law(GOOD) + "\nLaw.inner = lambda self, s, t, command, m: (s, command)\n"
    with pytest.raises(InputError, match="law: Law has an inner loop and is not batched: write it"):
        assemble(*load(scenario(tmp_path, code)))


def test_fields_that_differ_between_vehicles_are_named(tmp_path: Path) -> None:
    code = (
        law("return None, self.zero(m), Seen(m.rate) if self.first() else None")
        + """
def first(self):
    self.calls = getattr(self, 'calls', 0) + 1
    return self.calls % 2
Law.first = first
"""
    )
    built = assemble(*load(scenario(tmp_path, code)))
    with pytest.raises(FlightError, match=r"the law's signals has the fields \['e'\] for one veh"):
        list(fly(built, first_start(built, range(2)), range(2)))


def test_a_reference_is_asked_for_two_rows_at_least() -> None:
    """Since one row of a matrix product may be rounded otherwise than several."""
    asked = []

    class Source:
        def at(self, time: Any) -> Reference:
            asked.append(list(time))
            rows = np.zeros((len(time), 3))
            return Reference(np.tile([1.0, 0.0, 0.0, 0.0], (len(time), 1)), rows, rows + time[0])

    one = reference_at(Source(), np.array([0.5]))
    assert asked == [[0.5, 0.5]]
    assert one.attitude.shape == (1, 4)
    assert one.acceleration.tolist() == [[0.5, 0.5, 0.5]]
