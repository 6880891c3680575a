"""Arithmetic of functions of time with their first two derivatives: Leibniz's and the chain rule.

A function with its derivatives is a jet, as automatic differentiation in Taylor mode calls it
(Griewank and Walther 2008, "Evaluating Derivatives", chapter 13).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjspace import algebra
from mjspace import attitude as att
from mjspace.contract import Array, DesiredMotion, Reference


@dataclass(frozen=True)
class Jet:
    """A function of time and its derivatives: vectors (n, 3), quaternions (n, 4), scalars (n, 1).

    A scalar may stand for each component of a vector.
    """

    value: Array
    first: Array
    """Per second."""
    second: Array
    """Per second squared."""

    def __add__(self, other: "Jet") -> "Jet":
        """Return the sum."""
        return Jet(self.value + other.value, self.first + other.first, self.second + other.second)

    def __sub__(self, other: "Jet") -> "Jet":
        """Return the difference."""
        return self + other.times(-1.0)

    def __mul__(self, other: "Jet") -> "Jet":
        """Return the product component by component."""
        return bilinear(np.multiply, self, other)

    def times(self, factor: float) -> "Jet":
        """Return it ``factor`` times."""
        return Jet(factor * self.value, factor * self.first, factor * self.second)

    def power(self, exponent: float) -> "Jet":
        """Return each component, greater than zero, to that power."""
        x, p = self.value, exponent
        return self.through(x**p, p * x ** (p - 1.0), p * (p - 1.0) * x ** (p - 2.0))

    def through(self, value: Array, slope: Array, bend: Array) -> "Jet":
        """Return a function of each component, given it and its derivatives by the component."""
        return Jet(value, slope * self.first, bend * self.first**2 + slope * self.second)


def bilinear(operation: Callable[[Array, Array], Any], a: Jet, b: Jet) -> Jet:
    """Return a product of any kind, by Leibniz's rule."""
    return Jet(
        operation(a.value, b.value),
        operation(a.first, b.value) + operation(a.value, b.first),
        operation(a.second, b.value)
        + 2.0 * operation(a.first, b.first)
        + operation(a.value, b.second),
    )


def cross(a: Jet, b: Jet) -> Jet:
    """Return a x b, of vectors."""
    return bilinear(algebra.cross, a, b)


def dot(a: Jet, b: Jet) -> Jet:
    """Return the inner product, (n, 1)."""
    return bilinear(algebra.dot, a, b)


def unit(vector: Jet) -> Jet:
    """Return the direction of a vector that is not zero."""
    return vector * dot(vector, vector).power(-0.5)


def of_reference(reference: DesiredMotion) -> Jet:
    """Return the quaternion: q' = q w / 2 and q'' = (q w' + q' w) / 2, w as a quaternion."""
    q, rate, bend = reference.attitude, att.pure(reference.rate), att.pure(reference.acceleration)
    first = 0.5 * att.multiply(q, rate)
    return Jet(q, first, 0.5 * (att.multiply(q, bend) + att.multiply(first, rate)))


def to_reference(quaternion: Jet) -> Reference:
    """Return the motion of a unit quaternion: w = 2 q* q', and w' = 2 (q* q'' + q'* q').

    Of w' the second term is |q'|^2, without a vector part.
    """
    inverse = att.conjugate(quaternion.value)
    return Reference(
        quaternion.value,
        2.0 * att.multiply(inverse, quaternion.first)[..., 1:],
        2.0 * att.multiply(inverse, quaternion.second)[..., 1:],
    )
