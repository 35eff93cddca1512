"""Motion of the links of a serial robot and the wrench that each of their parameters makes (Newton-Euler)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.constant_folding import (
    Component,
    FrameChange,
    Vector,
    cross,
    difference,
    matrix_times,
    negative,
    product,
    total,
    vector_sum,
)
from identify.dynamics.geometry import Geometry
from identify.dynamics.standard_parameters import STANDARD_PARAMETERS


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
        """Moment at the origin per unit of a parameter, N m per unit; None where there is none."""
        wy_wz, wx_wz, wx_wy = self.products
        ax, ay, az = self.acceleration
        first, second, third = self.angular_acceleration
        (u00, u10, u20), (u01, u11, u21), (u02, u12, u22) = self.gyration
        match STANDARD_PARAMETERS[parameter]:
            case "XX":
                return first, wx_wz, negative(wx_wy)
            case "XY":
                return negative(u20), u21, difference(u00, u11)
            case "XZ":
                return u10, difference(u22, u00), negative(u12)
            case "YY":
                return negative(wy_wz), second, wx_wy
            case "YZ":
                return difference(u11, u22), negative(u01), u02
            case "ZZ":
                return wy_wz, negative(wx_wz), third
            case "MX":
                return 0.0, negative(az), ay
            case "MY":
                return az, 0.0, negative(ax)
            case "MZ":
                return negative(ay), ax, 0.0
        return None

    def force(self, parameter: int) -> Vector | None:
        """Force per unit of a parameter, N per unit; None where there is none."""
        match STANDARD_PARAMETERS[parameter]:
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
        turn = FrameChange(float(geometry.alpha[j]), theta)
        origin = product(r, -turn.sin_alpha), product(r, turn.cos_alpha)
        lever: Vector = (float(geometry.d[j]), *origin)

        acceleration = turn.into(vector_sum(acceleration, matrix_times(gyration, lever)))
        velocity = turn.into(velocity)
        angular_acceleration = turn.into(angular_acceleration)
        x, y, z = velocity
        if prismatic:
            ax, ay, az = acceleration
            coriolis = product(dq[j], 2.0)
            acceleration = (
                total(ax, product(y, coriolis)),
                difference(ay, product(x, coriolis)),
                total(az, ddq[j]),
            )
        else:
            first, second, third = angular_acceleration
            angular_acceleration = (
                total(first, product(y, dq[j])),
                difference(second, product(x, dq[j])),
                total(third, ddq[j]),
            )
            velocity = (x, y, total(z, dq[j]))

        for i in range(j):
            turned = rotations[i]
            moved = translations[i]
            if turned is not None:
                moved = vector_sum(moved, cross(turned, lever))
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
    yz, xz, xy = product(y, z), product(x, z), product(x, y)
    xx, yy, zz = product(x, x), product(y, y), product(z, z)
    columns = (
        (negative(total(yy, zz)), total(xy, third), difference(xz, second)),
        (difference(xy, third), negative(total(xx, zz)), total(yz, first)),
        (total(xz, second), difference(yz, first), negative(total(xx, yy))),
    )
    return columns, (yz, xz, xy)
