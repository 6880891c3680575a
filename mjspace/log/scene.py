"""A compiled model's visible shapes for viewers: ``foxglove.SceneUpdate`` and URDF, by body."""

from collections.abc import Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjspace.attitude import rotate, to_euler_zyx
from mjspace.contract import Array
from mjspace.log.schema import Scene

_GEOM = mujoco.mjtGeom
_SHOWN_GROUPS = 3  # MuJoCo draws groups 0 to 2; what only collides is kept in higher ones


class _Shape(NamedTuple):
    """A box, a cylinder along z, an ellipsoid or a mesh, in the axes of its body."""

    kind: str
    position: Array  # m
    quaternion: Array
    size: Array  # edge lengths or diameters [m] along the shape's axes
    color: Array
    mesh: int


def scene(model: Any) -> Scene:
    """Return what viewers draw of an ``mujoco.MjModel``: each body's frame, and its shapes in it.

    The world's own shapes are in frame ``world``. Planes and height fields are left out; in URDF,
    which has neither, so are meshes, and an ellipsoid is the sphere of its volume.
    """
    names = [model.body(i).name for i in range(model.nbody)]
    shapes = {name: list(_shapes(model, i)) for i, name in enumerate(names)}
    return Scene(tuple(names[1:]), _update(model, shapes), _urdf(shapes))


def _shapes(model: Any, body: int) -> Iterator[_Shape]:
    first = model.body_geomadr[body]
    for i in range(first, first + model.body_geomnum[body]):
        color = _color(model, i)
        if model.geom_group[i] >= _SHOWN_GROUPS or color[3] == 0.0:
            continue
        kind, size = _GEOM(int(model.geom_type[i])), model.geom_size[i]
        at = model.geom_pos[i], model.geom_quat[i]
        if kind in (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_ELLIPSOID):
            radii = size if kind == _GEOM.mjGEOM_ELLIPSOID else size[[0, 0, 0]]
            yield _Shape("ellipsoid", *at, 2.0 * radii, color, -1)
        elif kind == _GEOM.mjGEOM_BOX:
            yield _Shape("box", *at, 2.0 * size, color, -1)
        elif kind in (_GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_CAPSULE):
            yield _Shape("cylinder", *at, 2.0 * size[[0, 0, 1]], color, -1)
        elif kind == _GEOM.mjGEOM_MESH:
            yield _Shape("mesh", *at, np.ones(3), color, model.geom_dataid[i])
        if kind == _GEOM.mjGEOM_CAPSULE:
            end = rotate(at[1], np.array([0.0, 0.0, size[1]]))
            for cap in (at[0] + end, at[0] - end):
                yield _Shape("ellipsoid", cap, at[1], 2.0 * size[[0, 0, 0]], color, -1)


def _color(model: Any, geom: int) -> Array:
    """Return red, green, blue, alpha as MuJoCo draws them: its own before its material's."""
    own: Array = model.geom_rgba[geom]
    material = model.geom_matid[geom]
    if material < 0 or not np.array_equal(own, np.array([0.5, 0.5, 0.5, 1.0], np.float32)):
        return own
    color: Array = model.mat_rgba[material]
    return color


def _update(model: Any, shapes: dict[str, list[_Shape]]) -> bytes:
    update = SceneUpdate()
    for body, drawn in shapes.items():
        entity = update.entities.add(frame_id=body, id=body, frame_locked=True)
        lists: dict[str, Any] = {
            "box": entity.cubes,
            "cylinder": entity.cylinders,
            "ellipsoid": entity.spheres,
            "mesh": entity.triangles,
        }
        for shape in drawn:
            primitive = lists[shape.kind].add()
            if shape.kind == "mesh":
                _add_mesh(primitive, model, shape.mesh)
            else:
                _set(primitive.size, "xyz", shape.size)
            if shape.kind == "cylinder":
                primitive.bottom_scale = primitive.top_scale = 1.0
            _set(primitive.pose.position, "xyz", shape.position)
            _set(primitive.pose.orientation, "wxyz", shape.quaternion)
            _set(primitive.color, "rgba", shape.color)
    serialized: bytes = update.SerializeToString()
    return serialized


def _add_mesh(primitive: Any, model: Any, mesh: int) -> None:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    for vertex in model.mesh_vert[first : first + count]:
        _set(primitive.points.add(), "xyz", vertex)
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    primitive.indices.extend(model.mesh_face[first : first + count].ravel().tolist())


def _set(message: Any, names: str, values: Array) -> None:
    for name, value in zip(names, values.tolist(), strict=True):
        setattr(message, name, value)


def _urdf(shapes: dict[str, list[_Shape]]) -> str:
    """Return every body as a link that floats in ``world``: where it is, /tf says."""
    robot = ElementTree.Element("robot", name="mjspace")
    for body, drawn in shapes.items():
        link = ElementTree.SubElement(robot, "link", name=body)
        for i, shape in enumerate(shape for shape in drawn if shape.kind != "mesh"):
            visual = ElementTree.SubElement(link, "visual")
            ElementTree.SubElement(
                visual,
                "origin",
                xyz=_numbers(shape.position),
                rpy=_numbers(to_euler_zyx(shape.quaternion)),
            )
            _add_solid(ElementTree.SubElement(visual, "geometry"), shape)
            material = ElementTree.SubElement(visual, "material", name=f"{body}_{i}")
            ElementTree.SubElement(material, "color", rgba=_numbers(shape.color))
        if body != "world":
            joint = ElementTree.SubElement(robot, "joint", name=f"{body}_frame", type="floating")
            ElementTree.SubElement(joint, "parent", link="world")
            ElementTree.SubElement(joint, "child", link=body)
    return ElementTree.tostring(robot, encoding="unicode")


def _add_solid(geometry: ElementTree.Element, shape: _Shape) -> None:
    x, y, z = shape.size.tolist()
    if shape.kind == "box":
        ElementTree.SubElement(geometry, "box", size=_numbers(shape.size))
    elif shape.kind == "cylinder":
        ElementTree.SubElement(geometry, "cylinder", radius=repr(x / 2), length=repr(z))
    else:
        ElementTree.SubElement(geometry, "sphere", radius=repr((x * y * z) ** (1 / 3) / 2))


def _numbers(values: Array) -> str:
    return " ".join(map(repr, values.tolist()))
