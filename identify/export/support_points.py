"""A torque as a line through a few support points, chosen for the least squared error on a record.

Drives keep their own compensation so: friction over speed, cogging over a turn of the motor. A line with given support points
is linear in its values, so that these follow by least squares; the speeds of the points are searched for on a grid, one after
the other, until no point's place can be bettered. The record is summed up once, in the products of the grid's own lines.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]

GRID = 60
"""speeds among which the support points are chosen: steps of 10 % from the record's slowest hundredth to its top speed"""
SLOWEST = 0.004
"""of the top speed, the slowest support point: below, noise of the speed decides on the sign"""


@dataclass(frozen=True)
class SpeedLine:
    """A line over speed: zero at rest, straight to the first point and from point to point, held beyond the last.

    speeds   : (k,) rising, above 0
    forward  : (k,) values at these speeds; none negative
    backward : (k,) at the same speeds the other way; none positive
    constant : added in both directions, also at rest
    """

    speeds: Array
    forward: Array
    backward: Array
    constant: float

    def at(self, speed: Array) -> Array:
        """Values at any speeds."""
        size = np.abs(speed)
        knots = np.concatenate([[0.0], self.speeds])
        ahead = np.interp(size, knots, np.concatenate([[0.0], self.forward]))
        back = np.interp(size, knots, np.concatenate([[0.0], self.backward]))
        return np.where(speed >= 0, ahead, back) + self.constant


def speed_line(speed: Array, value: Array, points: int, mirrored: bool, constant: bool) -> SpeedLine:
    """The line with the least squared error.

    speed, value : (N,) of the record
    points       : support points in each direction
    mirrored     : whether the line backward is that forward with the sign turned
    constant     : whether a constant is kept beside it: that of the mirrored line. A mirrored line is always fitted beside
                   one, so that an offset is not taken for friction
    Raises ValueError: the record has no motion.
    """
    top = float(np.abs(speed).max(initial=0.0))
    if not top > 0.0:
        raise ValueError("the record has no motion, which friction over speed is seen in")
    if constant and not mirrored:
        beside = speed_line(speed, value, points, mirrored=True, constant=True).constant
        return replace(
            speed_line(speed, value - beside, points, mirrored=False, constant=False), constant=beside
        )
    grid = np.geomspace(SLOWEST * top, top, max(GRID, points))
    products, moments = _summed(speed, value, grid, mirrored)
    chosen = np.unique(np.rint(np.linspace(0, len(grid) - 1, points + 1)[1:]).astype(int))
    best = _error(products, moments, _basis(grid, chosen, mirrored))
    improved = True
    while improved:
        improved = False
        for place in range(points):
            lowest = chosen[place - 1] + 1 if place else 0
            highest = chosen[place + 1] if place + 1 < points else len(grid)
            for candidate in range(lowest, highest):
                tried = chosen.copy()
                tried[place] = candidate
                error = _error(products, moments, _basis(grid, tried, mirrored))
                if error < best - 1e-9 * abs(best):
                    best, chosen, improved = error, tried, True
    values = _bounded(products, moments, _basis(grid, chosen, mirrored), points, mirrored)
    forward = values[:points]
    backward = -forward if mirrored else values[points : 2 * points]
    return SpeedLine(grid[chosen], forward, backward, float(values[-1]) if constant else 0.0)


def _summed(speed: Array, value: Array, grid: Array, mirrored: bool) -> tuple[Array, Array]:
    """Products of the lines through the grid's points with each other and with the values; the last line is a constant."""
    size, count = np.abs(speed), len(grid)
    knots = np.concatenate([[0.0], grid])
    cell = np.clip(np.searchsorted(knots, size, side="right") - 1, 0, count - 1)
    upper = np.clip((size - knots[cell]) / (knots[cell + 1] - knots[cell]), 0.0, 1.0)
    back = speed < 0
    sides = 1 if mirrored else 2
    rows = np.arange(len(speed))
    columns = np.zeros((len(speed), sides * count + 1))
    shift = np.where(back, count, 0) if not mirrored else np.zeros(len(speed), int)
    sign = np.where(back, -1.0, 1.0) if mirrored else np.ones(len(speed))
    columns[rows, cell + shift] = sign * upper
    within = cell > 0
    columns[rows[within], (cell + shift)[within] - 1] = (sign * (1.0 - upper))[within]
    columns[:, -1] = 1.0
    return columns.T @ columns, columns.T @ value


def _basis(grid: Array, chosen: NDArray[np.intp], mirrored: bool) -> Array:
    """The lines through the chosen points as sums of those through the grid's."""
    knots = np.concatenate([[0.0], grid[chosen]])
    half = np.column_stack([np.interp(grid, knots, row) for row in np.eye(len(knots))[1:]])
    sides = 1 if mirrored else 2
    basis = np.zeros((sides * len(grid) + 1, sides * len(chosen) + 1))
    for side in range(sides):
        basis[side * len(grid) : (side + 1) * len(grid), side * len(chosen) : (side + 1) * len(chosen)] = half
    basis[-1, -1] = float(mirrored)
    return basis


def _error(products: Array, moments: Array, basis: Array) -> float:
    """Squared error less that of no line at all."""
    inner, right = basis.T @ products @ basis, basis.T @ moments
    inner[np.diag_indices_from(inner)] += 1e-12 * max(float(np.trace(inner)), 1e-300)
    return -float(right @ np.linalg.solve(inner, right))


def _bounded(products: Array, moments: Array, basis: Array, points: int, mirrored: bool) -> Array:
    """Values by least squares; none that drives."""
    inner, right = basis.T @ products @ basis, basis.T @ moments
    values, vectors = np.linalg.eigh(inner)
    root = np.sqrt(np.maximum(values, 1e-12 * values.max()))
    lower, upper = np.full(len(right), -np.inf), np.full(len(right), np.inf)
    lower[:points] = 0.0
    if not mirrored:
        upper[points : 2 * points] = 0.0
    solved = lsq_linear(root[:, None] * vectors.T, (vectors.T @ right) / root, (lower, upper))
    return np.asarray(solved.x, dtype=np.float64)


def turn_line(angle: Array, value: Array, points: int) -> Array:
    """(points,) values at equal distances over a turn, straight between, with the least squared error; their mean is 0.

    angle : (N,) rad, of the motor
    value : (N,) of the record
    """
    place = np.mod(angle / (2 * np.pi), 1.0) * points
    cell = np.minimum(place.astype(int), points - 1)
    upper = place - cell
    columns = np.zeros((len(angle), points))
    rows = np.arange(len(angle))
    columns[rows, cell] += 1.0 - upper
    columns[rows, (cell + 1) % points] += upper
    # a point that the record did not come near is bent least between its neighbours
    bend = 2.0 * np.eye(points) - np.roll(np.eye(points), 1, axis=0) - np.roll(np.eye(points), -1, axis=0)
    inner = columns.T @ columns + 1e-6 * max(len(angle) / points, 1.0) * bend.T @ bend
    values = np.linalg.lstsq(inner, columns.T @ value, rcond=None)[0]
    return values - values.mean()


def turn_line_at(values: Array, angle: Array) -> Array:
    """Of a turn's line at any angles, rad."""
    places = np.arange(len(values) + 1) / len(values)
    return np.interp(np.mod(angle / (2 * np.pi), 1.0), places, np.append(values, values[0]))
