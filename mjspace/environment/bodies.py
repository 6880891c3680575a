"""The vehicle in MuJoCo's arrays, which compiled terms read, and forces on its bodies."""

from typing import Any, NamedTuple

from mjspace.environment.compiled import compiled


class Bodies(NamedTuple):
    """What the terms read, under MuJoCo's names, and ``qfrc_passive``, which they add to.

    ``bus_dof`` is the first of the bus's six: force in world axes, then torque in body axes.
    """

    bus_dof: Any
    body_rootid: Any
    body_weldid: Any
    body_dofnum: Any
    body_dofadr: Any
    body_mass: Any
    body_inertia: Any
    dof_parentid: Any
    qpos: Any
    qvel: Any
    xipos: Any
    ximat: Any
    subtree_com: Any
    cdof: Any
    qfrc_passive: Any


@compiled
def in_bus_axes(bodies: Bodies, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a vector in the bus's axes, from its components in world axes."""
    dof = bodies.bus_dof + 3
    a, b, c = bodies.cdof[dof], bodies.cdof[dof + 1], bodies.cdof[dof + 2]  # the bus's axes
    return (
        a[0] * x + a[1] * y + a[2] * z,
        b[0] * x + b[1] * y + b[2] * z,
        c[0] * x + c[1] * y + c[2] * z,
    )


@compiled
def add_wrench_on_bus(bodies: Bodies, force: Any, torque: Any) -> None:
    """Add a force [N] at the bus's origin and a torque [N m], both (3) in the bus's axes."""
    dof = bodies.bus_dof
    a, b, c = bodies.cdof[dof + 3], bodies.cdof[dof + 4], bodies.cdof[dof + 5]  # the bus's axes
    for i in range(3):
        bodies.qfrc_passive[dof + i] += a[i] * force[0] + b[i] * force[1] + c[i] * force[2]
        bodies.qfrc_passive[dof + 3 + i] += torque[i]


@compiled
def add_force_on_bus(bodies: Bodies, place: Any, force: Any) -> None:
    """Add a force [N] on the bus at ``place`` [m] from its origin, both (3) in the bus's axes."""
    torque = (
        place[1] * force[2] - place[2] * force[1],
        place[2] * force[0] - place[0] * force[2],
        place[0] * force[1] - place[1] * force[0],
    )
    add_wrench_on_bus(bodies, force, torque)


@compiled
def add_wrench(bodies: Bodies, body: int, force: Any, torque: Any) -> None:
    """Add a force [N] at ``body``'s centre of mass and a torque [N m], both in world axes.

    Each dof that moves the body takes its share through ``cdof``, its axis of motion (rotation,
    translation) referred to the centre of mass of the body's tree.
    """
    place, center = bodies.xipos[body], bodies.subtree_com[bodies.body_rootid[body]]
    x, y, z = place[0] - center[0], place[1] - center[1], place[2] - center[2]
    mx = torque[0] + y * force[2] - z * force[1]
    my = torque[1] + z * force[0] - x * force[2]
    mz = torque[2] + x * force[1] - y * force[0]
    weld = bodies.body_weldid[body]
    dof = bodies.body_dofadr[weld] + bodies.body_dofnum[weld] - 1  # negative: nothing moves it
    while dof >= 0:
        s = bodies.cdof[dof]
        turn = s[0] * mx + s[1] * my + s[2] * mz
        bodies.qfrc_passive[dof] += turn + s[3] * force[0] + s[4] * force[1] + s[5] * force[2]
        dof = bodies.dof_parentid[dof]
