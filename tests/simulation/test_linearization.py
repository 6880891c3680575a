"""Matrices of linearized vehicles against closed forms, and against the flight itself."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from command_lines import command_line
from compiled_flights import Flown, assembly, flown
from hypothesis import given, settings
from hypothesis import strategies as st
from own_models import SENSED, write
from scipy.linalg import expm

import mjspace
from mjspace import attitude
from mjspace.errors import InputError
from mjspace.simulation.initial_state import INTEGRATION, initial_physics, start_at
from mjspace.simulation.linear_plant import LinearPlant

RIGID = """
description = "a rigid body with ideal thrusters"
duration = "1 s"
[plant]
model = "satellite_3rw"
mass = 100
bus_inertia = [[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]]
ideal_thrusters = true
[plant.wheels]
axes = []
[reference]
kind = "references:Hold"
[law]
kind = "nothing.so:yet"
"""
J = np.array([[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]])
ORBIT = ["environment.orbit.semi_major_axis=7e6"]
N2 = 3.986004418e14 / 7e6**3  # rad^2/s^2


def vectors(largest: float) -> st.SearchStrategy[np.ndarray]:
    """Return vectors of three numbers that a scenario can hold."""
    numbers = st.floats(-largest, largest).map(lambda number: round(number, 6))
    return st.lists(numbers, min_size=3, max_size=3).map(np.array)


@pytest.fixture(scope="module")
def rigid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rigid") / "rigid.toml"
    path.write_text(RIGID)
    return path


def cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def block(plant: LinearPlant, matrix: str, row: str, column: str) -> Any:
    """Return the part of a matrix between two named quantities."""
    of_rows, of_columns = {
        "A": (plant.states, plant.states),
        "Ad": (plant.states, plant.states),
        "B": (plant.states, plant.inputs),
        "C": (plant.outputs, plant.states),
    }[matrix]
    chosen = [
        [i for i, each in enumerate(names) if each.partition("[")[0] == name]
        for names, name in ((of_rows, row), (of_columns, column))
    ]
    return getattr(plant, matrix)[np.ix_(*chosen)]


def test_a_rigid_body_at_rest_is_a_double_integrator(rigid: Path) -> None:
    plant = mjspace.linearize(rigid)
    expected = np.zeros((12, 12))
    expected[:6, 6:] = np.eye(6)
    np.testing.assert_allclose(plant.A, expected, atol=1e-10)
    np.testing.assert_allclose(block(plant, "B", "rate", "torque"), np.linalg.inv(J), atol=1e-12)
    assert not block(plant, "B", "velocity", "torque").any()
    assert not plant.D.any()
    T = plant.control_period
    assert T == 1e-3
    np.testing.assert_allclose(plant.Bd[9:], T * np.linalg.inv(J), rtol=1e-8, atol=1e-16)
    np.testing.assert_allclose(plant.Bd[3:6], T**2 / 2 * np.linalg.inv(J), rtol=1e-5, atol=1e-12)


@settings(max_examples=8, deadline=None)
@given(vectors(0.5))
def test_a_spinning_body_has_eulers_equations(rigid: Path, rate: np.ndarray) -> None:
    """J w' = -w x J w, linearized; and attitude' = rate - w x attitude."""
    plant = mjspace.linearize(rigid, [f"initial.rate={rate.tolist()}"])
    of_rates = np.linalg.solve(J, cross(J @ rate) - cross(rate) @ J)
    np.testing.assert_allclose(block(plant, "A", "rate", "rate"), of_rates, atol=1e-9)
    np.testing.assert_allclose(block(plant, "A", "attitude", "attitude"), -cross(rate), atol=0)
    assert np.abs(block(plant, "A", "rate", "attitude")).max() < 1e-9


@settings(max_examples=8, deadline=None)
@given(vectors(0.5), vectors(200.0))
def test_wheels_couple_the_axes_by_their_momentum(rate: np.ndarray, speed: np.ndarray) -> None:
    """H w' = -w x (J w + Jw a W) for motors at rest, J = H + a^T Jw a; and torque is a reaction."""
    overrides = [f"initial.rate={rate.tolist()}", f"initial.wheel_speed={speed.tolist()}"]
    plant = mjspace.linearize("detumble-wheels", overrides)
    wheels, inertia, axial = np.eye(3), np.diag([10.0, 12.0, 14.0]), 0.05
    total = inertia + axial * wheels.T @ wheels
    momentum = total @ rate + axial * wheels.T @ speed
    of_rates = np.linalg.solve(inertia, cross(momentum) - cross(rate) @ total)
    of_wheels = np.linalg.solve(inertia, -cross(rate) @ (axial * wheels.T))
    np.testing.assert_allclose(block(plant, "A", "rate", "rate"), of_rates, atol=1e-8)
    np.testing.assert_allclose(block(plant, "A", "rate", "wheel_speed"), of_wheels, atol=1e-9)
    reaction = np.linalg.inv(inertia)
    np.testing.assert_allclose(block(plant, "B", "rate", "torque"), reaction, atol=1e-10)
    speeds = -np.eye(3) / axial - reaction
    np.testing.assert_allclose(block(plant, "B", "wheel_speed", "torque"), speeds, atol=1e-8)


def test_gravity_gives_its_stiffness(rigid: Path) -> None:
    """J w' = 3 n^2 o x J o (Wertz 17.2.1); the local vertical o turns by o x attitude."""
    plant = mjspace.linearize(rigid, ORBIT)
    o = np.array([1.0, 0.0, 0.0])  # at the ascending node, in which it starts
    torque = 3.0 * N2 * (cross(o) @ J @ cross(o) - cross(J @ o) @ cross(o))
    expected = np.linalg.solve(J, torque)
    np.testing.assert_allclose(
        block(plant, "A", "rate", "attitude"), expected, atol=1e-6 * np.abs(expected).max()
    )
    tides = N2 * np.diag([2.0, -1.0, -1.0])
    np.testing.assert_allclose(
        block(plant, "A", "velocity", "position"), tides, rtol=1e-4, atol=1e-11
    )


SPIN = "initial.rate=[0, 0, 0.3]"


@pytest.mark.parametrize(
    ("scenario", "equilibrium"),
    [
        ("lqr-gravity-gradient", []),
        ("detumble-wheels", [SPIN, "initial.wheel_speed=[0, 0, 50]"]),
        ("nutation-damper", [SPIN, "initial.wheel_speed=[0, 0, 0]"]),
    ],
)
def test_the_discrete_matrices_are_those_of_a_held_command(
    scenario: str, equilibrium: list[str]
) -> None:
    plant = mjspace.linearize(scenario, equilibrium)
    n, m = plant.B.shape
    both = np.zeros((n + m, n + m))
    both[:n] = np.hstack([plant.A, plant.B])
    held = expm(both * plant.control_period)
    scale = np.abs(plant.Bd).max()
    np.testing.assert_allclose(held[:n, :n], plant.Ad, atol=1e-7)
    np.testing.assert_allclose(held[:n, n:], plant.Bd, atol=1e-7 * scale)


def test_they_tell_how_a_flight_goes_on(rigid: Path, tmp_path: Path) -> None:
    """Ten control periods from a small error, under no command."""
    moved = ["initial.rate=[1e-4, -2e-4, 3e-4]", "initial.euler=[1e-4, 0, -1e-4]"]
    calm = ["initial.rate=[0.2, 0, 0]"]
    spinning = ["initial.rate=[0.2001, -2e-4, 3e-4]", "initial.euler=[1e-4, 0, -1e-4]"]
    for nominal, other in (([], moved), (calm, spinning)):
        plant = mjspace.linearize(rigid, nominal)
        coast = ["law.kind=coast:Coast", "rates.control='100 ms'", "duration=0.1"]
        rows = [
            mjspace.run(
                rigid, overrides=[*coast, *each], out=tmp_path / "out", force=True
            ).log.read("/truth")["rate"]
            for each in (nominal, other)
        ]
        start, end = rows[1] - rows[0]
        predicted = expm(0.1 * block(plant, "A", "rate", "rate")) @ start
        np.testing.assert_allclose(end, predicted, atol=1e-7)


def test_outputs_are_what_sensors_measure_under_their_names(rigid: Path) -> None:
    overrides = [
        "sensors.tracker.measures=attitude",
        "sensors.tracker.noise_std='10 arcsec'",
        "sensors.attitude.noise_std=1e-3",
        "sensors.gps.measures=position",
        "sensors.specific_force={}",
        "initial.rate=[0.1, 0.2, 0.3]",
        "initial.attitude=[0.5, 0.5, -0.5, 0.5]",
    ]
    plant = mjspace.linearize(rigid, overrides)
    named = [f"{name}[{i}]" for name in ("tracker", "attitude", "gps", "rate") for i in range(3)]
    assert sorted(plant.outputs) == sorted(named)
    for sensor, state in (("tracker", "attitude"), ("gps", "position"), ("rate", "rate")):
        np.testing.assert_allclose(block(plant, "C", sensor, state), np.eye(3), atol=1e-9)
    assert np.count_nonzero(np.abs(plant.C) > 1e-9) == 12
    noise = dict(zip(plant.outputs, plant.noise_std, strict=True))
    assert noise["tracker[2]"] == pytest.approx(np.radians(10 / 3600))
    assert noise["attitude[0]"] == 1e-3
    assert noise["gps[1]"] == 0.0
    units = dict(zip(plant.outputs, plant.output_units, strict=True))
    assert [units[f"{name}[0]"] for name in ("tracker", "gps", "rate")] == ["rad", "m", "rad/s"]


def test_coils_act_by_the_field_that_a_magnetometer_measures() -> None:
    """Torque = dipole x field; and the field, which is inertial, turns by field x attitude."""
    plant = mjspace.linearize("b-dot")
    field = block(plant, "C", "magnetic_field", "attitude")
    assert 1e-5 < np.linalg.norm(field) < 1e-4  # of the Earth [T], sqrt(2) times
    torque = 10.0 * block(plant, "B", "rate", "dipole")  # a sphere of 10 kg m^2
    np.testing.assert_allclose(torque, -field, atol=1e-11)


def test_hinges_and_wheels_have_their_names() -> None:
    plant = mjspace.linearize("nutation-damper")
    bus = ["position", "attitude", "velocity", "rate"]
    names = [f"{name}[{i}]" for name in bus for i in range(3)]
    names += [f"wheel_speed[{i}]" for i in range(3)]
    others = sorted(set(plant.states) - set(names))
    assert [name.rpartition(".")[2] for name in others] == ["position", "velocity"]
    assert len(plant.states) == len(names) + 2 == len(plant.A) == len(plant.state_units)
    units = dict(zip(plant.states, plant.state_units, strict=True))
    assert [units[name] for name in others] == ["rad", "rad/s"]


LAGGING = SENSED.replace(
    '<motor joint="rw3"/>',
    '<general name="slow" joint="rw3" dyntype="filterexact" dynprm="0.2" gainprm="0.05"/>',
)
"""A model of one's own in which a motor lags behind its command by 0.2 s."""


def test_a_motor_of_ones_own_lags_by_its_activation(tmp_path: Path) -> None:
    plant = mjspace.linearize(write(tmp_path, LAGGING), ["initial.rate=[0, 0, 0]"])
    states, inputs = list(plant.states), list(plant.inputs)
    slow, column = states.index("slow.activation"), inputs.index("control[1]")
    assert plant.A[slow, slow] == pytest.approx(-5.0, rel=1e-9)
    assert plant.B[slow, column] == pytest.approx(5.0, rel=1e-9)
    assert np.count_nonzero(np.abs(plant.A[slow]) > 1e-9) == 1
    # At once the command turns nothing; the activation does, as a torque of 0.05 N m for each unit.
    rates = [states.index(f"rate[{i}]") for i in range(3)]
    wheel = states.index("gimbal_rate[1]")  # a hinge that no wheel's motor turns
    np.testing.assert_allclose(plant.B[[*rates, wheel], column], 0.0, atol=1e-12)
    axial = 0.5 * 0.2 * 0.03**2
    turned = plant.A[wheel, slow] + plant.A[rates[2], slow]
    assert turned == pytest.approx(0.05 / axial, rel=1e-6)
    n, m = plant.B.shape
    both = np.zeros((n + m, n + m))
    both[:n] = np.hstack([plant.A, plant.B])
    held = expm(both * plant.control_period)
    # RK4 in steps of 4 ms, with a servo.
    np.testing.assert_allclose(held[:n, :n], plant.Ad, atol=1e-5 * np.abs(plant.Ad).max())
    np.testing.assert_allclose(held[:n, n:], plant.Bd, atol=1e-5 * np.abs(plant.Bd).max())


JET = """
<mujoco>
  <worldbody>
    <body name="bus">
      <freejoint/>
      <inertial pos="0 0 0" mass="10" diaginertia="1 2 2.5"/>
      <site name="jet" pos="0 0.2 -0.1"/>
    </body>
  </worldbody>
  <actuator>
    <general name="jet" site="jet" gear="0 0 2 0 0 0" ctrlrange="0 1"/>
    <general name="back" site="jet" gear="1 0 0 0 0 0" ctrlrange="-3 0"/>
  </actuator>
</mujoco>
"""


def test_a_thruster_that_only_pushes_has_its_slope_to_that_side(tmp_path: Path) -> None:
    plant = mjspace.linearize(write(tmp_path, JET), ["initial.rate=[0, 0, 0]"])
    np.testing.assert_array_equal([plant.input_least, plant.input_largest], [[0, -3], [2, 0]])
    force = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).T
    turning = np.cross([0.0, 0.2, -0.1], force.T).T / np.array([[1.0], [2.0], [2.5]])
    of_velocity = block(plant, "B", "velocity", "thruster_force")
    np.testing.assert_allclose(of_velocity, force / 10.0, atol=1e-12)
    of_rate = block(plant, "B", "rate", "thruster_force")
    np.testing.assert_allclose(of_rate, turning, atol=1e-12)
    np.testing.assert_allclose(plant.Bd[9:], 0.02 * turning, atol=1e-9)  # a control period of 20 ms
    assert not plant.A[6:].any()  # no thrust is in what the states do


def test_the_outputs_of_ones_own_sensors_are_those_of_motion(tmp_path: Path) -> None:
    noisy = "sensors.star_tracker={measures='model',noise_std='0.1 deg'}"
    plant = mjspace.linearize(write(tmp_path), ["initial.rate=[0, 0, 0]", noisy])
    turn = np.radians(30.0)
    c, s = np.cos(turn), np.sin(turn)
    into = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(block(plant, "C", "imu_rate", "rate"), into, atol=1e-9)
    np.testing.assert_allclose(block(plant, "C", "star_tracker", "attitude"), into, atol=1e-9)
    np.testing.assert_allclose(block(plant, "C", "elbow_angle", "gimbal_angle"), [[1.0]], atol=1e-9)
    assert not any(name.startswith("acceleration") for name in plant.outputs)
    noise = dict(zip(plant.outputs, plant.noise_std, strict=True))
    assert noise["star_tracker[1]"] == pytest.approx(np.radians(0.1))
    assert plant.C.shape == (len(plant.outputs), len(plant.states))


def test_dry_friction_in_motion_is_constant(tmp_path: Path) -> None:
    moving = ["initial.rate=[0, 0, 0]", "initial.joint_speed.elbow=0.5"]
    dry = SENSED.replace('name="elbow" axis', 'name="elbow" frictionloss="0.01" axis')
    plant, without = (mjspace.linearize(write(tmp_path, text), moving) for text in (dry, SENSED))
    speed = list(plant.states).index("gimbal_rate[0]")
    by_speed = without.A[:, speed]
    np.testing.assert_allclose(plant.A[:, speed], by_speed, atol=1e-6 * np.abs(by_speed).max())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ('ctrlrange="0 1"', 'ctrlrange="0.2 1"'),
            r"command\.thruster_force\[0\]: zero is not within its range, from 0\.4 to 2",
        ),
        (
            ('<motor joint="rw3"/>', '<muscle name="m" joint="rw3" lengthrange="0 1" force="1"/>'),
            r"(m\.activation|command\.control\[1\]): does not act linearly about zero",
        ),
        (
            ('name="elbow" axis', 'name="elbow" frictionloss="0.01" axis'),
            r"plant\.model: joint 'elbow' has dry friction and is at rest",
        ),
        (
            ('<motor joint="rw3"/>', '<motor joint="rw3" nsample="5" delay="0.01"/>'),
            r"plant\.model: its motors act late",
        ),
    ],
)
def test_motors_of_ones_own_that_have_no_linear_model(
    change: tuple[str, str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=said):
        mjspace.linearize(write(tmp_path, SENSED.replace(*change)))


@pytest.mark.parametrize(
    ("scenario", "said"),
    [
        ("rcs-schmitt", "plant: Thrusters has states of its own .*rcs_thrust"),
        ("dgvscmg-tracking", "plant: MotorDrives has states of its own .*current"),
        ("cmg-slew", "plant: GimbalServos has states of its own .*servo_integral"),
        ("no-such", "no scenario"),
    ],
)
def test_what_has_no_linear_model_is_refused(
    scenario: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InputError, match=said):
        mjspace.linearize(scenario)
    assert command_line("linearize", scenario, "--out", str(tmp_path / "plant.npz")) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_file_holds_it_all(rigid: Path, tmp_path: Path) -> None:
    path = tmp_path / "plant.npz"
    assert command_line("linearize", str(rigid), "--out", str(path)) == 0
    plant = mjspace.linearize(rigid)
    with np.load(path) as read:  # without pickles
        assert set(read.files) == set(vars(plant))
        for name in read.files:
            np.testing.assert_array_equal(read[name], getattr(plant, name))
    with pytest.raises(OSError, match="No such file"):
        plant.save(tmp_path / "none" / "plant.npz")


STEP = 2e-4
TWO = [
    *(f"rates.physics={STEP}", f"rates.control={STEP}", f"duration={2 * STEP}", "events=[]"),
    *("checks=[]", "law={kind='coast:Coast'}", "initial.velocity=[0.1,0,0]"),
    *("initial.rate=[0.2,-0.1,0.15]", "initial.wheel_speed=[20,-30,10]"),
    "sensors.navigation={measures='model',of='dock_attitude',noise_std='0.1 deg'}",
]
APART = [f"plant.spacecraft.target.{key}" for key in ("velocity=[0,0.1,0]", "rate=[0.3,0.2,-0.4]")]
DOCKED = [
    "plant.spacecraft={target={mass=40,inertia=[[4,0.1,0],[0.1,3,0],[0,0,5]],"
    "ports={drogue={position=[-0.4,0,0.1],euler=[0.2,0,0.3]}}}}",
    "plant.connections.dock={between=['probe','target_drogue'],closed=true,frequency=0.2}",
]


@pytest.mark.parametrize("overrides", [APART, DOCKED], ids=["apart", "docked"])
def test_two_spacecraft_move_and_are_seen_as_they_fly(overrides: list[str]) -> None:
    """Differences of two flights of tumbling spacecraft: all states, and relative navigation."""
    plant = mjspace.linearize("tumbling-target-capture", [*TWO, *overrides])
    built = assembly("tumbling-target-capture", *TWO, *overrides)
    model, nominal = built.vehicle.model, initial_physics(built, 1)[0]
    wheels = set(built.vehicle.wheel_dof)  # on whose angles nothing depends
    kept = [i for i in range(2 * model.nv) if i not in wheels]
    data, other = mujoco.MjData(model), mujoco.MjData(model)

    def flight(error: np.ndarray) -> Flown:
        """Fly from a state with an ``error`` in the coordinates of ``qvel``, and in ``qvel``."""
        mujoco.mj_setState(model, data, nominal, INTEGRATION)
        mujoco.mj_integratePos(model, data.qpos, error[: model.nv], 1.0)
        data.qvel[:] += error[model.nv :]
        row = np.empty((1, len(nominal)))
        mujoco.mj_getState(model, data, row[0], INTEGRATION)
        return flown(built, start=start_at(built, row, [0]))

    def between(one: np.ndarray, two: np.ndarray) -> np.ndarray:
        """Return the error of the second state from the first."""
        for each, row in ((data, one), (other, two)):
            mujoco.mj_setState(model, each, row, INTEGRATION)
        apart = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, apart, 1.0, data.qpos, other.qpos)
        return np.concatenate([apart, other.qvel - data.qvel])[kept]

    outputs = np.array([name.partition("[")[0] for name in plant.outputs])
    random, size = np.random.default_rng(7), 1e-4
    for _ in range(3):
        error = np.zeros(2 * model.nv)
        error[kept] = random.normal(size=len(kept))
        up, down = (flight(sign * size * error).rows for sign in (1.0, -1.0))
        physics = zip(down["/state.physics"][:, 0], up["/state.physics"][:, 0], strict=True)
        states = [between(*rows) / (2.0 * size) for rows in physics]
        derivative = (-3.0 * states[0] + 4.0 * states[1] - states[2]) / (2.0 * STEP)
        # Differences: of (2 pi f)^3 h^2 / 3 in time, size^2 / 6 in the states.
        np.testing.assert_allclose(plant.A @ error[kept], derivative, atol=1e-5)
        np.testing.assert_allclose(plant.Ad @ error[kept], states[1], atol=1e-7)
        for name in dict.fromkeys(outputs):
            topic = "dock_attitude" if name == "navigation" else name
            one, two = (rows[f"/truth.{topic}"][0, 0] for rows in (down, up))
            seen = two - one
            if topic.endswith("attitude"):
                seen = attitude.multiply(attitude.conjugate(one), two)
                seen = attitude.to_rotation_vector(seen)
            expected = plant.C[outputs == name] @ error[kept]
            np.testing.assert_allclose(seen / (2.0 * size), expected, atol=1e-6, err_msg=name)
    assert {"navigation", "target_position", "target_velocity", "dock_rate"} <= set(outputs)


JOINTED = """
<mujoco>
  <worldbody>
    <body name="bus">
      <freejoint/>
      <inertial pos="0 0 0" mass="10" diaginertia="1 2 2.5"/>
      <body name="head" pos="0 0 0.3">
        <joint name="neck" type="ball"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.2 0.25"/>
      </body>
    </body>
    <body name="moon" pos="3 0 0">
      <freejoint/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.3 0.2 0.4"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_each_joint_that_turns_freely_has_its_kinematics_and_names(tmp_path: Path) -> None:
    """attitude' = rate - w x attitude, of a second free body and of a ball joint."""
    path = write(tmp_path, JOINTED)
    turning = "plant.spacecraft.moon={rate=[0.3,-0.1,0.2],velocity=[0,1,0]}"
    plant = mjspace.linearize(path, ["initial.rate=[0,0,0.5]", turning])
    rates = {"": [0.0, 0.0, 0.5], "moon.": [0.3, -0.1, 0.2], "neck.": [0.0, 0.0, 0.0]}
    for name, turning_at in rates.items():
        of_itself = block(plant, "A", f"{name}attitude", f"{name}attitude")
        np.testing.assert_array_equal(of_itself, -cross(np.array(turning_at)))
        np.testing.assert_array_equal(
            block(plant, "A", f"{name}attitude", f"{name}rate"), np.eye(3)
        )
    np.testing.assert_array_equal(block(plant, "A", "moon.position", "moon.velocity"), np.eye(3))
    inertia, rate = np.diag([0.3, 0.2, 0.4]), np.array([0.3, -0.1, 0.2])
    of_rates = np.linalg.solve(inertia, cross(inertia @ rate) - cross(rate) @ inertia)
    np.testing.assert_allclose(block(plant, "A", "moon.rate", "moon.rate"), of_rates, atol=1e-9)
    units = dict(zip(plant.states, plant.state_units, strict=True))
    assert [units[f"{name}[2]"] for name in ("moon.position", "neck.attitude", "moon.rate")] == [
        *("m", "rad", "rad/s")
    ]
    assert len(set(plant.states)) == len(plant.states) == 30
