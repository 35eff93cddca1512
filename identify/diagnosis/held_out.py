"""The error that a model makes on motion that its fit did not see, for many candidates at once.

Everything here is algebra on the products WᵀW, WᵀY of blocks of time, which the factors give. For a training set the
base columns B are eliminated once (Schur complement); what is left of every candidate column and of Y beside B then
gives each candidate's fit, and the same combination on the blocks left out gives its error there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.admissible import Admissible
from identify.estimation.constrained import nearest_admissible
from identify.estimation.observation import Observation

Array = NDArray[np.float64]
Index = NDArray[np.intp]

RIDGE = 1e-12
"""relative; keeps the elimination of nearly dependent columns stable without moving any estimate noticeably"""
DEPENDENT = 1e-6
"""A candidate column of whose power less than this is left beside the base adds nothing that could be seen."""


@dataclass(frozen=True)
class Trial:
    """A candidate: for every choice of its constants the global columns it adds, and what their parameters can be.

    bounds : one for each choice, or none at all where the parameters can be anything
    """

    variants: tuple[Index, ...]
    bounds: tuple[Admissible, ...] = ()


@dataclass(frozen=True)
class HeldOut:
    """Errors of a candidate on the rows of one joint, squared norms.

    trained : on the data of the fit, the best variant on all data
    fold    : (folds,) on each fold left out, with the variant chosen without that fold
    power   : (folds,) squared norm of what the candidate predicts there beside the base
    variant : the best variant on all data
    """

    trained: float
    fold: Array
    power: Array
    variant: int

    @property
    def total(self) -> float:
        """Sum over the folds."""
        return float(self.fold.sum())


class FoldedProducts:
    """Products of all columns, by fold, for the rows of each joint.

    folds : (blocks,) index of the fold that each block belongs to
    known : weight with which a candidate's estimate on all data enters that without a fold; above zero where a fold
            left out may leave nothing that tells its parameters
    """

    def __init__(self, observation: Observation, weights: Array, folds: Index, known: float = 0.0) -> None:
        self.observation, self.weights, self.folds, self.known = observation, weights, folds, known
        self.count = int(folds.max()) + 1
        self.local: list[dict[int, int]] = []
        self.products: list[Array] = []
        self.whole: list[Array] = []
        for joint, columns in enumerate(observation.joint_columns):
            width = len(columns) + 2
            products = np.zeros((self.count, width, width))
            for block, factors in enumerate(observation.factors):
                products[folds[block]] += factors[joint].gram()
            self.products.append(products)
            self.whole.append(products.sum(0))
            self.local.append({int(column): place for place, column in enumerate(columns)})

    def measured(self, joint: int) -> float:
        """Squared norm of the joint's measured torque."""
        return float(self.whole[joint][-1, -1])

    def evaluate(self, joint: int, base: Index, trials: Sequence[Trial]) -> list[HeldOut]:
        """Errors on a joint's rows of the base with each trial added."""
        columns = np.unique(np.concatenate([np.concatenate(trial.variants) for trial in trials] + [base[:0]]))
        columns = np.setdiff1d(columns, base)
        place = {int(column): index for index, column in enumerate(columns)}
        wanted = np.concatenate([base, columns])
        places = [self._places(row_joint, wanted) for row_joint in range(len(self.products))]
        # the scale of a column is its norm over all rows that it is on
        everything = self._assembled(self.whole, places, len(wanted) + 1)
        fold_systems = []
        for fold in range(self.count):
            left_out = [products[fold] for products in self.products]
            without = everything - self._assembled(left_out, places, len(wanted) + 1)
            judged = _placed(left_out[joint], places[joint], len(wanted) + 1)
            fold_systems.append(_Reduced.of(without, len(base), judged))
        judged = _placed(self.whole[joint], places[joint], len(wanted) + 1)
        whole = _Reduced.of(everything, len(base), judged)
        return [self._judge(trial, place, whole, fold_systems) for trial in trials]

    def _judge(
        self, trial: Trial, place: dict[int, int], whole: "_Reduced", folds: Sequence["_Reduced"]
    ) -> HeldOut:
        options = [
            np.array([place[int(c)] for c in variant if int(c) in place], np.intp)
            for variant in trial.variants
        ]
        bounds = list(trial.bounds) or [None] * len(options)
        trained = [whole.fit(option, bound) for option, bound in zip(options, bounds, strict=True)]
        best = int(np.argmax([gain for _, gain in trained]))
        errors, power = [], []
        for reduced in folds:
            aided = reduced.aided(whole, self.known)
            fits = [aided.fit(option, bound) for option, bound in zip(options, bounds, strict=True)]
            chosen = int(np.argmax([gain for _, gain in fits]))
            errors.append(reduced.error(options[chosen], fits[chosen][0]))
            power.append(reduced.power(options[chosen], fits[chosen][0]))
        return HeldOut(whole.error(options[best], trained[best][0]), np.array(errors), np.array(power), best)

    def _assembled(
        self, products: Sequence[Array], places: Sequence[tuple[Index, Index]], size: int
    ) -> Array:
        """(size, size) weighted products of the wanted columns and Y over all joints."""
        total = np.zeros((size, size))
        for weight, product, (there, here) in zip(self.weights, products, places, strict=True):
            total[there[:, None], there] += weight**2 * product[here[:, None], here]
        return total

    def _places(self, joint: int, wanted: Index) -> tuple[Index, Index]:
        """Where the wanted columns of a joint, and Y behind them, stand among all wanted, and among the joint's."""
        known = self.local[joint]
        listed = [(place, known[column]) for place, column in enumerate(wanted.tolist()) if column in known]
        there = np.array([*(place for place, _ in listed), len(wanted)], np.intp)
        return there, np.array([*(source for _, source in listed), len(known)], np.intp)


def _placed(products: Array, places: tuple[Index, Index], size: int) -> Array:
    """(size, size) products of one joint's rows at their places among the wanted columns."""
    placed = np.zeros((size, size))
    there, here = places
    placed[there[:, None], there] = products[here[:, None], here]
    return placed


@dataclass(frozen=True)
class _Reduced:
    """What is left of columns and Y beside the base: on the training set, and with the same combination on the test set."""

    left: Array
    """(c + 1, c + 1) Schur complement on the training set"""
    size: Array
    """(c,) power of each column before the elimination"""
    judged: Array
    """(c + 1, c + 1) the same combinations on the rows to be judged"""

    @classmethod
    def of(cls, products: Array, b: int, judged: Array) -> "_Reduced":
        """From products [base, columns, Y] of a training set, the first `b` of them the base, and those to be judged."""
        rest = products[b:, b:]
        combination = base_within(products[:b, :b], products[:b, b:])
        onto = np.vstack([-combination, np.eye(len(rest))])
        return cls(rest - products[b:, :b] @ combination, np.diag(rest)[:-1], onto.T @ judged @ onto)

    def aided(self, whole: "_Reduced", weight: float) -> "_Reduced":
        """The same with some of what all data say of the columns added to the training set."""
        return self if weight == 0 else replace(self, left=self.left + weight * whole.left)

    def fit(self, option: Index, bounds: Admissible | None = None) -> tuple[Array, float]:
        """Parameters of some columns, inside what they can be, and how much they lower the squared error of the
        training set."""
        values = np.zeros(len(option))
        if not len(option):
            return values, 0.0
        power = np.diag(self.left)[option]
        seen = power > DEPENDENT * np.maximum(self.size[option], 1e-300)
        if not seen.any():
            return values, 0.0
        kept = option[seen]
        scale = np.sqrt(power[seen])
        inner = self.left[np.ix_(kept, kept)] / np.outer(scale, scale)
        inner[np.diag_indices(len(kept))] += 1e-9
        product = self.left[kept, -1] / scale
        solved = np.asarray(np.linalg.solve(inner, product), np.float64)
        if bounds is not None and len(bounds.lower) == len(option):
            seen_bounds = bounds.of(seen, scale)
            if seen_bounds.violation(solved) > 0:
                solved = _inside(inner, product, solved, seen_bounds)
        values[seen] = solved / scale
        return values, float(2 * product @ solved - solved @ inner @ solved)

    def error(self, option: Index, values: Array) -> float:
        """Squared error on the judged rows with these parameters."""
        whole = self.judged[-1, -1]
        return float(whole - 2 * values @ self.judged[option, -1] + self.power(option, values))

    def power(self, option: Index, values: Array) -> float:
        """Squared norm of the columns' share on the judged rows with these parameters."""
        return float(values @ self.judged[np.ix_(option, option)] @ values)


def _inside(inner: Array, product: Array, free: Array, bounds: Admissible) -> Array:
    """The admissible values with the least squared error, `free` being where it is least.

    inner, product : WᵀW and WᵀY of the columns; one or two columns with a range each need no general solver, and they
                     are most of the catalogue
    """
    if len(bounds.least) or len(free) > 2:
        return nearest_admissible(np.asarray(np.linalg.cholesky(inner).T, float), free, bounds)
    if len(free) == 1:
        return np.clip(free, bounds.lower, bounds.upper)
    tried = []
    for held in range(2):
        other = 1 - held
        for bound in (bounds.lower[held], bounds.upper[held]):
            if np.isfinite(bound):
                values = np.full(2, bound)
                best = (product[other] - inner[other, held] * bound) / inner[other, other]
                values[other] = np.clip(best, bounds.lower[other], bounds.upper[other])
                tried.append(values)
    return max(tried, key=lambda values: float(2 * product @ values - values @ inner @ values))


def base_within(base: Array, others: Array) -> Array:
    """(b, k): which combination of base columns is within other columns.

    base, others : (b, b) products WᵀW of the base, and (b, k) of the base with the others
    """
    scale = np.sqrt(np.maximum(np.diag(base), 1e-300))
    inner = base / np.outer(scale, scale)
    inner[np.diag_indices(len(base))] += RIDGE
    return np.asarray(np.linalg.solve(inner, others / scale[:, None]) / scale[:, None], float)


def held_out_errors(observation: Observation, weights: Array, folds: Index) -> list[float]:
    """For every joint the relative error of all columns together on folds that the fit did not see."""
    products = FoldedProducts(observation, weights, folds)
    everything = np.arange(observation.width)
    errors = []
    for joint in range(len(observation.joint_columns)):
        fared = products.evaluate(joint, everything, [Trial((everything[:0],))])[0]
        measured = products.measured(joint)
        errors.append(float(np.sqrt(max(fared.total, 0.0) / measured)) if measured > 0 else float("nan"))
    return errors


def folds_of_motion(observation: Observation, per_session: int) -> Index:
    """Fold of every block: the k-th stretch of every session makes fold k, so that each session stays in each fit."""
    folds = np.zeros(len(observation.blocks), np.intp)
    for session in range(len(observation.entries)):
        blocks = observation.blocks_of(session)
        folds[blocks] = np.arange(len(blocks)) * per_session // max(1, len(blocks))
    return folds


def folds_of_sessions(observation: Observation) -> Index:
    """Fold of every block: its session."""
    return np.array([block.session for block in observation.blocks], np.intp)
