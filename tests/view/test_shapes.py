"""Solids as triangles: closed, outward, of the right volume."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjspace.view.shapes import bodies

SIZE = 2.0, 3.0, 4.0


@pytest.mark.parametrize(
    # Inscribed polygons of 48 sides and 24 rings have a little less than the round ones.
    ("kind", "share"),
    [("cubes", 1.0), ("cylinders", np.pi / 4 * 0.9971), ("spheres", np.pi / 6 * 0.991)],
)
def test_a_solid_has_its_volume_wherever_it_stands(kind: str, share: float) -> None:
    update = SceneUpdate()
    entity = update.entities.add(frame_id="bus")
    solid = getattr(entity, kind).add()
    solid.size.x, solid.size.y, solid.size.z = SIZE
    solid.pose.position.x = 5.0
    solid.pose.orientation.w, solid.pose.orientation.x = np.cos(0.3), np.sin(0.3)
    solid.color.r = solid.color.a = 1.0
    (body,) = bodies(update)
    (mesh,) = body.meshes
    assert mesh.color == (1.0, 0.0, 0.0, 1.0)
    corners = mesh.vertices[mesh.faces]
    # By the divergence theorem; it is negative where faces look inward.
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume == pytest.approx(np.prod(SIZE) * share, rel=2e-3)
    middle = np.average(corners.mean(axis=1), axis=0, weights=np.linalg.det(corners)) * 0.75
    np.testing.assert_allclose(middle, [5.0, 0.0, 0.0], atol=1e-6)


def test_a_mesh_of_vertices_that_are_not_there_is_refused() -> None:
    update = SceneUpdate()
    mesh = update.entities.add(frame_id="bus").triangles.add()
    for x in range(3):
        mesh.points.add(x=x)
    mesh.indices.extend([0, 1, 3])
    with pytest.raises(ValueError, match="3 vertices and no 3"):
        bodies(update)
