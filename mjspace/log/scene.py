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
FARTHEST = 1200.0
"""m: what of the world reaches farther is scenery, which would frame a viewer's picture."""
_GROUND = 100.0  # m, half the edge of an infinite plane as it is drawn
_THICKNESS = 0.02  # m, of a plane
_CELLS = 100  # of a height field, along an edge, as it is drawn


REFERENCE = "reference"
"""The frame of the desired attitude: at the desired position, or at the bus where none is."""
_AXES = 3  # the group of a bus's axes, as of its geom bus_axis_x
_HALO, _TRANSLUCENT = 2.2, 0.4  # the desired axes' thickness over the body's, and their opacity


class _Shape(NamedTuple):
    """A box, a cylinder along z, an ellipsoid or a mesh, in the axes of its body."""

    kind: str
    position: Array  # m
    quaternion: Array
    size: Array  # edge lengths or diameters [m] along the shape's axes
    color: Array
    mesh: tuple[Array, Array] | None = None  # vertices (n, 3) [m], faces (m, 3)


def scene(model: Any) -> Scene:
    """Return what viewers draw of an ``mujoco.MjModel``: each body's frame, and its shapes in it.

    The world's own shapes are in frame ``world``, but for scenery beyond ``FARTHEST``. A plane is a
    thin box, a height field a mesh of fewer cells; what has a texture has its mean color. URDF has
    no meshes of its own: they are left out of it, and an ellipsoid is the sphere of its volume.
    The last frame is ``REFERENCE``, where no body has that name: it has the bus's axes once more.
    """
    names = [model.body(i).name for i in range(model.nbody)]
    shapes = {name: list(_shapes(model, i)) for i, name in enumerate(names)}
    if model.nbody > 1 and REFERENCE not in names:
        shapes[REFERENCE] = [_halo(each) for i in _axes(model) for each in _shape(model, i)]
    return Scene(tuple(shapes)[1:], _update(shapes), _urdf(shapes))


def _axes(model: Any) -> list[int]:
    """Return the geoms of the axes that the bus, which the first joint moves, is drawn with."""
    bus = model.jnt_bodyid[0] if model.njnt else 0
    here = np.flatnonzero((model.geom_bodyid == bus) & (model.geom_group == _AXES))
    return [i for i in here.tolist() if "axis_" in model.geom(i).name]


def _halo(shape: _Shape) -> _Shape:
    """Return an axis as that of the desired attitude: thicker, and translucent."""
    long = np.argmax(shape.size) if shape.kind == "cylinder" else -1
    size = np.where(np.arange(3) == long, shape.size, _HALO * shape.size)
    return shape._replace(size=size, color=shape.color * [1.0, 1.0, 1.0, _TRANSLUCENT])


def _shapes(model: Any, body: int) -> Iterator[_Shape]:
    first, axes = model.body_geomadr[body], _axes(model)
    for i in range(first, first + model.body_geomnum[body]):
        reach = np.linalg.norm(model.geom_pos[i]) + model.geom_rbound[i]
        scenery = body == 0 and reach > FARTHEST
        if not scenery and (model.geom_group[i] < _SHOWN_GROUPS or i in axes):
            yield from _shape(model, i)


def _shape(model: Any, i: int) -> Iterator[_Shape]:
    """Yield the shapes of a geom, none of what is fully transparent."""
    color = _color(model, i)
    if color[3] > 0.0:
        kind, size = _GEOM(int(model.geom_type[i])), model.geom_size[i]
        at = model.geom_pos[i], model.geom_quat[i]
        if kind in (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_ELLIPSOID):
            radii = size if kind == _GEOM.mjGEOM_ELLIPSOID else size[[0, 0, 0]]
            yield _Shape("ellipsoid", *at, 2.0 * radii, color)
        elif kind == _GEOM.mjGEOM_BOX:
            yield _Shape("box", *at, 2.0 * size, color)
        elif kind == _GEOM.mjGEOM_PLANE:
            yield _plane(at, size, color)
        elif kind in (_GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_CAPSULE):
            yield _Shape("cylinder", *at, 2.0 * size[[0, 0, 1]], color)
        elif kind == _GEOM.mjGEOM_MESH:
            yield _Shape("mesh", *at, np.ones(3), color, _mesh(model, model.geom_dataid[i]))
        elif kind == _GEOM.mjGEOM_HFIELD:
            yield _Shape("mesh", *at, np.ones(3), color, _terrain(model, model.geom_dataid[i]))
        if kind == _GEOM.mjGEOM_CAPSULE:
            end = rotate(at[1], np.array([0.0, 0.0, size[1]]))
            for cap in (at[0] + end, at[0] - end):
                yield _Shape("ellipsoid", cap, at[1], 2.0 * size[[0, 0, 0]], color)


def _plane(at: tuple[Array, Array], size: Array, color: Array) -> _Shape:
    """Return a thin box below a plane, whose edges are infinite where they are 0."""
    edges = np.where(size[:2] > 0.0, 2.0 * size[:2], 2.0 * _GROUND)
    below = rotate(at[1], np.array([0.0, 0.0, -0.5 * _THICKNESS]))
    return _Shape("box", at[0] + below, at[1], np.array([*edges, _THICKNESS]), color)


def _mesh(model: Any, mesh: int) -> tuple[Array, Array]:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[first : first + count]
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return vertices, model.mesh_face[first : first + count]


def _terrain(model: Any, field: int) -> tuple[Array, Array]:
    """Return a height field as triangles, of its own vertices but not of all of them."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    first = model.hfield_adr[field]
    heights = model.hfield_data[first : first + rows * columns].reshape(rows, columns)
    half_x, half_y, height, _ = model.hfield_size[field]
    i, j = (np.unique(np.linspace(0, n - 1, min(n, _CELLS + 1)).round()) for n in (rows, columns))
    i, j = i.astype(int), j.astype(int)
    x, y = np.linspace(-half_x, half_x, columns)[j], np.linspace(-half_y, half_y, rows)[i]
    grid = np.stack([*np.meshgrid(x, y), height * heights[np.ix_(i, j)]], axis=-1)
    corner = (np.arange(len(i) - 1)[:, None] * len(j) + np.arange(len(j) - 1)).ravel()
    right, up, across = corner + 1, corner + len(j), corner + len(j) + 1
    faces = np.concatenate(
        [np.stack(t, axis=-1) for t in ((corner, right, across), (corner, across, up))]
    )
    return grid.reshape(-1, 3), faces


def _color(model: Any, geom: int) -> Array:
    """Return red, green, blue, alpha as MuJoCo draws them: its own before its material's.

    A material with a texture has the texture's mean color in place of each point's.
    """
    color: Array = model.geom_rgba[geom].astype(float)
    material = model.geom_matid[geom]
    if material < 0:
        return color
    if np.array_equal(color, [0.5, 0.5, 0.5, 1.0]):
        color = model.mat_rgba[material].astype(float)
    texture = model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB]
    if texture >= 0:
        first, channels = model.tex_adr[texture], model.tex_nchannel[texture]
        count = model.tex_height[texture] * model.tex_width[texture] * channels
        pixels = model.tex_data[first : first + count].reshape(-1, channels)
        mean = pixels[:, :3].mean(axis=0) / 255.0
        color = np.array([*(color[:3] * mean), color[3]])
    return color


def _update(shapes: dict[str, list[_Shape]]) -> bytes:
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
            if shape.mesh is not None:
                _add_mesh(primitive, *shape.mesh)
            else:
                _set(primitive.size, "xyz", shape.size)
            if shape.kind == "cylinder":
                primitive.bottom_scale = primitive.top_scale = 1.0
            _set(primitive.pose.position, "xyz", shape.position)
            _set(primitive.pose.orientation, "wxyz", shape.quaternion)
            _set(primitive.color, "rgba", shape.color)
    serialized: bytes = update.SerializeToString()
    return serialized


def _add_mesh(primitive: Any, vertices: Array, faces: Array) -> None:
    for vertex in vertices:
        _set(primitive.points.add(), "xyz", vertex)
    primitive.indices.extend(faces.ravel().tolist())


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
