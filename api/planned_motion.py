"""Numbers of a planned motion before anything moves: how well it determines a model, and how much of it repeats."""

from dataclasses import dataclass

import numpy as np

from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig
from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry

WELL_CONDITIONED = 100.0
"""Condition number of the observation matrix up to which every parameter is determined in practice."""


@dataclass(frozen=True)
class Determination:
    """How well a motion alone determines the parameters of the usual model, eq. (8).

    parameters : number of them
    condition  : greatest condition number of a joint's observation matrix, columns of unit length
    weak       : names of those that cannot be separated by this motion; empty where all are determined
    """

    parameters: int
    condition: float
    weak: tuple[str, ...]


def determination(
    rig: Rig, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
) -> Determination:
    """Of a motion (N, n) in rad or m, joint by joint."""
    step = slice(None, None, 6)
    base = base_parameters(Geometry.from_robot(rig.robot))
    columns = base.columns(position[step], velocity[step], acceleration[step])
    weak: dict[str, None] = {}
    worst, count = 1.0, len(base.names)
    for joint in range(columns.shape[1]):
        dq = velocity[step][:, joint]
        acts = base.acts_on(joint)
        W = np.column_stack([columns[:, joint, acts], dq, np.sign(dq), np.ones_like(dq)])
        names = [name for name, on in zip(base.names, acts, strict=True) if on] + ["FV", "FC", "offset"]
        count += 3
        norms = np.linalg.norm(W, axis=0)
        weak |= dict.fromkeys(name for name, norm in zip(names, norms, strict=True) if norm == 0)
        _, singular, directions = np.linalg.svd(W[:, norms > 0] / norms[norms > 0], full_matrices=False)
        condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
        worst = max(worst, condition)
        if condition > WELL_CONDITIONED:
            present = [name for name, norm in zip(names, norms, strict=True) if norm > 0]
            weak |= dict.fromkeys(present[index] for index in np.flatnonzero(np.abs(directions[-1]) > 0.3))
    return Determination(count, worst, tuple(weak))


@dataclass(frozen=True)
class Repetition:
    """How much of a plan repeats exactly.

    repeats  : periods that do
    repeated : share of the plan in which motion does
    """

    repeats: float
    repeated: float


def repetition(plan: ExcitationPlan) -> Repetition:
    """Of a plan."""
    return Repetition(
        repeats=sum((end - begin) / period for begin, end, period in plan.repeated),
        repeated=sum(end - begin for begin, end, _ in plan.repeated) / plan.duration,
    )
