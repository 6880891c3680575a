"""Of a log's model only the numbers are taken: its structure is what the scenario compiles to."""

import gzip
import hashlib
import warnings
from typing import Any

import mujoco
import numpy as np
import pytest

from mjspace.errors import InputError
from mjspace.scenario.plant import PlantTable, Rates
from mjspace.vehicle.composition import ASSETS
from mjspace.vehicle.logged_model import OtherModelWarning, logged_model
from mjspace.vehicle.vehicle import build, from_mjb, packed, saved, to_mjb


@pytest.fixture(scope="module")
def here() -> Any:
    return build(PlantTable(), Rates(), userdata=40).model


def taken(here: Any, mjb: bytes, **metadata: str) -> Any:
    size = mujoco.mj_stateSize(here, mujoco.mjtState.mjSTATE_INTEGRATION)
    return logged_model(here, packed(mjb), metadata, (size,))


def changed(here: Any, **fields: Any) -> bytes:
    """Return the MJB of the model with the first number of some fields changed."""
    model = from_mjb(to_mjb(here))
    for name, value in fields.items():
        getattr(model, name).flat[0] = value
    return to_mjb(model)


def test_every_bit_of_its_numbers_is_kept(here: Any) -> None:
    assert taken(here, to_mjb(here)) is here
    mjb = changed(here, body_inertia=1.25, geom_rgba=0.125, qpos0=-0.0)
    assert to_mjb(taken(here, mjb)) == mjb
    model = from_mjb(to_mjb(here))
    model.opt.timestep, model.stat.extent = 0.0625, 3.0
    assert to_mjb(taken(here, to_mjb(model))) == to_mjb(model)


def test_a_model_that_was_compiled_elsewhere_is_the_same(here: Any) -> None:
    """How long the paths of its files are together is in it, and in older logs the paths."""
    own, (mjb, paths) = to_mjb(here), saved(here)
    longer = mjb[: paths.start] + b"/a" + mjb[paths.start :]
    at = own.index(here.npaths.to_bytes(8, "little"))
    longer = longer[:at] + (here.npaths + 2).to_bytes(8, "little") + longer[at + 8 :]
    assert to_mjb(taken(here, longer)) == own


def test_a_log_does_not_tell_where_its_files_were(here: Any) -> None:
    folder = str(ASSETS).encode()
    assert folder in here.paths
    assert folder not in to_mjb(here)
    assert from_mjb(to_mjb(here)).paths == bytes(here.npaths)


@pytest.mark.parametrize(
    "fields",
    [
        {"jnt_qposadr": 10**6},
        {"dof_parentid": 5},
        {"sensor_adr": -(10**6)},
        {"actuator_trnid": 99, "body_mass": 2.0},
        {"geom_type": 77},
    ],
)
def test_no_index_of_it_is_taken(here: Any, fields: dict[str, float]) -> None:
    with pytest.warns(OtherModelWarning, match="is not the one that its scenario compiles to here"):
        assert taken(here, changed(here, **fields)) is here


def test_whatever_its_bytes_are_no_structure_of_it_is_taken(here: Any) -> None:
    own, random = np.frombuffer(to_mjb(here), np.uint8), np.random.default_rng(0)
    structure = to_mjb(here)
    for _ in range(8):
        mjb = own.copy()
        mjb[random.integers(0, 5000, 3)] ^= random.integers(1, 256, 3, np.uint8)
        with warnings.catch_warnings(action="ignore", category=OtherModelWarning):
            model = taken(here, mjb.tobytes())
        for name in ("jnt_qposadr", "dof_parentid", "sensor_adr", "geom_type", "M_colind"):
            np.testing.assert_array_equal(getattr(model, name), getattr(here, name))
        assert len(to_mjb(model)) == len(structure)


def test_what_is_damaged_is_refused(here: Any) -> None:
    mjb, state = to_mjb(here), (mujoco.mj_stateSize(here, mujoco.mjtState.mjSTATE_INTEGRATION),)
    whole = packed(mjb)
    for data, message in (
        (b"no gzip", "cannot be unpacked"),
        (whole[: len(whole) // 2], "ends too early"),
        (gzip.compress(bytes(10**8), 1), "is larger than the model that its scenario compiles to"),
        (b"", "ends too early"),
    ):
        with pytest.raises(InputError, match=message):
            logged_model(here, data, {}, state)
    with pytest.raises(InputError, match="body_mass that are not finite"):
        taken(here, changed(here, body_mass=np.nan))
    with pytest.raises(InputError, match="is not the one that flew, by the log's digest"):
        taken(here, mjb, model_sha256=hashlib.sha256(b"x").hexdigest())
    taken(here, mjb, model_sha256=hashlib.sha256(whole).hexdigest())
    with pytest.raises(InputError, match=r"laid its state out differently: .* version 0\.9"):
        logged_model(here, whole, {"mjspace": "0.9"}, (3,))
