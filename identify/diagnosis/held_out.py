"""The error that a model makes on motion that its fit did not see, for many candidates at once.

Everything here is algebra on the products WᵀW, WᵀY of blocks of time, which the factors give. For a training set the
base columns B are eliminated once (Schur complement); what is left of every candidate column and of Y beside B then
gives each candidate's fit, and the same combination on the blocks left out gives its error there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.option_fits import Remainder, fit_options
from identify.effects.admissible import Admissible
from identify.estimation.fitting import column_price
from identify.estimation.observation import Observation

Array = NDArray[np.float64]
Index = NDArray[np.intp]

RIDGE = 1e-12
"""relative; keeps the elimination of nearly dependent columns stable without moving any estimate noticeably"""


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
    model : columns whose subsets are the bases mostly asked for
    known : weight with which all data enter every fit beside those that the fold left out leaves; above zero where these
            may tell nothing of some parameters, of the model's as of a candidate's
    """

    def __init__(
        self,
        observation: Observation,
        weights: Array,
        folds: Index,
        known: float = 0.0,
        model: Index | None = None,
    ) -> None:
        self.observation, self.weights, self.folds = observation, weights, folds
        self.count = int(folds.max()) + 1
        self.products: list[Array] = []
        self._measured: list[float] = []
        self._bases: dict[bytes, _Base] = {}
        self._alone: dict[tuple[int, bytes], HeldOut] = {}
        self._of_model: tuple[Index, Array] | None = None
        self._last: tuple[int, Index, Index, Remainder, Remainder] | None = None
        # of each joint: place of every column among its own, of Y behind them, and of what is not on its rows: zeros
        self._local = np.empty((len(observation.joint_columns), observation.width + 1), np.intp)
        # what is left of columns asks for products later; it is kept here, and must not refer to all of this
        self._pairs = _Pairs(self.products, self._local, self.count, known)
        for joint, columns in enumerate(observation.joint_columns):
            width = len(columns) + 2
            products = np.zeros((self.count, width, width))
            stacked = observation.stacked(joint)
            of_fold = folds[stacked.block]
            for fold in range(self.count):
                rows = stacked.rows[of_fold == fold]
                products[fold] = rows.T @ rows
            self._measured.append(float(products[:, -1, -1].sum()))
            products[:, -1] = products[:, :, -1] = 0.0
            self.products.append(products)
            self._local[joint] = width - 1
            self._local[joint, columns] = np.arange(len(columns))
            self._local[joint, -1] = width - 2
        if model is not None:
            self._of_model = np.sort(model), self._training_products(np.sort(model))

    def measured(self, joint: int) -> float:
        """Squared norm of the joint's measured torque."""
        return self._measured[joint]

    def evaluate(self, joint: int, base: Index, trials: Sequence[Trial]) -> list[HeldOut]:
        """Errors on a joint's rows of the base with each trial added."""
        listed = [variant for trial in trials for variant in trial.variants]
        columns = np.setdiff1d(np.unique(np.concatenate([*listed, base[:0]])), base)
        columns, trained, judged = self._holding(joint, base, columns)
        place = np.full(self.observation.width, -1, np.intp)
        place[columns] = np.arange(len(columns))
        options = [places[places >= 0] for places in (place[variant] for variant in listed)]
        bounds = [b for trial in trials for b in trial.bounds or (None,) * len(trial.variants)]
        fits = fit_options(trained, judged, options, bounds)
        left = float(self.weights[joint] ** 2 * judged.target()[-1])
        widths = np.array([len(option) for option in options])
        errors: list[HeldOut] = []
        first = 0
        for trial in trials:
            of_trial = slice(first, first + len(trial.variants))
            first = of_trial.stop
            price = column_price(left, fits.gain[-1, of_trial], len(self.observation.blocks))
            best = np.argmax(fits.gain[:, of_trial] - price * widths[of_trial], axis=1)
            chosen = (np.arange(self.count), of_trial.start + best[:-1])
            errors.append(
                HeldOut(
                    float(fits.error[-1, of_trial.start + best[-1]]),
                    fits.error[chosen],
                    fits.power[chosen],
                    int(best[-1]),
                )
            )
        return errors

    def alone(self, joint: int, base: Index) -> HeldOut:
        """Errors on a joint's rows of the base with nothing added; kept, since it is what every candidate is compared with."""
        key = joint, base.tobytes()
        if key not in self._alone:
            _, judged = self._beside(joint, base, base[:0])
            error = judged.target()
            self._alone[key] = HeldOut(float(error[-1]), error[:-1], np.zeros(self.count), 0)
        return self._alone[key]

    def _holding(self, joint: int, base: Index, columns: Index) -> tuple[Index, Remainder, Remainder]:
        """What is left of some columns beside the base, or of more of them where that was asked for last: pairs of candidates
        are tried after all single ones. With the columns that it holds."""
        if self._last is not None:
            last_joint, last_base, held, trained, judged = self._last
            if last_joint == joint and np.array_equal(last_base, base) and np.isin(columns, held).all():
                return held, trained, judged
        trained, judged = self._beside(joint, base, columns)
        self._last = joint, base, columns, trained, judged
        return columns, trained, judged

    def _base(self, base: Index) -> "_Base":
        """The base's own products; kept, since most candidates are judged beside the same few bases."""
        key = base.tobytes()
        if key not in self._bases:
            count = len(base)
            training = self._training_products(base)
            scale = np.sqrt(np.maximum(np.einsum("fii->fi", training[:, :, :-1]), 1e-300))
            inner = training[:, :, :-1] / (scale[:, :, None] * scale[:, None, :])
            inner[:, np.arange(count), np.arange(count)] += RIDGE
            target = training[:, :, -1]
            combination = (
                np.asarray(np.linalg.solve(inner, (target / scale)[..., None])[..., 0], float) / scale
            )
            self._bases[key] = _Base(inner, scale, target, combination)
        return self._bases[key]

    def _training_products(self, base: Index) -> Array:
        """(sets, b, b + 1) WᵀW and WᵀY of some columns over all joints' weighted rows, of each training set; picked from the
        model's where that holds them."""
        if self._of_model is not None and np.isin(base, self._of_model[0]).all():
            model, training = self._of_model
            places = np.searchsorted(model, base)
            return training[:, places[:, None], np.append(places, len(model))]
        count = len(base)
        products = np.zeros((self.count, count, count + 1))
        for joint, of_joint in enumerate(self.products):
            there, here = self._on_rows(joint, base)
            products[:, there[:, None], there] += self.weights[joint] ** 2 * of_joint[:, here[:, None], here]
            products[:, there, -1] += self.weights[joint] ** 2 * of_joint[:, here, -2]
        return self._pairs.training(products)

    def _beside(self, joint: int, base: Index, columns: Index) -> tuple[Remainder, Remainder]:
        """What is left of columns and Y beside the base: on each training set, and on the rows of a joint that it left
        out, where the base is taken out as the training set has it. All data are the last set, left out and not."""
        known, pairs = self._base(base), self._pairs
        wanted = np.append(columns, self.observation.width)
        cross = np.zeros((self.count, len(base), len(wanted)))
        carrying: list[tuple[float, int]] = []
        for row, of_row in enumerate(self.products):
            there, here = self._on_rows(row, columns)
            if len(there):
                weight = float(self.weights[row]) ** 2
                carrying.append((weight, row))
                on, at = self._on_rows(row, base)
                cross[:, on[:, None], there] += weight * of_row[:, at[:, None], here]
        cross = pairs.training(cross)
        cross[:, :, -1] = known.target
        combination = np.empty_like(cross)
        combination[:, :, -1] = known.combination
        if len(columns):
            scale = known.scale[:, :, None]
            combination[:, :, :-1] = np.linalg.solve(known.inner, cross[:, :, :-1] / scale) / scale

        def training(one: Index, other: Index) -> Array:
            return pairs.training(pairs.of(carrying, wanted[one], wanted[other]))

        def left_out(one: Index, other: Index) -> Array:
            products = pairs.of([(1.0, joint)], wanted[one], wanted[other])
            return np.concatenate([products, products.sum(0, keepdims=True)])

        of_joint = self.products[joint]
        on, at = self._on_rows(joint, base)
        taken = combination[:, on]
        within = of_joint[:, at[:, None], at]
        beside = of_joint[:, at[:, None], self._local[joint, wanted]]
        within, beside = (np.concatenate([part, part.sum(0, keepdims=True)]) for part in (within, beside))
        trained = Remainder(training, cross, combination)
        judged = Remainder(
            left_out,
            np.concatenate([beside, taken], axis=1),
            np.concatenate([taken, beside - within @ taken], axis=1),
        )
        return trained, judged

    def _on_rows(self, joint: int, wanted: Index) -> tuple[Index, Index]:
        """Which of some columns stand on a joint's rows: their places among the wanted, and among the joint's."""
        local = self._local[joint, wanted]
        there = np.flatnonzero(local < self.products[joint].shape[1] - 1)
        return there, local[there]


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Products of pairs of columns.

    products : of each joint those of its own columns, by fold
    local    : (joints, columns + 1) of each joint the place of every column among its own, as in `FoldedProducts`
    """

    products: list[Array]
    local: Index
    folds: int
    known: float

    def training(self, products: Array) -> Array:
        """(folds + 1, …) products of each training set, from those of the folds (folds, …); of all data last."""
        whole = products.sum(0)
        return np.concatenate([(1 + self.known) * whole - products, whole[None]])

    def of(self, joints: Sequence[tuple[float, int]], one: Index, other: Index) -> Array:
        """(folds, …) weighted products of pairs of columns over the rows of some joints."""
        products = np.zeros((self.folds, *np.broadcast_shapes(one.shape, other.shape)))
        for weight, joint in joints:
            of_joint, here = self.products[joint], self.local[joint, one]
            if (here < of_joint.shape[1] - 1).any():
                products += weight * of_joint[:, here, self.local[joint, other]]
        return products


@dataclass(frozen=True)
class _Base:
    """Base columns on each training set, all data being the last.

    inner       : (sets, b, b) WᵀW of the columns brought to unit norm
    scale       : (sets, b) their norms
    target      : (sets, b) WᵀY
    combination : (sets, b) which combination of the columns is within Y: the fit of the base
    """

    inner: Array
    scale: Array
    target: Array
    combination: Array


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
        fared = products.alone(joint, everything)
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
    return observation.sessions
