"""Friction in formats that have damping and dry friction alone: exactly where that is all, else fitted on the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from identify.export.exported_model import RIGID, ExportedModel
from identify.export.link_files import JointFriction
from identify.export.record_error import Motion, TorqueOf

Array = NDArray[np.float64]

HAS_SPRINGS = ("sdf", "xml")
HAS_ROTORS = ("xml",)


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
        placed = {part.place: part for part in of_joint if part.place and _has_place(kind, part.place)}
        exact = {place: sum(part.values) for place, part in placed.items()}
        rubbing = [part for part in of_joint if part.rubs and part not in placed.values()]
        approximated: list[str] = []
        if rubbing or any(exact.get(place, 0.0) < 0 for place in ("damping", "dry")):
            exact["damping"], exact["dry"] = _fitted(joint, friction)
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


def _has_place(kind: str, place: str) -> bool:
    return place != "stiffness" or kind in HAS_SPRINGS


def _fitted(joint: int, friction: list[tuple[Motion, Array]]) -> tuple[float, float]:
    """Damping and dry friction, neither below zero, with the least squared error of this joint's friction torque."""
    dq = np.concatenate([motion.dq[:, joint] for motion, _ in friction])
    torque = np.concatenate([values[:, joint] for _, values in friction])
    columns = np.column_stack([dq, np.sign(dq), np.ones(len(dq)), -np.ones(len(dq))])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    # a constant beside them: what the format cannot hold must not be taken for friction
    coefficients, _ = nnls(columns / size, torque)
    return float(coefficients[0] / size[0]), float(coefficients[1] / size[1])
