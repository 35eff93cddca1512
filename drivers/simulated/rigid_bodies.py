"""Mass matrix and bias torques of a serial robot by Lagrange's equations with homogeneous matrices (Uicker,
Kahn).

Link k stands in the base frame by the 4 x 4 matrix T_k. With the unit twists Ŝ_j (4 x 4, about the axis of
joint j, in the base frame) and J_k = T_k J T_kᵀ, the link's pseudo-inertia ∫ r rᵀ dm in homogeneous
coordinates of the base:

    V_k = Σ_{j<=k} Ŝ_j q̇_j                      T̈_k = (A_k + Σ_{j<=k} Ŝ_j q̈_j) T_k
    A_k = V_k V_k + Σ_{j<=k} (V_j Ŝ_j − Ŝ_j V_j) q̇_j
    M_ij = Σ_{k>=max(i,j)} tr(Ŝ_i J_k Ŝ_jᵀ)      h_i = Σ_{k>=i} tr(Ŝ_i J_k (A_k − G)ᵀ)

where G carries gravity in its last column. All sums over links are cumulative sums over stacks of 4 x 4
matrices: some twenty calls of NumPy, whatever the number of links.
"""

from collections.abc import Sequence
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.plant_settings import Inertia, LinkSettings, Vector3

Array = NDArray[np.float64]


def pseudo_inertia(mass: float, com: Vector3, inertia: Inertia) -> Array:
    """(4, 4): ∫ r rᵀ dm with r = (x, y, z, 1) about the frame's origin.

    mass : kg; com : m; inertia : kg m² about the centre of mass, XX XY XZ YY YZ ZZ
    """
    xx, xy, xz, yy, yz, zz = inertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    centre = np.array(com, dtype=float)
    out = np.empty((4, 4))
    out[:3, :3] = 0.5 * np.trace(tensor) * np.eye(3) - tensor + mass * np.outer(centre, centre)
    out[:3, 3] = out[3, :3] = mass * centre
    out[3, 3] = mass
    return out


class RigidBodies:
    """The links of a robot with revolute joints, and what hangs on the last one."""

    def __init__(self, links: Sequence[LinkSettings], gravity: Vector3, payload: Array | None = None) -> None:
        """payload : (4, 4) pseudo-inertia in the last link's frame"""
        self._joints = tuple((cos(link.alpha), sin(link.alpha), link.d, link.theta, link.r) for link in links)
        self._inertias = np.array([pseudo_inertia(link.mass, link.com, link.inertia) for link in links])
        if payload is not None:
            self._inertias[-1] += payload
        self._gravity = np.zeros((4, 4))
        self._gravity[:3, 3] = gravity
        n = len(links)
        self._lower = np.tril(np.ones((n, n)))
        self._strictly_lower = np.tril(np.ones((n, n)), -1)

    def frames(self, q: Sequence[float]) -> tuple[Array, Array]:
        """(T, Ŝ), each (n, 4, 4): frames of the links and unit twists of the joints, in the base frame,
        at q (rad).
        """
        frames: list[float] = []
        twists: list[float] = []
        x0, x1, x2 = 1.0, 0.0, 0.0
        y0, y1, y2 = 0.0, 1.0, 0.0
        z0, z1, z2 = 0.0, 0.0, 1.0
        p0, p1, p2 = 0.0, 0.0, 0.0
        for angle, (ca, sa, d, theta, r) in zip(q, self._joints, strict=True):
            c, s = cos(angle + theta), sin(angle + theta)
            # turn about x by α, then about the new z by θ; shift by d along the old x and by r along the
            # new z
            p0, p1, p2 = p0 + d * x0, p1 + d * x1, p2 + d * x2
            u0, u1, u2 = ca * y0 + sa * z0, ca * y1 + sa * z1, ca * y2 + sa * z2
            z0, z1, z2 = ca * z0 - sa * y0, ca * z1 - sa * y1, ca * z2 - sa * y2
            y0, y1, y2 = c * u0 - s * x0, c * u1 - s * x1, c * u2 - s * x2
            x0, x1, x2 = c * x0 + s * u0, c * x1 + s * u1, c * x2 + s * u2
            p0, p1, p2 = p0 + r * z0, p1 + r * z1, p2 + r * z2
            frames += (x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2, 0.0, 0.0, 0.0, 1.0)
            twists += (
                *(0.0, -z2, z1, p1 * z2 - p2 * z1),
                *(z2, 0.0, -z0, p2 * z0 - p0 * z2),
                *(-z1, z0, 0.0, p0 * z1 - p1 * z0),
                *(0.0, 0.0, 0.0, 0.0),
            )
        n = len(self._joints)
        return np.array(frames).reshape(n, 4, 4), np.array(twists).reshape(n, 4, 4)

    def dynamics(self, q: Sequence[float], v: Array) -> tuple[Array, Array]:
        """Mass matrix (n, n), kg m², and bias torques (n,), N m: gravity, centrifugal and Coriolis.

        q : n joint angles, rad; v : (n,) rad/s
        """
        frames, twists = self.frames(q)
        n = len(frames)
        inertias = frames @ self._inertias @ frames.transpose(0, 2, 1)
        moving = twists * v[:, np.newaxis, np.newaxis]
        velocity = moving.cumsum(axis=0)
        acceleration = velocity @ velocity - self._gravity
        acceleration += (velocity @ moving - moving @ velocity).cumsum(axis=0)
        carried = inertias[::-1].cumsum(axis=0)[::-1]
        forces = (acceleration @ inertias)[::-1].cumsum(axis=0)[::-1]
        flat = twists.reshape(n, 16)
        half = (twists @ carried).reshape(n, 16) @ flat.T
        lower = half * self._lower
        mass = lower + (half * self._strictly_lower).T
        bias = (flat * forces.reshape(n, 16)).sum(axis=1)
        return mass, bias

    def energy(self, q: Sequence[float], v: Array) -> float:
        """Kinetic and potential energy, J."""
        frames, _ = self.frames(q)
        mass, _ = self.dynamics(q, v)
        potential = -np.einsum("i,kij,kj->", self._gravity[:3, 3], frames[:, :3, :], self._inertias[:, :, 3])
        return float(0.5 * v @ mass @ v + potential)
