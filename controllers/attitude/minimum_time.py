"""Minimum-time slews by direct optimal control: torques for a table, planned before a flight.

The attitude, the rates and the torques of a rigid body are the unknowns of one nonlinear program
(multiple shooting), which CasADi and IPOPT solve from several starts. Its solution is bang-bang; a
second program moves the instants at which the torques switch. K. D. Bilimoria and B. Wie,
"Time-optimal three-axis reorientation of a rigid spacecraft", Journal of Guidance, Control, and
Dynamics 16 (1993): faster than the turn about the eigenaxis, since all three torques are used.
"""

from typing import Any, NamedTuple

import numpy as np

from mjspace import attitude as att
from mjspace.algebra import cross
from mjspace.contract import Array

_INTERVALS = 60
"""In which the torques are constant, in the first program."""
_SUBSTEPS = 40
"""Of an arc between two switches, in the second: exact to 1e-9."""


class Slew(NamedTuple):
    """Torques that are constant from switch to switch, as ``planned:Planned`` flies them."""

    time: Array
    """Of the start, the switches and the end [s], (row + 1,)."""
    torque: Array
    """Until the next of these times [N m], body axes, (row, 3)."""


def minimum_time_slew(
    inertia: Array, torque_limit: Array, attitude: Array, starts: int = 6
) -> Slew:
    """Return the fastest slew found, from rest at the identity to rest at ``attitude``.

    ``inertia`` (3, 3) [kg m^2] is about the centre of mass, ``torque_limit`` (3,) [N m] is of each
    body axis by itself, ``attitude`` (4,) the final quaternion, scalar first. There may be several
    slews of the same duration, and slower ones that are locally the fastest: the best of so many
    ``starts`` is returned. It needs CasADi: ``pip install mjspace[planning]``.

    Raises:
        ModuleNotFoundError: CasADi is not installed.
        RuntimeError: no start converged, or the fastest slew is not bang-bang.
    """
    ca = _casadi()
    # Units in which a mean inertia and a mean torque limit are one.
    mass, torque = np.trace(inertia) / 3.0, float(np.mean(torque_limit))
    unit = np.sqrt(mass / torque)
    body, limit = inertia / mass, np.asarray(torque_limit) / torque
    final = att.normalize(np.asarray(attitude, dtype=float))
    final = final if final[0] >= 0.0 else -final
    duration, torques = _on_a_grid(ca, body, limit, final, starts)
    lengths, signs = _arcs(duration, torques / limit)
    lengths = _refined(ca, body, limit * signs, final, lengths)
    if abs(lengths.sum() - duration) > 0.01 * duration:
        raise RuntimeError("the fastest slew is not bang-bang")
    switches = np.concatenate([[0.0], np.cumsum(lengths)])
    return Slew(unit * switches, torque * limit * signs)


def eigenaxis_time(inertia: Array, torque_limit: Array, attitude: Array) -> float:
    """Return the duration [s] of the bang-bang turn about the eigenaxis within the same limits.

    Its angular acceleration is constant but for its sign, so that the torque is largest at the
    fastest rate, where the gyroscopic torque w x J w is added to it.
    """
    vector = att.to_rotation_vector(np.asarray(attitude, dtype=float))
    angle = float(np.linalg.norm(vector))
    momentum = inertia @ (vector / angle)
    needed = np.abs(momentum) + angle * np.abs(cross(vector / angle, momentum))
    with np.errstate(divide="ignore"):
        acceleration = np.min(np.asarray(torque_limit) / needed)
    return float(2.0 * np.sqrt(angle / acceleration))


def _casadi() -> Any:
    try:
        import casadi
    except ImportError:
        raise ModuleNotFoundError(
            "minimum_time_slew needs CasADi: pip install 'mjspace[planning]'"
        ) from None
    return casadi


def _integration(ca: Any, inertia: Array, substeps: int) -> Any:
    """Return the function (attitude and rate (7), torque (3), duration) -> (7), by RK4."""
    inverse = np.linalg.inv(inertia)

    def derivative(x: Any, u: Any) -> Any:
        q, w = x[:4], x[4:]
        turned = 0.5 * ca.vertcat(-ca.dot(q[1:], w), q[0] * w + ca.cross(q[1:], w))
        return ca.vertcat(turned, inverse @ (u - ca.cross(w, inertia @ w)))

    start, u, duration = ca.SX.sym("x", 7), ca.SX.sym("u", 3), ca.SX.sym("T")
    x, h = start, duration / substeps
    for _ in range(substeps):
        k1 = derivative(x, u)
        k2 = derivative(x + 0.5 * h * k1, u)
        k3 = derivative(x + 0.5 * h * k2, u)
        k4 = derivative(x + h * k3, u)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return ca.Function("integration", [start, u, duration], [x])


def _left(ca: Any, state: Any, final: Array) -> Any:
    """Return what is zero at rest at ``final``: the error's vector part and the rate, (6)."""
    q, f = state[:4], ca.DM(final)
    return ca.vertcat(f[0] * q[1:] - q[0] * f[1:] - ca.cross(f[1:], q[1:]), state[4:])


def _solver(ca: Any, unknowns: Any, cost: Any, zero: Any) -> Any:
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.tol": 1e-10}
    return ca.nlpsol("slew", "ipopt", {"x": unknowns, "f": cost, "g": zero}, quiet)


def _on_a_grid(
    ca: Any, inertia: Array, limit: Array, final: Array, starts: int
) -> tuple[float, Array]:
    """Return the least duration and the torques of each interval, (intervals, 3)."""
    n = _INTERVALS
    duration, u, x = ca.MX.sym("T"), ca.MX.sym("u", 3, n), ca.MX.sym("x", 7, n + 1)
    ahead = _integration(ca, inertia, 2).map(n)(x[:, :-1], u, ca.repmat(duration / n, 1, n))
    at_rest = ca.DM([1.0, 0, 0, 0, 0, 0, 0])
    zero = ca.vertcat(x[:, 0] - at_rest, ca.vec(ahead - x[:, 1:]), _left(ca, x[:, -1], final))
    solver = _solver(ca, ca.vertcat(duration, ca.vec(u), ca.vec(x)), duration, zero)
    free = np.full(7 * (n + 1), np.inf)
    most = np.concatenate([[np.inf], np.tile(limit, n), free])
    least = np.concatenate([[0.0], np.tile(-limit, n), -free])

    slowest = eigenaxis_time(inertia, limit, final)
    vector = att.to_rotation_vector(final)
    s = np.linspace(0.0, 1.0, n + 1)[:, None]
    turned = np.where(s < 0.5, 2.0 * s**2, 1.0 - 2.0 * (1.0 - s) ** 2) * vector
    rate = 4.0 * np.minimum(s, 1.0 - s) * vector / slowest
    states = np.concatenate([att.from_rotation_vector(turned), rate], axis=1)
    random, found = np.random.default_rng(0), []
    for _ in range(starts):
        guess = np.concatenate(
            [[slowest], (0.5 * limit * random.uniform(-1.0, 1.0, (n, 3))).ravel(), states.ravel()]
        )
        solution = solver(x0=guess, lbx=least, ubx=most, lbg=0.0, ubg=0.0)
        if solver.stats()["success"]:
            found.append(np.array(solution["x"]).ravel())
    if not found:
        raise RuntimeError(f"none of {starts} starts converged")
    best = min(found, key=lambda unknowns: float(unknowns[0]))
    return float(best[0]), best[1 : 1 + 3 * n].reshape(n, 3)


def _arcs(duration: float, shares: Array) -> tuple[Array, Array]:
    """Return lengths (arcs,) and signs (arcs, 3) of the torques, from their ``shares`` (n, 3)."""
    interval, signs = duration / len(shares), np.where(shares >= 0.0, 1.0, -1.0)
    switches = []
    for axis in range(3):
        for row in np.flatnonzero(np.diff(signs[:, axis])) + 1:
            # Within the interval before or after, where the torque is between its limits.
            around = np.clip(shares[row - 1 : row + 1, axis] * signs[row, axis], -1.0, 1.0)
            at = interval * (row - 0.5 * np.sum(around))
            switches.append((float(at), axis))
    switches.sort()
    rows = [signs[0].copy()]
    for _, axis in switches:
        rows.append(np.where(np.arange(3) == axis, -rows[-1], rows[-1]))
    times = np.array([0.0, *(at for at, _ in switches), duration])
    return np.diff(times), np.array(rows)


def _refined(ca: Any, inertia: Array, torques: Array, final: Array, lengths: Array) -> Array:
    """Return the lengths of the arcs of constant ``torques`` (arcs, 3) in the fastest slew."""
    unknown, step = ca.MX.sym("d", len(lengths)), _integration(ca, inertia, _SUBSTEPS)
    state = ca.DM([1.0, 0, 0, 0, 0, 0, 0])
    for arc, torque in enumerate(torques):
        state = step(state, ca.DM(torque), unknown[arc])
    solver = _solver(ca, unknown, ca.sum1(unknown), _left(ca, state, final))
    solution = solver(x0=lengths, lbx=0.0, ubx=float(np.sum(lengths)), lbg=0.0, ubg=0.0)
    if not solver.stats()["success"]:
        raise RuntimeError("the fastest slew is not bang-bang")
    return np.array(solution["x"]).ravel()
