"""Friction in formats with a few coefficients a joint: exactly where these are all there is, else fitted on the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from identify.effects.effect import LinkFilePlace
from identify.export.exported_model import RIGID, ExportedModel, Torque
from identify.export.link_files import JointFriction
from identify.export.record_error import Motion, TorqueOf

Array = NDArray[np.float64]

PLACES: dict[str, tuple[LinkFilePlace, ...]] = {
    "urdf": ("damping", "dry"),
    "sdf": ("damping", "dry", "stiffness"),
    "xml": ("damping", "dry", "stiffness", "quadratic", "cubic", "constant"),
}
"""what a joint has in each format"""
NEVER_NEGATIVE: dict[str, tuple[LinkFilePlace, ...]] = {"sdf": ("stiffness",)}
"""what the readers of a format refuse below zero, friction apart: Drake ends with an error"""
HAS_ROTORS = ("xml",)
WORTH_A_POLYNOMIAL = 0.95
"""part of the error that damping in proportion to the speed leaves; a polynomial, which older versions of MuJoCo refuse, is taken
for fitted friction only where it leaves less"""


@dataclass(frozen=True)
class JointPart:
    """What a format keeps of a joint's friction, and how."""

    friction: JointFriction
    kept: tuple[str, ...]
    approximated: tuple[str, ...]
    lost: tuple[str, ...]


def joint_parts(
    model: ExportedModel, kind: str, motions: list[Motion], torque_of: TorqueOf
) -> list[JointPart]:
    """For every joint what the format `kind` (urdf, sdf, xml) keeps.

    motions   : of the identification sessions
    torque_of : torque of the whole exported model and of its rigid part alone is the difference that is fitted
    """
    parts = []
    friction = [(motion, torque_of(motion)) for motion in motions]
    for joint in range(model.joints):
        of_joint = [part for part in model.torques if part.row == joint]
        missing = [effect for effect, place in model.lost if place == joint]
        placed = {part.place: part for part in of_joint if part.place and _has_place(kind, part)}
        exact = {place: sum(part.values) for place, part in placed.items()}
        rubbing = [part for part in of_joint if part.rubs and part not in placed.values()]
        approximated: list[str] = []
        if rubbing or any(exact.get(place, 0.0) < 0 for place in ("damping", "dry")):
            exact |= _fitted(joint, friction, kind, exact.get("stiffness", 0.0))
            approximated = [part.effect for part in [*rubbing, *(p for p in placed.values() if p.rubs)]]
        rotor = float(model.standard[11 * joint + 10]) if kind in HAS_ROTORS else 0.0
        held = [part.effect for part in placed.values() if part.effect not in approximated]
        lost = [part.effect for part in of_joint if part.effect not in (*held, *approximated)]
        parts.append(
            JointPart(
                JointFriction(**exact, rotor=rotor),
                (RIGID, *held),
                tuple(dict.fromkeys(approximated)),
                (*dict.fromkeys(lost), *missing),
            )
        )
    return parts


def _has_place(kind: str, part: Torque) -> bool:
    refused = part.place in NEVER_NEGATIVE.get(kind, ()) and sum(part.values) < 0
    return part.place in PLACES[kind] and not refused


def _fitted(
    joint: int, friction: list[tuple[Motion, Array]], kind: str, stiffness: float
) -> dict[LinkFilePlace, float]:
    """What the format has for friction, none of it below zero, and for a constant, with the least squared error of this joint's
    friction torque.

    stiffness : of the spring that the file has beside it
    """
    q, dq = (np.concatenate([part[:, joint] for part in parts]) for parts in _motion_of(friction))
    torque = np.concatenate([values[:, joint] for _, values in friction]) - stiffness * q
    columns: dict[LinkFilePlace, Array] = {
        "damping": dq,
        "dry": np.sign(dq),
        "quadratic": np.abs(dq) * dq,
        "cubic": dq**3,
        "constant": np.ones(len(dq)),
    }
    straight = _least_squares(
        {place: columns[place] for place in ("damping", "dry", "constant") if place in PLACES[kind]}, torque
    )
    curved = _least_squares({place: columns[place] for place in PLACES[kind] if place in columns}, torque)
    return (curved if curved[1] < WORTH_A_POLYNOMIAL * straight[1] else straight)[0]


def _least_squares(
    columns: dict[LinkFilePlace, Array], torque: Array
) -> tuple[dict[LinkFilePlace, float], float]:
    """Coefficients, none of friction below zero, and the norm of what they leave.

    A constant stands beside them also where the format has no place for one: it must not be taken for friction.
    """
    rubbing: dict[LinkFilePlace, Array] = {p: column for p, column in columns.items() if p != "constant"}
    constant = np.ones(len(torque))
    table = np.column_stack([*rubbing.values(), constant, -constant])
    size = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    values, left = nnls(table / size, torque)
    values /= size
    coefficients: dict[LinkFilePlace, float] = {
        place: float(value) for place, value in zip(rubbing, values, strict=False)
    }
    if "constant" in columns:
        coefficients["constant"] = float(values[-2] - values[-1])
    return coefficients, float(left)


def _motion_of(friction: list[tuple[Motion, Array]]) -> tuple[list[Array], list[Array]]:
    return [motion.q for motion, _ in friction], [motion.dq for motion, _ in friction]
