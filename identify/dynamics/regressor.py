"""Regressor of the inverse dynamic model in the standard parameters, eq. (9), vectorised over the samples.

Newton-Euler in the links' own frames (paper's [11], chapter 9). For link j with angular velocity w, angular
acceleration w' and acceleration a of its origin O_j (gravity included), its ten parameters make at O_j

    force  f = M a + U MS            U = [w']x + [w]x [w]x
    moment n = J w' + w x J w + MS x a

and joint i feels  tau_i = z_i . n + (z_i x O_i O_j) . f  (revolute) or  tau_i = z_i . f  (prismatic), all in
frame j.

A quantity is held as three components, each an array over the samples or a plain float where it is constant:
products with a constant 0 or 1 are then never computed, which is what a symbolic generator does when it
customises the recursion to a robot. Samples are taken in blocks whose intermediate arrays stay in the
processor's cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.standard_parameters import LINK_PARAMETERS, PARAMETERS_PER_JOINT

Component = float | NDArray[np.float64]
Vector = tuple[Component, Component, Component]

BLOCK_SAMPLES = 2048
"""Samples taken at once: about a hundred arrays of 16 kB are alive, which is what a core's second-level cache
holds."""

ROTOR = len(LINK_PARAMETERS)
"""Index of Ia among the parameters of a joint."""


@dataclass(frozen=True)
class ColumnRequest:
    """One column to compute: the torque on `joint` per unit of `parameter` of `link`, into row `row` of the
    result.
    """

    joint: int
    link: int
    parameter: int
    row: int


def standard_regressor(
    geometry: Geometry, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike
) -> NDArray[np.float64]:
    """Standard regressor D_St of eq. (9), inertial part.

    q, dq, ddq : (N, n) joint positions, velocities, accelerations, rad or m
    Returns      (N, n, 11 n): torque (N m or N) on each joint per unit of each standard parameter, in the
                 order of `standard_names`. The samples are contiguous in memory.
    """
    n = geometry.joint_count
    width = PARAMETERS_PER_JOINT * n
    requests = [
        ColumnRequest(joint, link, parameter, joint * width + link * PARAMETERS_PER_JOINT + parameter)
        for link in range(n)
        for joint in range(link + 1)
        for parameter in range(PARAMETERS_PER_JOINT)
        if parameter != ROTOR or joint == link
    ]
    samples = np.shape(q)[0]
    rows = np.zeros((n * width, samples))
    compute_columns(geometry, q, dq, ddq, requests, rows)
    return rows.reshape(n, width, samples).transpose(2, 0, 1)


def compute_columns(
    geometry: Geometry,
    q: ArrayLike,
    dq: ArrayLike,
    ddq: ArrayLike,
    requests: list[ColumnRequest],
    rows: NDArray[np.float64],
) -> None:
    """Write the requested columns of the standard regressor into `rows`.

    q, dq, ddq : (N, n)
    rows       : (>= number of requests, N), overwritten at the requested rows; other rows are left alone
    Raises ValueError if the shapes do not match the robot.
    """
    motion = [np.asarray(array, dtype=float) for array in (q, dq, ddq)]
    for array in motion:
        if array.shape != (rows.shape[1], geometry.joint_count):
            raise ValueError(
                f"positions, velocities and accelerations must be ({rows.shape[1]}, {geometry.joint_count}), "
                f"not {array.shape}"
            )
    by_link: dict[int, list[ColumnRequest]] = {}
    for request in requests:
        by_link.setdefault(request.link, []).append(request)
    last_link = max(by_link, default=-1)
    for start in range(0, rows.shape[1], BLOCK_SAMPLES):
        block = slice(start, min(start + BLOCK_SAMPLES, rows.shape[1]))
        positions, velocities, accelerations = (np.ascontiguousarray(array[block].T) for array in motion)
        for link in link_motions(geometry, positions, velocities, accelerations, last_link):
            for request in by_link.get(link.index, ()):
                _write_column(link, request, rows[request.row, block], accelerations)


@dataclass(frozen=True)
class LinkMotion:
    """Motion of one link over a block of samples, in the link's own frame.

    gyration     : U = [w']x + [w]x [w]x as three columns
    acceleration : of the frame's origin, gravity subtracted, m/s^2
    rotations    : axis of each joint up to this one as it turns the link (None for a prismatic joint)
    translations : velocity of the frame's origin per unit of each joint's velocity
    """

    index: int
    angular_acceleration: Vector
    products: Vector
    gyration: tuple[Vector, Vector, Vector]
    acceleration: Vector
    rotations: list[Vector | None]
    translations: list[Vector]

    def moment(self, parameter: int) -> Vector | None:
        """Moment at the origin per unit of a link parameter, N m per unit; None where there is none."""
        wy_wz, wx_wz, wx_wy = self.products
        ax, ay, az = self.acceleration
        first, second, third = self.angular_acceleration
        (u00, u10, u20), (u01, u11, u21), (u02, u12, u22) = self.gyration
        match LINK_PARAMETERS[parameter]:
            case "XX":
                return first, wx_wz, _negative(wx_wy)
            case "XY":
                return _negative(u20), u21, _difference(u00, u11)
            case "XZ":
                return u10, _difference(u22, u00), _negative(u12)
            case "YY":
                return _negative(wy_wz), second, wx_wy
            case "YZ":
                return _difference(u11, u22), _negative(u01), u02
            case "ZZ":
                return wy_wz, _negative(wx_wz), third
            case "MX":
                return 0.0, _negative(az), ay
            case "MY":
                return az, 0.0, _negative(ax)
            case "MZ":
                return _negative(ay), ax, 0.0
        return None

    def force(self, parameter: int) -> Vector | None:
        """Force per unit of a link parameter, N per unit; None where there is none."""
        match LINK_PARAMETERS[parameter]:
            case "MX":
                return self.gyration[0]
            case "MY":
                return self.gyration[1]
            case "MZ":
                return self.gyration[2]
            case "M":
                return self.acceleration
        return None


def link_motions(
    geometry: Geometry,
    q: NDArray[np.float64],
    dq: NDArray[np.float64],
    ddq: NDArray[np.float64],
    last_link: int,
) -> Iterator[LinkMotion]:
    """Forward recursion over the links 0 .. last_link; q, dq, ddq are (n, samples)."""
    velocity: Vector = (0.0, 0.0, 0.0)
    angular_acceleration: Vector = (0.0, 0.0, 0.0)
    gx, gy, gz = geometry.gravity.tolist()
    acceleration: Vector = (-gx, -gy, -gz)
    gyration: tuple[Vector, Vector, Vector] = (velocity, velocity, velocity)
    rotations: list[Vector | None] = []
    translations: list[Vector] = []
    for j in range(last_link + 1):
        prismatic = bool(geometry.prismatic[j])
        theta: Component = float(geometry.theta[j]) if prismatic else q[j] + geometry.theta[j]
        r: Component = q[j] + geometry.r[j] if prismatic else float(geometry.r[j])
        turn = _FrameChange(float(geometry.alpha[j]), theta)
        origin = _product(r, -turn.sin_alpha), _product(r, turn.cos_alpha)
        lever: Vector = (float(geometry.d[j]), *origin)

        acceleration = turn.into(_sum3(acceleration, _matrix_times(gyration, lever)))
        velocity = turn.into(velocity)
        angular_acceleration = turn.into(angular_acceleration)
        x, y, z = velocity
        if prismatic:
            ax, ay, az = acceleration
            coriolis = _product(dq[j], 2.0)
            acceleration = (
                _sum(ax, _product(y, coriolis)),
                _difference(ay, _product(x, coriolis)),
                _sum(az, ddq[j]),
            )
        else:
            first, second, third = angular_acceleration
            angular_acceleration = (
                _sum(first, _product(y, dq[j])),
                _difference(second, _product(x, dq[j])),
                _sum(third, ddq[j]),
            )
            velocity = (x, y, _sum(z, dq[j]))

        for i in range(j):
            turned = rotations[i]
            moved = translations[i]
            if turned is not None:
                moved = _sum3(moved, _cross(turned, lever))
                rotations[i] = turn.into(turned)
            translations[i] = turn.into(moved)
        rotations.append(None if prismatic else (0.0, 0.0, 1.0))
        translations.append((0.0, 0.0, 1.0) if prismatic else (0.0, 0.0, 0.0))

        gyration, products = _gyration(velocity, angular_acceleration)
        yield LinkMotion(
            j, angular_acceleration, products, gyration, acceleration, list(rotations), list(translations)
        )


def _gyration(velocity: Vector, rate: Vector) -> tuple[tuple[Vector, Vector, Vector], Vector]:
    """Columns of U = [w']x + [w]x [w]x, and the products w_y w_z, w_x w_z, w_x w_y."""
    x, y, z = velocity
    first, second, third = rate
    yz, xz, xy = _product(y, z), _product(x, z), _product(x, y)
    xx, yy, zz = _product(x, x), _product(y, y), _product(z, z)
    columns = (
        (_negative(_sum(yy, zz)), _sum(xy, third), _difference(xz, second)),
        (_difference(xy, third), _negative(_sum(xx, zz)), _sum(yz, first)),
        (_sum(xz, second), _difference(yz, first), _negative(_sum(xx, yy))),
    )
    return columns, (yz, xz, xy)


def _write_column(
    link: LinkMotion, request: ColumnRequest, out: NDArray[np.float64], accelerations: NDArray[np.float64]
) -> None:
    """One column over a block of samples: z_i . n + (z_i x O_i O_j) . f, into `out`."""
    if request.parameter == ROTOR:
        out[:] = accelerations[
            request.joint
        ]  # Ia_j is referred to the joint: it is felt there and nowhere else
        return
    pairs: list[tuple[Component, Component]] = []
    rotation = link.rotations[request.joint]
    moment = link.moment(request.parameter)
    force = link.force(request.parameter)
    if rotation is not None and moment is not None:
        pairs += zip(rotation, moment, strict=True)
    if force is not None:
        pairs += zip(link.translations[request.joint], force, strict=True)
    terms = [pair for pair in pairs if not (_is_zero(pair[0]) or _is_zero(pair[1]))]
    if not terms:
        out[:] = 0.0
        return
    np.multiply(*terms[0], out=out)
    for left, right in terms[1:]:
        out += _product(left, right)


class _FrameChange:
    """Components of a vector of frame j-1 in frame j: Rot(z, -theta) Rot(x, -alpha)."""

    def __init__(self, alpha: float, theta: Component) -> None:
        self.cos_alpha, self.sin_alpha = _clean_cosine_sine(alpha)
        if isinstance(theta, float):
            self.cos_theta, self.sin_theta = _clean_cosine_sine(theta)
        else:
            self.cos_theta, self.sin_theta = np.cos(theta), np.sin(theta)

    def into(self, vector: Vector) -> Vector:
        x, y, z = vector
        tilted = _sum(_product(y, self.cos_alpha), _product(z, self.sin_alpha))
        return (
            _sum(_product(x, self.cos_theta), _product(tilted, self.sin_theta)),
            _difference(_product(tilted, self.cos_theta), _product(x, self.sin_theta)),
            _difference(_product(z, self.cos_alpha), _product(y, self.sin_alpha)),
        )


def _clean_cosine_sine(angle: float) -> tuple[float, float]:
    """Cosine and sine; what rounding leaves of a zero (6e-17 for the cosine of pi/2) is a zero."""
    cosine, sine = float(np.cos(angle)), float(np.sin(angle))
    return (0.0 if abs(cosine) < 1e-15 else cosine), (0.0 if abs(sine) < 1e-15 else sine)


def _is_zero(value: Component) -> bool:
    return isinstance(value, float) and value == 0.0


def _product(left: Component, right: Component) -> Component:
    if isinstance(left, float):
        left, right = right, left
    if isinstance(right, float):
        if right == 0.0 or _is_zero(left):
            return 0.0
        if right == 1.0:
            return left
    return left * right


def _sum(left: Component, right: Component) -> Component:
    if _is_zero(left):
        return right
    return left if _is_zero(right) else left + right


def _difference(left: Component, right: Component) -> Component:
    if _is_zero(right):
        return left
    return -right if _is_zero(left) else left - right


def _negative(value: Component) -> Component:
    return 0.0 if _is_zero(value) else -value


def _sum3(left: Vector, right: Vector) -> Vector:
    return _sum(left[0], right[0]), _sum(left[1], right[1]), _sum(left[2], right[2])


def _cross(left: Vector, right: Vector) -> Vector:
    (a, b, c), (x, y, z) = left, right
    return (
        _difference(_product(b, z), _product(c, y)),
        _difference(_product(c, x), _product(a, z)),
        _difference(_product(a, y), _product(b, x)),
    )


def _matrix_times(columns: tuple[Vector, Vector, Vector], vector: Vector) -> Vector:
    scaled = [
        tuple(_product(entry, weight) for entry in column)
        for column, weight in zip(columns, vector, strict=True)
    ]
    return _sum3(_sum3(scaled[0], scaled[1]), scaled[2])  # pyright: ignore
