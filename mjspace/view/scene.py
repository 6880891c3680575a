"""The scene in the browser: bodies, axes, arrows and a trail, moved from instant to instant."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.log.arrows import ARROWS, TRAIL, Arrow
from mjspace.log.frames import Poses
from mjspace.view.shapes import Body

FOLLOWS = ("the spacecraft", "the spacecraft, turning with it", "nothing")
"""What the camera follows."""
_AXES = ((242, 64, 51), (77, 217, 77), (77, 128, 255))  # x, y, z
_STILL = 0.5  # of the vehicle's radius: what moves less leaves the trail of its x axis


class Moment(NamedTuple):
    """All that is drawn of one instant."""

    time: float
    """[s]"""
    poses: Poses
    desired: Array | None
    """The desired attitude (4,); None where there is none."""
    vectors: Mapping[str, Array]
    """Each (3,), by the arrow's name, in the arrow's own axes and unit."""


class Scene:
    """A model in a viser server; ``show`` moves it.

    Attributes:
        longest: of each arrow, by name, the vector's size that is drawn at full length.
        path: the trail's points, times [s] (n,) and places [m] (n, 3), inertial axes.
        shown: whether "axes", "arrows" and the "trail" are.
        follow: what the camera follows, one of ``FOLLOWS``.
    """

    def __init__(self, server: Any, drawn: Sequence[Body], bus: str) -> None:
        """Draw the bodies, of which the spacecraft's is the ``bus``, at their origins."""
        self._server, scene = server, server.scene
        self.longest: dict[str, float] = {}
        self.path: tuple[Array, Array] = np.empty(0), np.empty((0, 3))
        self.shown = {"axes": True, "arrows": True, "trail": True}
        self.follow = FOLLOWS[0]
        own = [body.radius for body in drawn if body.name != "world"]
        self.size = max([*own, 1e-3])
        # Under one frame, so that the camera follows by moving the world against it.
        self._world = scene.add_frame("/flight", show_axes=False)
        self._bodies: dict[str, Any] = {}
        for number, body in enumerate(drawn):
            node = f"/flight/body_{number}"  # the log's names are a stranger's
            self._bodies[body.name] = scene.add_frame(node, show_axes=False)
            for part, mesh in enumerate(body.meshes):
                *color, opacity = mesh.color
                scene.add_mesh_simple(
                    f"{node}/{part}",
                    mesh.vertices.astype(np.float32),
                    mesh.faces.astype(np.uint32),
                    color=tuple(color),
                    opacity=None if opacity >= 1.0 else opacity,
                    flat_shading=True,
                    cast_shadow=False,
                )
        self._own = bus
        self._axes = self._frame("/flight/axes", 1.1, 0.02, 0)
        self._desired = self._frame("/flight/desired", 1.3, 0.008, 110)
        self._arrows = {arrow.name: self._arrow(arrow) for arrow in ARROWS}
        self._flown = 0
        self._line = self._trail()
        scene.configure_default_lights(True, cast_shadow=False)
        server.initial_camera.position = tuple(self.size * np.array([1.9, -1.6, 1.1]))
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        server.initial_camera.near = 0.01 * self.size

    def show(self, moment: Moment, trail_to: float | None = None) -> None:
        """Move everything to where it is at that moment.

        The trail is that up to the moment, or to the time ``trail_to`` [s].
        """
        with self._server.atomic():
            poses = moment.poses
            for name, place, turn in zip(*poses[1:], strict=True):
                if name in self._bodies:
                    _move(self._bodies[name], place, turn)
            place, turn = self._pose_of_own(poses)
            self._look_along(place, turn)
            for axes, angle in ((self._axes, turn), (self._desired, moment.desired)):
                axes.visible = self.shown["axes"] and angle is not None
                if angle is not None:
                    _move(axes, place, angle)
            self._draw_arrows(moment, place, turn)
            self._draw_trail(moment.time if trail_to is None else trail_to)

    def _pose_of_own(self, poses: Poses) -> tuple[Array, Array]:
        """Return place and attitude of the spacecraft's bus."""
        if self._own in poses.names:
            number = poses.names.index(self._own)
            return poses.position[number], poses.quaternion[number]
        return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])

    def _look_along(self, place: Array, turn: Array) -> None:
        if self.follow == FOLLOWS[0]:
            _move(self._world, -place, np.array([1.0, 0.0, 0.0, 0.0]))
        elif self.follow == FOLLOWS[1]:
            back = attitude.conjugate(turn)
            _move(self._world, -attitude.rotate(back, place), back)
        else:
            _move(self._world, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))

    def _frame(self, name: str, length: float, thickness: float, paler: int) -> Any:
        """Add axes of a length and thickness in radii of the vehicle, of paler colors."""
        long, thick = length * self.size, thickness * self.size
        node = self._server.scene.add_frame(name, show_axes=False, visible=False)
        for letter, color, direction in zip("xyz", _AXES, np.eye(3), strict=True):
            self._server.scene.add_arrows(
                f"{name}/{letter}",
                np.array([[np.zeros(3), long * direction]], np.float32),
                tuple(min(part + paler, 255) for part in color),
                shaft_radius=0.5 * thick,
                head_radius=1.2 * thick,
                head_length=4.0 * thick,
            )
        return node

    def _arrow(self, arrow: Arrow) -> Any:
        thick = 0.03 * self.size
        return self._server.scene.add_arrows(
            f"/flight/{arrow.name.replace(' ', '_')}",
            np.array([[np.zeros(3), [0.0, 0.0, self.size]]], np.float32),
            arrow.color,
            shaft_radius=0.4 * thick,
            head_radius=thick,
            head_length=2.5 * thick,
            visible=False,
        )

    def _draw_arrows(self, moment: Moment, place: Array, turn: Array) -> None:
        for arrow in ARROWS:
            node, vector = self._arrows[arrow.name], moment.vectors.get(arrow.name)
            share = 0.0
            if vector is not None and self.longest.get(arrow.name, 0.0) > 0.0:
                share = float(np.linalg.norm(vector)) / self.longest[arrow.name]
            node.visible = bool(self.shown["arrows"] and 1e-3 < share < np.inf)
            if node.visible and vector is not None:
                direction = attitude.rotate(turn, vector) if arrow.in_body else vector
                tip = 1.3 * self.size * share * direction / np.linalg.norm(direction)
                node.points = np.array([[place, place + tip]], np.float32)

    def _draw_trail(self, time: float) -> None:
        flown = int(np.searchsorted(self.path[0], time, side="right"))
        visible = self.shown["trail"] and flown > 1
        if visible and flown != self._flown:
            points = self.path[1][:flown]
            self._line.points = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
            self._line.colors = np.broadcast_to(TRAIL, (flown - 1, 2, 3)).astype(np.uint8)
            self._flown = flown
        self._line.visible = visible

    def _trail(self) -> Any:
        return self._server.scene.add_line_segments(
            "/flight/trail",
            np.zeros((1, 2, 3), np.float32),
            TRAIL,
            thickness=2.0,
            thickness_units="screen",
            visible=False,
        )


def trail(time: Array, position: Array, quaternion: Array, size: float) -> tuple[Array, Array]:
    """Return the trail of a vehicle of that ``size`` [m]: times (n,) and points (n, 3).

    Where it stays where it is, that is what the tip of its x axis draws around it.
    """
    reach = np.ptp(position, axis=0).max(initial=0.0)
    if reach > _STILL * size:
        return time, position
    return time, position + attitude.rotate(quaternion, np.array([1.1 * size, 0.0, 0.0]))


def _move(node: Any, place: Array, turn: Array) -> None:
    node.position, node.wxyz = place, turn
