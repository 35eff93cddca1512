"""Mass and inertia of MuJoCo's shapes, for bodies whose file leaves them to its compiler.

Of <https://mujoco.readthedocs.io/en/stable/XMLreference.html>: body/geom (type, size, fromto, mass, density, group), compiler
(inertiafromgeom, inertiagrouprange). Solids of uniform density; shells, meshes and height fields are not known here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WATER = 1000.0
"""kg/m^3, the density of a shape that states none."""
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Solids that are known, and how many sizes each has: radius; radius and half length; three half lengths."""
LONG = ("capsule", "cylinder", "ellipsoid", "box")
"""Solids that may lie from one point to another."""
WITHOUT_MASS = ("plane", "hfield")


@dataclass(frozen=True)
class Solid:
    """A shape in its body."""

    kind: str
    size: Array
    """m, as many as the kind has, of a capsule and a cylinder the half length last"""
    placement: Array
    """(4, 4) of its axes in the body"""
    mass: float | None
    """kg; None: by its density"""
    density: float
    """kg/m^3"""

    def weight(self) -> float:
        """Its mass, kg."""
        return self.density * self.volume() if self.mass is None else self.mass

    def volume(self) -> float:
        """m^3"""
        r = float(self.size[0])
        if self.kind == "sphere":
            return 4 / 3 * np.pi * r**3
        if self.kind == "cylinder":
            return 2 * np.pi * r**2 * float(self.size[1])
        if self.kind == "capsule":
            return 2 * np.pi * r**2 * float(self.size[1]) + 4 / 3 * np.pi * r**3
        product = float(np.prod(self.size))
        return 4 / 3 * np.pi * product if self.kind == "ellipsoid" else 8 * product

    def principal(self) -> Array:
        """(3,) moments of inertia about its axes through its centre, kg m^2."""
        m, r = self.weight(), float(self.size[0])
        if self.kind == "sphere":
            return np.full(3, 2 / 5 * m * r**2)
        if self.kind in ("ellipsoid", "box"):
            squares = self.size**2
            return m * (squares.sum() - squares) / (5 if self.kind == "ellipsoid" else 3)
        h = float(self.size[1])
        if self.kind == "cylinder":
            across = m * (3 * r**2 + 4 * h**2) / 12
            return np.array([across, across, m * r**2 / 2])
        round_share = (
            4 / 3 * np.pi * r**3
        ) / self.volume()  # of the mass, in the two half spheres at the ends
        ends, middle = m * round_share, m * (1 - round_share)
        across = middle * (r**2 / 4 + h**2 / 3) + ends * (2 / 5 * r**2 + h**2 + 3 / 4 * h * r)
        return np.array([across, across, middle * r**2 / 2 + ends * 2 / 5 * r**2])


def body_of(solids: list[Solid]) -> tuple[float, Array, Array]:
    """Mass (kg), (3,) centre of mass (m) and (3, 3) inertia about it (kg m^2) of solids that move as one."""
    masses = np.array([solid.weight() for solid in solids])
    total = float(masses.sum())
    if total <= 0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    centres = np.array([solid.placement[:3, 3] for solid in solids])
    centre = masses @ centres / total
    tensor = np.zeros((3, 3))
    for solid, mass, place in zip(solids, masses, centres, strict=True):
        turn, way = solid.placement[:3, :3], place - centre
        tensor += turn @ np.diag(solid.principal()) @ turn.T
        tensor += mass * ((way @ way) * np.eye(3) - np.outer(way, way))
    return total, centre, tensor
