"""A torque as a line through a few support points, chosen for the least squared error on a record.

Drives keep their own compensation so: friction over speed, cogging over a turn of the motor. A line with given support points
is linear in its values, so that these follow by least squares; the speeds of the points are searched for on a grid, one after
the other, until no point's place can be bettered. The record is summed up once, in the products of the grid's own lines.

Values follow the record where it came, and have no freedom where it did not: there a line is as level as it can be.
Samples slower than the slowest support point that there can be say nothing of any: the drive's line goes through zero there,
and a friction that does not is met at one speed only. Left in, they raise the first point to twice the friction, for
which a second one beside it makes up.
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
STIFFNESS = 1e-7
"""of the samples that a point has on average, what the line's slope counts: nothing beside samples, all where there are none"""


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
    """The line with the least squared error on the samples that are no slower than the slowest support point can be.

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
    seen = np.abs(speed) >= grid[0]
    products, moments = _summed(speed[seen], value[seen], grid, mirrored)
    stiffness = STIFFNESS * max(np.count_nonzero(seen) / points, 1.0)

    def normal(chosen: NDArray[np.intp]) -> tuple[Array, Array]:
        basis, slopes = _basis(grid, chosen, mirrored), _slopes(grid[chosen], mirrored)
        return basis.T @ products @ basis + stiffness * slopes.T @ slopes, basis.T @ moments

    chosen = np.unique(np.rint(np.linspace(0, len(grid) - 1, points + 1)[1:]).astype(int))
    best = _error(*normal(chosen))
    improved = True
    while improved:
        improved = False
        for place in range(points):
            lowest = chosen[place - 1] + 1 if place else 0
            highest = chosen[place + 1] if place + 1 < points else len(grid)
            for candidate in range(lowest, highest):
                tried = chosen.copy()
                tried[place] = candidate
                error = _error(*normal(tried))
                if error < best - 1e-9 * abs(best):
                    best, chosen, improved = error, tried, True
    values = _bounded(*normal(chosen), points, mirrored)
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


def _slopes(speeds: Array, mirrored: bool) -> Array:
    """Rows whose squares add up to those of the line's slope over the speeds, beyond the first point: least for a line that goes
    straight where there are samples on both sides, and keeps its value where there are none further on."""
    points, sides = len(speeds), 1 if mirrored else 2
    half = np.diff(np.eye(points), axis=0) * np.sqrt(speeds[-1] / np.diff(speeds))[:, None]
    return np.column_stack([np.kron(np.eye(sides), half), np.zeros(sides * (points - 1))])


def _error(inner: Array, right: Array) -> float:
    """Squared error less that of no line at all, from the normal equations."""
    inner = inner.copy()
    inner[np.diag_indices_from(inner)] += 1e-12 * max(float(np.trace(inner)), 1e-300)
    return -float(right @ np.linalg.solve(inner, right))


def _bounded(inner: Array, right: Array, points: int, mirrored: bool) -> Array:
    """Values by least squares; none that drives."""
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
