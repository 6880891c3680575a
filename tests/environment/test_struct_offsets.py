"""Offsets into MuJoCo's structs are right, and wrong ones are refused before they are used."""

import ctypes

import mujoco
import numba
import pytest

from mjspace.environment import kernel, struct_offsets

_OTHER_MODEL = """
<mujoco>
  <option timestep="0.25"/>
  <size nuserdata="3"/>
  <worldbody>
    <body><freejoint name="first"/><geom size="1"/></body>
    <body pos="9 0 0"><freejoint/><geom size="2"/></body>
  </worldbody>
  <actuator><motor joint="first" gear="1 0 0 0 0 0"/></actuator>
  <sensor><clock/></sensor>
</mujoco>
"""
_SIZE = ctypes.sizeof(struct_offsets.layout("mjData"))


def test_offsets_hold_for_a_model_they_were_not_found_with() -> None:
    model_at, data_at = struct_offsets.find()
    model = mujoco.MjModel.from_xml_string(_OTHER_MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    struct_offsets.verify(model, model_at, ctypes.sizeof(struct_offsets.layout("mjModel")))
    struct_offsets.verify(data, data_at, _SIZE)


@pytest.mark.parametrize("field", struct_offsets.ModelOffsets._fields)
def test_a_shifted_model_field_is_named(field: str) -> None:
    model_at, _ = struct_offsets.find()
    model = mujoco.MjModel.from_xml_string(struct_offsets._PROBE)
    wrong = model_at._replace(**{field: getattr(model_at, field) + 1})
    with pytest.raises(RuntimeError, match=rf"MjModel\.{field}: found .* expected"):
        struct_offsets.verify(model, wrong, ctypes.sizeof(struct_offsets.layout("mjModel")))


@pytest.mark.parametrize("field", struct_offsets.DataOffsets._fields)
def test_a_shifted_data_field_is_named(field: str) -> None:
    _, data_at = struct_offsets.find()
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(struct_offsets._PROBE))
    data.time = 0.5
    wrong = data_at._replace(**{field: getattr(data_at, field) + 1})
    with pytest.raises(RuntimeError, match=rf"MjData\.{field}: found .* expected"):
        struct_offsets.verify(data, wrong, _SIZE)


def test_the_most_constraints_are_where_they_are_said_to_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(_OTHER_MODEL))
    data.maxuse_efc = 71
    place = data._address + struct_offsets.most_constraints()
    assert ctypes.c_int.from_address(place).value == 71
    wrong = type("Wrong", (ctypes.Structure,), {"_fields_": [("maxuse_efc", ctypes.c_int)]})
    monkeypatch.setattr(struct_offsets, "layout", lambda name: wrong)
    with pytest.raises(RuntimeError, match=r"maxuse_efc is not at byte 0: mujoco .* reinstall"):
        struct_offsets.most_constraints.__wrapped__()


@pytest.mark.parametrize("word", [-1, _SIZE // 8, 2**40])
def test_nothing_is_read_outside_the_struct(word: int) -> None:
    _, data_at = struct_offsets.find()
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(struct_offsets._PROBE))
    with pytest.raises(RuntimeError, match=r"MjData\.cdof: offset .* outside"):
        struct_offsets.verify(data, data_at._replace(cdof=word), _SIZE)


def test_other_offsets_are_never_given_cached_machine_code(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    model_at, data_at = struct_offsets.find()
    # a field in the middle, so that the number of words stays
    moved = data_at._replace(qfrc_passive=data_at.qfrc_passive - 1)

    def hits(offsets: struct_offsets.DataOffsets) -> int:
        return kernel.sensor_callback(model_at, offsets).cache_hits

    assert [hits(data_at), hits(data_at), hits(moved), hits(moved), hits(data_at)] == [
        0,
        1,
        0,
        1,
        1,
    ]
