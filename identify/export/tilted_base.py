"""A base that is not level, in formats with bodies: gravity itself is tilted, and pulls on the bodies.

That is the identified torque wherever gravity, as declared, loads the joint. Of the first link of an upright first joint the
record tells nothing but its moment of inertia about the axis, so that its centre of mass is free to be where gravity's torque on
that joint has the least error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.export.exported_model import ExportedModel
from identify.export.formula_torque import module_of, module_torque
from identify.export.record_error import Motion

Array = NDArray[np.float64]

SAME = 1e-6
"""of the tilt's torque on a joint: bodies that have the identified base parameters to rounding leave less"""

ZZ, MX, MASS = 5, 6, 9
"""places among a link's standard parameters"""


@dataclass(frozen=True)
class TiltedBase:
    """What a file with bodies makes of a tilt.

    gravity  : (3,) m/s², the file's
    standard : (11 n,) its bodies
    left     : (n,) part of the tilt's torque on each joint that the file does not have, root mean square over the record; 1 where
        it has none, 0 where there is no such torque
    held     : whether gravity is tilted; it is not where that would be further off than nothing
    """

    gravity: Array
    standard: Array
    left: Array
    held: bool = True

    def sort(self, joint: int) -> int:
        """Of a joint: 0 where the file keeps the tilt, 1 where it approximates it, 2 where it loses it."""
        return 0 if self.left[joint] <= SAME else 1 if self.left[joint] < 1.0 else 2

    def in_words(self, names: Sequence[str]) -> list[str]:
        """Remarks on what gravity the file has, and on joints that its tilt pulls on in another way than the model's."""
        if not self.held:
            return [
                "a base that is not level: no gravity makes the torques that were identified; it is left as declared"
            ]
        x, y, z = (float(value) for value in self.gravity)
        remarks = [f"the base is not level: gravity in its frame is {x:g} {y:g} {z:g} m/s²"]
        for name, left in zip(names, self.left, strict=True):
            if left > SAME and math.isfinite(left):
                remarks.append(f"{name}: the torque of the base's tilt is {left:.1%} off what was identified")
            elif left > SAME:
                remarks.append(
                    f"{name}: gravity of a base that is not level pulls on it in the file, and does not in the model"
                )
        return remarks


def tilted_base(
    model: ExportedModel, standard: Array, upright: bool, motions: Sequence[Motion]
) -> TiltedBase | None:
    """Of a model with a tilt, on the motion of its record; None where it has none.

    standard : (11 n,) of bodies with mass
    upright  : whether gravity, as declared, makes no torque on the first joint
    """
    tilts = tuple(each for each in model.torques if each.tilts_gravity)
    if not tilts:
        return None
    q = np.concatenate([motion.q for motion in motions])
    wanted = _wanted(replace(model, torques=tilts), motions)
    pull = np.asarray(sum(v * way for v, way in zip(tilts[0].values, model.directions, strict=True)), float)
    tilted = replace(model.geometry, gravity=pull)
    bodies = standard
    if upright and not model.geometry.prismatic[0]:
        bodies = _with_first_centre(tilted, standard, q, wanted[:, 0])
    off = _at_rest(tilted, bodies, q) - wanted
    size = np.linalg.norm(wanted, axis=0)
    if np.sum(off**2) >= np.sum(size**2):
        return TiltedBase(model.geometry.gravity, standard, np.where(size > 0.0, 1.0, 0.0), False)
    left = np.linalg.norm(off, axis=0)
    nothing = SAME * float(size.max())
    share = np.where(size > 0.0, left / np.maximum(size, 1e-300), np.where(left <= nothing, 0.0, np.inf))
    return TiltedBase(model.geometry.gravity + pull, bodies, share)


def _wanted(model: ExportedModel, motions: Sequence[Motion]) -> Array:
    """(N, n) torque of the tilt alone, without payload."""
    torque_of = module_torque(module_of(model), model)
    torques = []
    for motion in motions:
        bare = motion.payload.model_copy(update={"mass": 0.0, "inertia": (0.0,) * 6})
        still = np.zeros(motion.q.shape)
        at_rest = replace(motion, dq=still, ddq=still, payload=bare)
        torques.append(torque_of(at_rest) - _at_rest(model.geometry, model.standard, motion.q))
    return np.concatenate(torques)


def _at_rest(geometry: Geometry, standard: Array, q: Array) -> Array:
    """(N, n) torque that holds the bodies at rest."""
    still = np.zeros(q.shape)
    return np.asarray(InverseDynamics(geometry, [standard]).torques(q, still, still)[0], float)


def _with_first_centre(tilted: Geometry, standard: Array, q: Array, wanted: Array) -> Array:
    """The bodies, the first one with the centre of mass that leaves the least of the torque wanted on its joint.

    It keeps its moment of inertia about the axis; its mass is what a body of that inertia has at least, twice.
    """
    bodies = standard.copy()
    bodies[MX : MX + 2] = 0.0
    rest = _at_rest(tilted, bodies, q)[:, 0]
    columns = []
    for axis in range(2):
        unit = np.zeros(len(bodies))
        unit[MX + axis] = 1.0
        columns.append(_at_rest(tilted, unit, q)[:, 0])
    moments = np.linalg.lstsq(np.column_stack(columns), wanted - rest, rcond=1e-9)[0]
    about = float(standard[ZZ])
    mass = max(float(standard[MASS]), 4.0 * float(moments @ moments) / about)
    bodies[: MASS + 1] = [about, 0.0, 0.0, about, 0.0, about, *moments, 0.0, mass]
    return bodies
