"""Connections of two spacecraft at their ports: a soft latch, and springs that push them apart.

Force and torque act on both at one point, so that linear and angular momentum of the two together
stay what they are, whatever the latch and the springs do.
"""

import math
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mjspace.contract import Array
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, add_wrench
from mjspace.environment.compiled import compiled
from mjspace.errors import input_error_at
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import (
    Each,
    NonNegative,
    Positive,
    Si,
    Switch,
    Table,
    Time,
    of_each,
    refuse_other_count,
)
from mjspace.scenario.plant import PlantTable
from mjspace.vehicle import port_frames

OPEN, CLOSED, RELEASED = 0.0, 1.0, 2.0
"""States of a connection: not yet closed, closed, and opened for good."""
_FIXED = 32
"""Numbers of a connection in ``userdata``, before those of its springs."""
_SPRING = 5
"""Numbers of a spring: stiffness [N/m], stroke [m], its foot in the second port's axes [m]."""


@compiled
def connect(payload: Any, time: float, bodies: Bodies) -> None:
    """Add the forces of a latch that is closed, or of the springs once it is released.

    ``payload``: state; stiffness [N/m], [N m/rad] and damping [N s/m], [N m s/rad]; number of
    springs; of each port its body, place and axes (rows) in that body's principal axes about its
    centre of mass; the springs.
    """
    state = payload[0]
    if state == 0.0:
        return
    one, two = int(payload[6]), int(payload[19])
    x1, a1 = _port(payload, 6, bodies)
    x2, a2 = _port(payload, 19, bodies)
    if state == 1.0:
        _latch(payload, bodies, one, two, x1, a1, x2, a2)
        return
    n = (a1[0], a1[3], a1[6])  # the docking axis
    for spring in range(int(payload[5])):
        row = payload[_FIXED + _SPRING * spring : _FIXED + _SPRING * (spring + 1)]
        foot = _moved(x2, a2, row[2], row[3], row[4])
        base = _moved(x1, a1, row[2], row[3], row[4])
        way = 0.0
        for i in range(3):
            way += (foot[i] - base[i]) * n[i]
        push = row[0] * (row[1] - way)
        if push > 0.0:
            force = (push * n[0], push * n[1], push * n[2])
            _push(bodies, two, one, foot, force, (0.0, 0.0, 0.0))


@compiled
def _latch(
    payload: Any, bodies: Bodies, one: int, two: int, x1: Any, a1: Any, x2: Any, a2: Any
) -> None:
    """Add spring and damper between the two ports, about the middle between them."""
    middle = (0.5 * (x1[0] + x2[0]), 0.5 * (x1[1] + x2[1]), 0.5 * (x1[2] + x2[2]))
    v1, w1 = _motion(bodies, one, middle)
    v2, w2 = _motion(bodies, two, middle)
    turn = _rotation(a1, a2)
    force = (
        -payload[1] * (x1[0] - x2[0]) - payload[3] * (v1[0] - v2[0]),
        -payload[1] * (x1[1] - x2[1]) - payload[3] * (v1[1] - v2[1]),
        -payload[1] * (x1[2] - x2[2]) - payload[3] * (v1[2] - v2[2]),
    )
    torque = (
        -payload[2] * turn[0] - payload[4] * (w1[0] - w2[0]),
        -payload[2] * turn[1] - payload[4] * (w1[1] - w2[1]),
        -payload[2] * turn[2] - payload[4] * (w1[2] - w2[2]),
    )
    _push(bodies, one, two, middle, force, torque)


@compiled
def _push(bodies: Bodies, one: int, two: int, place: Any, force: Any, torque: Any) -> None:
    """Add force and torque on body ``one`` at ``place``, and their reaction there on ``two``."""
    for body, sign in ((one, 1.0), (two, -1.0)):
        com = bodies.xipos[body]
        x, y, z = place[0] - com[0], place[1] - com[1], place[2] - com[2]
        fx, fy, fz = sign * force[0], sign * force[1], sign * force[2]
        moment = (
            sign * torque[0] + y * fz - z * fy,
            sign * torque[1] + z * fx - x * fz,
            sign * torque[2] + x * fy - y * fx,
        )
        add_wrench(bodies, body, (fx, fy, fz), moment)


@compiled
def _port(payload: Any, first: int, bodies: Bodies) -> tuple[Any, Any]:
    """Return a port's place [m] and its axes, the columns of a matrix by rows, in world axes."""
    body = int(payload[first])
    m, com = bodies.ximat[body], bodies.xipos[body]
    p = payload[first + 1 : first + 4]
    r = payload[first + 4 : first + 13]
    place = (
        com[0] + m[0] * p[0] + m[1] * p[1] + m[2] * p[2],
        com[1] + m[3] * p[0] + m[4] * p[1] + m[5] * p[2],
        com[2] + m[6] * p[0] + m[7] * p[1] + m[8] * p[2],
    )
    axes = (
        m[0] * r[0] + m[1] * r[3] + m[2] * r[6],
        m[0] * r[1] + m[1] * r[4] + m[2] * r[7],
        m[0] * r[2] + m[1] * r[5] + m[2] * r[8],
        m[3] * r[0] + m[4] * r[3] + m[5] * r[6],
        m[3] * r[1] + m[4] * r[4] + m[5] * r[7],
        m[3] * r[2] + m[4] * r[5] + m[5] * r[8],
        m[6] * r[0] + m[7] * r[3] + m[8] * r[6],
        m[6] * r[1] + m[7] * r[4] + m[8] * r[7],
        m[6] * r[2] + m[7] * r[5] + m[8] * r[8],
    )
    return place, axes


@compiled
def _moved(place: Any, axes: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a place in world axes, from its components in a port's axes."""
    return (
        place[0] + axes[0] * x + axes[1] * y + axes[2] * z,
        place[1] + axes[3] * x + axes[4] * y + axes[5] * z,
        place[2] + axes[6] * x + axes[7] * y + axes[8] * z,
    )


@compiled
def _motion(bodies: Bodies, body: int, place: Any) -> tuple[Any, Any]:
    """Return the velocity [m/s] of the body's point at ``place`` and its rate, world axes."""
    vx = vy = vz = wx = wy = wz = 0.0
    weld = bodies.body_weldid[body]
    dof = bodies.body_dofadr[weld] + bodies.body_dofnum[weld] - 1
    while dof >= 0:
        s, speed = bodies.cdof[dof], bodies.qvel[dof]
        wx += speed * s[0]
        wy += speed * s[1]
        wz += speed * s[2]
        vx += speed * s[3]
        vy += speed * s[4]
        vz += speed * s[5]
        dof = bodies.dof_parentid[dof]
    center = bodies.subtree_com[bodies.body_rootid[body]]
    x, y, z = place[0] - center[0], place[1] - center[1], place[2] - center[2]
    return (vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x), (wx, wy, wz)


@compiled
def _rotation(a: Any, b: Any) -> tuple[float, float, float]:
    """Return the rotation vector [rad], world axes, that turns the axes ``b`` into ``a``."""
    # Of a b^T: its trace is 1 + 2 cos(angle), its skew part the axis times sin(angle).
    trace = 0.0
    for i in range(9):
        trace += a[i] * b[i]
    x = y = z = 0.0
    for k in range(3):
        ax, ay, az = a[k], a[3 + k], a[6 + k]
        bx, by, bz = b[k], b[3 + k], b[6 + k]
        x += 0.5 * (by * az - bz * ay)
        y += 0.5 * (bz * ax - bx * az)
        z += 0.5 * (bx * ay - by * ax)
    sine = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, 0.5 * (trace - 1.0))
    scale = angle / sine if sine > 1e-12 else 1.0
    return scale * x, scale * y, scale * z


class Closing(Table):
    """When an open connection closes: when all of this holds at a control instant."""

    distance: Annotated[Positive, Si("m")] = 0.05
    """Between the ports at most."""
    angle: Annotated[Positive, Field(le=math.pi), Si("rad")] = math.radians(10.0)
    """Between their axes at most."""
    speed: Annotated[Positive, Si("m/s")] | None = None
    """Relative, at most; none when left out."""
    after: Time = 0.0
    """Not before."""


class Springs(Table):
    """Springs between the two ports, compressed until the connection opens.

    They push and never pull: none is fastened to the other spacecraft.
    """

    stiffness: Annotated[Each, Si("N/m")]
    """Of all, or of each."""
    stroke: Annotated[Each, Si("m")]
    """By which each is compressed while the ports touch, along the vehicle's docking axis; it
    pushes no farther."""
    positions: list[Annotated[list[float], Field(min_length=3, max_length=3), Si("m")]] = [
        [0.0, 0.0, 0.0]
    ]
    """Of their feet from the ports, in the ports' axes, one row for each spring."""

    @model_validator(mode="after")
    def _one_for_each(self) -> Self:
        for key in ("stiffness", "stroke"):
            refuse_other_count(key, getattr(self, key), len(self.positions), "positions")
        return self

    def rows(self) -> Array:
        """Return stiffness [N/m], stroke [m] and foot [m] of each, (n, 5)."""
        count = len(self.positions)
        each = of_each(self.stiffness, count), of_each(self.stroke, count)
        return np.column_stack([*each, np.reshape(self.positions, (-1, 3))])


class Connection(Table):
    """A soft latch between a port of the vehicle and one of another spacecraft.

    Closed, it draws the ports together by spring and damper in all six directions; it opens once,
    and then its ``springs`` push. The reaction acts at the same point: no momentum is made.
    """

    between: Annotated[list[str], Field(min_length=2, max_length=2)]
    """Names of two sites: a port of the vehicle, and one of the other spacecraft."""
    closed: Switch = False
    """Whether it is closed at first: the other spacecraft then begins docked, at rest relative to
    the vehicle."""
    closes: Closing = Closing()
    """When it closes, if it is open at first."""
    opens_at: Annotated[NonNegative, Si("s")] | None = None
    """When it opens, for good; never when left out."""
    frequency: Annotated[Positive, Si("Hz")] = 1.0
    """At which the two spacecraft swing on the closed latch. Its stiffness is (2 pi f)^2 / a along
    all three axes, with a the acceleration of one port relative to the other for one newton between
    them, the mean of the axes; likewise in rotation. Where a differs from axis to axis, so do the
    frequencies, to either side of f."""
    damping_ratio: NonNegative = 0.7
    """Of that swing; 1 returns without swinging over."""
    springs: Springs | None = None
    """None when left out."""

    @model_validator(mode="after")
    def _springs_need_an_opening(self) -> Self:
        if self.springs is not None and self.opens_at is None:
            raise ValueError("springs: they push once the connection opens: give opens_at")
        return self


class Latch(Term):
    """What acts at one connection; its state is the first number of its block."""

    kernels: ClassVar = {10: connect}

    name: str
    table: Connection

    @classmethod
    def of(cls, plant: PlantTable) -> list[Self]:
        """Return one for each of the plant's connections, in their order."""
        return [cls(name=name, table=table) for name, table in plant.connections.items()]

    def payload_size(self, environment: Environment) -> int:
        """Return the size of what ``pack`` returns."""
        return _FIXED + _SPRING * len(self._springs())

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the parameters of ``connect``.

        Raises:
            InputError: as ``port_frames.check`` and ``port_frames.latch``.
        """
        table = self.table
        with input_error_at(f"plant.connections.{self.name}"):
            port_frames.check(model, table.between)
            stiffness, damping = port_frames.latch(
                model, table.between, 2.0 * math.pi * table.frequency, table.damping_ratio
            )
        ports = [port_frames.of_site(model, name) for name in table.between]
        springs = self._springs()
        state = CLOSED if table.closed else OPEN
        numbers = [np.array([state, *stiffness, *damping, len(springs)]), *ports, springs.ravel()]
        return np.concatenate(numbers)

    def _springs(self) -> Array:
        return np.zeros((0, _SPRING)) if self.table.springs is None else self.table.springs.rows()
