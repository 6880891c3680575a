"""Scenarios as dm_control environments: the same flights, the contract of dm_env, no display."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any
from unittest import TestCase

import mujoco
import numpy as np
import pytest

pytest.importorskip("dm_control")

from dm_env import StepType, TimeStep, test_utils

from mjspace import dm_env
from mjspace.contract import Measurement
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.errors import InputError
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import INTEGRATION, first_start
from mjspace.simulation.loop import fly as flight
from mjspace.simulation.recording import Block
from mjspace.vehicle.model_checks import ModelWarning
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

pytestmark = [
    pytest.mark.filterwarnings(f"ignore::{kind.__module__}.{kind.__name__}")
    for kind in (UnphysicalInertiaWarning, ModelWarning)
]

Fly = Callable[[TimeStep, int], Any]
"""Returns the command for a time step and the number of its control period."""
A, INF = np.radians(20.0), np.inf
SHORT = "duration=0.048"  # a whole number of all control periods here
NOISY = [
    "sensors.rate.noise_std=0.01",
    "sensors.rate.bias_walk=0.001",
    "sensors.rate.period='3 ms'",
    "sensors.attitude.noise_std=1e-4",
    "sensors.attitude.delay='8 ms'",
    "sensors.wheel_speed.quantization=0.1",
    "plant.wheels.torque_limit=5",
    "plant.wheels.coulomb_friction=0.01",
    "plant.wheels.static_imbalance=1e-4",
    "rates.control='4 ms'",
]
WIND = """
def wind(time, truth):
    return [time, 0.0, 1.0], truth.rate * [1.0, 2.0, 3.0] - time
"""


class _Conformance(test_utils.EnvironmentTestMixin):
    """dm_env's own tests: each runs two episodes and begins a third."""

    scenario: str
    overrides: Sequence[str] = ()

    def make_object_under_test(self) -> Any:
        return dm_env.load(self.scenario, [SHORT, *self.overrides])

    def make_action_sequence(self) -> Iterator[np.ndarray]:
        spec = self.environment.action_spec()
        random = np.random.default_rng(1)
        for _ in range(60):
            yield random.uniform(spec.minimum, spec.maximum)


class TestIdeal(_Conformance, TestCase):
    scenario = "contraction-adaptive"


class TestNoisy(_Conformance, TestCase):
    scenario = "contraction-noise"
    overrides = NOISY


class TestManoeuvreAsPrinted(_Conformance, TestCase):
    scenario = "immersion-invariance"


class TestDivergence(_Conformance, TestCase):
    scenario = "contraction-ideal"

    def make_action_sequence(self) -> Iterator[np.ndarray]:
        for index in range(60):
            yield np.full(3, np.nan if index % 7 == 3 else 1e9)


class TestEngine(_Conformance, TestCase):
    scenario = "lander"
    overrides = ("duration=0.2",)


class TestCoils(_Conformance, TestCase):
    scenario = "b-dot"
    overrides = ("duration=40", "initial.rate=[0.1, 0, 0]")


OF_A_LAW = {"wheel-stuck"}
"""Their faults begin with a signal of the law."""


@pytest.mark.parametrize("scenario", sorted(OF_A_LAW))
def test_a_fault_that_depends_on_a_law_is_refused(scenario: str) -> None:
    with pytest.raises(InputError, match=r"faults\.0\.when\.signal: law\.path: an environment fl"):
        dm_env.load(scenario)


@pytest.mark.parametrize("scenario", sorted({*scenario_names()} - OF_A_LAW))
def test_every_scenario_is_an_environment(scenario: str) -> None:
    environment = dm_env.load(scenario)
    environment.reset()
    spec = environment.action_spec()
    step = environment.step(np.clip(np.zeros(spec.shape), spec.minimum, spec.maximum))
    assert step.mid()
    assert 0.0 < step.reward <= 1.0 or load(scenario)[0].task is not None
    assert len(spec.name.split("\t")) == spec.shape[0]


def observed(built: Assembly, step: TimeStep) -> tuple[Measurement, Any]:
    """Return what a law receives, with the measurement's vehicle axis."""
    observation = step.observation
    reported = {n: a[None] for n, a in observation.items() if not n.startswith("reference_")}
    kind = type(built.reference.at(np.zeros(1)))
    desired = kind(*(observation[f"reference_{name}"] for name in kind._fields))
    return Measurement(**reported), desired


def by_law(built: Assembly) -> Fly:
    """Return what commands as the scenario's law does; its inner loop at equal rates alone."""
    law: Any = built.law
    memory = None

    def fly(step: TimeStep, number: int) -> Any:
        nonlocal memory
        time = number * built.scenario.rates.control
        measurement, reference = observed(built, step)
        if step.first():
            memory = law.reset(measurement, reference)
        memory, command, _ = law.step(memory, time, measurement, reference)
        if built.inner:
            memory, command = law.inner(memory, time, command, measurement)
        return command

    return fly


def by_log(blocks: list[Block]) -> Fly:
    """Return what commands as a flight has logged."""
    kind: Any = blocks[0].kinds["/command"][""]
    columns = {name: joined(blocks, "/command", name) for name in kind._fields}

    def fly(step: TimeStep, number: int) -> Any:
        return kind(**{name: values[number] for name, values in columns.items()})

    return fly


def joined(blocks: list[Block], topic: str, name: str) -> Any:
    """Return the rows of a field, without the vehicle axis."""
    return np.concatenate([block.rows[topic][name][:, 0] for block in blocks])


def episode(environment: Any, built: Assembly, fly: Fly) -> list[dict[str, Any]]:
    """Fly an episode and return /state and measurement of each period."""
    step, rows, physics = environment.reset(), [], environment.physics
    taken = [name for kind in built.actuators.kinds for name in kind.takes]
    while True:
        measurement, _ = observed(built, step)
        reported = {f"measured_{n}": m[0] for n, m in measurement._asdict().items() if m.size}
        rows.append({"physics": physics.get_state(INTEGRATION), **physics.memory(), **reported})
        if step.last():
            return rows
        command = fly(step, physics.period())
        step = environment.step(np.concatenate([getattr(command, n).ravel() for n in taken]))


FAILS = [
    "duration=0.1",
    "faults=[{motor='wheel_1',kind='dead',at=0.0403},{motor='wheel_0',kind='noisy',value=0.01,at=0}]",
]
OUT = ["duration=0.6", "rates.control='0.1 s'", "rates.physics='0.05 s'"]
CONTROL = "rates.control=0.004"
AT_ONCE = [f"plant.parts.{side}.deployment.at=0.12" for side in ("east", "west")]


@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [
        ("contraction-adaptive", [SHORT]),
        ("contraction-noise", ["duration=0.1", *NOISY]),
        ("contraction-ideal", [SHORT, "rates.control='2 ms'", "rates.integrator='Euler'"]),
        (
            "contraction-ideal",
            [
                "duration=0.045",
                "rates.control='5 ms'",
                "environment.python='wind.py:wind'",
                "environment.torques=[{bias=[1,2,3]}]",
                "environment.orbit.semi_major_axis=7e6",
            ],
        ),
        ("immersion-invariance", ["duration=0.55"]),  # more than a block of references
        ("rcs-schmitt", ["duration=0.3", "initial.rate=[0.1, 0.2, 0]"]),
        ("rcs-three-axis", ["duration=1", "initial.rate=[0.01, 0.02, 0]"]),
        ("lander", ["duration=0.2"]),
        ("lander-engine-lag", ["duration=0.2"]),
        ("cmg-slew", ["duration=0.2"]),
        ("dgvscmg-tracking", ["duration=0.01", "rates.control='0.1 ms'"]),
        ("wheel-failure", FAILS),
        ("gravity-gradient-boom", ["plant.parts.boom.deployment.at=0.25", *OUT]),
        ("yo-yo-despin", [*AT_ONCE, "duration=0.8", "rates.physics=0.005", "rates.control=0.01"]),
        ("desaturation-magnetic", ["duration=2"]),
        (
            "contraction-ideal",
            [SHORT, "plant.wheels.speed_limit='30 rad/s'", CONTROL],
        ),
    ],
    ids=[
        *("ideal", "noisy", "euler", "disturbed", "long", "thrusters", "pulses", "lander", "lag"),
        *("gimbals", "inner loop", "faults", "boom", "yo-yo", "coils", "speed limit"),
    ],
)
def test_the_same_commands_are_the_same_flight_bit_for_bit(
    scenario: str, overrides: list[str], tmp_path: Path
) -> None:
    (tmp_path / "wind.py").write_text(WIND)
    overrides = [text.replace("wind.py", str(tmp_path / "wind.py")) for text in overrides]
    overrides.append("checks=[]")
    built = assemble(*load(scenario, overrides))
    blocks = list(flight(built, first_start(built, [0])))
    state = [name for name in blocks[0].rows["/state"] if not name.startswith("law_")]
    logged = {name: joined(blocks, "/state", name) for name in state}
    measured = blocks[0].rows["/measurement"]
    logged |= {f"measured_{name}": joined(blocks, "/measurement", name) for name in measured}
    environment = dm_env.load(scenario, overrides)
    # An inner loop's commands are not logged. The second episode starts where the first did.
    for fly in (by_law(built), by_law(built) if built.inner else by_log(blocks)):
        rows = episode(environment, built, fly)
        assert rows[0].keys() == logged.keys()
        for name, values in logged.items():
            assert np.array([row[name] for row in rows]).tobytes() == values.tobytes(), name


def at_rest(*overrides: str) -> Any:
    """Return a spacecraft at rest, 2 deg from the attitude that it is to hold."""
    return dm_env.load(
        "contraction-regulation",
        [
            SHORT,
            "law={kind='contraction:Ideal', rate_gain=25, attitude_gain=25}",
            "reference={kind='references:Hold'}",
            "initial={euler=['2 deg', 0, 0]}",
            *overrides,
        ],
    )


def test_the_action_is_the_torque_on_the_bus() -> None:
    environment = at_rest()
    environment.reset()
    torque = np.array([0.3, -0.2, 0.1])
    observation = environment.step(torque).observation
    inertia = np.array([[15, 5, 5], [5, 10, 7], [5, 7, 20]])
    # From rest, H rate = torque t but for the wheels' gyroscopic torque, of order rate^2 = 1e-9.
    np.testing.assert_allclose(inertia @ observation["rate"], torque * 1e-3, rtol=0, atol=1e-9)


def test_the_action_is_bounded_by_what_the_wheels_give() -> None:
    axes = "[[1,0,0],[0,1,0],[0,0,1],[1,1,1]]"
    environment = at_rest("plant.wheels.torque_limit=5", f"plant.wheels.axes={axes}")
    spec = environment.action_spec()
    # About each axis: its own wheel and the skewed one, at an angle of cosine 1/sqrt(3).
    np.testing.assert_allclose(spec.maximum, 5 + 5 / np.sqrt(3), rtol=1e-15)
    np.testing.assert_array_equal(spec.minimum, -spec.maximum)
    environment.reset()
    environment.step(2 * spec.maximum)
    np.testing.assert_array_equal(environment.physics.control(), np.full(4, -5.0))
    free = at_rest().action_spec()
    assert free.maximum == pytest.approx(np.full(3, 2734.324), rel=1e-6)  # 100 x 27.34324 kg m^2
    np.testing.assert_array_equal(free.minimum, -free.maximum)


@pytest.mark.parametrize(
    ("scenario", "label", "least", "largest"),
    [
        ("lander", "thrust [N]", [0, -A, -A], [320, A, A]),  # the throttle, both gimbals by 20 deg
        ("b-dot", "dipole[0] [A m^2]", [-5] * 3, [5] * 3),
        ("cmg-slew", "gimbal_rate[0] [rad/s]", [-2.5] * 4, [2.5] * 4),
        ("rcs-schmitt", "on_time[0] [s]", [0] * 12, [1e-3] * 12),
        ("dgvscmg-tracking", "voltage[0, 0] [V]", [-INF] * 4 + [-400] * 2, [INF] * 4 + [400] * 2),
    ],
)
def test_the_action_has_the_fields_units_and_limits_of_the_actuators(
    scenario: str, label: str, least: list[float], largest: list[float]
) -> None:
    spec = dm_env.load(scenario).action_spec()
    assert spec.name.split("\t")[0] == label
    np.testing.assert_allclose(spec.minimum, least, rtol=1e-6)
    np.testing.assert_allclose(spec.maximum, largest, rtol=1e-6)


def test_an_action_of_another_length_is_refused() -> None:
    environment = dm_env.load("lander", ["duration=0.2"])
    environment.reset()
    with pytest.raises(ValueError, match=r"has shape \(4,\): it must be \(3,\), of thrust \[N\]"):
        environment.step(np.zeros(4))


def test_a_step_is_a_whole_control_period_under_a_command() -> None:
    physics = dm_env.load("lander", ["duration=0.2"]).physics
    with pytest.raises(ValueError, match="no command"):
        physics.step()
    with pytest.raises(ValueError, match="nstep is 3: a step is one control period, 10 integr"):
        physics.step(3)


def test_what_happens_in_a_period_is_known_and_the_masses_follow() -> None:
    fault = "faults=[{motor='engine',kind='scaled',value=0.9,at=0.03}]"
    environment = dm_env.load("lander", ["duration=0.2", fault])
    physics = environment.physics
    for _ in range(2):
        environment.reset()
        full = physics.named.model.body_mass["tank"]
        environment.step(np.array([200.0, 0.0, 0.0]))
        assert physics.events() == []
        environment.step(np.array([200.0, 0.0, 0.0]))
        assert [event[3] for event in physics.events()] == ["fault: engine is scaled"]
        left = physics.truth().propellant[0]
        # That of the middle of the last integration step of 2 ms, at 0.1 kg/s.
        assert physics.named.model.body_mass["tank"] == pytest.approx(left, abs=2e-4)
        assert full - left == pytest.approx(0.04 * 200.0 / (310.0 * STANDARD_GRAVITY), rel=0.5)


def test_a_task_may_change_the_start() -> None:
    environment = dm_env.load("detumble-wheels", ["duration=0.1", "checks=[]"])
    physics = environment.physics
    with physics.reset_context():
        physics.data.qvel[3:6] = [0.5, 0.0, 0.0]
    np.testing.assert_array_equal(physics.measurement().rate, [0.5, 0.0, 0.0])


@pytest.mark.parametrize(
    ("checks", "rewards"),
    [
        # Time: 0.001, 0.02, 0.03 and 0.04 s. The error is 2 deg throughout.
        ("[]", [1 / 2, 1 / 2, 1 / 2, 1 / 2]),
        ("[{name='a', signal='truth.attitude_error', below='3 deg'}]", [1, 1, 1, 1]),
        (
            "[{name='a', signal='truth.attitude_error', below='0.5 deg'},"
            "{name='b', signal='/truth.attitude_error[0]', statistic='peak', below='0.1 deg',"
            "start=0.0195, end=0.0305},"
            "{name='c', signal='truth.attitude_error', statistic='rms', below='1e-9 deg'},"
            "{name='d', signal='truth.attitude_error', target=1, below='1e-9 deg'},"
            "{name='e', signal='truth.attitude_error', above=0},"
            "{name='f', signal='truth.rate', below=1e-9}]",
            [1 / 4, 1 / 20, 1 / 20, 1 / 4],
        ),
    ],
)
def test_the_reward_is_the_tightest_bound_over_the_error(checks: str, rewards: list[float]) -> None:
    # Of the true error: the star tracker's say nothing of it.
    environment = at_rest(f"checks={checks}", "sensors.attitude.noise_std=0.1")
    environment.reset()
    earned = [environment.step(np.zeros(3)).reward for _ in range(50)]
    # At rest and without torque nothing moves, but for rounding.
    np.testing.assert_allclose([earned[k - 1] for k in (1, 20, 30, 40)], rewards, rtol=1e-12)


def test_readings_are_of_the_instant_of_the_state() -> None:
    environment = at_rest("environment.torques=[{frame='inertial', bias=[1,2,3]}]")
    mujoco.set_mjcb_passive(None)  # as other users of MuJoCo in this process may leave it
    environment.reset()
    start = environment.physics.momentum()
    for _ in range(10):
        observation = environment.step(np.zeros(3)).observation
    physics = environment.physics
    # A constant inertial torque: H0 + M t exactly; readings a step old would be 3e-3 off.
    np.testing.assert_allclose(physics.momentum() - start, [0.01, 0.02, 0.03], atol=1e-12)
    np.testing.assert_array_equal(physics.truth().attitude, observation["attitude"])
    np.testing.assert_array_equal(physics.named.data.xquat["bus"], observation["attitude"])


def test_an_observation_is_the_agents_own() -> None:
    environment = dm_env.load("contraction-noise", [SHORT, *NOISY])
    first = environment.reset().observation
    kept = {name: values.copy() for name, values in first.items()}
    environment.step(np.ones(3))
    for name, values in first.items():
        np.testing.assert_array_equal(values, kept[name])
        values[:] = 7.0
    for name, values in environment.reset().observation.items():
        np.testing.assert_array_equal(values, kept[name])


def test_the_task_of_the_scenario_is_observed_and_rewarded() -> None:
    environment = at_rest(
        "task.observation=['truth.attitude_error','measurement.rate[1]','error.attitude']",
        "task.reward=[{signal='command.torque',weight=-2}]",
        "task.terminate=[{signal='truth.rate',above=1e-9,reward=3}]",
    )
    step = environment.reset()
    assert list(step.observation) == ["truth_attitude_error", "rate[1]", "error_attitude"]
    angle = step.observation["truth_attitude_error"]
    np.testing.assert_allclose(angle, np.radians(2.0))
    np.testing.assert_allclose(step.observation["error_attitude"], [angle[0], 0, 0], atol=1e-12)
    assert environment.step(np.zeros(3)).reward == 0.0
    step = environment.step(np.array([3.0, 0.0, 4.0]))
    assert (step.reward, step.discount, step.last()) == (-10.0 + 3.0, 0.0, True)


def test_an_episode_ends_with_the_scenario() -> None:
    environment = dm_env.load("contraction-adaptive", ["duration=0.3", "rates.control=0.1"])
    environment.reset()
    steps = [environment.step(np.zeros(3)) for _ in range(4)]
    assert [step.step_type for step in steps] == [
        StepType.MID,
        StepType.MID,
        StepType.LAST,
        StepType.FIRST,
    ]
    assert steps[2].discount == 1.0  # out of time, not out of bounds: the value goes on
    assert environment.control_timestep() == pytest.approx(0.1)


@pytest.mark.parametrize("action", [np.nan, np.inf, 1e300, 1e11])
def test_an_episode_ends_where_the_state_is_not_finite(action: float) -> None:
    environment = dm_env.load("contraction-adaptive", [SHORT])
    start = environment.reset()
    for _ in range(3):
        step = environment.step(np.full(3, action))
        if step.last():
            break
    assert step.last()
    assert (step.reward, step.discount) == (0.0, 0.0)
    again = environment.step(np.zeros(3))
    assert again.first()
    for name, values in start.observation.items():
        np.testing.assert_array_equal(again.observation[name], values)
    assert not environment.step(np.zeros(3)).last()


def run_python(code: str) -> str:
    """Return what ``code`` prints, without MUJOCO_GL and with every warning but ours an error."""
    command = [sys.executable, "-W", "error", "-W", "ignore::UserWarning", "-c", code]
    environ = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run(command, capture_output=True, text=True, env=environ, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_flight_does_not_import_dm_control(tmp_path: Path) -> None:
    loaded = run_python(
        "import sys, mjspace.cli, mjspace.runner.replay\n"
        f"mjspace.run('contraction-ideal', overrides=['{SHORT}'], out={str(tmp_path)!r})\n"
        "print(sorted(name for name in sys.modules if name.startswith(('dm_', 'absl'))))"
    )
    assert loaded.strip() == "[]"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere dm_control makes its own choice")
def test_works_without_any_opengl() -> None:
    """OpenGL's Python package failing as it does where there is no library behind it."""
    said = run_python(
        "import os, sys\n"
        "class Broken:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'OpenGL.platform': raise AttributeError('no glGetError')\n"
        "sys.meta_path.insert(0, Broken())\n"
        "from mjspace import dm_env\n"
        "from dm_control import _render\n"
        f"environment = dm_env.load('contraction-ideal', ['{SHORT}'])\n"
        "environment.reset(); environment.step([0.0, 0.0, 0.0])\n"
        "print(_render.BACKEND, os.environ.get('MUJOCO_GL'))"
    )
    assert said.split() == ["off", "None"]


def test_the_page_runs() -> None:
    page = Path(__file__).parents[2] / "docs" / "dm_control.md"
    for snippet in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL):
        exec(compile(snippet, str(page), "exec"), {})
