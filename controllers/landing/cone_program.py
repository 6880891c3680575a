"""Minimizes a sum of vector lengths under second-order cone constraints, by a barrier method.

Sums and the elimination are NumPy's own loops, not BLAS: the last bit of a BLAS product depends on
the number of threads, and a search can amplify it to a different solution.
"""

from typing import NamedTuple

import numpy as np

from mjspace.contract import Array

PENALTY = 100.0
"""Cost per unit of constraint violation: above the multipliers of the active constraints."""
SHARPNESS = (1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e7, 1e7)
"""Successive weights of the cost relative to the barrier."""
SIGN = np.array([1.0, -1.0, -1.0, -1.0])[:, None]


class Affine(NamedTuple):
    """n vectors of dimension d that are affine in k unknowns."""

    slope: Array
    """Derivatives by the unknowns, (k, d, n)."""
    offset: Array
    """Vectors at unknowns of zero, (d, n)."""

    def at(self, x: Array) -> Array:
        """Return the vectors (d, n) at ``x`` (k,)."""
        vectors: Array = self.offset + np.einsum("kdn,k->dn", self.slope, x)
        return vectors

    def mapped(self, matrix: Array) -> "Affine":
        """Return ``matrix`` (e, d) times each vector."""
        return Affine(*(np.einsum("ed,...dn->...en", matrix, part) for part in self))

    def mixed(self, shares: Array) -> "Affine":
        """Return m linear combinations of the vectors, with the weights ``shares`` (m, n)."""
        return Affine(*(np.einsum("mn,...n->...m", shares, part) for part in self))

    def plus(self, row: int, length: float) -> "Affine":
        """Return the vectors with ``length`` added to component ``row``."""
        offset = self.offset.copy()
        offset[row] += length
        return Affine(self.slope, offset)

    def beside(self, other: "Affine") -> "Affine":
        """Return these vectors followed by the other ones."""
        return Affine(*(np.concatenate(parts, axis=-1) for parts in zip(self, other, strict=True)))


def least(lengths: Affine, weight: Array, shortest: float, cones: Affine) -> tuple[Array, float]:
    """Return the unknowns (k,) and the constraint violation.

    Minimizes sum(weight |v|) over the n vectors v of ``lengths`` subject to |v| >= ``shortest`` and
    to t >= |(x, y, z)| for each vector (t, x, y, z) of ``cones``. Where the constraints contradict
    each other, all are violated by the same least amount, at a cost of ``PENALTY`` a unit. A least
    length is not a convex constraint: it is replaced by one on the component of v along the v of
    the previous iteration (along the third axis in the first), so that the solution is a local
    minimum. Numbers should be of order one.

    Boyd and Vandenberghe, Convex Optimization, 2004, sections 11.3 and 11.6.
    """
    k, _, n = lengths.slope.shape
    lengths = Affine(np.concatenate([lengths.slope, np.zeros((1, 3, n))]), lengths.offset)
    slack = np.zeros((4, cones.offset.shape[1]))
    slack[0] = 1.0
    cones = Affine(np.concatenate([cones.slope, slack[None]]), cones.offset)
    excess = np.zeros((k + 1, 4, 1))
    excess[k, 0] = 1.0
    cones = cones.beside(Affine(excess, np.zeros((4, 1))))

    x, toward = np.zeros(k + 1), np.tile([[0.0], [0.0], [1.0]], n)
    # Start inside every cone, with the third component of every vector above the shortest length.
    x[k] = (
        1.0 + abs(shortest) + np.abs(cones.offset).sum(axis=0).max() + np.abs(lengths.offset).max()
    )
    for sharpness in SHARPNESS:
        long = Affine(np.zeros((k + 1, 4, n)), np.zeros((4, n)))
        long.slope[:, 0] = (lengths.slope * toward).sum(axis=1)
        long.slope[k, 0] = 1.0
        long.offset[0] = (lengths.offset * toward).sum(axis=0) - shortest
        x = _center(x, lengths, sharpness * weight, sharpness * PENALTY, cones.beside(long))
        toward = lengths.at(x) / _size(lengths.at(x))
    return x[:k], float(x[k])


def _center(x: Array, lengths: Affine, weight: Array, penalty: float, cones: Affine) -> Array:
    """Return the minimizer of cost plus barrier, by Newton's method from ``x`` inside the cones."""

    def value(x: Array) -> float:
        v = cones.at(x)
        room = (SIGN * v**2).sum(axis=0)
        if v[0].min() <= 0.0 or room.min() <= 0.0:
            return np.inf
        cost = (weight * _size(lengths.at(x))).sum() + penalty * x[-1]
        return float(cost - np.log(room).sum())

    now = value(x)
    for _ in range(60):
        slope, curvature = _derivatives(x, lengths, weight, cones)
        slope[-1] += penalty
        step = -_solve(curvature, slope)
        gain, share = -(slope * step).sum(), 1.0
        if gain < 1e-6:
            break
        while (after := value(x + share * step)) > now - 0.1 * share * gain:
            share *= 0.5
            if share < 1e-9:
                return x  # the remaining gain is rounding
        x, now = x + share * step, after
    return x


def _derivatives(x: Array, lengths: Affine, weight: Array, cones: Affine) -> tuple[Array, Array]:
    """Return gradient (k,) and Hessian (k, k) of cost plus barrier, without the penalty term."""
    v = lengths.at(x)
    size = _size(v)
    along = (lengths.slope * (v / size)).sum(axis=1)
    slope = (along * weight).sum(axis=1)
    curvature = _gram(lengths.slope, weight / size) - _gram(along[:, None], weight / size)

    v = cones.at(x)
    room = (SIGN * v**2).sum(axis=0)
    inward = 2.0 * (cones.slope * (SIGN * v / room)).sum(axis=1)
    slope -= inward.sum(axis=1)
    curvature += _gram(inward[:, None], np.ones(len(room)))
    return slope, curvature - _gram(cones.slope, 2.0 * SIGN / room)


def _gram(vectors: Array, weight: Array) -> Array:
    """Return the weighted Gram matrix (k, k) of the unknowns' vectors (k, d, n)."""
    k = len(vectors)
    heavy = (vectors * weight).reshape(k, -1)
    products: Array = np.einsum("ka,la->kl", heavy, vectors.reshape(k, -1))
    return products


def _size(vectors: Array) -> Array:
    """Return the lengths (n,), bounded away from zero so that they are differentiable."""
    size: Array = np.sqrt((vectors**2).sum(axis=0) + 1e-12)
    return size


def _solve(matrix: Array, right: Array) -> Array:
    """Return matrix^-1 right for a positive definite matrix (k, k), by Gaussian elimination."""
    rows, k = np.column_stack([matrix, right]), len(right)
    for i in range(k):
        rows[i + 1 :] -= rows[i + 1 :, i : i + 1] / rows[i, i] * rows[i]
    x = np.zeros(k)
    for i in reversed(range(k)):
        x[i] = (rows[i, k] - (rows[i, :k] * x).sum()) / rows[i, i]
    return x
