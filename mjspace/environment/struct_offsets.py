"""Where native callbacks find the fields of mjModel and mjData: laid out and verified at start-up.

MuJoCo publishes its structs' declarations in ``mujoco.introspect``; ctypes lays them out by the
platform's rules, and each offset is then compared with what the binding says of a small model.
"""

import ctypes
import functools
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco.introspect import structs

WORD = 8
"""Size [bytes] of every field listed here and the unit of their offsets."""

_SCALARS: dict[str, Any] = {
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "mjtNum": ctypes.c_double,
    "mjtSize": ctypes.c_int64,
    "mjtBool": ctypes.c_bool,
    "mjtByte": ctypes.c_ubyte,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
}

_NOT_LAID_OUT = (
    f"mujoco {mujoco.__version__} is not laid out as its introspect module says; "
    "reinstall mujoco or use another version"
)

# Every array is non-empty, so that no pointer is null, and every scalar has a value of its own.
_PROBE = """
<mujoco>
  <option timestep="0.00307"/>
  <size nuserdata="11"/>
  <worldbody>
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body>
        <joint name="hinge" axis="0 0 1"/>
        <inertial pos="1 0 0" mass="1" diaginertia="1 1 1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="hinge"/></actuator>
  <sensor><user dim="5"/></sensor>
</mujoco>
"""


class ModelOffsets(NamedTuple):
    """Offsets [words] of fields of mjModel; a field of ``opt`` has that prefix."""

    nq: int
    nv: int
    nbody: int
    nuserdata: int
    opt_timestep: int
    body_rootid: int
    body_weldid: int
    body_dofnum: int
    body_dofadr: int
    body_parentid: int
    body_mass: int
    body_subtreemass: int
    body_inertia: int
    dof_parentid: int


class DataOffsets(NamedTuple):
    """Offsets [words] of fields of mjData."""

    time: int
    qpos: int
    qvel: int
    ctrl: int
    qfrc_applied: int
    xfrc_applied: int
    userdata: int
    xipos: int
    ximat: int
    subtree_com: int
    cdof: int
    qfrc_passive: int
    sensordata: int


@functools.cache
def find() -> tuple[ModelOffsets, DataOffsets]:
    """Return the verified offsets of this process's MuJoCo.

    Raises:
        RuntimeError: the layout is not that of the library as loaded.
    """
    model_layout, data_layout = layout("mjModel"), layout("mjData")
    model_at = ModelOffsets(*(_offset(model_layout, name) for name in ModelOffsets._fields))
    data_at = DataOffsets(*(_offset(data_layout, name) for name in DataOffsets._fields))
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    data.time = 0.0471
    verify(model, model_at, ctypes.sizeof(model_layout))
    verify(data, data_at, ctypes.sizeof(data_layout))
    return model_at, data_at


@functools.cache
def most_constraints() -> int:
    """Return the verified offset [bytes] of mjData's ``maxuse_efc``, an int.

    Raises:
        RuntimeError: the layout is not that of the library as loaded.
    """
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(_PROBE))
    data.maxuse_efc = number = 0x5F3A71
    place = int(layout("mjData").maxuse_efc.offset)
    if ctypes.c_int.from_address(data._address + place).value != number:
        raise RuntimeError(f"mjData.maxuse_efc is not at byte {place}: {_NOT_LAID_OUT}")
    return place


def verify(struct: Any, offsets: ModelOffsets | DataOffsets, size: int) -> None:
    """Compare what lies at ``offsets`` [words] in ``struct`` with what the Python binding reports.

    ``struct`` is an MjModel or MjData of ``size`` bytes. Fields are read in rising order and none
    beyond the first mismatch, so that a wrong layout is reported, not walked off.

    Raises:
        RuntimeError: a field is not where its offset says.
    """
    kind = type(struct).__name__
    for name, word in sorted(offsets._asdict().items(), key=lambda item: item[1]):
        if not 0 <= word * WORD <= size - WORD:
            raise RuntimeError(f"{kind}.{name}: offset {word * WORD} is outside its {size} bytes")
        value = _binding(struct, name)
        expected = value.ctypes.data if isinstance(value, np.ndarray) else value
        scalar = ctypes.c_double if isinstance(expected, float) else ctypes.c_int64
        found = scalar.from_address(struct._address + word * WORD).value
        if found != expected:
            raise RuntimeError(
                f"{kind}.{name}: found {found!r} at byte {word * WORD}, expected {expected!r}: "
                f"{_NOT_LAID_OUT}"
            )


@functools.cache
def layout(name: str) -> type[ctypes.Structure]:
    """Return the struct ``name`` of MuJoCo's C interface as a ctypes type."""
    return _structure(name, structs.STRUCTS[name].fields)


def _structure(name: str, fields: Any) -> type[ctypes.Structure]:
    members = [(field.name, _ctype(field.type)) for field in fields]
    return type(name, (ctypes.Structure,), {"_fields_": members})


def _ctype(declared: Any) -> Any:
    match type(declared).__name__:
        case "PointerType":
            return ctypes.c_void_p
        case "ArrayType":
            return _ctype(declared.inner_type) * int(np.prod(declared.extents))
        case "AnonymousStructDecl":
            return _structure("anonymous", declared.fields)
    if declared.name in structs.STRUCTS:
        return layout(declared.name)
    if declared.name not in _SCALARS:
        raise RuntimeError(f"mujoco {mujoco.__version__} has a member of unknown type {declared}")
    return _SCALARS[declared.name]


def _path(name: str) -> list[str]:
    return name.split("_", 1) if name.startswith("opt_") else [name]


def _offset(struct: Any, name: str) -> int:
    total = 0
    for part in _path(name):
        if not hasattr(struct, part):
            raise RuntimeError(f"mujoco {mujoco.__version__}: {struct.__name__} has no {part}")
        total += getattr(struct, part).offset
        struct = dict(struct._fields_)[part]
    return total // WORD


def _binding(struct: Any, name: str) -> Any:
    for part in _path(name):
        struct = getattr(struct, part)
    return struct
