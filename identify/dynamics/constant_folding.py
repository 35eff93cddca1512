"""Three-component vectors over samples, whose components may be plain constants.

A component is an array over the samples, or a float where it is the same for all of them. A product with a
constant 0 or 1 is never computed, nor is a sum with a constant 0: what a symbolic generator does when it
customises the recursion to one robot happens here while the recursion runs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Component = float | NDArray[np.float64]
Vector = tuple[Component, Component, Component]


def is_zero(value: Component) -> bool:
    """Whether a component is the constant 0."""
    return isinstance(value, float) and value == 0.0


def product(left: Component, right: Component) -> Component:
    """left * right."""
    if isinstance(left, float):
        left, right = right, left
    if isinstance(right, float):
        if right == 0.0 or is_zero(left):
            return 0.0
        if right == 1.0:
            return left
    return left * right


def total(left: Component, right: Component) -> Component:
    """left + right."""
    if is_zero(left):
        return right
    return left if is_zero(right) else left + right


def difference(left: Component, right: Component) -> Component:
    """left - right."""
    if is_zero(right):
        return left
    return -right if is_zero(left) else left - right


def negative(value: Component) -> Component:
    """-value."""
    return 0.0 if is_zero(value) else -value


def vector_sum(left: Vector, right: Vector) -> Vector:
    """left + right."""
    return total(left[0], right[0]), total(left[1], right[1]), total(left[2], right[2])


def cross(left: Vector, right: Vector) -> Vector:
    """left x right."""
    (a, b, c), (x, y, z) = left, right
    return (
        difference(product(b, z), product(c, y)),
        difference(product(c, x), product(a, z)),
        difference(product(a, y), product(b, x)),
    )


def matrix_times(columns: tuple[Vector, Vector, Vector], vector: Vector) -> Vector:
    """The matrix with these columns times a vector."""
    first, second, third = (_scaled(column, weight) for column, weight in zip(columns, vector, strict=True))
    return vector_sum(vector_sum(first, second), third)


def _scaled(vector: Vector, weight: Component) -> Vector:
    return product(vector[0], weight), product(vector[1], weight), product(vector[2], weight)


class FrameChange:
    """Components of a vector of frame j-1 in frame j: Rot(z, -theta) Rot(x, -alpha)."""

    def __init__(self, alpha: float, theta: Component) -> None:
        self.cos_alpha, self.sin_alpha = _clean_cosine_sine(alpha)
        if isinstance(theta, float):
            self.cos_theta, self.sin_theta = _clean_cosine_sine(theta)
        else:
            self.cos_theta, self.sin_theta = np.cos(theta), np.sin(theta)

    def into(self, vector: Vector) -> Vector:
        """The vector's components in the new frame."""
        x, y, z = vector
        tilted = total(product(y, self.cos_alpha), product(z, self.sin_alpha))
        return (
            total(product(x, self.cos_theta), product(tilted, self.sin_theta)),
            difference(product(tilted, self.cos_theta), product(x, self.sin_theta)),
            difference(product(z, self.cos_alpha), product(y, self.sin_alpha)),
        )


def _clean_cosine_sine(angle: float) -> tuple[float, float]:
    """Cosine and sine; what rounding leaves of a zero (6e-17 for the cosine of pi/2) is a zero."""
    cosine, sine = float(np.cos(angle)), float(np.sin(angle))
    return (0.0 if abs(cosine) < 1e-15 else cosine), (0.0 if abs(sine) < 1e-15 else sine)
