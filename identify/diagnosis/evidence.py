"""Evidence for a group of columns that holds when residuals are correlated in time."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.held_out import base_within
from identify.diagnosis.option_fits import DEPENDENT
from identify.estimation.observation import Observation
from identify.estimation.statistics import FEWEST_CLUSTERS, joined

Array = NDArray[np.float64]
Index = NDArray[np.intp]


ROUNDING = 1e-14
"""Norm of a column, in parts of the largest, below which it is nothing but rounding: the moment of a payload about an axis
that never turns. Whatever its parameter is, its torque is none."""


class GroupEvidence(NamedTuple):
    """Of a group of columns: probability of their estimates, or larger ones, were they all zero; the estimates, and their
    deviations, which hold for coloured residuals; one for each column that the joint's rows carry. A parameter of which the
    rows say nothing has the estimate 0 and no deviation (NaN)."""

    p_value: float
    estimates: Array
    deviations: Array


def group_evidence(observation: Observation, joint: int, base: Index, extra: Index) -> GroupEvidence:
    """Evidence for a group of columns beside a base, on the rows of one joint.

    The estimates are those on all motion, one for each of `extra` that the joint's rows carry.
    Wald test with a covariance from the scores of blocks of time (cluster-robust, Liang and Zeger 1986; F with as
    many denominator degrees of freedom as blocks). Neighbouring blocks are joined to longer ones as for
    `std_robust`; the least favourable size counts.
    """
    inner, outer = observation.on_rows(joint, base), observation.on_rows(joint, extra)
    if not len(outer):
        return GroupEvidence(1.0, np.zeros(0), np.zeros(0))
    b = len(inner)
    stacked = observation.stacked(joint)
    rows = np.take(stacked.rows, np.concatenate([inner, outer]), axis=1)
    power = np.einsum("rc,rc->c", rows, rows)
    scale = np.where(power > ROUNDING**2 * power.max(), np.sqrt(np.maximum(power, 1e-300)), np.inf)
    rows /= scale
    measured = stacked.rows[:, -2]
    whole, score = rows.T @ rows, rows.T @ measured
    directions, combination = _seen_beside(whole, b)
    rank = directions.shape[1]
    if not rank:
        return GroupEvidence(1.0, np.zeros(len(outer)), np.full(len(outer), np.nan))
    onto = np.vstack([-combination @ directions, directions])
    power = np.einsum("ij,ik,kj->j", onto, whole, onto)
    value = onto.T @ score / power
    estimate = directions @ value
    rest = base_within(whole[:b, :b], score[:b, None])[:, 0] - combination @ estimate
    residual = measured - rows @ np.concatenate([rest, estimate])
    left = stacked.sums(rows @ (onto / power) * residual[:, None])
    influences = joined_influences(left, observation.sessions)
    deviation = np.sqrt(np.max([np.sum((directions @ part.T) ** 2, axis=1) for part in influences], axis=0))
    deviation = np.where(np.isfinite(scale[b:]), deviation / scale[b:], np.nan)
    return GroupEvidence(wald_p_value(value, influences), estimate / scale[b:], deviation)


def joined_influences(influence: Array, sessions: Index) -> list[Array]:
    """Influences (blocks, k) of single blocks of time, and of two and four joined, as far as enough are left.

    sessions : (blocks,) of each block, those of a session one after another
    """
    firsts = _first_of_joined(sessions.tobytes())
    return [influence, *(np.add.reduceat(influence, first, axis=0) for first in firsts)]


@lru_cache(maxsize=64)
def _first_of_joined(sessions: bytes) -> tuple[Index, ...]:
    """The first block of each group of two and of four, as far as there are enough groups; a search asks it of the same blocks
    some thousand times."""
    firsts: list[Index] = []
    for size in (2, 4):
        groups = joined(np.frombuffer(sessions, np.intp), size)
        if groups[-1] + 1 < FEWEST_CLUSTERS:
            break
        firsts.append(np.concatenate([[0], np.flatnonzero(np.diff(groups)) + 1]))
    return tuple(firsts)


def wald_p_value(value: Array, influences: Sequence[Array]) -> float:
    """Probability of estimates, or larger ones, were they all zero.

    value      : (k,) estimates
    influences : (blocks, k) each, what every block of time adds to them, of single blocks and of joined ones
    """
    from scipy.special import fdtrc

    rank = len(value)
    worst = 0.0
    for together in influences:
        count = len(together)
        if count <= rank + 1:
            return 1.0
        covariance = together.T @ together * count / max(count - 1, 1)
        strength = _strength(value, covariance)
        freedom = count - rank
        statistic = strength / rank * freedom / (count - 1)
        worst = max(worst, float(fdtrc(rank, freedom, max(statistic, 0.0))))
    return worst


def _strength(value: Array, covariance: Array) -> float:
    """Of estimates (k,), in squared deviations, without the directions that are not seen (1e-10 of the largest power); of one
    number, which most are, without a search for such."""
    if len(value) == 1:
        return float(value[0] ** 2 / covariance[0, 0]) if covariance[0, 0] > 0 else 0.0
    power, directions = np.linalg.eigh(covariance)
    seen = power > 1e-10 * power[-1]
    return float(np.sum((value @ directions[:, seen]) ** 2 / power[seen]))


def _seen_beside(products: Array, base: int) -> tuple[Array, Array]:
    """Combinations (columns) of the further columns that are seen beside the base, and what of the base is in each.

    products : WᵀW, columns of unit power, the base first. What is left of a dependent column is rounding and the
               difference of two searches: it would pass for evidence.
    """
    combination = base_within(products[:base, :base], products[:base, base:])
    left = products[base:, base:] - products[base:, :base] @ combination
    power, directions = np.linalg.eigh((left + left.T) / 2)
    return directions[:, power > DEPENDENT], combination
