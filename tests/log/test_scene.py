"""The shapes that viewers draw are those of the compiled model, in the frames that /tf moves."""

import json
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from hypothesis import given
from hypothesis import strategies as st

from mjspace.contract import Array
from mjspace.log.foxglove_layout import MOST, SIGNALS, layout
from mjspace.log.scene import scene

TETRAHEDRON = "0 0 0  1 0 0  0 1 0  0 0 1"
MODEL = f"""
<mujoco>
  <asset>
    <material name="foil" rgba="0.75 0.5 0.25 1"/>
    <mesh name="tetrahedron" vertex="{TETRAHEDRON}" scale="0.5 0.5 0.5"/>
  </asset>
  <worldbody>
    <geom type="sphere" size="0.1"/>
    <body name="bus">
      <freejoint/>
      <geom name="box" type="box" material="foil" size="1 0.5 0.25" pos="0.1 0.2 0.3"/>
      <geom name="lens" type="ellipsoid" material="foil" size="0.1 0.2 0.4" rgba="0 1 0 0.5"/>
      <geom name="hull" type="box" size="2 2 2" group="3"/>
      <geom name="glass" type="box" size="2 2 2" rgba="1 1 1 0"/>
      <geom name="plate" type="mesh" mesh="tetrahedron" pos="1 2 3"/>
      <body name="wheel_0" pos="2 0 0">
        <joint axis="1 0 0"/>
        <geom type="cylinder" size="0.5 0.1" euler="0 90 0"/>
      </body>
      <body name="boom" pos="0 2 0">
        <joint/>
        <geom type="capsule" size="0.2 0.4" euler="90 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.fixture(scope="module")
def model() -> Any:
    return mujoco.MjModel.from_xml_string(MODEL)


@pytest.fixture(scope="module")
def entities(model: Any) -> dict[str, Any]:
    return {
        entity.frame_id: entity for entity in SceneUpdate.FromString(scene(model).update).entities
    }


@pytest.fixture(scope="module")
def robot(model: Any) -> Any:
    return ElementTree.fromstring(scene(model).urdf)


def xyz(message: Any) -> list[float]:
    return [message.x, message.y, message.z]


def color(message: Any) -> list[float]:
    return [message.r, message.g, message.b, message.a]


def test_each_body_is_a_frame_an_entity_and_a_link(
    model: Any, entities: dict[str, Any], robot: Any
) -> None:
    assert scene(model).bodies == ("bus", "wheel_0", "boom", "reference")
    assert set(entities) == {"world", "bus", "wheel_0", "boom", "reference"}
    assert [link.get("name") for link in robot.findall("link")] == [
        "world",
        "bus",
        "wheel_0",
        "boom",
        "reference",
    ]
    # One tree: each body but the world is the child of exactly one joint, as it is on /tf.
    joints = {
        joint.find("child").get("link"): joint.find("parent").get("link")
        for joint in robot.findall("joint")
    }
    assert joints == dict.fromkeys(scene(model).bodies, "world")
    assert len(robot.findall("joint")) == 4
    assert all(entity.frame_locked for entity in entities.values())


def test_sizes_are_whole_and_what_is_hidden_is_left_out(entities: dict[str, Any]) -> None:
    bus = entities["bus"]
    ((box,), (lens,)) = bus.cubes, bus.spheres
    assert (xyz(box.size), xyz(box.pose.position)) == ([2.0, 1.0, 0.5], [0.1, 0.2, 0.3])
    assert xyz(lens.size) == [0.2, 0.4, 0.8]
    (wheel,) = entities["wheel_0"].cylinders
    assert (xyz(wheel.size), wheel.bottom_scale, wheel.top_scale) == ([1.0, 1.0, 0.2], 1.0, 1.0)
    assert xyz(entities["world"].spheres[0].size) == [0.2, 0.2, 0.2]


def test_colors_are_those_that_mujoco_draws(model: Any, entities: dict[str, Any]) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    drawn = mujoco.MjvScene(model, maxgeom=100)
    mujoco.mjv_updateScene(
        model,
        data,
        mujoco.MjvOption(),
        None,
        mujoco.MjvCamera(),
        mujoco.mjtCatBit.mjCAT_ALL.value,
        drawn,
    )
    by_geom = {
        g.objid: g.rgba.tolist()
        for g in drawn.geoms[: drawn.ngeom]
        if g.objtype == mujoco.mjtObj.mjOBJ_GEOM
    }
    ((box,), (lens,)) = entities["bus"].cubes, entities["bus"].spheres
    assert color(box.color) == by_geom[model.geom("box").id] == [0.75, 0.5, 0.25, 1.0]
    assert color(lens.color) == by_geom[model.geom("lens").id] == [0.0, 1.0, 0.0, 0.5]
    assert model.geom("hull").id not in by_geom


def test_a_capsule_has_round_ends_where_mujoco_has_them(entities: dict[str, Any]) -> None:
    boom = entities["boom"]
    (rod,) = boom.cylinders
    assert xyz(rod.size) == [0.4, 0.4, 0.8]
    ends = np.array([xyz(cap.pose.position) for cap in boom.spheres])
    # z of the capsule is -y of the body; the tolerance is double rounding.
    np.testing.assert_allclose(np.sort(ends[:, 1]), [-0.4, 0.4], atol=1e-15)
    np.testing.assert_allclose(ends[:, [0, 2]], 0.0, atol=1e-15)


def test_a_mesh_is_drawn_where_it_was_modelled(entities: dict[str, Any]) -> None:
    (plate,) = entities["bus"].triangles
    q, p = plate.pose.orientation, xyz(plate.pose.position)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.array([q.w, q.x, q.y, q.z]))
    points = np.array([xyz(point) for point in plate.points]) @ matrix.reshape(3, 3).T + p
    vertices = 0.5 * np.array(TETRAHEDRON.split(), float).reshape(4, 3) + [1, 2, 3]
    # The compiler moves vertices to the mesh's principal axes and stores them in single precision.
    for vertex in vertices:
        assert np.linalg.norm(points - vertex, axis=1).min() < 1e-6
    corners = points[np.array(plate.indices).reshape(-1, 3)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Outward faces of a closed surface: their volume is positive, and the tetrahedron's.
    volume = np.einsum("ij,ij", corners[:, 0] - points.mean(0), normals) / 6
    np.testing.assert_allclose(volume, 0.5**3 / 6, rtol=1e-5)


def visuals(robot: Any) -> Iterator[tuple[str, Any]]:
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            yield link.get("name"), visual


def test_urdf_has_the_same_shapes(robot: Any) -> None:
    wanted: list[tuple[str, str, dict[str, Any]]] = [
        ("world", "sphere", {"radius": 0.1}),
        ("bus", "box", {"size": [2.0, 1.0, 0.5]}),
        ("bus", "sphere", {"radius": 0.2}),  # the cube root of 0.1 0.2 0.4
        ("wheel_0", "cylinder", {"radius": 0.5, "length": 0.2}),
        ("boom", "cylinder", {"radius": 0.2, "length": 0.8}),
        ("boom", "sphere", {"radius": 0.2}),
        ("boom", "sphere", {"radius": 0.2}),
    ]
    for (link, visual), (body, kind, sizes) in zip(visuals(robot), wanted, strict=True):
        (solid,) = visual.find("geometry")
        assert (link, solid.tag, set(solid.attrib)) == (body, kind, set(sizes))
        for key, size in sizes.items():
            written = np.array(solid.get(key).split(), float)
            np.testing.assert_allclose(written, size, rtol=1e-14)  # a cube root's roundings
    materials = {visual.find("material").get("name") for _, visual in visuals(robot)}
    assert len(materials) == len(wanted)


def turned(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    plane = np.array([[c, -s], [s, c]])
    matrix = np.eye(3)
    others = [(1, 2), (2, 0), (0, 1)][axis]
    matrix[np.ix_(others, others)] = plane
    return matrix


@given(st.tuples(*[st.sampled_from([-180, -90, -30, 0, 45, 90, 89.999999, 180])] * 3))
def test_urdf_angles_are_the_geoms_orientation(angles: tuple[float, ...]) -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="b"><joint/><geom size="1 1 1" type="box" '
        f'euler="{" ".join(map(str, angles))}"/></body></worldbody></mujoco>'
    )
    ((_, visual),) = visuals(ElementTree.fromstring(scene(model).urdf))
    roll, pitch, yaw = map(float, visual.find("origin").get("rpy").split())
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[0])
    built = turned(2, yaw) @ turned(1, pitch) @ turned(0, roll)
    # Near a pitch of 90 deg the arc tangents keep about half the digits of the angles, not of the
    # rotation that they make up.
    np.testing.assert_allclose(built, matrix.reshape(3, 3), atol=1e-14)


SATELLITE = {
    "/truth": {"attitude_error": (1,), "rate": (3,), "wheel_speed": (4,), "velocity": (3,)},
    "/command": {"torque": (3,)},
}
LANDER = {
    "/truth": {"altitude": (1,), "velocity": (3,), "thrust": (1,), "wheel_speed": (0,)},
    "/command": {"on_time": (28,)},
}


def paths_of(topics: Any) -> list[str]:
    found = layout("hub", topics).decode()
    whole = json.loads(found)
    panels = re.findall(r"(?:3D|RosOut|Plot)!\w+", json.dumps(whole["layout"]))
    assert sorted(panels) == sorted(whole["configById"])
    return re.findall(r'"value": "([^"]+)"', found)


def test_the_layout_shows_what_flew() -> None:
    assert paths_of(SATELLITE) == [
        "/truth.attitude_error",
        *(f"/truth.rate[{i}]" for i in range(3)),
        *(f"/command.torque[{i}]" for i in range(3)),
        *(f"/truth.wheel_speed[{i}]" for i in range(4)),
    ]
    lander = paths_of(LANDER)
    assert lander[:2] == ["/truth.altitude", "/truth.velocity[0]"]
    assert sum(path.startswith("/command.on_time") for path in lander) == 12
    assert not any("wheel" in path for path in lander)
    assert paths_of({}) == []


def test_at_most_eight_plots_stand_beside_the_picture() -> None:
    every: dict[str, dict[str, tuple[int, ...]]] = {"/truth": {"altitude": (1,)}}
    for _, topic, field in SIGNALS:
        every.setdefault(topic, {})[field] = (1,)
    assert len(paths_of(every)) == MOST


def test_textures_have_their_mean_color_and_scenery_is_left_out() -> None:
    model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <asset>
    <texture name="half" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1"
             width="8" height="8"/>
    <material name="half" texture="half" rgba="0.5 1 1 0.75"/>
    <hfield name="hill" nrow="2" ncol="3" size="4 6 0.5 1" elevation="0 1 0 0 0 1"/>
  </asset>
  <worldbody>
    <geom type="plane" size="5 0 1" material="half"/>
    <geom type="hfield" hfield="hill" pos="0 0 1"/>
    <geom type="sphere" size="1000" pos="29000 0 0"/>
  </worldbody>
</mujoco>""")
    (world,) = SceneUpdate.FromString(scene(model).update).entities
    assert not world.spheres
    (plane,) = world.cubes
    color = plane.color
    assert [color.r, color.g, color.b, color.a] == pytest.approx([0.25, 0.0, 0.5, 0.75], abs=2e-3)
    assert [plane.size.x, plane.size.y] == [10.0, 200.0]
    assert plane.pose.position.z == pytest.approx(-plane.size.z / 2.0)  # its top is the plane
    (hill,) = world.triangles
    points = np.array([[p.x, p.y, p.z] for p in hill.points])
    right = [[-4, -6, 0], [0, -6, 0], [4, -6, 0.5], [-4, 6, 0], [0, 6, 0.5], [4, 6, 0]]
    assert np.allclose(points, right)
    data, hit = mujoco.MjData(model), np.zeros(1, np.int32)
    mujoco.mj_forward(model, data)
    above = np.array([3.99, -5.99, 11.0]), np.array([0.0, 0.0, -1.0])
    assert mujoco.mj_ray(model, data, *above, None, 1, -1, hit) == pytest.approx(9.5, abs=0.01)
    corners = points[np.array(hill.indices).reshape(-1, 3)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0.0).all()
    assert normals[:, 2].sum() / 2.0 == pytest.approx(8.0 * 12.0)  # its triangles cover it


def test_the_desired_attitude_has_the_axes_of_the_bus_thicker_and_translucent() -> None:
    model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <worldbody>
    <body name="bus">
      <freejoint/>
      <geom type="box" size="1 1 1"/>
      <geom name="bus_axis_x" type="capsule" size="0.1" fromto="0 0 0 3 0 0" group="3"
            rgba="1 0 0 1"/>
    </body>
  </worldbody>
</mujoco>""")
    found = scene(model)
    assert found.bodies == ("bus", "reference")
    drawn = {e.frame_id: e for e in SceneUpdate.FromString(found.update).entities}
    (own,), (desired,) = drawn["bus"].cylinders, drawn["reference"].cylinders
    assert desired.pose == own.pose
    assert desired.size.z == own.size.z == pytest.approx(3.0)
    assert desired.size.x > own.size.x
    assert (own.color.a, desired.color.a) == (1.0, 0.4)


def test_a_body_of_the_references_name_is_drawn_in_its_place() -> None:
    model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <worldbody><body name="reference"><freejoint/><geom size="1"/></body></worldbody>
</mujoco>""")
    assert scene(model).bodies == ("reference",)
