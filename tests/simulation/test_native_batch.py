"""MuJoCo's batch through its C interface, against MuJoCo's own in Python."""

import ctypes
import gc
import weakref
from typing import Any

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch, SimulationError

from mjspace.environment import struct_offsets
from mjspace.simulation import native_batch
from mjspace.simulation.native_batch import NativeBatch, address

PENDULUM = """
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <body name="pole">
      <joint name="hinge" axis="0 1 0"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -1" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor joint="hinge"/></actuator>
</mujoco>
"""
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def rows(model: Any, vehicles: int) -> np.ndarray:
    """Return states of as many pendulums, no two alike."""
    data = mujoco.MjData(model)
    states = np.empty((vehicles, mujoco.mj_stateSize(model, STATE)))
    for vehicle, row in enumerate(states):
        data.qpos, data.qvel, data.ctrl = 0.1 + vehicle, -0.2 * vehicle, 0.3
        mujoco.mj_getState(model, data, row, STATE)
    return states


@pytest.fixture(scope="module")
def pendulum() -> Any:
    return mujoco.MjModel.from_xml_string(PENDULUM)


@pytest.mark.parametrize("threads", [1, 2])
def test_states_are_those_of_mujocos_own_batch(pendulum: Any, threads: int) -> None:
    masses = np.tile(pendulum.body_mass, (5, 1)) * np.arange(1.0, 6.0)[:, None]
    inertias = np.tile(pendulum.body_inertia, (5, 1, 1)) * np.arange(1.0, 6.0)[:, None, None]
    fields = {"body_mass": masses, "body_inertia": inertias}
    native, own = NativeBatch(pendulum, 5, threads, fields), Batch(pendulum, 5, threads)
    for name, values in fields.items():
        own.expand(name)[:] = values
    own.set_const()
    native.state[...] = own.state[...] = rows(pendulum, 5)
    for _ in range(20):
        native.apply(address("mj_step"), 0)
        own.step()
        assert native.state.tobytes() == own.state.tobytes()
    assert not native.warning.any()
    assert len(np.unique(native.state[:, 1])) == 5
    # And without the fields, they move otherwise.
    alike = NativeBatch(pendulum, 5, threads, {})
    alike.state[...] = rows(pendulum, 5)
    alike.apply(address("mj_step"), 0)
    native.state[...] = rows(pendulum, 5)
    native.apply(address("mj_step"), 0)
    assert (alike.state[1:] != native.state[1:]).any(axis=1).all()


def test_fields_may_follow_those_of_another_batch(pendulum: Any) -> None:
    native, own = NativeBatch(pendulum, 3, 2, {}), Batch(pendulum, 3, 1)
    native.state[...] = own.state[...] = rows(pendulum, 3)
    for heavier in (1.0, 3.0, 2.0):
        mass = own.expand("body_mass")
        mass[:, 1] = heavier * np.arange(1.0, 4.0)
        own.set_const()
        native.follow({"body_mass": mass})
        native.apply(address("mj_step"), 0)
        own.step()
        assert native.state.tobytes() == own.state.tobytes()


def test_what_a_function_changes_of_its_threads_model_is_gone_at_the_next_vehicle(
    pendulum: Any,
) -> None:
    word, found = struct_offsets.find()[0].body_mass, []

    def halve(model: int, data: int, vehicle: int, argument: int) -> None:
        address = ctypes.c_int64.from_address(model + struct_offsets.WORD * word).value
        mass = (ctypes.c_double * 2).from_address(address)
        found.append(mass[1])
        mass[1] *= 0.5

    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2, ctypes.c_int, ctypes.c_void_p)
    function = kind(halve)
    native = NativeBatch(pendulum, 3, 1, {}, {"body_mass"})
    for _ in range(2):
        native.apply(ctypes.cast(function, ctypes.c_void_p).value, 0)
    assert found == [1.0] * 6
    assert pendulum.body_mass[1] == 1.0


def test_warnings_are_counted_by_vehicle_and_kind(pendulum: Any) -> None:
    native, own = NativeBatch(pendulum, 3, 1, {}), Batch(pendulum, 3, 1)
    states = rows(pendulum, 3)
    states[1, 2] = np.inf  # its velocity
    native.state[...] = own.state[...] = states
    native.apply(address("mj_step"), 0)
    own.step()
    np.testing.assert_array_equal(native.warning, own.warning)
    kinds = np.flatnonzero(native.warning[1, :, 1])
    assert [mujoco.mjtWarning(int(kind)).name for kind in kinds] == ["mjWARN_BADQVEL"]
    assert not native.warning[[0, 2]].any()


WELDED = PENDULUM.replace("<actuator>", "<equality><weld body1='pole'/></equality><actuator>")


def test_an_error_of_mujoco_is_raised_and_names_the_vehicles() -> None:
    model = mujoco.MjModel.from_xml_string(WELDED)
    model.eq_type[0] = 99  # no kind of constraint
    batch, own = NativeBatch(model, 3, 1, {}), Batch(model, 3, 1)
    with pytest.raises(SimulationError, match=r"3 of 3 simulations .* simulation 0: ") as raised:
        batch.apply(address("mj_step"), 0)
    with pytest.raises(SimulationError) as of_own:
        own.step()
    assert str(raised.value) == str(of_own.value)
    np.testing.assert_array_equal(raised.value.ids, [0, 1, 2])
    assert batch.state.tobytes() == own.state.tobytes()  # as before


def test_fields_that_mujoco_refuses_raise() -> None:
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint type='slide'/>"
        "<geom size='0.1' mass='1' contype='0' conaffinity='0'/></body></worldbody></mujoco>"
    )
    masses = np.tile(model.body_mass, (3, 1))
    masses[1, 1] = 0.0
    with pytest.raises(SimulationError) as raised:
        NativeBatch(model, 3, 1, {"body_mass": masses})
    np.testing.assert_array_equal(raised.value.ids, [1])


def test_a_batch_that_cannot_be_made_says_why(pendulum: Any) -> None:
    with pytest.raises(ValueError, match=r".{5}"):
        NativeBatch(pendulum, 0, 1, {})


def test_it_is_freed_when_nothing_of_it_is_held(
    pendulum: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    freed: list[int] = []
    library = native_batch.library()
    delete = library.mjb_deleteBatch

    def deleted(batch: int) -> None:
        freed.append(batch)
        delete(batch)

    monkeypatch.setattr(library, "mjb_deleteBatch", deleted)
    batch = NativeBatch(pendulum, 2, 1, {})
    gone, state = weakref.ref(batch), batch.state
    del batch
    gc.collect()
    assert not freed
    state[...] = 0.0  # MuJoCo's memory, which is still there
    del state
    gc.collect()
    assert gone() is None
    assert len(freed) == 1


def test_mujocos_timers_stand_still_but_not_a_clock_of_the_users_own(pendulum: Any) -> None:
    step = int(mujoco.mjtTimer.mjTIMER_STEP)
    durations = []
    for clock in (iter(range(1000)).__next__, None):  # None: the one that the package installs
        mujoco.set_mjcb_time(clock)
        try:
            NativeBatch(pendulum, 1, 1, {})
            data = mujoco.MjData(pendulum)
            mujoco.mj_step(pendulum, data)
        finally:
            mujoco.set_mjcb_time(None)
        durations.append(data.timer[step].duration)
        assert data.timer[step].number == 1
    native_batch.stop_timers()
    assert durations[0] >= 1.0
    assert durations[1] == 0.0
