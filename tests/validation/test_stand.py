"""The test stand: loads at every stage, loads held, faults that are really in the model."""

from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment.orbit import Orbit
from mjspace.scenario.environment import Environment
from mjspace.validation import meter, stand
from mjspace.validation.benchmark import Conditions

ORBIT = Environment(orbit=Orbit(semi_major_axis=7.0e6))
STEP = Conditions(0.05)


def pushed(model: Any, data: Any, time: float) -> Array:
    """A torque about z that grows with the square of time: RK4 integrates it without error."""
    force = np.zeros(model.nv)
    force[5] = 14.0 * time**2
    return force


def rate_after_a_second(conditions: Conditions) -> float:
    model = stand.build(conditions, "tumbler")
    record = stand.fly(conditions, model, stand.start(model), 1.0, load=pushed)
    return float(record.qvel[-1, 5])


def test_loads_are_evaluated_at_every_stage() -> None:
    assert rate_after_a_second(STEP) == pytest.approx(1.0 / 3.0, rel=1e-14)


def test_a_held_load_is_that_of_the_start_of_its_step() -> None:
    starts = 0.05 * np.arange(20)
    held = rate_after_a_second(Conditions(0.05, fault="held"))
    assert held == pytest.approx(np.sum(starts**2) * 0.05, rel=1e-14)


def test_the_native_environment_can_be_held_too() -> None:
    ends = []
    for fault in (None, "held"):
        conditions = Conditions(20.0, fault=fault)
        model = stand.build(conditions, "tumbler", outside=ORBIT)
        data = stand.start(model, ORBIT)
        data.qpos[3:7] = [0.9, 0.1, 0.4, 0.1]
        ends.append(stand.fly(conditions, model, data, 2000.0).qvel[-1, 3:6])
    assert 1e-6 < np.linalg.norm(ends[1] - ends[0]) < 0.1 * np.linalg.norm(ends[0])


def test_the_environment_is_back_after_a_load() -> None:
    rate_after_a_second(STEP)
    model = stand.build(STEP, "tumbler", outside=ORBIT)
    data = stand.start(model, ORBIT)
    data.qpos[3:7] = [0.9, 0.1, 0.4, 0.1]
    mujoco.mj_forward(model, data)
    assert np.any(data.qfrc_passive)


def test_faults_are_in_the_model() -> None:
    sound, heavy, uneven = (
        stand.build(Conditions(0.05, fault=fault), "tumbler")
        for fault in (None, "armature", "inertia")
    )
    np.testing.assert_allclose(heavy.dof_armature[3:6], [1.0, 1.2, 1.4], rtol=1e-15)
    # MuJoCo's own order of the principal moments
    np.testing.assert_allclose(uneven.body_inertia[1] / sound.body_inertia[1], [1.01, 0.99, 1.01])
    assert stand.build(Conditions(0.05, fault="integrator"), "tumbler").opt.integrator == 0
    jointed = stand.build(Conditions(0.05, fault="armature"), "offset_gimbals")
    assert np.all(jointed.dof_armature[:6] == 0.0)
    assert np.all(jointed.dof_armature[6:] > 0.0)


def test_a_flight_that_is_lost_ends_with_what_is_not_finite() -> None:
    def mad(model: Any, data: Any, time: float) -> Array:
        return np.full(model.nv, np.nan if time > 0.5 else 0.0)

    model = stand.build(STEP, "tumbler")
    record = stand.fly(STEP, model, stand.start(model), 1.0, load=mad)
    assert record.time[-1] < 0.7
    assert not np.all(np.isfinite(record.qvel[-1]))
    assert np.all(np.isfinite(record.qvel[:-1]))


def test_the_meter_agrees_with_mujoco() -> None:
    model = stand.build(STEP, "offset_gimbals")
    data = stand.start(model)
    data.qvel[:] = np.random.default_rng(1).normal(size=model.nv)
    record = stand.fly(STEP, model, data, 0.5, samples=5)
    for row in range(len(record.time)):
        data.qpos[:], data.qvel[:] = record.qpos[row], record.qvel[row]
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        mujoco.mj_energyVel(model, data)
        total = model.body_mass.sum() * data.subtree_linvel[0]
        for ours, theirs in (
            (meter.angular_momentum(record)[row], data.subtree_angmom[0]),
            (meter.linear_momentum(record)[row], total),
            (meter.centre_of_mass(record)[row], data.subtree_com[0]),
        ):
            np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)
        assert meter.kinetic_energy(record)[row] == pytest.approx(data.energy[1], rel=1e-12)


TWO_AND_A_STAND = """
<mujoco>
  <option gravity="0 0 -10"/>
  <worldbody>
    <body pos="0 0 50"><inertial pos="0 0 0" mass="100" diaginertia="1 1 1"/></body>
    <body><freejoint/><inertial pos="0 0.5 0" mass="1" diaginertia="0.3 0.4 0.5"/></body>
    <body><freejoint/><inertial pos="0 0 0" mass="3" diaginertia="2 1 1.5"/></body>
  </worldbody>
</mujoco>
"""


def test_what_flies_apart_counts_and_what_stands_does_not() -> None:
    """Two bodies, the first with its centre of mass beside its origin; the sums are by hand."""
    model = mujoco.MjModel.from_xml_string(TWO_AND_A_STAND)
    qpos = np.array([[1.0, -0.5, 0, 1, 0, 0, 0, -1.0, 0, 0, 1, 0, 0, 0]])
    # The first turns about x, so that its centre of mass moves by 4 * 0.5 along z too.
    qvel = np.array([[0, 2.0, 0, 4.0, 0, 0, 0, 0, -1.0, 0, 3.0, 0]])
    record = stand.Record(model, np.zeros(1), qpos, qvel)
    np.testing.assert_allclose(meter.centre_of_mass(record), [[-0.5, 0, 0]], atol=1e-15)
    # 1 kg at (0, 2, 2) m/s and 3 kg at (0, 0, -1) m/s
    np.testing.assert_allclose(meter.linear_momentum(record), [[0, 2, -1]], atol=1e-15)
    # 3/4 kg of reduced mass, 2 m apart along x, at (0, 2, 3) m/s; and the spins
    spins = [0.3 * 4.0, 1.0 * 3.0, 0.0]
    np.testing.assert_allclose(
        meter.angular_momentum(record), [np.add([0, -4.5, 3], spins)], rtol=1e-15
    )
    turning = 0.5 * (0.3 * 16.0 + 1.0 * 9.0)
    assert meter.kinetic_energy(record) == pytest.approx([0.5 * 8.0 + 0.5 * 3.0 + turning])


SPRINGS = """
<mujoco>
  <option gravity="0 0 -10"/>
  <worldbody>
    <body>
      <joint name="slide" type="slide" axis="0 0 1" stiffness="8"/>
      <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
    </body>
  </worldbody>
  <tendon><fixed stiffness="6" springlength="0.5"><joint joint="slide" coef="1"/></fixed></tendon>
</mujoco>
"""


def test_potential_energy_is_of_height_joints_and_tendons() -> None:
    model = mujoco.MjModel.from_xml_string(SPRINGS)
    height = np.array([0.0, 1.0, -0.5])
    record = stand.Record(model, np.arange(3.0), height[:, None], np.ones((3, 1)))
    energy = 2.0 * 10.0 * height + 0.5 * 8.0 * height**2 + 0.5 * 6.0 * (height - 0.5) ** 2
    np.testing.assert_allclose(meter.potential_energy(record), energy, rtol=1e-15)


def test_drift_is_the_largest_departure_from_the_first_row() -> None:
    vectors = np.array([[3.0, 4.0], [3.0, 4.5], [0.0, 0.0], [3.0, 3.0]])
    assert meter.drift(vectors) == pytest.approx(1.0, rel=1e-15)  # 5 of 5
    assert meter.drift(vectors[:2]) == pytest.approx(0.1, rel=1e-15)
    assert meter.drift(vectors, scale=2.0) == pytest.approx(2.5, rel=1e-15)
    assert meter.drift(np.array([-4.0, -4.0, -3.0])) == 0.25  # of a scalar
    assert meter.drift(vectors[:1]) == 0.0


def test_phases_join_to_one_record() -> None:
    model = stand.build(STEP, "tumbler")
    data = stand.start(model)
    parts = [stand.fly(STEP, model, data, 1.0, samples=4) for _ in range(2)]
    whole = stand.joined(*parts)
    np.testing.assert_allclose(whole.time, np.arange(9) * 0.25, atol=1e-12)
    assert whole.qpos.shape == (9, 7)
